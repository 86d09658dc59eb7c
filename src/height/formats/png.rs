//! PNG with 8 or 16 bits of grey: a sample is the grey value. All its checksums are compared.

use png::{BitDepth, ColorType, DecodingError, Limits};

use super::decoded::Decoded;
use super::input::{self, Input};
use super::options::Options;
use super::picture::checked;
use super::sample::{Order, SampleType};
use super::terrain_rgb;
use crate::height::error::Error;
use crate::height::holes::Holes;
use crate::height::samples::Samples;

/// Most bytes that a byte of Deflate data can expand to.
const EXPANSION: u64 = 1032;

/// Reads grey heights row by row; colour pictures go to [`terrain_rgb`].
pub(super) fn read(input: &mut Input, options: &Options) -> Result<Decoded, Error> {
    let (name, input_len) = (input.name, input.len);
    let error = |place: String, e: DecodingError| Error::new(name, place, e);
    let mut decoder = checked(&mut input.reader);
    let header = decoder.read_header_info().map_err(|e| error("header".to_owned(), e))?;
    let (size, color, depth) = ([header.width, header.height], header.color_type, header.bit_depth);
    let interlaced = header.interlaced;
    let sample = match (color, depth) {
        (ColorType::Grayscale | ColorType::GrayscaleAlpha, BitDepth::Eight) => SampleType::U8,
        (ColorType::Grayscale | ColorType::GrayscaleAlpha, BitDepth::Sixteen) => SampleType::U16,
        (ColorType::Grayscale, depth) => {
            return Err(input.error("bit depth", format!("expected 8 or 16, found {}", depth as u8)));
        }
        _ => {
            terrain_rgb::asked(name, options)?;
            drop(decoder);
            input.reader.rewind().map_err(|e| input.error("byte 0", e))?;
            return terrain_rgb::read(input, options);
        }
    };
    let count = input::samples(name, size.map(u64::from), options)?;
    if input_len.saturating_mul(EXPANSION) < count as u64 * sample.bytes() as u64 {
        let what = format!("expected data of {} x {} samples, found a file of {input_len} bytes", size[0], size[1]);
        return Err(Error::new(name, "length", what));
    }
    let row_bytes = size[0] as usize * sample.bytes() * color.samples();
    // The decoder holds a few rows; the rest of its default limit is for other chunks.
    decoder.set_limits(Limits { bytes: Limits::default().bytes.saturating_add(row_bytes.saturating_mul(8)) });
    let mut reader = decoder.read_info().map_err(|e| error("header".to_owned(), e))?;

    let mut target =
        Target { sample, channels: color.samples(), samples: sample.blank(count), holes: Holes::none(count) };
    if interlaced {
        let mut picture = vec![0; row_bytes * size[1] as usize];
        reader.next_frame(&mut picture).map_err(|e| error("picture".to_owned(), e))?;
        target.store(&picture, 0);
    } else {
        for j in 0..size[1] {
            let row = reader.next_row().map_err(|e| error(format!("row {j}"), e))?;
            let row = row.ok_or_else(|| Error::new(name, format!("row {j}"), format!("expected {} rows", size[1])))?;
            target.store(row.data(), j as usize * size[0] as usize);
        }
    }
    // The last checksums are compared at the end of the file.
    reader.finish().map_err(|e| error("end".to_owned(), e))?;
    let transparent = reader.info().trns.as_ref().filter(|_| target.channels == 1);
    let transparent = transparent.map(|bytes| bytes.iter().fold(0, |value, &b| value << 8 | u32::from(b)));
    let mut raster = Decoded::new(sample.name(), size, target.samples);
    raster.holes = target.holes;
    raster.nodata = transparent.map(f64::from);
    Ok(raster)
}

/// Samples and holes that pixels are stored to.
struct Target {
    sample: SampleType,
    channels: usize,
    samples: Samples,
    holes: Holes,
}

impl Target {
    /// Stores grey pixels as samples `at..`; where alpha is 0 there is no data.
    fn store(&mut self, pixels: &[u8], at: usize) {
        if self.channels == 1 {
            return self.sample.store(Order::Big, pixels, &mut self.samples, at);
        }
        let bytes = self.sample.bytes();
        for (k, pixel) in (at..).zip(pixels.chunks_exact(2 * bytes)) {
            self.sample.store(Order::Big, &pixel[..bytes], &mut self.samples, k);
            if pixel[bytes..].iter().all(|&b| b == 0) {
                self.holes.insert(k);
            }
        }
    }
}
