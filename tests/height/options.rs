//! Holes, warnings and options.

use cuesta::internal::height::{HoleFill, Loaded, Options, load_bytes};

use super::{
    tiff_file::{Tag, TiffFile},
    tiny::{self, SIZE},
};

const NODATA: u16 = 42113;

fn load(file: &TiffFile, value: impl Fn(usize, usize) -> f64, options: &Options) -> Loaded {
    load_bytes("options.tif", &file.bytes(value), options).unwrap()
}

/// The tiny field with another value in its first two samples.
fn with(value: f64) -> impl Fn(usize, usize) -> f64 {
    move |i, j| if j == 0 && i < 2 { value } else { tiny::height(i, j) }
}

#[test]
fn nodata_becomes_holes() {
    let short = TiffFile::new(SIZE, 16, 2).tag(NODATA, Tag::Text("-32768".to_owned()));
    let loaded = load(&short, with(-32768.0), &Options::default());
    assert_eq!((loaded.field.holes().count(), loaded.warnings.len()), (2, 0));
    assert!(loaded.field.is_hole(0, 0) && loaded.exact_in_16_bit);
    assert_eq!(loaded.field.statistics().min, 23.0);

    // The lowest f32, rounded as some programs write it.
    let float = TiffFile::new(SIZE, 32, 3).tag(NODATA, Tag::Text("-3.40282306074e+38 ".to_owned()));
    let loaded = load(&float, with(f64::from(f32::MIN)), &Options::default());
    assert_eq!((loaded.field.holes().count(), loaded.exact_in_16_bit), (2, true));

    for infinity in [f64::INFINITY, f64::NEG_INFINITY] {
        let float = TiffFile::new(SIZE, 32, 3).tag(NODATA, Tag::Text(infinity.to_string()));
        let loaded = load(&float, with(infinity), &Options::default());
        assert_eq!((loaded.field.holes().count(), loaded.warnings.len()), (2, 0), "{infinity}");
    }

    let options = Options { nodata: Some(23.0), ..Options::default() };
    let loaded = load(&short, tiny::height, &options);
    assert_eq!(loaded.field.holes().count(), 1);
    assert!(loaded.field.is_hole(0, 1));
    let filled = load(&short, tiny::height, &Options { hole_fill: HoleFill::Interpolate, ..options });
    assert_eq!((filled.field.holes().count(), filled.field.is_hole(0, 1)), (0, false));
}

#[test]
fn nan_and_infinity_become_holes() {
    let float = TiffFile::new(SIZE, 32, 3);
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let loaded = load(&float, with(bad), &Options::default());
        assert_eq!(loaded.field.holes().count(), 2);
        assert_eq!(loaded.warnings, ["2 samples are NaN or infinite and become holes"]);
        assert!((0..5).all(|i| loaded.field.height(i, 0).is_finite()));
    }
}

#[test]
fn undeclared_nodata_is_named() {
    for (bits, format, value) in
        [(16, 2, -32768.0), (16, 2, -32767.0), (16, 2, -9999.0), (16, 1, 65535.0), (32, 3, -9999.0)]
    {
        let options = Options { spacing: Some([1.0; 2]), ..Options::default() };
        let loaded = load(&TiffFile::new(SIZE, bits, format), with(value), &options);
        let [warning] = &loaded.warnings[..] else { panic!("{value}: {:?}", loaded.warnings) };
        let flag = format!("--nodata {}", f64::from(value as f32));
        assert!(warning.starts_with("2 samples") && warning.contains(&flag), "{warning}");
    }
    // A single spike, a plain beside a hill, and a slope are terrain.
    let file = TiffFile::new([9, 9], 16, 2);
    let terrains: [fn(usize, usize) -> f64; 3] = [
        |i, j| if i == 3 && j == 3 { -9999.0 } else { (i + j) as f64 },
        |i, j| if i < 4 { 0.0 } else { (100 + 30 * i + j) as f64 },
        |i, _| i as f64 * 100.0,
    ];
    for terrain in terrains {
        assert_eq!(load(&file, terrain, &Options::default()).warnings, Vec::<String>::new());
    }
}

#[test]
fn crop_tile_and_scale() {
    let file = TiffFile::new(SIZE, 16, 2).placed([10.0, 10.0], [0.0, 0.0]).keys(&[[1024, 1], [3072, 32611]]);
    let options = Options {
        crop: Some([1, 2, 3, 2]),
        tiles: Some([2, 3]),
        height_scale: Some(0.5),
        spacing: Some([7.0, 8.0]),
        ..Options::default()
    };
    let field = load(&file, tiny::height, &options).field;
    assert_eq!((field.stored(), field.size()), ([3, 2], [6, 6]));
    assert_eq!(field.height(4, 3), tiny::height(2, 3) as f32 / 2.0);
    assert_eq!((field.spacing, field.origin), ([7.0, 8.0], [15.0, 25.0]));
    for options in [
        Options { crop: Some([3, 0, 3, 2]), ..Options::default() },
        Options { crop: Some([0, 0, 1, 2]), ..Options::default() },
        Options { crop: Some([u32::MAX, 0, 2, 2]), ..Options::default() },
        Options { tiles: Some([0, 1]), ..Options::default() },
        Options { tiles: Some([u32::MAX, 1]), ..Options::default() },
        Options { spacing: Some([0.0, 1.0]), ..Options::default() },
        Options { spacing: Some([f64::NAN, 1.0]), ..Options::default() },
        Options { height_scale: Some(f64::INFINITY), ..Options::default() },
        Options { max_samples: 19, ..Options::default() },
    ] {
        assert!(load_bytes("wrong", &file.bytes(tiny::height), &options).is_err(), "{options:?}");
    }
}

#[test]
fn raw_layouts() {
    for text in ["5x4", "5x4:u8", "x4:u16le", "5x-4:f32be", "5x4:u16le "] {
        assert!(text.parse::<cuesta::internal::height::RawLayout>().is_err(), "{text}");
    }
    for (text, bytes) in [
        ("2x2:u16le", vec![1, 0, 2, 0, 3, 0, 4, 0]),
        ("2x2:i16be", vec![0, 1, 0, 2, 0, 3, 0, 4]),
        ("2x2:f32be", [1f32, 2.0, 3.0, 4.0].into_iter().flat_map(f32::to_be_bytes).collect()),
    ] {
        let options = Options { raw: Some(text.parse().unwrap()), ..Options::default() };
        let loaded = load_bytes("bare", &bytes, &options).unwrap();
        assert_eq!((loaded.field.height(1, 1), loaded.format), (4.0, "raw"), "{text}");
        let error = load_bytes("bare", &bytes[1..], &options).unwrap_err().to_string();
        assert!(error.contains("expected") && error.contains(&format!("found {}", bytes.len() - 1)), "{error}");
    }
}
