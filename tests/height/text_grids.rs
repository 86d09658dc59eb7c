//! ASCII grids as programs and countries write them.

use cuesta::internal::height::{Field, Holes, Options, Samples, load, load_bytes, load_bytes_with};

use super::{real::shared, tiny};

/// The heights of a grid and its position.
fn content(text: &[u8]) -> (Samples, Holes, [f64; 2], [f64; 2]) {
    let field = field(text);
    (field.samples().clone(), field.holes().clone(), field.spacing, field.origin)
}

fn field(text: &[u8]) -> Field {
    let loaded = load_bytes("grid.asc", text, &Options::default()).unwrap();
    let warned = loaded.warnings.iter().filter(|warning| !warning.contains("coordinate system")).count();
    assert_eq!(warned, 0, "{:?}", loaded.warnings);
    loaded.field
}

/// GDAL 3.10 reads 30 × 20 heights of 81.91 … 410.41 m from the first, and refuses the mark of the second.
#[test]
fn shared_grids() {
    for file in ["a_null.asc", "a_bom.asc"] {
        let Some(path) = shared("reports/asc").map(|folder| folder.join(file)) else { return };
        let loaded = load(&path, &Options::default()).unwrap();
        let statistics = loaded.field.statistics();
        assert_eq!((loaded.field.size(), loaded.field.holes().count()), ([30, 20], 0), "{file}");
        assert_eq!((loaded.field.height(0, 0), loaded.field.height(1, 1)), (170.76, 218.86), "{file}");
        assert_eq!((statistics.min, statistics.max), (81.91, 410.41), "{file}");
    }
}

#[test]
fn marks_and_decimal_commas_are_read() {
    let plain = tiny::asc();
    let expected = content(plain.as_bytes());
    assert_eq!(content(format!("\u{feff}{plain}").as_bytes()), expected);
    assert_eq!(content(format!("\u{feff}{plain}").replace('\n', "\r\n").as_bytes()), expected);
    let commas = plain.replace("cellsize 10", "cellsize 10,5").replace(" 27 ", " 27,25 ");
    let points = plain.replace("cellsize 10", "cellsize 10.5").replace(" 27 ", " 27.25 ");
    assert_ne!(commas, plain.replace("cellsize 10", "cellsize 10,5"));
    assert_eq!(content(commas.as_bytes()), content(points.as_bytes()));
    assert_eq!(field(commas.as_bytes()).spacing, [10.5; 2]);
    for word in ["1,2,3", "1.000,5", "1,x", ",", "--5", "1.2.3"] {
        let text = plain.replace(" 27 ", &format!(" {word} "));
        let error = load_bytes("grid.asc", text.as_bytes(), &Options::default()).unwrap_err().to_string();
        assert!(error.contains("line 7") && error.contains(word), "{error}");
    }
}

#[test]
fn words_for_no_data_are_holes() {
    for word in
        ["null", "NULL", "nan", "-NaN", "-nan(ind)", "1.#QNAN", "-1.#IND", "1.#INF", "-1.#J", "NA", "none", "inf"]
    {
        let text = tiny::asc().replace("-9999", word).replace(" 27 ", &format!(" {word} "));
        let field = field(text.as_bytes());
        assert_eq!((field.holes().count(), field.is_hole(1, 0)), (1, true), "{word}");
        // Beside a number that means "no data" they are holes too, with a warning.
        let text = tiny::asc().replace(" 27 ", &format!(" {word} "));
        let loaded = load_bytes("grid.asc", text.as_bytes(), &Options::default()).unwrap();
        assert_eq!(loaded.field.holes().count(), 1, "{word}");
        assert!(
            loaded.warnings.iter().any(|warning| warning.contains("become holes")),
            "{word}: {:?}",
            loaded.warnings
        );
    }
    let words = tiny::asc().replace("NODATA_value -9999\n", "").replace(" 27 ", " null ");
    assert!(load_bytes("grid.asc", words.as_bytes(), &Options::default()).unwrap().field.is_hole(1, 0));
}

#[test]
fn headers_of_bare_samples_are_read_alike() {
    let bil = tiny::all().into_iter().find(|file| file.name == "esri.bil").unwrap();
    let header = String::from_utf8(bil.hdr.clone().unwrap()).unwrap();
    let expected = bil.load().unwrap().field;
    let marked = format!("\u{feff}{}", header.replace("XDIM 10", "XDIM 10,0").replace("NODATA 0", "NODATA null"));
    let siblings = |extension: &str| (extension == "hdr").then(|| marked.clone().into_bytes());
    let found = load_bytes_with(bil.name, &bil.bytes, &siblings, &bil.options).unwrap().field;
    assert_eq!((found.samples(), found.spacing, found.origin), (expected.samples(), expected.spacing, expected.origin));
}
