//! Position and spacing of samples.

use std::fs;

use cuesta::internal::height::{Field, Options, load, load_bytes, load_bytes_with, metres_per_degree};

use super::{
    tiff_file::{Tag, TiffFile},
    tiny::{self, SIZE},
};

fn tiff() -> TiffFile {
    TiffFile::new(SIZE, 16, 2)
}

fn field(file: &TiffFile) -> Field {
    load_bytes("place.tif", &file.bytes(tiny::height), &Options::default()).unwrap().field
}

fn close(found: [f64; 2], expected: [f64; 2]) {
    let near = |k: usize| (found[k] - expected[k]).abs() <= 1e-9 * expected[k].abs().max(1.0);
    assert!(near(0) && near(1), "found {found:?}, expected {expected:?}");
}

/// Published lengths of a degree on WGS 84 (longitude, latitude), metres.
#[test]
fn degrees() {
    for (latitude, expected) in
        [(0.0, [111_319.5, 110_574.3]), (45.0, [78_846.8, 111_131.8]), (60.0, [55_800.0, 111_412.2])]
    {
        let found = metres_per_degree(latitude);
        assert!((found[0] - expected[0]).abs() < 1.0 && (found[1] - expected[1]).abs() < 1.0, "{latitude}: {found:?}");
    }
}

#[test]
fn area_and_point() {
    let area = field(&tiff().placed([30.0, 20.0], [1000.0, 2000.0]).keys(&[[1024, 1], [3072, 32611]]));
    close(area.spacing, [30.0, 20.0]);
    close(area.origin, [1015.0, -1990.0]);
    assert_eq!(area.crs.as_deref(), Some("EPSG:32611"));
    let point = field(&tiff().placed([30.0, 20.0], [1000.0, 2000.0]).keys(&[[1024, 1], [1025, 2], [3072, 32611]]));
    close(point.origin, [1000.0, -2000.0]);
}

#[test]
fn feet() {
    let file = tiff().placed([10.0, 10.0], [0.0, 0.0]);
    close(field(&file.clone().keys(&[[1024, 1], [3072, 2225], [3076, 9003]])).spacing, [12000.0 / 3937.0; 2]);
    close(field(&file.clone().keys(&[[1024, 1], [3072, 2225], [3076, 9002]])).spacing, [3.048; 2]);
    let tall = field(&file.keys(&[[1024, 1], [3072, 32611], [4099, 9002]]));
    assert_eq!(tall.height(0, 0), 20.0 * 0.3048f32);
}

#[test]
fn geographic() {
    let file = tiff().placed([0.001, 0.001], [10.0, 45.002]).keys(&[[1024, 2], [2048, 4326]]);
    let field = field(&file);
    let [east, north] = metres_per_degree(45.0);
    close(field.spacing, [0.001 * east, 0.001 * north]);
    close(field.origin, [10.0005 * east, -45.0015 * north]);
    // Latitudes beyond the pole are invalid.
    let file = tiff().placed([0.001, 0.001], [10.0, 145.0]).keys(&[[1024, 2], [2048, 4326]]);
    assert!(load_bytes("p", &file.bytes(tiny::height), &Options::default()).is_err());
}

#[test]
fn mercator_shrinks() {
    // y of latitude 60°, where Mercator is twice too long.
    let y = 6_378_137.0 * (std::f64::consts::FRAC_PI_4 + 30f64.to_radians()).tan().ln();
    let field = field(&tiff().placed([10.0, 10.0], [0.0, y + 20.0]).keys(&[[1024, 1], [3072, 3857]]));
    assert!((field.spacing[0] - 5.0).abs() < 1e-4, "{:?}", field.spacing);
    close(field.origin, [5.0, -y - 15.0]);
}

#[test]
fn matrix_and_south_up() {
    let matrix = |dx: f64, dy: f64| {
        let m = vec![dx, 0.0, 0.0, 500.0, 0.0, dy, 0.0, 700.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        field(&tiff().tag(34264, Tag::Double(m)).keys(&[[1024, 1], [3072, 32611]]))
    };
    let north_up = matrix(10.0, -10.0);
    close(north_up.origin, [505.0, -695.0]);
    assert_eq!(north_up.height(1, 0), tiny::height(1, 0) as f32);
    let south_up = matrix(10.0, 10.0);
    // The last row of the file is the north one.
    close(south_up.origin, [505.0, -735.0]);
    assert_eq!(south_up.height(1, 0), tiny::height(1, 3) as f32);
    let west = matrix(-10.0, -10.0);
    close(west.origin, [455.0, -695.0]);
    assert_eq!(west.height(0, 2), tiny::height(4, 2) as f32);
}

#[test]
fn grids() {
    let text = tiny::asc();
    let read = |text: &str, prj: Option<&str>| {
        let sibling = |extension: &str| prj.filter(|_| extension == "prj").map(|text| text.as_bytes().to_vec());
        load_bytes_with("g.asc", text.as_bytes(), &sibling, &Options::default()).unwrap()
    };
    close(read(&text, None).field.origin, [1005.0, -2035.0]);
    let centre = text.replace("llcorner", "llcenter").replace("cellsize 10", "dx 10\ndy 5");
    close(read(&centre, None).field.origin, [1000.0, -2015.0]);
    close(read(&centre, None).field.spacing, [10.0, 5.0]);
    let feet = r#"PROJCS["x",GEOGCS["y",UNIT["Degree",0.017]],UNIT["Foot_US",0.3048006096012192]]"#;
    close(read(&text, Some(feet)).field.spacing, [3.048006096012192; 2]);
    let compound = format!(
        r#"COMPD_CS["c",{},AUTHORITY["EPSG","2225"]],VERT_CS["v",UNIT["m",1],AUTHORITY["EPSG","5"]]]"#,
        &feet[..feet.len() - 1]
    );
    let compound = read(&text, Some(&compound)).field;
    close(compound.spacing, [3.048006096012192; 2]);
    assert_eq!(compound.crs.as_deref(), Some("EPSG:2225"));
    let degrees = text.replace("1000", "10").replace("2000", "50").replace("cellsize 10", "cellsize 0.01");
    let guessed = read(&degrees, None);
    assert_eq!(guessed.warnings.len(), 1);
    assert!((guessed.field.spacing[1] - 1112.3).abs() < 1.0, "{:?}", guessed.field.spacing);
    let named = read(&degrees, Some(r#"GEOGCS["GCS_WGS_1984"]"#));
    assert_eq!((named.field.spacing, named.warnings.len()), (guessed.field.spacing, 0));
}

#[test]
fn header_or_data_by_path() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["esri.bil", "esri.flt", "envi.dat"] {
        let file = tiny::all().into_iter().find(|file| file.name == name).unwrap();
        let path = folder.path().join(name.replace('.', "_") + "." + name.split('.').nth(1).unwrap());
        fs::write(&path, &file.bytes).unwrap();
        fs::write(path.with_extension("hdr"), file.hdr.as_ref().unwrap()).unwrap();
        let by_data = load(&path, &Options::default()).unwrap();
        let by_header = load(&path.with_extension("hdr"), &Options::default()).unwrap();
        close(by_data.field.origin, [1005.0, -2035.0]);
        assert_eq!(
            (by_data.field.origin, by_data.field.samples()),
            (by_header.field.origin, by_header.field.samples())
        );
        fs::remove_file(&path).unwrap();
        assert!(load(&path.with_extension("hdr"), &Options::default()).is_err());
    }
    assert!(load(&folder.path().join("absent"), &Options::default()).is_err());
    assert!(load(folder.path(), &Options::default()).unwrap_err().to_string().contains("zoom/x/y"));
}

/// A 2 × 2 rectangle of tiles with one absent, and a deeper level with only one tile.
#[test]
fn tile_directories() {
    let folder = tempfile::tempdir().unwrap();
    let tile = |path: &str, code: [u8; 4]| {
        let path = folder.path().join(path);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        image::RgbaImage::from_pixel(4, 4, image::Rgba(code)).save(path).unwrap();
    };
    tile("1/0/0.png", [128, 1, 0, 255]);
    tile("1/1/0.png", [128, 2, 0, 255]);
    tile("1/0/1.png", [128, 3, 0, 255]);
    tile("1/1/x.png", [0, 0, 0, 255]);
    let error = load(folder.path(), &Options::default()).unwrap_err().to_string();
    assert!(error.contains("--encoding terrarium|mapbox"), "{error}");
    fs::write(folder.path().join("tilejson.json"), r#"{"encoding": "terrarium"}"#).unwrap();
    let loaded = load(folder.path(), &Options::default()).unwrap();
    let field = &loaded.field;
    assert_eq!((field.size(), field.holes().count(), loaded.warnings.len()), ([8, 8], 16, 1));
    assert_eq!([field.height(0, 0), field.height(4, 0), field.height(0, 4)], [1.0, 2.0, 3.0]);
    assert!(field.is_hole(4, 4));
    let world = 2.0 * std::f64::consts::PI * 6_378_137.0;
    close(field.spacing, [world / 8.0; 2]);
    close(field.origin, [-world * 7.0 / 16.0; 2]);

    tile("2/3/3.png", [128, 9, 0, 0]);
    tile("2/3/2.png", [128, 9, 0, 255]);
    let loaded = load(folder.path(), &Options::default()).unwrap();
    assert_eq!((loaded.field.size(), loaded.field.holes().count()), ([4, 8], 16), "level 2 is complete");
    let options = Options { zoom: Some(1), ..Options::default() };
    assert_eq!(load(folder.path(), &options).unwrap().field.size(), [8, 8]);
    let options = Options { zoom: Some(7), ..Options::default() };
    assert!(load(folder.path(), &options).unwrap_err().to_string().contains("expected one of 1, 2, found 7"));
}
