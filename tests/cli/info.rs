//! `info` about georeferenced, damaged and badly described files.

use super::*;
use crate::height::{tiff_file::TiffFile, tiny};

const UTM_32: [[u16; 2]; 2] = [[1024, 1], [3072, 32632]];

#[test]
fn the_extent_is_printed_in_degrees() {
    let folder = folder();
    let tiff = TiffFile::new([101, 201], 16, 2).placed([10.0, 10.0], [499_500.0, 5_200_000.0]);
    std::fs::write(folder.path().join("utm.tif"), tiff.clone().keys(&UTM_32).bytes(tiny::height)).unwrap();
    std::fs::write(folder.path().join("local.tif"), tiff.bytes(tiny::height)).unwrap();
    let extent = &json(folder.path(), &["info", "utm.tif"])["extent_deg"];
    let [west, south, east, north] = ["west", "south", "east", "north"].map(|side| extent[side].as_f64().unwrap());
    // 1 km by 2 km around the central meridian, 9° E.
    assert!(west < 9.0 && 9.0 < east && (east - west - 0.01318).abs() < 1e-4, "{extent}");
    assert!((46.9..47.0).contains(&north) && (north - south - 0.018).abs() < 1e-4, "{extent}");
    assert!(json(folder.path(), &["info", "local.tif"])["extent_deg"].is_null());
    let text = stdout(&cuesta(folder.path(), &["info", "utm.tif"]));
    assert!(text.contains("extent deg: west 8.99"), "{text}");
    assert!(!stdout(&cuesta(folder.path(), &["info", "local.tif"])).contains("extent"));
}

#[test]
fn warnings_name_their_file() {
    let folder = folder();
    let at = folder.path();
    std::fs::write(at.join("d.tif"), TiffFile::new([5, 4], 16, 2).bytes(tiny::height)).unwrap();
    std::fs::write(at.join("d.tfw"), "5\n0\n0\nx\n1\n2").unwrap();
    let warnings = String::from_utf8_lossy(&cuesta(at, &["info", "d.tif"]).stderr).into_owned();
    assert!(warnings.contains("warning: d.tif: .tfw: expected six numbers"), "{warnings}");
    assert!(warnings.lines().all(|line| line.starts_with("warning: d.tif: ")), "{warnings}");
}

#[test]
fn damaged_files_are_refused_in_one_plain_line() {
    let folder = folder();
    let at = folder.path();
    let tiff = TiffFile::new([37, 23], 16, 2).bytes(tiny::height);
    std::fs::write(at.join("broken.tif"), &tiff[..tiff.len() / 2]).unwrap();
    std::fs::write(at.join("broken.zip"), &tiny::zip(&[("a.tif", &tiff)])[..99]).unwrap();
    std::fs::write(at.join("N42E001.hgt"), vec![0; 1000]).unwrap();
    std::fs::write(at.join("empty.png"), "").unwrap();
    refused(at, &["info", "broken.tif"], &["broken.tif: ", "end"]);
    refused(at, &["info", "broken.zip"], &["broken.zip: zip directory: ", "incomplete"]);
    refused(at, &["info", "N42E001.hgt"], &["N42E001.hgt: content: expected an SRTM tile", "found 1000"]);
    refused(at, &["info", "empty.png"], &["empty.png: content: ", "an empty file"]);
}
