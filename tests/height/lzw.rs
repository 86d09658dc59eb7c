//! LZW as programs write it around a change of the code width, with an end code or without.

use cuesta::internal::height::{Options, load_bytes};

use super::tiff_file::{LZW, NONE, TiffFile};

const CLEAR: u32 = 256;
const END: u32 = 257;

/// The end code that a writer leaves after its data.
#[derive(Clone, Copy, Debug, PartialEq)]
enum End {
    /// As wide as the next code.
    Wide,
    /// As wide as the last code.
    Narrow,
    /// No end code.
    Absent,
}

/// Bytes of which no two neighbours occur twice, so that every code is a literal and adds an entry to the table.
fn literals(count: usize) -> Vec<u8> {
    (0..count).map(|k| if k % 2 == 0 { 0 } else { (k / 2 + 1) as u8 }).collect()
}

fn encode(bytes: &[u8], end: End) -> Vec<u8> {
    let (mut out, mut bits, mut held) = (Vec::new(), 0, 0u32);
    let mut put = |code: u32, width: u32| {
        held = held << width | code;
        bits += width;
        while bits >= 8 {
            bits -= 8;
            out.push((held >> bits) as u8);
            held &= (1 << bits) - 1;
        }
        (held, bits)
    };
    // The table has 258 entries and gets one with each literal but the first; code 511 is the first of 10 bits.
    let width = |literals: usize| if 258 + literals > 511 { 10 } else { 9 };
    put(CLEAR, 9);
    bytes.iter().enumerate().for_each(|(k, &byte)| {
        put(u32::from(byte), width(k));
    });
    let last = match end {
        End::Wide => put(END, width(bytes.len())),
        End::Narrow => put(END, width(bytes.len() - 1)),
        End::Absent => put(0, 0),
    };
    if last.1 > 0 {
        out.push((last.0 << (8 - last.1)) as u8);
    }
    out
}

/// A file of one strip of such data.
fn file(packed: &[u8], size: [usize; 2]) -> Vec<u8> {
    // Stored as if it were raw samples, then named LZW.
    let rows = TiffFile { compression: NONE, ..TiffFile::new([packed.len(), 1], 8, 1) };
    let mut bytes = rows.bytes(|i, _| f64::from(packed[i]));
    let at = u32::from_le_bytes(bytes[4..8].try_into().unwrap()) as usize;
    for entry in 0..usize::from(u16::from_le_bytes(bytes[at..at + 2].try_into().unwrap())) {
        let entry = at + 2 + 12 * entry;
        let value = match u16::from_le_bytes(bytes[entry..entry + 2].try_into().unwrap()) {
            256 => size[0],
            257 => size[1],
            259 => usize::from(LZW),
            _ => continue,
        };
        bytes[entry + 8..entry + 12].copy_from_slice(&(value as u32).to_le_bytes());
    }
    bytes
}

#[test]
fn every_length_around_a_change_of_width() {
    for half in 118..=138 {
        let expected = literals(2 * half);
        for end in [End::Wide, End::Narrow, End::Absent] {
            let bytes = file(&encode(&expected, end), [half, 2]);
            let loaded = load_bytes("lzw.tif", &bytes, &Options::default());
            let loaded = loaded.unwrap_or_else(|e| panic!("{} bytes, {end:?}: {e}", 2 * half));
            for (k, &byte) in expected.iter().enumerate() {
                let height = loaded.field.height((k % half) as u32, (k / half) as u32);
                assert_eq!(height, f32::from(byte), "{} bytes, {end:?}", 2 * half);
            }
        }
    }
}

#[test]
fn too_few_and_too_many_bytes_are_refused() {
    for (count, words) in [(230, "expected 240 bytes, found the end"), (260, "expected the end of the data, found")] {
        let bytes = file(&encode(&literals(count), End::Wide), [120, 2]);
        let error = load_bytes("lzw.tif", &bytes, &Options::default()).unwrap_err().to_string();
        assert!(error.contains("strip 0") && error.contains(words), "{error}");
    }
}
