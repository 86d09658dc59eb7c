//! ESRI ASCII grid: a header of keys and numbers, then heights as text, rows from the north.

use super::decoded::Decoded;
use super::input::Input;
use super::options::Options;
use super::text;
use super::words::Words;
use crate::height::error::Error;
use crate::height::georef::affine::Affine;
use crate::height::georef::place::Grid;
use crate::height::samples::Samples;

/// The keys of a header, lower case.
const KEYS: [&str; 11] = [
    "ncols",
    "nrows",
    "xllcorner",
    "xllcenter",
    "yllcorner",
    "yllcenter",
    "cellsize",
    "dx",
    "dy",
    "nodata_value",
    "nodata",
];

/// Returns true if a file begins with a key of a grid's header.
pub(super) fn is_header(head: &[u8]) -> bool {
    let word = head.trim_ascii_start().split(u8::is_ascii_whitespace).next().unwrap_or_default();
    KEYS.iter().any(|key| word.eq_ignore_ascii_case(key.as_bytes()))
}

/// Reads a grid.
pub(super) fn read(input: &mut Input, options: &Options) -> Result<Decoded, Error> {
    let mut words = Words::new();
    let header = Header::read(input, &mut words)?;
    let size = header.size(input)?;
    let count = input.samples(size, options)?;
    // Each height takes a digit and a space, except the last.
    input.need("heights", (count as u64).saturating_mul(2) - 1)?;
    let heights = read_heights(input, &mut words, count)?;
    let size = size.map(|n| n as u32);
    let mut raster = Decoded::new("text", size, Samples::F32(heights));
    raster.nodata = header.value(&["nodata_value", "nodata"]);
    raster.georeference.affine = Some(Affine::north_up(header.grid(input, size)?));
    Ok(raster)
}

/// The numbers of a header.
struct Header(Vec<(String, f64)>);

impl Header {
    /// Reads keys and numbers up to the first height, at which `words` stays.
    fn read(input: &mut Input, words: &mut Words) -> Result<Self, Error> {
        let mut values = Vec::new();
        loop {
            words.next(input)?;
            let key = words.word().to_lowercase();
            if !KEYS.contains(&key.as_str()) || values.len() > KEYS.len() {
                return Ok(Self(values));
            }
            words.next(input)?;
            values.push((key, number(input, words)?));
        }
    }

    fn value(&self, keys: &[&str]) -> Option<f64> {
        self.0.iter().find(|(key, _)| keys.contains(&key.as_str())).map(|&(_, value)| value)
    }

    fn size(&self, input: &Input) -> Result<[u64; 2], Error> {
        let side = |key: &str| match self.value(&[key]) {
            Some(n) if n >= 0.0 && n.fract() == 0.0 && n < 1e15 => Ok(n as u64),
            Some(n) => Err(input.error(key, format!("expected a whole number, found {n}"))),
            None => Err(input.error(key, "expected in the header, found none")),
        };
        Ok([side("ncols")?, side("nrows")?])
    }

    /// Returns the position of the samples.
    fn grid(&self, input: &Input, [_, rows]: [u32; 2]) -> Result<Grid, Error> {
        let step = [self.value(&["dx", "cellsize"]), self.value(&["dy", "cellsize"])];
        let [Some(dx), Some(dy)] = step else {
            return Err(input.error("cellsize", "expected cellsize or dx and dy, found none"));
        };
        if !(dx > 0.0 && dy > 0.0) {
            return Err(input.error("cellsize", format!("expected a positive number, found {dx}, {dy}")));
        }
        let corner = |corner: &str, centre: &str, step: f64| {
            self.value(&[centre]).or(self.value(&[corner]).map(|at| at + step / 2.0)).unwrap_or(step / 2.0)
        };
        let west = corner("xllcorner", "xllcenter", dx);
        let north = corner("yllcorner", "yllcenter", dy) + dy * f64::from(rows - 1);
        Ok(([west, north], [dx, dy]))
    }
}

fn read_heights(input: &mut Input, words: &mut Words, count: usize) -> Result<Vec<f32>, Error> {
    let mut heights: Vec<f32> = Vec::with_capacity(count);
    while !words.word().is_empty() {
        if heights.len() == count {
            return Err(input.error(format!("line {}", words.line), format!("expected {count} heights, found more")));
        }
        heights.push(number(input, words)? as f32);
        words.next(input)?;
    }
    if heights.len() < count {
        let what = format!("expected {count} heights, found {}", heights.len());
        return Err(input.error(format!("line {}", words.line), what));
    }
    Ok(heights)
}

fn number(input: &Input, words: &Words) -> Result<f64, Error> {
    let wrong = || input.error(format!("line {}", words.line), format!("expected a number, found {:?}", words.word()));
    text::number(words.word()).ok_or_else(wrong)
}
