//! Bands of a TIFF: heights, colours, opacity and masks.

use cuesta::internal::height::{Encoding, Loaded, Options, load_bytes};

use super::tiff_file::{DEFLATE, NONE, Tag, TiffFile, chained};

const SIZE: [usize; 2] = [37, 23];

fn load(bytes: &[u8], options: &Options) -> Result<Loaded, String> {
    load_bytes("bands.tif", bytes, options).map_err(|e| e.to_string())
}

/// Options that state a spacing, so that nothing is assumed.
fn placed() -> Options {
    Options { spacing: Some([1.0; 2]), ..Options::default() }
}

/// Every way to lay out several bands.
fn layouts(file: &TiffFile) -> impl Iterator<Item = TiffFile> {
    (0..8).map(|layout| TiffFile {
        planar: layout & 1 != 0,
        tile: (layout & 2 != 0).then_some([16, 16]),
        compression: if layout & 4 != 0 { DEFLATE } else { NONE },
        ..file.clone()
    })
}

fn value(i: usize, j: usize, band: usize) -> f64 {
    (1000 * band + 20 * j + i) as f64
}

#[test]
fn each_band_by_its_number() {
    for (bands, bits, predictor) in [(2, 16, 1), (3, 16, 2), (5, 32, 3), (7, 12, 1), (5, 8, 1)] {
        let format = if bits == 32 { 3 } else { 1 };
        for file in layouts(&TiffFile { bands, predictor, ..TiffFile::new(SIZE, bits, format) }) {
            let short = |value: f64| if bits < 16 { value % 250.0 } else { value };
            let bytes = file.bytes(|i, j| short(value(i / bands, j, i % bands)));
            for band in 0..bands {
                let options = Options { band: Some(band as u32 + 1), ..placed() };
                let loaded = load(&bytes, &options).unwrap();
                for (i, j) in [(0, 0), (36, 22), (17, 9), (15, 16)] {
                    assert_eq!(
                        f64::from(loaded.field.height(i, j)),
                        short(value(i as usize, j as usize, band)),
                        "{file:?}"
                    );
                }
                assert_eq!(loaded.warnings, Vec::<String>::new());
            }
            let first = load(&bytes, &placed()).unwrap();
            assert_eq!(f64::from(first.field.height(17, 9)), short(value(17, 9, 0)));
            let words = format!("{bands} bands; heights are band 1 (--band");
            assert!(matches!(&first.warnings[..], [warning] if warning.contains(&words)), "{:?}", first.warnings);
            let error = load(&bytes, &Options { band: Some(bands as u32 + 1), ..Options::default() }).unwrap_err();
            assert!(error.contains(&format!("--band: expected 1 to {bands}, found {}", bands + 1)), "{error}");
        }
    }
}

/// A picture of colours needs an encoding in every layout; one of its bands may be read too.
#[test]
fn colours() {
    let encoding: Encoding = "terrarium".parse().unwrap();
    for bands in [3, 4] {
        for file in layouts(&TiffFile { bands, predictor: 2, ..TiffFile::new(SIZE, 8, 1) }) {
            let bytes = file.bytes(|i, j| match i % bands {
                0 => 129.0,
                1 => (i / bands + j) as f64,
                2 => 64.0,
                _ => f64::from(u8::from(i / bands != 5)),
            });
            let error = load(&bytes, &Options::default()).unwrap_err();
            assert!(error.contains("--encoding terrarium|mapbox"), "{error}");
            let loaded = load(&bytes, &Options { encoding: Some(encoding), ..Options::default() }).unwrap();
            assert_eq!(loaded.field.height(9, 4), 256.0 + 13.0 + 0.25, "{file:?}");
            assert_eq!(loaded.field.holes().count(), if bands == 4 { 23 } else { 0 });
            let loaded = load(&bytes, &Options { band: Some(2), ..Options::default() }).unwrap();
            assert_eq!(loaded.field.height(9, 4), 13.0);
        }
    }
}

#[test]
fn opacity_of_0_is_a_hole() {
    for kind in [1, 2] {
        for (bits, format) in [(8, 1), (16, 1), (16, 2), (32, 3)] {
            let file = TiffFile { bands: 2, ..TiffFile::new(SIZE, bits, format) };
            for file in layouts(&file.tag(338, Tag::Short(vec![kind]))) {
                let opacity = |i: usize| if (3..8).contains(&i) { 0.0 } else { 100.0 };
                let bytes = file.bytes(|i, j| if i % 2 == 0 { (i / 2 + j) as f64 } else { opacity(i / 2) });
                let loaded = load(&bytes, &placed()).unwrap();
                assert_eq!(loaded.field.holes().count(), 5 * 23, "{file:?}");
                assert!(loaded.field.is_hole(3, 0) && !loaded.field.is_hole(8, 22) && loaded.warnings.is_empty());
            }
        }
    }
}

/// A mask of 1 or 8 bits, behind an overview and its own overview.
#[test]
fn internal_masks() {
    for (bits, on) in [(1, 1.0), (8, 255.0)] {
        for file in layouts(&TiffFile::new(SIZE, 32, 3)) {
            let mut bytes = TiffFile { planar: false, ..file.clone() }.bytes(|i, j| value(i, j, 0));
            let second_target = |kind: u64, size: [usize; 2], bits: u16, format: u16| {
                TiffFile { planar: false, size, bits, format, ..file.clone() }.tag(254, Tag::Long(vec![kind]))
            };
            let clear = |i: usize, j: usize| if (4..8).contains(&i) && j < 3 { 0.0 } else { on };
            for (kind, size, bits, format) in [(1, [19, 12], 32, 3), (5, [19, 12], bits, 1), (4, SIZE, bits, 1)] {
                let next = TiffFile { base: bytes.len(), ..second_target(kind, size, bits, format) };
                let next = next.bytes(|i, j| if kind == 4 { clear(i, j) } else { 0.0 });
                bytes = chained(&bytes, &next);
            }
            let loaded = load(&bytes, &placed()).unwrap();
            assert_eq!(loaded.field.holes().count(), 12, "{file:?}");
            assert!(loaded.field.is_hole(4, 0) && loaded.field.is_hole(7, 2) && !loaded.field.is_hole(8, 2));
            assert_eq!(loaded.field.statistics().min, 0.0);
        }
    }
    let first = TiffFile::new(SIZE, 32, 3).bytes(|i, j| value(i, j, 0));
    let mask = TiffFile { base: first.len(), ..TiffFile::new([20, 20], 8, 1) }.tag(254, Tag::Long(vec![4]));
    let error = load(&chained(&first, &mask.bytes(|_, _| 1.0)), &Options::default()).unwrap_err();
    assert!(error.contains("directory 1: expected a mask of 37x23, found 20x20"), "{error}");
}

/// Directories that lead back to each other end too.
#[test]
fn a_circle_of_directories_ends() {
    let first = TiffFile::new(SIZE, 16, 1).bytes(|i, j| value(i, j, 0));
    let next = TiffFile { base: first.len(), ..TiffFile::new(SIZE, 16, 1) }.tag(254, Tag::Long(vec![1]));
    let mut bytes = chained(&first, &next.bytes(|_, _| 1.0));
    let [back, second] = [4, first.len() + 4].map(|at| u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()));
    let entries = usize::from(u16::from_le_bytes(bytes[second as usize..second as usize + 2].try_into().unwrap()));
    let at = second as usize + 2 + 12 * entries;
    bytes[at..at + 4].copy_from_slice(&back.to_le_bytes());
    assert_eq!(load(&bytes, &placed()).unwrap().field.height(1, 0), 1.0);
}

#[test]
fn other_formats_have_one_band() {
    for file in super::tiny::all() {
        let options = Options { band: Some(2), ..file.options.clone() };
        let error = load_bytes(file.name, &file.bytes, &options).unwrap_err().to_string();
        assert!(error.contains("--band") && error.contains("found 2"), "{error}");
    }
}
