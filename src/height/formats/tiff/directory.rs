//! The claims of a TIFF's first directory, read before its decoder trusts them.
//!
//! The decoder multiplies sizes unchecked while it opens a file, and takes its limits only afterwards.

use std::{
    collections::BTreeMap,
    io::{self, Read, Seek, SeekFrom},
};

use crate::height::error::Error;
use crate::height::formats::input::Input;
use crate::height::formats::options::Options;
use crate::height::formats::sample::Order;

const WIDTH: u16 = 256;
const LENGTH: u16 = 257;
const SAMPLES_PER_PIXEL: u16 = 277;
const ROWS_PER_STRIP: u16 = 278;
const TILE_WIDTH: u16 = 322;
const TILE_LENGTH: u16 = 323;

/// The most samples of a tile, 2^26: four times the largest in use.
const TILE_SAMPLES: u64 = 1 << 26;

/// Refuses sizes out of bounds.
pub(super) fn check(input: &mut Input, options: &Options) -> Result<(), Error> {
    let numbers = first_directory(input).map_err(|e| input.error("directory", e))?;
    let number = |tag: u16, default: u64| numbers.get(&tag).copied().unwrap_or(default);
    let (w, h) = (number(WIDTH, 0), number(LENGTH, 0));
    input.samples([w, h], options)?;
    let bands = number(SAMPLES_PER_PIXEL, 1);
    if !(1..=u64::from(u16::MAX)).contains(&bands) || h.saturating_mul(bands) > u64::from(u32::MAX) {
        return Err(input.error("SamplesPerPixel", format!("expected 1 to 65535 bands, found {bands}")));
    }
    let tile = number(TILE_WIDTH, 1).saturating_mul(number(TILE_LENGTH, 1));
    if !(1..=TILE_SAMPLES).contains(&tile) || number(ROWS_PER_STRIP, 1) == 0 {
        let what = format!("expected at least one row, and at most {TILE_SAMPLES} samples in a tile, found {tile}");
        return Err(input.error("TileWidth, TileLength, RowsPerStrip", what));
    }
    input.reader.rewind().map_err(|e| input.error("byte 0", e))
}

/// The directory's entries that are one unsigned integer.
fn first_directory(input: &mut Input) -> io::Result<BTreeMap<u16, u64>> {
    let mut head = [0; 4];
    input.reader.read_exact(&mut head)?;
    let order = if head[0] == b'M' { Order::Big } else { Order::Little };
    let big = head[2] == 43 || head[3] == 43;
    let mut file = Numbers { reader: &mut input.reader, order };
    let (at, entries) = if big {
        file.unsigned(4)?;
        let at = file.unsigned(8)?;
        file.reader.seek(SeekFrom::Start(at))?;
        (at, file.unsigned(8)?)
    } else {
        let at = file.unsigned(4)?;
        file.reader.seek(SeekFrom::Start(at))?;
        (at, file.unsigned(2)?)
    };
    let (word, entry) = if big { (8, 20) } else { (4, 12) };
    if entries == 0 || entries.saturating_mul(entry) > input.len.saturating_sub(at) {
        return Err(io::Error::other(format!(
            "expected its entries within {} bytes, found {entries} at byte {at}",
            input.len
        )));
    }
    let mut numbers = BTreeMap::new();
    for _ in 0..entries {
        let (tag, kind, count) = (file.unsigned(2)? as u16, file.unsigned(2)?, file.unsigned(word)?);
        let mut value = vec![0; word];
        file.reader.read_exact(&mut value)?;
        let len = match kind {
            1 => 1,
            3 => 2,
            4 | 13 => 4,
            16 | 18 => 8,
            // The decoder reports these itself, on stderr.
            2 if count > input.len => {
                return Err(io::Error::other(format!(
                    "expected a text within the file, found {count} bytes of tag {tag}"
                )));
            }
            2 | 5..=12 | 17 => continue,
            // The decoder skips too few bytes of these and reads the rest as entries.
            _ if big => return Err(io::Error::other(format!("expected a known type of tag {tag}, found {kind}"))),
            _ => continue,
        };
        if count == 1 && len <= word {
            numbers.insert(tag, Numbers { reader: &mut value.as_slice(), order }.unsigned(len)?);
        } else {
            numbers.remove(&tag);
        }
    }
    Ok(numbers)
}

/// Integers of a file.
struct Numbers<'a, R> {
    reader: &'a mut R,
    order: Order,
}

impl<R: Read> Numbers<'_, R> {
    fn unsigned(&mut self, len: usize) -> io::Result<u64> {
        let mut bytes = [0; 8];
        self.reader.read_exact(&mut bytes[..len])?;
        if self.order == Order::Big {
            bytes[..len].reverse();
        }
        Ok(u64::from_le_bytes(bytes))
    }
}
