//! Errors about incomplete and damaged files name the file and say in plain words what is wrong.

use cuesta::internal::height::{Options, load_bytes};

use super::{tiff_file::TiffFile, tiny};

/// Returns the error of a file with these bytes, which must begin with the file's name.
fn error(name: &str, bytes: &[u8]) -> String {
    let error = load_bytes(name, bytes, &Options::default()).expect_err(name).to_string();
    assert!(error.starts_with(name) && !error.contains('\n'), "{error}");
    error
}

fn whole(name: &str) -> Vec<u8> {
    tiny::all().into_iter().find(|file| file.name == name).expect(name).bytes
}

#[test]
fn files_that_end_too_early_are_called_incomplete() {
    let png = whole("grey16.png");
    let tiff = TiffFile::new([37, 23], 16, 2).bytes(tiny::height);
    let zip = tiny::zip(&[("a.png", &png)]);
    let gzip = tiny::gzip(&png);
    for (name, bytes) in [("a.png", &png), ("a.tif", &tiff), ("a.zip", &zip), ("a.png.gz", &gzip)] {
        for len in [bytes.len() / 3, bytes.len() / 2] {
            let error = error(name, &bytes[..len]);
            assert!(error.contains("incomplete") || error.contains("the file's end"), "{len} bytes of {name}: {error}");
        }
    }
}

#[test]
fn flipped_bits_are_called_damage() {
    let mut png = whole("grey16.png");
    let middle = png.len() / 2;
    png[middle] ^= 4;
    assert!(error("a.png", &png).contains("expected undamaged data"));
    // The width in the header chunk.
    let mut png = whole("grey16.png");
    png[19] ^= 1;
    assert!(error("a.png", &png).ends_with("header: expected undamaged data, found a wrong checksum"));
}

#[test]
fn tiles_of_a_wrong_length_are_named_as_tiles() {
    for len in [10, 2_884_801, 2_884_803] {
        let error = error("N42E001.hgt", &vec![0; len]);
        assert!(error.contains("SRTM tile of 2884802, 25934402") && error.contains(&format!("found {len}")), "{error}");
    }
}
