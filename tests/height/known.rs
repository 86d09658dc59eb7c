//! Files that are recognised and not read, and SRTM tiles of unusual sizes and names.

use cuesta::internal::height::{Options, load, load_bytes, metres_per_degree};
use tempfile::tempdir;

use super::tiny;

fn error(name: &str, bytes: &[u8]) -> String {
    load_bytes(name, bytes, &Options::default()).unwrap_err().to_string()
}

fn after(count: usize, magic: &[u8]) -> Vec<u8> {
    [&vec![b' '; count][..], magic, &[7; 300]].concat()
}

#[test]
fn formats_that_are_not_read_are_named_with_what_to_do() {
    let geopackage = [&b"SQLite format 3\0"[..], &[1; 52], b"GPKG", &[1; 300]].concat();
    let utf16: Vec<u8> = "\u{feff}ncols 3".encode_utf16().flat_map(u16::to_le_bytes).collect();
    for (bytes, name, advice) in [
        (after(0, b"CDF\x01"), "NetCDF", "gdal_translate"),
        (after(0, b"CDF\x05"), "NetCDF", "gdal_translate"),
        (after(0, b"\x89HDF\r\n\x1a\n"), "HDF5", "gdal_translate"),
        (after(0, b"\x0e\x03\x13\x01"), "HDF4", "gdal_translate"),
        (after(0, b"GRIB"), "GRIB", "gdal_translate"),
        (after(0, b"UHL1"), "DTED", "gdal_translate"),
        (after(80, b"UHL1"), "DTED", "gdal_translate"),
        (after(0, b"v/1\x01"), "OpenEXR", "gdal_translate"),
        (after(0, b"EHFA_HEADER_TAG"), "Erdas Imagine", "gdal_translate"),
        (after(0, b"DSAA\n"), "Surfer", "gdal_translate"),
        (after(0, b"\0\0\0\x0cjP  \r\n\x87\n"), "JPEG 2000", "gdal_translate"),
        (after(0, b"msid"), "MrSID", "gdal_translate"),
        (geopackage, "a GeoPackage", "gdal_translate"),
        (after(0, b"SQLite format 3\0"), "MBTiles", "gdal_translate"),
        (after(0, b"PMTiles"), "PMTiles", "zoom/x/y.png"),
        (after(0, b"LASF"), "LAS or LAZ", "pdal"),
        (after(0, b"\0\0\x27\x0a\0"), "shapefile", "gdal_rasterize"),
        (after(0, b"7z\xbc\xaf\x27\x1c"), "7z", "unpack"),
        (after(0, b"Rar!\x1a\x07"), "RAR", "unpack"),
        (after(0, b"\xfd7zXZ\0"), "xz", "unpack"),
        (after(0, b"BZh9"), "bzip2", "unpack"),
        (after(0, b"%PDF-1.7"), "PDF", "download"),
        (after(0, b"\xff\xd8\xff\xe0"), "JPEG", "16-bit"),
        (after(0, b"glTF"), "glTF", "16-bit"),
        (b"<VRTDataset rasterXSize=\"5\">".to_vec(), "virtual raster", "gdal_translate"),
        (b"<?xml version=\"1.0\"?>\n<VRTDataset>".to_vec(), "virtual raster", "gdal_translate"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 9\n".to_vec(), "git-lfs", "git lfs pull"),
        (b"\n<!DOCTYPE HTML><title>404</title>".to_vec(), "HTML", "download"),
        (b"<head/><body>no</body>".to_vec(), "HTML", "download"),
        (b"{\"error\": \"no such dataset\"}".to_vec(), "JSON", "download"),
        (b"{\"type\": \"FeatureCollection\", \"features\": []}".to_vec(), "GeoJSON", "gdal_rasterize"),
        (b"{\"tilejson\": \"2.0.0\"}".to_vec(), "tile directory", "directory"),
        (b"<?xml version=\"1.0\"?><kml>".to_vec(), "KML", "gdal_rasterize"),
        (b"<?xml version=\"1.0\"?><ServiceExceptionReport>".to_vec(), "XML error", "download"),
        (b"x,y,z\n600000,200000,10.5\n600025,200000,11\n".to_vec(), "XYZ", "gdal_translate"),
        (b"600000 200000 10.5\n600025 200000 11\n600050 20".to_vec(), "XYZ", "gdal_translate"),
        (b"north: 4928000\nsouth: 4914000\n".to_vec(), "GRASS", "gdal_translate"),
        (utf16, "UTF-16", "UTF-8"),
        (Vec::new(), "an empty file", "download"),
    ] {
        let error = error("file", &bytes);
        assert!(error.starts_with("file: content: expected a height format that is read, found "), "{error}");
        assert!(error.contains(name) && error.contains(advice) && !error.contains('\n'), "{name}: {error}");
    }
    // Text and bytes of no format are not given a name.
    for bytes in [&b"# Heights\n\n| file | source |\n"[..], b"one two three\n1 2\n", &[1; 999], b"1 2\n3 4\n", b"\n"] {
        assert!(error("file", bytes).contains("--raw"), "{}", String::from_utf8_lossy(bytes));
    }
}

/// A header beside makes bare samples of unknown bytes, not of another format's.
#[test]
fn a_header_beside_does_not_hide_a_format() {
    let bil = tiny::all().into_iter().find(|file| file.name == "esri.bil").unwrap();
    for magic in [&b"CDF\x01"[..], b"EHFA_HEADER_TAG", b"SQLite format 3\0"] {
        let error = bil.load_as(&[magic, &bil.bytes].concat(), bil.hdr.as_deref()).unwrap_err().to_string();
        assert!(error.contains("content: expected a height format"), "{error}");
    }
    let text = b"<VRTDataset rasterXSize=\"5\" rasterYSize=\"4\"></VRTDataset>";
    assert!(bil.load_as(text, bil.hdr.as_deref()).unwrap_err().to_string().contains("virtual raster"));
    // Two or three bytes may as well be a height: -257 m.
    assert_eq!(bil.load_as(&[b"\xff\xfe", &bil.bytes[2..]].concat(), bil.hdr.as_deref()).unwrap().format, "ESRI BIL");
}

#[test]
fn folders_that_are_one_dataset_are_named() {
    for (file, name) in [
        ("a00000001.gdbtable", "Esri file geodatabase"),
        (".zarray", "Zarr"),
        ("zarr.json", "Zarr"),
        ("hdr.adf", "Arc/Info binary grid"),
    ] {
        let folder = tempdir().unwrap();
        std::fs::write(folder.path().join(file), [3; 64]).unwrap();
        let error = load(folder.path(), &Options::default()).unwrap_err().to_string();
        assert!(error.contains(name) && error.contains("gdal_translate"), "{error}");
    }
}

#[test]
fn what_lies_in_a_gzip_file_is_named() {
    assert!(error("a.nc.gz", &tiny::gzip(&after(0, b"CDF\x01"))).contains("NetCDF"));
    assert!(error("a.gz", &tiny::gzip(&tiny::gzip(b"1"))).contains("archive within an archive"));
}

/// Sizes and steps as GDAL's SRTMHGT driver reads them.
#[test]
fn hgt_sizes() {
    for (name, size, lat) in [
        ("N60E010.hgt", [1801, 3601], 60.5),
        ("N45W074.hgt", [1201, 1201], 45.5),
        ("n45w074.SRTMGL1.hgt", [3601, 3601], 45.5),
        ("S23E010.hgt", [7201, 7201], -22.5),
    ] {
        let loaded = load_bytes(name, &vec![0; size[0] * size[1] * 2], &Options::default()).unwrap();
        let (field, degree) = (&loaded.field, metres_per_degree(lat));
        assert_eq!(field.size(), size.map(|n| n as u32), "{name}");
        for axis in 0..2 {
            let expected = degree[axis] / (size[axis] - 1) as f64;
            assert!((field.spacing[axis] - expected).abs() < 1e-9, "{name}: {:?}", field.spacing);
        }
        assert_eq!(loaded.warnings, Vec::<String>::new(), "{name}");
    }
    // 2 by 1 arc-seconds at 60.5° are nearly square.
    let field = load_bytes("N60E010.hgt", &vec![0; 1801 * 3601 * 2], &Options::default()).unwrap().field;
    assert!(field.spacing.iter().all(|metres| (metres - 30.9).abs() < 0.5), "{:?}", field.spacing);
}

#[test]
fn a_part_of_a_degree_is_refused_with_its_spacing() {
    let error = error("N45W074T86.hgt", &vec![0; 1201 * 1201 * 2]);
    assert!(error.contains("T86") && error.contains("--raw 1201x1201:i16be --spacing 7.2"), "{error}");
    let options = Options { raw: Some("1201x1201:i16be".parse().unwrap()), ..Options::default() };
    assert!(load_bytes("N45W074T86.hgt", &vec![0; 1201 * 1201 * 2], &options).is_ok());
}

#[test]
fn hgt_names_without_a_position_are_warned_about() {
    let loaded = load_bytes("land.hgt", &vec![0; 1201 * 1201 * 2], &Options::default()).unwrap();
    assert!(loaded.warnings[0].contains("no position"), "{:?}", loaded.warnings);
    let loaded = load_bytes("NASADEM_HGT_n42e001.hgt", &vec![0; 1201 * 1201 * 2], &Options::default()).unwrap();
    assert_eq!((loaded.warnings.len(), loaded.field.origin[0] / loaded.field.spacing[0]), (0, 1200.0));
}
