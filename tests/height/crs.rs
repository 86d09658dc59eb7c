//! Units of coordinates and heights, by EPSG codes and by the units that keys declare.

use cuesta::internal::height::{Loaded, Options, load_bytes, load_bytes_with};

use super::{
    tiff_file::{Tag, TiffFile},
    tiny::{self, SIZE},
};

/// Keys, and the right values as GDAL 3.10.3 (PROJ 9.5.1, EPSG v11.022) reads them.
///
/// `unit` is metres or radians a unit. Spacing is that of 10 units, or of 0.001° at 45° N by geodesics of PROJ.
/// `height_unit_m` is empty where nothing states the unit of heights.
const UNITS: &str = include_str!("epsg_units.csv");

/// The file of a row, its spacing, its unit of height, and true for a unit of distance shorter than a metre.
fn row(record: &csv::StringRecord) -> (TiffFile, [f64; 2], Option<f64>, bool) {
    let pairs = |text: &str| -> Vec<(u16, f64)> {
        let pair = |word: &str| word.split_once('=').map(|(k, v)| (k.parse().unwrap(), v.parse().unwrap()));
        text.split_whitespace().map(|word| pair(word).unwrap()).collect()
    };
    let (codes, doubles) = (pairs(&record[0]), pairs(&record[1]));
    let mut directory = vec![1, 1, 0, (codes.len() + doubles.len()) as u16];
    codes.iter().for_each(|&(key, code)| directory.extend([key, 0, 1, code as u16]));
    doubles.iter().zip(0..).for_each(|(&(key, _), n)| directory.extend([key, 34736, 1, n]));
    let unit: f64 = record[2].parse().unwrap();
    let is_linear = codes.contains(&(1024, 1.0));
    let (step, north) = match is_linear {
        true => (10.0, 0.0),
        false => (0.001f64.to_radians() / unit, 45f64.to_radians() / unit),
    };
    // Four rows: the middle lies at 45 degrees.
    let file = TiffFile::new(SIZE, 16, 2)
        .placed([step, step], [0.0, north + 2.0 * step])
        .tag(34735, Tag::Short(directory))
        .tag(34736, Tag::Double(doubles.iter().map(|&(_, value)| value).chain([0.0]).collect()));
    let spacing = [record[3].parse().unwrap(), record[4].parse().unwrap()];
    (file, spacing, record[5].parse().ok(), is_linear && unit < 0.95)
}

#[test]
fn codes_and_declared_units_are_those_of_gdal() {
    let mut reader = csv::Reader::from_reader(UNITS.as_bytes());
    let mut rows = 0;
    for record in reader.records().map(Result::unwrap) {
        let (file, spacing, height_unit, is_short) = row(&record);
        let loaded = load_bytes("row.tif", &file.bytes(tiny::height), &Options::default()).unwrap();
        let found = loaded.field.spacing;
        for axis in 0..2 {
            let slack = if spacing[axis] == spacing[1 - axis] { 1e-11 } else { 1e-7 };
            assert!((found[axis] / spacing[axis] - 1.0).abs() < slack, "{record:?}: {found:?}");
        }
        let height = tiny::height(3, 2) * height_unit.unwrap_or(1.0);
        assert!((f64::from(loaded.field.height(3, 2)) / height - 1.0).abs() < 1e-6, "{record:?}");
        let flag = loaded.warnings.iter().filter(|warning| warning.contains("--height-scale 0.")).count();
        assert_eq!(flag, usize::from(is_short && height_unit.is_none()), "{record:?}: {:?}", loaded.warnings);
        rows += 1;
    }
    assert!(rows >= 60, "{rows} rows");
}

fn keys(keys: &[[u16; 2]]) -> TiffFile {
    TiffFile::new(SIZE, 16, 2).placed([10.0, 10.0], [500_000.0, 200_000.0]).keys(keys)
}

fn read(file: &TiffFile, options: &Options) -> Loaded {
    load_bytes("crs.tif", &file.bytes(tiny::height), options).unwrap()
}

#[test]
fn unstated_vertical_unit_of_a_system_in_feet_names_the_flag() {
    let file = keys(&[[1024, 1], [3072, 2263]]);
    let loaded = read(&file, &Options::default());
    let [warning] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
    assert!(warning.contains("--height-scale 0.304801"), "{warning}");
    assert_eq!(loaded.field.height(0, 0), 20.0);
    let loaded = read(&file, &Options { height_scale: Some(0.3048), ..Options::default() });
    assert_eq!((loaded.warnings.len(), loaded.field.height(0, 0)), (0, 20.0 * 0.3048f32));
}

#[test]
fn codes_that_no_registry_holds_and_contradictions_are_warned_of() {
    let warned = |file: &TiffFile, words: &str| {
        let loaded = read(file, &Options::default());
        assert!(loaded.warnings.iter().any(|warning| warning.contains(words)), "{words}: {:?}", loaded.warnings);
        loaded
    };
    warned(&keys(&[[1024, 1], [3072, 1]]), "EPSG:1:");
    warned(&TiffFile::new(SIZE, 16, 2).placed([0.1, 0.1], [7.0, 45.0]).keys(&[[1024, 2], [2048, 1]]), "EPSG:1:");
    warned(&keys(&[[1024, 1], [3072, 32611], [4096, 5715]]), "depths");
    // The code decides, as in GDAL.
    let loaded = warned(&keys(&[[1024, 1], [3072, 32611], [4096, 6360], [4099, 9001]]), "VerticalUnits");
    assert!((loaded.field.height(0, 0) - 20.0 * 0.3048006).abs() < 1e-5);
}

/// ESRI's systems have codes that do not fit a key: GDAL writes their text into a citation.
#[test]
fn esri_systems() {
    let pe = |text: &str| {
        let citation = format!("name|ESRI PE String = {text}|");
        let file = keys(&[[1024, 1], [3072, 32767]]).tag(34737, Tag::Text(citation));
        read(&file, &Options::default()).field.spacing
    };
    let geographic = r#"GEOGCS["GCS_WGS_1984",DATUM["D_WGS_1984",SPHEROID["WGS_1984",6378137.0,298.257223563]],PRIMEM["Greenwich",0.0],UNIT["Degree",0.0174532925199433]]"#;
    let mercator = pe(&format!(
        r#"PROJCS["WGS_1984_Web_Mercator_Auxiliary_Sphere",{geographic},PROJECTION["Mercator_Auxiliary_Sphere"],UNIT["Meter",1.0]]"#
    ));
    // cos φ of the northing 199,980 m.
    assert!((mercator[0] - 10.0 / (199_980.0f64 / 6_378_137.0).cosh()).abs() < 1e-9, "{mercator:?}");
    let feet = pe(&format!(
        r#"PROJCS["a",{geographic},PROJECTION["Lambert_Conformal_Conic"],UNIT["Foot_US",0.3048006096012192]]"#
    ));
    assert!((feet[0] - 3.048006096012192).abs() < 1e-12);
}

/// Texts of a `.prj`, with the spacing of 10 units and metres a unit of height.
#[test]
fn projection_files() {
    let asc = tiny::asc();
    let load = |prj: &str| {
        let sibling = |extension: &str| (extension == "prj").then(|| prj.as_bytes().to_vec());
        load_bytes_with("g.asc", asc.as_bytes(), &sibling, &Options::default()).unwrap()
    };
    let utm = r#"PROJCS["u",GEOGCS["g",DATUM["d",SPHEROID["s",6378137,298.257]],UNIT["degree",0.0174532925199433]],PROJECTION["Transverse_Mercator"],UNIT["metre",1]"#;
    let us = 0.3048006096012192;
    let wkt2 = r#"COMPOUNDCRS["c",PROJCRS["p",BASEGEOGCRS["b",DATUM["d",ELLIPSOID["e",6378137,298.257,LENGTHUNIT["metre",1]]]],CONVERSION["k",METHOD["Transverse Mercator"]],CS[Cartesian,2],AXIS["(E)",east,ORDER[1],LENGTHUNIT["US survey foot",0.304800609601219]],AXIS["(N)",north,ORDER[2],LENGTHUNIT["US survey foot",0.304800609601219]]],VERTCRS["v",VDATUM["w"],CS[vertical,1],AXIS["gravity-related height (H)",up,LENGTHUNIT["foot",0.3048]]]]"#;
    let rows: [(String, f64, f64); 14] = [
        (format!("{utm}]"), 1.0, 1.0),
        (format!("COMPD_CS[\"c\",{utm}],VERT_CS[\"v\",VERT_DATUM[\"w\",2005],UNIT[\"foot\",0.3048]]]"), 1.0, 0.3048),
        // ESRI writes one after the other.
        (format!("{utm}],VERTCS[\"v\",VDATUM[\"w\"],PARAMETER[\"Direction\",1.0],UNIT[\"Foot_US\",{us}]]"), 1.0, us),
        (format!("{utm}],VERTCS[\"NAVD88 height (ftUS)\",VDATUM[\"w\"],AUTHORITY[\"EPSG\",6360]]"), 1.0, us),
        (wkt2.to_owned(), 0.304800609601219, 0.3048),
        (r#"LOCAL_CS["l",UNIT["foot",0.3048]]"#.to_owned(), 0.3048, 1.0),
        ("EPSG:2263+6360".to_owned(), us, us),
        ("EPSG:2263+5703".to_owned(), us, 1.0),
        ("urn:ogc:def:crs:EPSG::8360".replace("8360", "32611"), 1.0, 1.0),
        ("ESRI:102100\n".to_owned(), (2020.0f64 / 6_378_137.0).cosh().recip(), 1.0),
        ("Projection STATEPLANE\nUnits FEET\nZunits FEET\nFipszone 3104\n".to_owned(), us, us),
        ("Projection UTM\nZone 11\nUnits METERS\nZunits 100\n".to_owned(), 1.0, 0.01),
        ("Projection UTM\r\nZunits NO\r\nUnits METERS\r\n".to_owned(), 1.0, 1.0),
        (format!("\u{feff}{utm}]\n"), 1.0, 1.0),
    ];
    for (prj, unit, height) in rows {
        let field = load(&prj).field;
        assert!((field.spacing[0] / (10.0 * unit) - 1.0).abs() < 1e-6, "{prj}: {:?}", field.spacing);
        assert!((f64::from(field.height(1, 1)) - tiny::height(1, 1) * height).abs() < 1e-5, "{prj}");
    }
    let bad = load("nonsense");
    assert!(bad.warnings.iter().any(|warning| warning.contains(".prj")), "{:?}", bad.warnings);
}
