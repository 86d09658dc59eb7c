//! TIFF samples of every width, and compressions that are not read.

use cuesta::internal::height::{Field, Options, load_bytes};

use super::tiff_file::{DEFLATE, LZW, NONE, Tag, TiffFile, ZSTD};

const SIZE: [usize; 2] = [21, 19];

fn heights(field: &Field) -> Vec<f32> {
    let [w, h] = field.size();
    (0..h).flat_map(|j| (0..w).map(move |i| field.height(i, j))).collect()
}

fn expected(value: impl Fn(usize, usize) -> f64) -> Vec<f32> {
    (0..SIZE[1]).flat_map(|j| (0..SIZE[0]).map(|i| value(i, j) as f32).collect::<Vec<_>>()).collect()
}

/// Options that state a spacing, so that nothing is assumed.
fn placed() -> Options {
    Options { spacing: Some([1.0; 2]), ..Options::default() }
}

/// Every layout of a width: strips and tiles, three compressions, chunky and planar; the first of two bands is read.
fn check(file: &TiffFile, name: &str, value: impl Fn(usize, usize) -> f64) {
    for compression in [NONE, LZW, DEFLATE, ZSTD] {
        for layout in 0..8 {
            let file = TiffFile {
                tile: (layout & 1 != 0).then_some([16, 16]),
                planar: layout & 2 != 0,
                bands: if layout & 4 != 0 { 2 } else { 1 },
                compression,
                ..file.clone()
            };
            let bytes = file.bytes(|i, j| if i % file.bands == 0 { value(i / file.bands, j) } else { 1.0 });
            let loaded = load_bytes("width.tif", &bytes, &placed()).unwrap();
            assert_eq!(heights(&loaded.field), expected(&value), "{file:?}");
            assert_eq!(loaded.sample_type, name, "{file:?}");
        }
    }
}

#[test]
fn integers_of_every_width() {
    for bits in (1..=32).chain([64]) {
        for format in [1, 2] {
            // Heights end at 1e12 m, before the numbers of 64 bits do.
            let span = 2f64.powi(i32::from(bits).min(39));
            let value = |i: usize, j: usize| {
                let share = ((31 * i + 17 * j) % 97) as f64 / 96.0;
                let number = (share * (span - 1.0)).floor();
                if format == 2 { number - span / 2.0 } else { number }
            };
            let name = format!("{}{bits}", if format == 1 { "u" } else { "i" });
            for big_endian in [false, true] {
                // GDAL writes 24 bits otherwise where the file is big-endian.
                if bits != 24 || !big_endian {
                    check(&TiffFile { big_endian, ..TiffFile::new(SIZE, bits, format) }, &name, value);
                }
            }
        }
    }
}

#[test]
fn integers_of_64_bits_with_prediction() {
    for format in [1, 2] {
        let sign = if format == 2 { -1.0 } else { 1.0 };
        let value = |i: usize, j: usize| sign * (1e10 * i as f64 + 1e7 * j as f64);
        for big_endian in [false, true] {
            let file = TiffFile { predictor: 2, big_endian, ..TiffFile::new(SIZE, 64, format) };
            check(&file, if format == 1 { "u64" } else { "i64" }, value);
        }
    }
}

#[test]
fn floats_of_16_bits() {
    let value = |i: usize, j: usize| (31 * i + 17 * j) as f64 * 0.25 - 60.0;
    for predictor in [1, 2, 3] {
        for big_endian in [false, true] {
            check(&TiffFile { predictor, big_endian, ..TiffFile::new(SIZE, 16, 3) }, "f16", value);
        }
    }
}

/// 7 bits of exponent biased by 63, 16 of fraction: 0x3f0000 is 1.
#[test]
fn floats_of_24_bits() {
    for (pattern, height) in [
        (0x3f_0000, 1.0),
        (0xbf_0000, -1.0),
        (0x40_8000, 3.0),
        (0x00_0000, 0.0),
        (0x00_8000, 0.5 * 2f32.powi(-62)),
        (0x47_8001, 384.003_9),
    ] {
        for big_endian in [false, true] {
            let pixel = |i: usize, _: usize| if i == 0 { f64::from(pattern) } else { f64::from(0x3f_0000) };
            let mut file = TiffFile { big_endian, ..TiffFile::new(SIZE, 24, 1) };
            file = file.tag(339, Tag::Short(vec![3]));
            let mut bytes = file.bytes(pixel);
            if !big_endian {
                // The writer stores 24 bits from the highest on; floats are in the file's order.
                let data = SIZE[0] * SIZE[1] * 3;
                bytes[8..8 + data].chunks_exact_mut(3).for_each(<[u8]>::reverse);
            }
            let loaded = load_bytes("float24.tif", &bytes, &placed()).unwrap();
            assert_eq!((loaded.field.height(0, 0), loaded.field.height(1, 0)), (height, 1.0), "{pattern:#x}");
            assert_eq!(loaded.sample_type, "f24");
        }
    }
    let nan = TiffFile::new(SIZE, 24, 1).tag(339, Tag::Short(vec![3]));
    let loaded =
        load_bytes("nan.tif", &nan.bytes(|i, _| if i == 0 { f64::from(0x01_807f) } else { 0.0 }), &Options::default());
    assert_eq!(loaded.unwrap().field.holes().count(), 19);
}

#[test]
fn bits_from_the_lowest_on() {
    let value = |i: usize, j: usize| (31 * i + 17 * j) as f64;
    for compression in [NONE, DEFLATE] {
        let file = TiffFile { compression, ..TiffFile::new(SIZE, 16, 1) }.tag(266, Tag::Short(vec![2]));
        let mut bytes = file.bytes(value);
        let directory = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
        bytes[8..directory].iter_mut().for_each(|byte| *byte = byte.reverse_bits());
        let loaded = load_bytes("reversed.tif", &bytes, &placed()).unwrap();
        assert_eq!(heights(&loaded.field), expected(value));
    }
}

#[test]
fn other_compressions_and_types_are_named() {
    for (code, name) in [
        (34887, "LERC"),
        (50002, "JPEG XL"),
        (52546, "JPEG XL"),
        (7, "JPEG"),
        (34712, "JPEG 2000"),
        (50001, "WebP"),
        (34925, "LZMA"),
        (4, "CCITT group 4"),
        (12345, "an unknown one (code 12345)"),
    ] {
        let file = TiffFile { compression: code, ..TiffFile::new(SIZE, 16, 1) };
        let error = load_bytes("a.tif", &file.bytes(|_, _| 1.0), &Options::default()).unwrap_err().to_string();
        assert!(error.contains("a.tif: Compression: ") && error.contains(&format!("found {name}")), "{error}");
    }
    for (bits, format, words) in [
        (64, 6, "found 64 bits of"),
        (40, 1, "expected integers of 1 to 32 or 64 bits or floats of 16, 24, 32 or 64, found 40 bits"),
        (8, 3, "found 8 bits of IEEEFP"),
    ] {
        let file = TiffFile::new(SIZE, bits, format);
        let error = load_bytes("a.tif", &file.bytes(|_, _| 1.0), &Options::default()).unwrap_err().to_string();
        assert!(error.contains("BitsPerSample, SampleFormat") && error.contains(words), "{error}");
    }
}
