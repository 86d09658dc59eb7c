//! Saved files read back as what was saved.

use std::fs;
use std::path::Path;

use cuesta::internal::height::save::{Codes, save};
use cuesta::internal::height::synth::{Kind, synth};
use cuesta::internal::height::{Field, Holes, Samples};
use tiff::decoder::{Decoder, DecodingResult};
use tiff::tags::Tag;

/// A field with fractions, a hole, unequal spacing and an origin.
fn awkward() -> Field {
    let heights: Vec<f32> = (0..15).map(|k| k as f32 * 1.25 - 3.0).collect();
    let mut holes = Holes::none(15);
    holes.insert(7);
    let mut field = Field::new(Samples::F32(heights), [5, 3], [10.0, 20.0], holes);
    field.origin = [1000.0, -5000.0];
    field
}

fn saved(field: &Field, name: &str) -> Vec<u8> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    save(field, &path).unwrap();
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left beside it");
    fs::read(path).unwrap()
}

fn decode(bytes: Vec<u8>) -> Decoder<std::io::Cursor<Vec<u8>>> {
    Decoder::new(std::io::Cursor::new(bytes)).unwrap()
}

#[test]
fn tiff_keeps_fractions_holes_and_place() {
    let field = awkward();
    let mut tiff = decode(saved(&field, "a.TIF"));
    assert_eq!(tiff.dimensions().unwrap(), (5, 3));
    assert_eq!(tiff.get_tag_f64_vec(Tag::ModelPixelScaleTag).unwrap(), [10.0, 20.0, 0.0]);
    assert_eq!(tiff.get_tag_f64_vec(Tag::ModelTiepointTag).unwrap(), [0.0, 0.0, 0.0, 1000.0, 5000.0, 0.0]);
    assert_eq!(tiff.get_tag_ascii_string(Tag::GdalNodata).unwrap(), "-9999");
    let DecodingResult::F32(heights) = tiff.read_image().unwrap() else { panic!("expected f32") };
    for (k, &height) in heights.iter().enumerate() {
        assert_eq!(height, if k == 7 { -9999.0 } else { field.samples().height(k) });
    }
}

#[test]
fn tiff_is_16_bit_where_that_is_exact() {
    let field = synth(Kind::Checker, [70, 130], 0);
    let mut tiff = decode(saved(&field, "a.tiff"));
    assert!(tiff.get_tag(Tag::GdalNodata).is_err());
    let DecodingResult::I16(heights) = tiff.read_image().unwrap() else { panic!("expected i16") };
    assert!(heights.iter().enumerate().all(|(k, &h)| f32::from(h) == field.samples().height(k)));
}

#[test]
fn asc_keeps_fractions_holes_and_place() {
    let text = String::from_utf8(saved(&awkward(), "a.asc")).unwrap();
    let lines: Vec<_> = text.lines().collect();
    assert_eq!(lines[..4], ["ncols 5", "nrows 3", "xllcenter 1000", "yllcenter 4960"]);
    assert_eq!(lines[4..8], ["dx 10", "dy 20", "NODATA_value -9999", "-3 -1.75 -0.5 0.75 2"]);
    assert_eq!(lines[8..], ["3.25 4.5 -9999 7 8.25", "9.5 10.75 12 13.25 14.5"]);
}

#[test]
fn png_keeps_whole_metres_and_codes() {
    for (kind, code, metres) in [(Kind::Cliff, 1000, 1000.0), (Kind::Checker, 65535, 32767.0)] {
        let field = synth(kind, [33, 17], 0);
        let picture = image::load_from_memory(&saved(&field, "a.png")).unwrap().into_luma16();
        assert_eq!((picture.width(), picture.height()), (33, 17));
        let highest = picture.enumerate_pixels().find(|(.., code)| code.0 == [picture_max(&picture)]).unwrap();
        assert_eq!((highest.2.0, field.height(highest.0, highest.1)), ([code], metres));
    }
}

fn picture_max(picture: &image::ImageBuffer<image::Luma<u16>, Vec<u16>>) -> u16 {
    picture.pixels().map(|p| p.0[0]).max().unwrap()
}

#[test]
fn png_says_its_scale() {
    let bytes = saved(&synth(Kind::Eroded, [9, 9], 0), "a.png");
    let reader = png::Decoder::new(std::io::Cursor::new(bytes)).read_info().unwrap();
    let text = &reader.info().uncompressed_latin1_text[0];
    assert_eq!((text.keyword.as_str(), text.text.as_str()), ("Description", "height in metres = (code - 0) * 0.1"));
}

#[test]
fn fractions_are_stretched_over_all_codes() {
    let field = awkward();
    let Codes { codes, zero, scale } = Codes::new(&field);
    assert_eq!((codes.iter().min(), codes.iter().max()), (Some(&0), Some(&65535)));
    for (k, &code) in codes.iter().enumerate() {
        let height = (f64::from(code) - zero) * scale;
        assert!((height - f64::from(field.samples().height(k))).abs() <= scale * 0.5001);
    }
}

#[test]
fn raw_is_little_endian() {
    let field = synth(Kind::Peers, [7, 5], 1);
    let Samples::Coded { codes, .. } = field.samples() else { panic!("expected codes") };
    let bytes = saved(&field, "a.r16");
    assert_eq!(bytes, codes.iter().flat_map(|c| c.to_le_bytes()).collect::<Vec<_>>());
    assert_eq!(saved(&field, "a.raw"), bytes);
}

#[test]
fn tiles_are_saved_repeated() {
    let field = synth(Kind::Spike, [4, 3], 1).tiled([2, 3]);
    assert_eq!(saved(&field, "a.r16").len(), 8 * 9 * 2);
}

#[test]
fn errors_name_the_file_and_keep_what_was_there() {
    let field = awkward();
    let error = save(&field, Path::new("a.jpeg2000")).unwrap_err();
    assert_eq!(error.to_string(), "a.jpeg2000: output: expected .tif, .asc, .png, .r16 or .raw, found \"jpeg2000\"");
    assert!(
        save(&field, Path::new("no/such/folder/a.tif")).unwrap_err().to_string().starts_with("no/such/folder/a.tif")
    );
}
