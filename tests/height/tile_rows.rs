//! Directories of tiles: rows from the south, double density, empty tiles, other grids than web Mercator's.

use std::{fs, path::Path};

use cuesta::internal::height::{Encoding, Loaded, Options, load, metres_per_degree};
use tempfile::{TempDir, tempdir};

use super::real::shared;

/// A tile of one height, in steps of 0.1 m above −10000 m, with a last pixel of its own.
fn tile(side: u32, code: u8, alpha: u8) -> Vec<u8> {
    let mut pixels: Vec<u8> = (0..side * side).flat_map(|_| [1, 134, code, alpha]).collect();
    let last = pixels.len() - 2;
    pixels[last] = pixels[last].wrapping_add(1);
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, side, side);
    encoder.set_color(png::ColorType::Rgba);
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
    bytes
}

fn put(folder: &Path, name: &str, bytes: &[u8]) {
    let path = folder.join(name);
    fs::create_dir_all(path.parent().unwrap()).unwrap();
    fs::write(path, bytes).unwrap();
}

fn folder(files: &[(&str, Vec<u8>)]) -> TempDir {
    let folder = tempdir().unwrap();
    files.iter().for_each(|(name, bytes)| put(folder.path(), name, bytes));
    folder
}

fn read(folder: &TempDir) -> Loaded {
    let options = Options { encoding: Some(Encoding::Mapbox), ..Options::default() };
    load(folder.path(), &options).unwrap()
}

/// Steps of 0.1 m of a tile's first pixel over those of code 0.
fn code(loaded: &Loaded, i: u32, j: u32) -> i64 {
    (f64::from(loaded.field.height(i, j)) * 10.0 + 100_000.0).round() as i64 - (1 << 16) - (134 << 8)
}

#[test]
fn shared_tms_is_the_same_field() {
    let (Some(xyz), Some(tms)) = (shared("reports/tms/mapbox-a"), shared("reports/tms/mapbox-tms")) else { return };
    let (xyz, tms) = (load(&xyz, &Options::default()).unwrap(), load(&tms, &Options::default()).unwrap());
    assert_eq!((xyz.field.size(), &xyz.warnings), (tms.field.size(), &tms.warnings));
    assert_eq!((xyz.field.samples(), xyz.field.origin), (tms.field.samples(), tms.field.origin));
    let [w, h] = xyz.field.size();
    assert!((0..w).any(|i| xyz.field.height(i, 0) != xyz.field.height(i, h - 1)), "reversed rows would be seen");
}

#[test]
fn descriptions_say_where_rows_begin() {
    let tiles = [("2/1/0.png", tile(4, 10, 255)), ("2/1/1.png", tile(4, 20, 255))];
    let origin = read(&folder(&tiles)).field.origin;
    for (name, text, is_tms) in [
        ("tiles.json", r#"{"scheme": "tms"}"#, true),
        ("tilejson.json", "\u{feff}{\"scheme\": \"TMS\"}", true),
        ("metadata.json", r#"{"scheme": "xyz"}"#, false),
        ("metadata.json", r#"{"name": "tms"}"#, false),
        ("metadata.json", "not JSON", false),
        ("tilemapresource.xml", "<TileMap><TileSets profile=\"mercator\"/></TileMap>", true),
        ("tilemapresource.xml", "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<TileMap/>", true),
    ] {
        let folder = folder(&tiles);
        put(folder.path(), name, text.as_bytes());
        let loaded = read(&folder);
        let expected = if is_tms { [20, 10] } else { [10, 20] };
        assert_eq!([code(&loaded, 0, 0), code(&loaded, 0, 4)], expected, "{name}: {text}");
        // Rows 0 and 1 from the south are rows 3 and 2 from the north: mirrored about the equator.
        let [_, north] = loaded.field.origin;
        let below = loaded.field.spacing[1];
        let expected = if is_tms { -(origin[1] + 7.0 * step()) } else { origin[1] };
        assert!((north - expected).abs() < 1e-6 && below > 0.0, "{name}: {north}, {expected}");
    }
    let broken = folder(&tiles);
    put(broken.path(), "tilemapresource.xml", b"<TileMap>");
    let error = load(broken.path(), &Options::default()).unwrap_err().to_string();
    assert!(error.contains("tilemapresource.xml: XML") && !error.contains('\n'), "{error}");
}

/// Web Mercator metres a pixel of 4-pixel tiles at zoom 2.
fn step() -> f64 {
    std::f64::consts::TAU * 6_378_137.0 / 16.0
}

#[test]
fn an_encoding_in_a_description_is_used() {
    let folder = folder(&[("0/0/0.png", tile(4, 10, 255))]);
    put(folder.path(), "tiles.json", br#"{"encoding": "terrarium", "attribution": "Mapbox"}"#);
    assert_eq!(load(folder.path(), &Options::default()).unwrap().format, "Terrarium tiles");
}

#[test]
fn double_density() {
    let single = [("3/2/4.png", tile(4, 10, 255)), ("3/3/4.png", tile(4, 20, 255))];
    let double = [("3/2/4@2x.png", tile(8, 10, 255)), ("3/3/4@2x.png", tile(8, 20, 255))];
    let (coarse, fine) = (read(&folder(&single)), read(&folder(&double)));
    assert_eq!((coarse.field.size(), fine.field.size()), ([8, 4], [16, 8]));
    let ratio = coarse.field.spacing[0] / fine.field.spacing[0];
    assert!((ratio - 2.0).abs() < 0.01, "{ratio}");
    assert_eq!(code(&fine, 8, 0), 20);
    // Of both, the one with more tiles; of equally many the finer.
    let both: Vec<_> = single.iter().chain(&double).cloned().collect();
    assert_eq!(read(&folder(&both)).field.size(), [16, 8]);
    assert_eq!(read(&folder(&both[..3])).field.size(), [8, 4]);
}

#[test]
fn empty_tiles_are_holes() {
    for empty in [Vec::new(), tile(1, 0, 0), tile(4, 0, 0)] {
        let files = [
            ("1/0/0.png", empty.clone()),
            ("1/1/0.png", tile(4, 10, 255)),
            ("1/0/1.png", tile(4, 20, 255)),
            ("1/1/1.png", tile(4, 30, 255)),
        ];
        let loaded = read(&folder(&files));
        assert_eq!((loaded.field.size(), loaded.field.holes().count()), ([8, 8], 16), "{} bytes", empty.len());
        assert!(loaded.field.is_hole(3, 3) && !loaded.field.is_hole(4, 3));
        assert_eq!((code(&loaded, 4, 0), code(&loaded, 0, 4)), (10, 20));
    }
    let files = [("1/0/0.png", Vec::new()), ("1/1/0.png", tile(4, 10, 255))];
    assert_eq!(read(&folder(&files)).warnings, ["1 of 2 tiles at zoom 1 are empty and become holes"]);
    let options = Options { encoding: Some(Encoding::Mapbox), ..Options::default() };
    let error = load(folder(&files[..1]).path(), &options).unwrap_err().to_string();
    assert!(error.contains("tiles with data at zoom 1"), "{error}");
    // An opaque picture of another size does not count as an empty tile.
    let files = [("1/0/0.png", tile(4, 1, 255)), ("1/1/0.png", tile(8, 10, 255))];
    let error = load(folder(&files).path(), &options).unwrap_err().to_string();
    assert!(error.contains("expected 4x4 pixels, found 8x8"), "{error}");
}

#[test]
fn geodetic_and_local_profiles() {
    let tiles = [("1/2/1.png", tile(4, 10, 255)), ("1/3/1.png", tile(4, 20, 255)), ("1/2/0.png", tile(4, 30, 255))];
    let geodetic = folder(&tiles);
    put(geodetic.path(), "tilemapresource.xml", b"<TileMap><TileSets profile=\"geodetic\"/></TileMap>");
    let field = read(&geodetic).field;
    // Zoom 1 has 4 x 2 tiles of 90°; columns 2 and 3 are the eastern half, from 90° north.
    let degrees = 90.0 / 4.0;
    let metres = metres_per_degree(0.0);
    assert_eq!((field.size(), field.crs.as_deref()), ([8, 8], Some("EPSG:4326")));
    assert!((field.spacing[0] - degrees * metres[0]).abs() < 1e-6, "{:?}", field.spacing);
    assert!((field.origin[0] - degrees / 2.0 * metres[0]).abs() < 1e-6, "{:?}", field.origin);
    assert!((field.origin[1] + (90.0 - degrees / 2.0) * metres[1]).abs() < 1e-6, "{:?}", field.origin);

    let local = folder(&tiles[1..2]);
    let xml = "<TileMap><SRS>EPSG:32611</SRS><Origin x=\"5000\" y=\"7000\"/><TileSets profile=\"raster\">\
               <TileSet href=\"1\" units-per-pixel=\"10\" order=\"1\"/></TileSets></TileMap>";
    put(local.path(), "tilemapresource.xml", xml.as_bytes());
    let field = read(&local).field;
    assert_eq!((field.spacing, field.origin), ([10.0; 2], [5000.0 + 125.0, -(7000.0 + 75.0)]));
    put(local.path(), "tilemapresource.xml", xml.replace("order=\"1\"", "order=\"7\"").as_bytes());
    let options = Options { encoding: Some(Encoding::Mapbox), ..Options::default() };
    let error = load(local.path(), &options).unwrap_err().to_string();
    assert!(error.contains("units-per-pixel of order 1"), "{error}");
}

/// A tile's name is its plain number. Of two pictures of one tile the first by name counts.
#[test]
fn other_spellings_of_a_number_are_no_tiles() {
    let tiles = [("1/0/00.png", 9), ("1/0/+0.png", 8), ("1/0/0.png", 1), ("1/0/0.pngraw", 7), ("1/00/0.png", 6)];
    let loaded = read(&folder(&tiles.map(|(name, code)| (name, tile(4, code, 255)))));
    assert_eq!((loaded.field.size(), code(&loaded, 0, 0)), ([4, 4], 1));
}
