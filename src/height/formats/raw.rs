//! Bare samples without a header, and rows of samples in general.

use std::io::SeekFrom;

use super::decoded::Decoded;
use super::input::Input;
use super::options::Options;
use super::raw_layout::RawLayout;
use super::sample::{Order, SampleType};
use crate::height::error::Error;
use crate::height::samples::Samples;

/// Reads bare samples of the layout in the options.
pub(super) fn read(input: &mut Input, options: &Options) -> Result<Decoded, Error> {
    let Some(RawLayout { size, sample, order }) = options.raw else {
        return Err(input.error("content", hint(input.len)));
    };
    let [w, h] = size;
    let count = input.samples(size.map(u64::from), options)?;
    let expected = (count * sample.bytes()) as u64;
    if input.len != expected {
        let what = format!("expected {expected} bytes for {w}x{h} {}, found {}", sample.name(), input.len);
        return Err(input.error("--raw", what));
    }
    let rows = Rows { sample, order, start: 0, stride: u64::from(w) * sample.bytes() as u64 };
    let samples = rows.read(input, size, count)?;
    Ok(Decoded::new(sample.name(), size, samples))
}

/// Rows of uncompressed samples in a file.
pub(super) struct Rows {
    /// Type of a sample.
    pub sample: SampleType,
    /// Order of its bytes.
    pub order: Order,
    /// Byte position of the first row.
    pub start: u64,
    /// Bytes from one row to the next.
    pub stride: u64,
}

impl Rows {
    /// Reads all rows, `count` samples, which the caller has checked against the limit.
    pub fn read(&self, input: &mut Input, [w, h]: [u32; 2], count: usize) -> Result<Samples, Error> {
        let row_bytes = w as usize * self.sample.bytes();
        let needed = self.stride.checked_mul(u64::from(h) - 1).and_then(|n| n.checked_add(row_bytes as u64));
        let needed = needed.and_then(|n| n.checked_add(self.start)).unwrap_or(u64::MAX);
        input.need("samples", needed)?;
        let mut samples = self.sample.blank(count);
        let mut row = vec![0; row_bytes];
        for j in 0..h as usize {
            let at = self.start + j as u64 * self.stride;
            let read = input.reader.seek(SeekFrom::Start(at)).and_then(|_| input.reader.read_exact(&mut row));
            read.map_err(|e| input.error(format!("row {j}"), e))?;
            self.sample.store(self.order, &row, &mut samples, j * w as usize);
        }
        Ok(samples)
    }
}

/// Returns the error text for a file of no known format: the flag to use, and the square sizes that would fit.
pub(super) fn hint(len: u64) -> String {
    let fits = |bytes: u64| {
        (len.is_multiple_of(bytes)).then(|| (len / bytes).isqrt()).filter(|n| *n > 1 && n * n * bytes == len)
    };
    let mut fitting = Vec::new();
    fitting.extend(fits(2).map(|n| format!("{n}x{n}:u16le")));
    fitting.extend(fits(4).map(|n| format!("{n}x{n}:f32le")));
    let fitting = if fitting.is_empty() { "no square".to_owned() } else { fitting.join(" or ") };
    format!(
        "expected a known height format, found {len} other bytes; bare samples need --raw WxH:TYPE ({fitting} fits)"
    )
}
