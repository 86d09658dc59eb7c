//! The meaning of "no data": texts of files, and values that are no heights.

use cuesta::internal::height::{Loaded, Options, Samples, load_bytes, load_bytes_with};

use super::tiff_file::{Tag, TiffFile};
use super::tiny::{self, SIZE};

const NODATA: u16 = 42113;

fn load(text: &str, value: f64, options: &Options) -> Loaded {
    let file = TiffFile::new(SIZE, 32, 3).tag(NODATA, Tag::Text(text.to_owned()));
    let bytes = file.bytes(|i, j| if j == 0 && i < 2 { value } else { tiny::height(i, j) });
    load_bytes("nodata.tif", &bytes, options).unwrap()
}

fn holes(loaded: &Loaded) -> u64 {
    loaded.field.holes().count()
}

#[test]
fn a_text_that_is_no_number_is_named_and_ignored() {
    for text in ["none", "", "n/a", "-9999,0"] {
        let loaded = load(text, 5.0, &Options::default());
        assert_eq!(holes(&loaded), 0, "{text}");
        let [warning] = &loaded.warnings[..] else { panic!("{text}: {:?}", loaded.warnings) };
        assert!(warning.contains(&format!("GDAL_NODATA is {text:?}")) && warning.contains("--nodata"), "{warning}");
        let loaded = load(text, 5.0, &Options { nodata: Some(5.0), ..Options::default() });
        assert_eq!((holes(&loaded), loaded.warnings), (2, Vec::new()), "{text}");
    }
}

/// An infinite value means itself, not every number that is infinitely near to it.
#[test]
fn numbers_that_are_not_finite() {
    for text in ["nan", "-nan", "NaN", "1.#QNAN", "-1.#IND", "1.#SNAN"] {
        let loaded = load(text, f64::NAN, &Options::default());
        assert_eq!((holes(&loaded), loaded.warnings), (2, Vec::new()), "{text}");
    }
    for (text, value) in [
        ("inf", f64::INFINITY),
        ("-inf", f64::NEG_INFINITY),
        ("Infinity", f64::INFINITY),
        ("1.#INF", f64::INFINITY),
        ("-1.#INF", f64::NEG_INFINITY),
        ("-1.7976931348623157e+308", f64::NEG_INFINITY),
    ] {
        let loaded = load(text, value, &Options::default());
        assert_eq!((holes(&loaded), loaded.field.statistics().max), (2, 69.0), "{text}");
        let options = Options { nodata: Some(value), ..Options::default() };
        assert_eq!(holes(&load("-1", value, &options)), 2, "{text}");
        assert_eq!(holes(&load(text, 5.0, &Options::default())), 0, "{text}");
    }
}

/// One or many, of either sign, whatever else is declared.
#[test]
fn values_beyond_reason_are_holes() {
    for value in [-3.4028234663852886e38, 3.4028234663852886e38, 1.1e30, -1e38, 1e31] {
        for text in ["-9999", "nan", "none"] {
            let loaded = load(text, value, &Options::default());
            assert_eq!((holes(&loaded), loaded.field.statistics().min), (2, 23.0), "{value}");
            let named = format!("--nodata {:e}", f64::from(value as f32));
            let warned = |w: &String| w.contains("2 samples are beyond ±1e30") && w.contains(&named);
            assert!(loaded.warnings.iter().any(warned), "{:?}", loaded.warnings);
        }
        let declared = load(&format!("{value:e}"), value, &Options::default());
        assert_eq!((holes(&declared), declared.warnings), (2, Vec::new()), "{value}");
    }
    let one = TiffFile::new(SIZE, 64, 3).bytes(|i, j| if i + j == 0 { 2e30 } else { tiny::height(i, j) });
    let loaded = load_bytes("one.tif", &one, &Options::default()).unwrap();
    assert!(holes(&loaded) == 1 && loaded.warnings[0].starts_with("1 sample is beyond"), "{:?}", loaded.warnings);
}

/// Heights that are too large for any view are refused by the file's name, and by the flag only where it is given.
#[test]
fn heights_beyond_1e12_are_refused_by_what_makes_them() {
    let file = TiffFile::new(SIZE, 32, 3);
    let bytes = file.bytes(|i, j| if i + j == 0 { -1e20 } else { tiny::height(i, j) });
    let error = load_bytes("far.tif", &bytes, &Options::default()).unwrap_err().to_string();
    assert!(
        error.starts_with("far.tif: heights: expected at most 1e12 m, found -1.0000000200408773e20; --nodata"),
        "{error}"
    );
    assert_eq!(
        holes(&load_bytes("far.tif", &bytes, &Options { nodata: Some(-1e20), ..Options::default() }).unwrap()),
        1
    );
    let options = Options { height_scale: Some(1e13), ..Options::default() };
    let error = load_bytes("far.tif", &file.bytes(tiny::height), &options).unwrap_err().to_string();
    assert!(error.contains("--height-scale"), "{error}");
}

/// A field of depths turned over, as codes and as floats.
#[test]
fn a_negative_scale() {
    for (bits, format) in [(16, 2), (16, 1), (8, 1), (32, 3)] {
        let file = TiffFile::new(SIZE, bits, format).tag(NODATA, Tag::Text("20".to_owned()));
        let options = Options { height_scale: Some(-0.5), ..Options::default() };
        let loaded = load_bytes("depth.tif", &file.bytes(tiny::height), &options).unwrap();
        let field = &loaded.field;
        assert!(field.is_hole(0, 0) && loaded.exact_in_16_bit);
        // Codes rise with the heights.
        assert!(matches!(field.samples(), Samples::Coded { scale: 0.5, .. }), "{bits} {format}");
        for (i, j) in [(1, 0), (4, 3), (2, 2)] {
            assert_eq!(f64::from(field.height(i, j)), tiny::height(i as usize, j as usize) * -0.5);
        }
        assert_eq!((field.statistics().min, field.statistics().max), (-34.5, -11.5));
    }
}

#[test]
fn headers_of_bare_samples_too() {
    let samples: Vec<u8> = (0..20).flat_map(|k: u16| (k + 10).to_le_bytes()).collect();
    for (text, holes) in [("none", 0), ("", 0), ("1.#QNAN", 0), ("12", 1), ("inf", 0)] {
        let bil = format!("NROWS 4\nNCOLS 5\nNBITS 16\nBYTEORDER I\nNODATA {text}\n");
        let envi = format!(
            "ENVI\nsamples = 5\nlines = 4\nbands = 1\ndata type = 12\nbyte order = 0\ndata ignore value = {text}\n"
        );
        for header in [bil, envi] {
            let sibling = |extension: &str| (extension == "hdr").then(|| header.clone().into_bytes());
            let loaded = load_bytes_with("bare", &samples, &sibling, &Options::default()).unwrap();
            assert_eq!(loaded.field.holes().count(), holes, "{header}");
            let warned = loaded.warnings.iter().any(|w| w.contains("NODATA") && w.contains("no number"));
            assert_eq!(
                warned,
                text == "none" || text.is_empty() && header.starts_with("ENVI"),
                "{:?}",
                loaded.warnings
            );
        }
    }
}
