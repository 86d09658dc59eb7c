//! Any bytes yield a field or an error of one line, quickly and without a panic.

use std::panic::{AssertUnwindSafe, catch_unwind};

use cuesta::internal::height::{Options, load_bytes};

use super::{
    tiff_file::{DEFLATE, NONE, Tag, TiffFile},
    tiny::{self, Tiny},
};

/// Bytes at the beginning and at the end in which single bits are flipped: headers and directories.
const HEADER: usize = 1200;

/// Loads changed bytes; returns true if they were refused.
fn refused(file: &Tiny, what: &str, bytes: &[u8], hdr: Option<&[u8]>) -> bool {
    let loaded = catch_unwind(AssertUnwindSafe(|| file.load_as(bytes, hdr)));
    let loaded = loaded.unwrap_or_else(|_| panic!("{}: {what} panics", file.name));
    if let Err(error) = &loaded {
        let error = error.to_string();
        assert!(!error.contains('\n') && error.starts_with(file.name), "{}: {what}: {error}", file.name);
    }
    loaded.is_err()
}

/// Calls `visit` with every change of some bytes: each byte inverted, and single bits near both ends.
fn changes(bytes: &[u8], mut visit: impl FnMut(&str, &[u8])) {
    let mut changed = bytes.to_vec();
    for at in 0..bytes.len() {
        let is_header = at < HEADER || at + HEADER > bytes.len();
        let bits = (0..8).map(|bit| 1u8 << bit).filter(|_| is_header);
        for mask in bits.chain([0xff]) {
            changed[at] ^= mask;
            visit(&format!("byte {at} ^ {mask:#x}"), &changed);
            changed[at] ^= mask;
        }
    }
}

#[test]
fn every_prefix_is_refused() {
    for file in tiny::all() {
        for len in 0..file.bytes.len() {
            let is_refused = refused(&file, &format!("prefix {len}"), &file.bytes[..len], file.hdr.as_deref());
            // What follows the last sample may be absent: white space, the end marks of PNG and of archives.
            let is_sample = !file.bytes[len..].trim_ascii().is_empty() && len + 40 < file.bytes.len();
            assert!(
                is_refused || !is_sample || file.name.contains(".tif"),
                "{}: prefix {len} of {}",
                file.name,
                file.bytes.len()
            );
        }
        for len in 0..file.hdr.as_ref().map_or(0, Vec::len) {
            refused(&file, &format!("header prefix {len}"), &file.bytes, file.hdr.as_ref().map(|hdr| &hdr[..len]));
        }
    }
}

#[test]
fn every_flipped_byte_is_survived() {
    for file in tiny::all() {
        changes(&file.bytes, |what, bytes| {
            refused(&file, what, bytes, file.hdr.as_deref());
        });
        if let Some(hdr) = &file.hdr {
            changes(hdr, |what, hdr| {
                refused(&file, &format!("header {what}"), &file.bytes, Some(hdr));
            });
        }
    }
}

#[test]
fn every_flipped_byte_of_a_zipped_hgt_is_survived() {
    let hgt: Vec<u8> = (0..1201 * 1201).flat_map(|k| ((k / 90_000) as i16).to_be_bytes()).collect();
    for (name, bytes) in [("N01E001.zip", tiny::zip(&[("N01E001.hgt", &hgt)])), ("N01E001.hgt.gz", tiny::gzip(&hgt))] {
        let is_end = |at: usize| at < 60 || at + 160 > bytes.len();
        for at in (0..bytes.len()).filter(|&at| is_end(at) || at % 97 == 0) {
            let mut changed = bytes.clone();
            changed[at] ^= 0xff;
            let _ = load_bytes(name, &changed, &Options::default());
            let _ = load_bytes(name, &bytes[..at], &Options::default());
        }
    }
}

/// A file that claims more than it holds causes no large allocation.
#[test]
fn huge_claims_are_refused() {
    let tiff = |w: u64, h: u64| {
        let mut file = TiffFile::new([4, 4], 16, 1);
        file = file.tag(256, Tag::Long(vec![w])).tag(257, Tag::Long(vec![h]));
        file.bytes(|_, _| 1.0)
    };
    let asc = |w: u64, h: u64| format!("ncols {w}\nnrows {h}\ncellsize 1\n1 2 3\n").into_bytes();
    let dem = String::from_utf8(tiny::usgs_dem(|_| [0, 3])).unwrap();
    let far = dem.replacen("6.000000000000000D+05", "6.000000000000000D+11", 1).into_bytes();
    let many = dem.replacen("     1     5   ", "     199999   ", 1).into_bytes();
    // Steps so small that neighbouring rows have the same coordinate.
    let fine = dem.replacen("  3.000000E1  3.000000E1", "  3.000000E1 1.000000E-9", 1);
    let fine = fine.replace("5.100000000000000D+06", "5.100000000000000D+11");
    let fine = fine.replacen("5.100000000000000D+11", "5.100000000000001D+11", 1).into_bytes();
    for (name, bytes) in [
        ("a.tif", tiff(1 << 16, 1 << 15)),
        ("b.tif", tiff(u64::from(u32::MAX), u64::from(u32::MAX))),
        ("c.tif", tiff(4, 1 << 27)),
        ("d.asc", asc(1 << 16, 1 << 15)),
        ("e.asc", asc(99_999_999_999_999, 99_999_999_999_999)),
        ("f.asc", asc(1 << 15, 1 << 15)),
        ("g.dem", far),
        ("h.dem", many),
        ("i.dem", fine),
    ] {
        let start = std::time::Instant::now();
        let error = load_bytes(name, &bytes, &Options::default()).unwrap_err();
        assert!(start.elapsed().as_secs() < 2, "{error}");
    }
    let error = load_bytes("a.tif", &tiff(1 << 16, 1 << 15), &Options::default()).unwrap_err().to_string();
    assert!(error.contains("--max-samples") && error.contains("65536x32768"), "{error}");
    let raw = Options { raw: Some("65536x65536:f32le".parse().unwrap()), ..Options::default() };
    assert!(load_bytes("i.raw", &[0; 64], &raw).unwrap_err().to_string().contains("--max-samples"));
}

/// Chunks are checked against the file's length, and against what their compression can hold.
#[test]
fn chunks_that_lie_are_refused() {
    let file = TiffFile::new([4, 4], 16, 1);
    for (tag, compression, words) in [
        ((279, Tag::Long(vec![16, 99_999])), NONE, ["strip 1", "expected 99999 bytes at byte 24"]),
        ((279, Tag::Long(vec![15, 16])), NONE, ["strip 0", "found 15 bytes"]),
        ((257, Tag::Long(vec![4_000_000])), DEFLATE, ["strip 0", "expected enough data for 4x4000000 samples"]),
    ] {
        let mut file = TiffFile { compression, ..file.clone() }.tag(tag.0, tag.1);
        if compression == DEFLATE {
            // All rows in one strip.
            file.size[1] = 2;
            file = file.tag(278, Tag::Long(vec![4_000_000]));
        }
        let error = load_bytes("chunk.tif", &file.bytes(|_, _| 1.0), &Options::default()).unwrap_err().to_string();
        assert!(words.iter().all(|word| error.contains(word)), "{error}");
    }
}

#[test]
fn a_bomb_is_refused() {
    let bomb = tiny::gzip(&vec![b' '; 40 << 20]);
    let options = Options { max_samples: 1 << 20, ..Options::default() };
    let error = load_bytes("bomb.gz", &bomb, &options).unwrap_err().to_string();
    assert!(error.contains("at most 16777216 bytes"), "{error}");
}

#[test]
fn errors_say_what_to_do() {
    for (bytes, words) in [
        (vec![0u8; 513 * 513 * 2], vec!["--raw", "513x513:u16le"]),
        (vec![0u8; 64 * 64 * 4], vec!["--raw", "64x64:f32le"]),
        (vec![], vec!["found 0"]),
        (b"\xff\xd8\xff\xe0".to_vec(), vec!["JPEG"]),
        (b"ncols 3\nnrows 3\n1 2 3".to_vec(), vec!["length", "heights"]),
        (b"ncols 3\nnrows 2\ncellsize 1\n1 2 3 4 5 x\n".to_vec(), vec!["line 4", "\"x\""]),
        (b"ncols 3\nnrows 2\ncellsize 1\n1 2 3 4 5    \n".to_vec(), vec!["expected 6 heights, found 5"]),
        (b"ncols 1\nnrows 2\ncellsize 1\n1 2\n".to_vec(), vec!["2x2", "1x2"]),
    ] {
        let error = load_bytes("f", &bytes, &Options::default()).unwrap_err().to_string();
        let mut words = words.into_iter().filter(|word| *word != "length" && *word != "heights");
        assert!(words.all(|word| error.contains(word)), "{error}");
    }
}

/// Writes the tiny files as seeds of the fuzz target (`fuzz/fuzz_targets/load.rs` says how they are read).
#[test]
#[ignore = "writes fuzz/seeds"]
fn write_seeds() {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fuzz/seeds");
    std::fs::create_dir_all(&folder).unwrap();
    for file in tiny::all() {
        let wish = u8::from(file.options.raw.is_some()) | u8::from(file.options.encoding.is_some()) << 1;
        let hdr = file.hdr.map(|hdr| [b"\xffH", hdr.as_slice()].concat()).unwrap_or_default();
        // The target's inputs have at most 4096 bytes: two of five profiles.
        let is_long = file.bytes.len() > 4096;
        let bytes = if is_long { [&file.bytes[..863], b"2", &file.bytes[864..3072]].concat() } else { file.bytes };
        std::fs::write(folder.join(file.name), [vec![wish], bytes, hdr].concat()).unwrap();
    }
}

/// A header that claims more samples than its file can hold is refused before memory is taken for them.
#[test]
fn a_picture_that_claims_too_much_is_refused() {
    let mut bytes = Vec::new();
    let mut encoder = png::Encoder::new(&mut bytes, 32_768, 32_768);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Sixteen);
    drop(encoder.write_header().unwrap());
    let error = cuesta::internal::height::load_bytes("a.png", &bytes, &cuesta::internal::height::Options::default())
        .unwrap_err();
    assert!(error.to_string().contains("a.png: length: expected data of 32768 x 32768 samples"), "{error}");
}
