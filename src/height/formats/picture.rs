//! Pictures as colours with opacity: PNG, whose checksums are all compared, and WebP.

use std::io::{BufRead, Cursor, Seek};

use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits, RgbaImage};
use png::{BitDepth, DecodeOptions, Decoder, DecodingError, Transformations};

use super::input;
use super::options::Options;
use crate::height::error::Error;

/// Decodes the picture of a tile.
pub(super) fn decode_bytes(name: &str, bytes: &[u8], options: &Options) -> Result<RgbaImage, Error> {
    decode(name, Cursor::new(bytes), options)
}

/// Decodes a picture of at most 8 bits a channel.
pub(super) fn decode(name: &str, reader: impl input::ReadSeek, options: &Options) -> Result<RgbaImage, Error> {
    let error = |e: &dyn std::fmt::Display| Error::new(name, "picture", e);
    let reader = ImageReader::new(reader).with_guessed_format().map_err(|e| error(&e))?;
    if reader.format() == Some(ImageFormat::Png) {
        return colours(name, reader.into_inner(), options);
    }
    let mut limits = Limits::default();
    limits.max_alloc = Some(options.max_samples.saturating_mul(8).max(1 << 20));
    let mut reader = reader;
    reader.limits(limits);
    let decoder = reader.into_decoder().map_err(|e| error(&e))?;
    let (w, h) = decoder.dimensions();
    // Servers send a picture of one pixel for absent tiles.
    input::samples(name, [w, h].map(|n| u64::from(n.max(2))), options)?;
    match decoder.color_type() {
        ColorType::Rgb8 | ColorType::Rgba8 | ColorType::L8 | ColorType::La8 => (),
        other => return Err(error(&format!("expected 8 bits a channel, found {other:?}"))),
    }
    Ok(DynamicImage::from_decoder(decoder).map_err(|e| error(&e))?.into_rgba8())
}

/// Returns a decoder that verifies every checksum, of optional chunks too: one of them holds the transparent value.
pub(super) fn checked<R: BufRead + Seek>(reader: R) -> Decoder<R> {
    let mut options = DecodeOptions::default();
    options.set_ignore_adler32(false);
    options.set_skip_ancillary_crc_failures(false);
    Decoder::new_with_options(reader, options)
}

/// Reads a picture of 8 bits a channel as colours with opacity.
fn colours(name: &str, reader: impl input::ReadSeek, options: &Options) -> Result<RgbaImage, Error> {
    let error = |e: DecodingError| Error::new(name, "picture", e);
    let mut decoder = checked(reader);
    let header = decoder.read_header_info().map_err(error)?;
    let (w, h, depth) = (header.width, header.height, header.bit_depth);
    // Servers send a picture of one pixel for absent tiles.
    input::samples(name, [w, h].map(|n| u64::from(n.max(2))), options)?;
    let count = w as usize * h as usize;
    if depth == BitDepth::Sixteen {
        return Err(Error::new(name, "picture", "expected 8 bits a channel, found 16"));
    }
    decoder.set_limits(png::Limits { bytes: png::Limits::default().bytes.saturating_add(count.saturating_mul(4)) });
    // A palette becomes colours, and a transparent colour opacity.
    decoder.set_transformations(Transformations::EXPAND);
    let mut reader = decoder.read_info().map_err(error)?;
    let channels = reader.output_color_type().0.samples();
    let mut pixels = vec![0; count * channels];
    reader.next_frame(&mut pixels).map_err(error)?;
    reader.finish().map_err(error)?;
    let mut picture = RgbaImage::new(w, h);
    for (to, pixel) in picture.pixels_mut().zip(pixels.chunks_exact(channels)) {
        to.0 = match *pixel {
            [grey] => [grey, grey, grey, u8::MAX],
            [grey, alpha] => [grey, grey, grey, alpha],
            [r, g, b] => [r, g, b, u8::MAX],
            _ => [pixel[0], pixel[1], pixel[2], pixel[3]],
        };
    }
    Ok(picture)
}
