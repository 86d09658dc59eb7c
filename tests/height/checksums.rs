//! One flipped bit is found wherever a format has a checksum.
//!
//! PNG has a CRC-32 for each chunk and an Adler-32 for its data; gzip and zip have a CRC-32 of what they hold; Deflate in TIFF has
//! an Adler-32 for each strip or tile, and ZSTD in TIFF an XXH64 if the writer adds it; libtiff does not. The tags
//! of a TIFF, its uncompressed, LZW and PackBits data, and ZSTD without a checksum have none: there a flip may stay unseen.

use std::ops::Range;

use cuesta::internal::height::{Encoding, Options, Samples, load_bytes};
use fastrand::Rng;
use png::{BitDepth, ColorType};

use super::tiff_file::{DEFLATE, LZW, NONE, PACK_BITS, Tag, TiffFile, ZSTD};
use super::tiny;

const SIZE: [usize; 2] = [64, 48];
const FLIPS: usize = 1000;

/// Land that is rough enough not to compress to nothing.
fn height(i: usize, j: usize) -> f64 {
    (300 + 7 * i + 3 * j + (i * i * 31 + j * 17) % 23) as f64
}

struct File {
    name: &'static str,
    bytes: Vec<u8>,
    options: Options,
    /// The bytes that a checksum covers, or whose change makes the file another one.
    covered: Range<usize>,
}

impl File {
    fn whole(name: &'static str, bytes: Vec<u8>) -> Self {
        let (covered, options) = (0..bytes.len(), Options::default());
        Self { name, bytes, options, covered }
    }

    /// The strips or tiles of a TIFF, which lie before its directory.
    fn tiff(name: &'static str, file: &TiffFile) -> Self {
        let bytes = file.bytes(height);
        let directory = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
        Self { covered: 8..directory, ..Self::whole(name, bytes) }
    }

    fn load(&self, bytes: &[u8]) -> Option<Samples> {
        Some(load_bytes(self.name, bytes, &self.options).ok()?.field.samples().clone())
    }

    /// Counts flips of single bits that are refused, change nothing, and change heights.
    fn flipped(&self, flips: impl Iterator<Item = (usize, u8)>) -> [usize; 3] {
        let same = self.load(&self.bytes).expect("the file itself is read");
        let (mut bytes, mut counts) = (self.bytes.clone(), [0; 3]);
        for (at, mask) in flips {
            bytes[at] ^= mask;
            counts[match self.load(&bytes) {
                None => 0,
                Some(samples) if samples == same => 1,
                Some(_) => 2,
            }] += 1;
            bytes[at] ^= mask;
        }
        counts
    }
}

fn picture(color: ColorType, depth: BitDepth, pixel: impl Fn(usize, usize) -> Vec<u8>) -> Vec<u8> {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, SIZE[0] as u32, SIZE[1] as u32);
    encoder.set_color(color);
    encoder.set_depth(depth);
    let pixels: Vec<u8> =
        (0..SIZE[1]).flat_map(|j| (0..SIZE[0]).flat_map(|i| pixel(i, j)).collect::<Vec<_>>()).collect();
    encoder.write_header().unwrap().write_image_data(&pixels).unwrap();
    bytes
}

fn files() -> Vec<File> {
    let grey = picture(ColorType::Grayscale, BitDepth::Sixteen, |i, j| (height(i, j) as u16).to_be_bytes().to_vec());
    let low = picture(ColorType::Grayscale, BitDepth::Eight, |i, j| vec![(height(i, j) % 256.0) as u8]);
    let colours = picture(ColorType::Rgb, BitDepth::Eight, |i, j| {
        let [high, low] = (32768 + height(i, j) as u16).to_be_bytes();
        vec![high, low, 0]
    });
    let [w, h] = SIZE;
    let mut asc = format!("ncols {w}\nnrows {h}\ncellsize 10\n");
    (0..h).for_each(|j| (0..w).for_each(|i| asc += &format!("{} ", height(i, j))));
    let tiff = TiffFile { predictor: 2, ..TiffFile::new(SIZE, 16, 1) };
    let deflate = TiffFile { compression: DEFLATE, ..tiff.clone() };
    let tiled = TiffFile { tile: Some([32, 32]), ..deflate.clone() };
    let floats = TiffFile { bits: 32, format: 3, predictor: 3, ..deflate.clone() };
    let encoding: Encoding = "terrarium".parse().unwrap();
    vec![
        File::whole("grey16.png", grey.clone()),
        File::whole("grey8.png", low),
        File { options: Options { encoding: Some(encoding), ..Options::default() }, ..File::whole("rgb.png", colours) },
        File::tiff("deflate.tif", &deflate),
        File::tiff("tiled.tif", &tiled),
        File::tiff("floats.tif", &floats),
        File::tiff("zstd.tif", &TiffFile { compression: ZSTD, checksum: true, ..tiff.clone() }),
        File::whole("land.asc.gz", tiny::gzip(asc.as_bytes())),
        File::whole("land.tif.gz", tiny::gzip(&tiff.bytes(height))),
        File::whole("land.asc.zip", tiny::zip(&[("land.asc", asc.as_bytes())])),
        File::whole("land.png.zip", tiny::zip(&[("land.png", &grey)])),
    ]
}

#[test]
fn no_flip_of_a_thousand_changes_a_height() {
    let mut random = Rng::with_seed(19);
    let mut wrong = Vec::new();
    for file in files() {
        let flips = (0..FLIPS).map(|_| (random.usize(file.covered.clone()), 1u8 << random.u8(..8)));
        let [refused, same, different] = file.flipped(flips);
        println!("{}: {refused} refused, {same} the same, {different} different", file.name);
        // Names and dates in archives may change; so may bits that nothing depends on.
        if different > 0 || refused * 10 < FLIPS * 9 {
            wrong.push((file.name, refused, same, different));
        }
    }
    assert!(wrong.is_empty(), "refused, the same, different: {wrong:?}");
}

/// As 63 of 120 once were read.
#[test]
fn every_flip_in_the_last_data_of_a_png_is_refused() {
    for file in files().into_iter().filter(|file| file.name.ends_with(".png")) {
        let last = file.bytes.windows(4).rposition(|word| word == b"IDAT").unwrap();
        // To the end of its checksum: the last chunk has 12 bytes.
        let end = file.bytes.len() - 12;
        let flips = (last.max(end - 300)..end).flat_map(|at| (0..8).map(move |bit| (at, 1 << bit)));
        let [refused, same, different] = file.flipped(flips);
        assert_eq!([same, different], [0, 0], "{}: {refused} refused", file.name);
    }
}

/// The Adler-32 alone is wrong where a writer computes the CRC-32 over data that are wrong already.
#[test]
fn the_inner_checksum_of_a_png_is_compared_too() {
    for file in files().into_iter().filter(|file| file.name.ends_with(".png")) {
        let mut bytes = file.bytes.clone();
        let last = bytes.windows(4).rposition(|word| word == b"IDAT").unwrap();
        let crc = bytes.len() - 12 - 4;
        bytes[crc - 1] ^= 1;
        let mut sum = flate2::Crc::new();
        sum.update(&bytes[last..crc]);
        bytes[crc..crc + 4].copy_from_slice(&sum.sum().to_be_bytes());
        assert!(file.load(&bytes).is_none(), "{}", file.name);
    }
}

/// Data that end too soon, go on too long, or are followed by others.
#[test]
fn data_of_another_length_are_refused() {
    let tiled = TiffFile { tile: Some([16, 16]), ..TiffFile::new([16, 16], 16, 1) };
    for compression in [NONE, LZW, DEFLATE, PACK_BITS, ZSTD] {
        let file = TiffFile { compression, ..tiled.clone() };
        let rows = |rows: u16| {
            let file = file.clone().tag(257, Tag::Short(vec![rows])).tag(323, Tag::Short(vec![rows]));
            load_bytes("rows.tif", &file.bytes(height), &Options::default()).map_err(|e| e.to_string())
        };
        assert!(rows(16).is_ok());
        for wrong in [12, 15, 17, 20] {
            let error = rows(wrong).unwrap_err();
            assert!(error.contains("tile 0: expected"), "{compression}, {wrong} rows: {error}");
        }
        let padded = |padding: &[u8]| {
            let file = TiffFile { padding: padding.to_vec(), ..file.clone() };
            load_bytes("padded.tif", &file.bytes(height), &Options::default()).map_err(|e| e.to_string())
        };
        let error = padded(&[7; 9]).unwrap_err();
        assert!(error.contains("tile 0"), "{compression}: {error}");
        if compression != ZSTD {
            padded(&[0]).unwrap();
        }
    }
}

/// Some writers fill the last strip with rows below the picture.
#[test]
fn a_full_last_strip_is_read() {
    for compression in [NONE, LZW, DEFLATE, PACK_BITS, ZSTD] {
        let file = TiffFile { compression, ..TiffFile::new([16, 16], 16, 1) };
        let bytes = file.tag(257, Tag::Short(vec![15])).bytes(height);
        let loaded = load_bytes("strip.tif", &bytes, &Options::default()).unwrap();
        assert_eq!(loaded.field.size(), [16, 15]);
        assert_eq!(f64::from(loaded.field.height(15, 14)), height(15, 14));
    }
}
