//! Heights encoded in the colours of a picture: Terrarium and Mapbox Terrain-RGB.

use std::{io::Cursor, str::FromStr};

use image::{ColorType, DynamicImage, ImageDecoder, ImageFormat, ImageReader, Limits, RgbaImage};

use super::{
    decoded::Decoded,
    input::{self, Input},
    load::Options,
    png,
};
use crate::height::{Error, Holes, Samples};

/// Encoding of heights in colours.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Encoding {
    /// R · 256 + G + B / 256 − 32768 metres.
    Terrarium,
    /// −10000 + (R · 65536 + G · 256 + B) · 0.1 metres.
    Mapbox,
}

impl FromStr for Encoding {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "terrarium" => Ok(Encoding::Terrarium),
            "mapbox" => Ok(Encoding::Mapbox),
            _ => Err(format!("expected terrarium|mapbox, found {text:?}")),
        }
    }
}

impl Encoding {
    /// Returns metres per unit of a value.
    pub(super) fn step(self) -> f64 {
        match self {
            Encoding::Terrarium => 1.0,
            Encoding::Mapbox => 0.1,
        }
    }

    /// Returns the name of the sample type.
    pub(super) fn name(self) -> &'static str {
        match self {
            Encoding::Terrarium => "terrarium rgb",
            Encoding::Mapbox => "mapbox rgb",
        }
    }

    /// Returns the exact value of a colour, given as a number of 24 bits, in steps of [`Self::step`].
    pub(super) fn value(self, number: i32) -> f32 {
        match self {
            Encoding::Terrarium => (number - (32768 << 8)) as f32 / 256.0,
            Encoding::Mapbox => (number - 100_000) as f32,
        }
    }

    /// Stores pixels of 3 or 4 bytes as samples `at..`; where alpha is 0 there is no data.
    pub(super) fn store(self, pixels: &[u8], channels: usize, heights: &mut [f32], holes: &mut Holes, at: usize) {
        for (k, pixel) in (at..heights.len()).zip(pixels.chunks_exact(channels)) {
            heights[k] = self.value(pixel[..3].iter().fold(0, |number, &byte| number << 8 | i32::from(byte)));
            if pixel.get(3) == Some(&0) {
                holes.insert(k);
            }
        }
    }
}

/// Returns the requested encoding, or an error that names the option.
pub(super) fn asked(name: &str, options: &Options) -> Result<Encoding, Error> {
    let what = "found a colour picture, which could mean several things: give --encoding terrarium|mapbox";
    options.encoding.ok_or_else(|| Error::new(name, "content", what))
}

/// Returns true if a file begins as a WebP picture.
pub(super) fn is_webp(head: &[u8]) -> bool {
    matches!(head, [b'R', b'I', b'F', b'F', _, _, _, _, b'W', b'E', b'B', b'P', ..])
}

/// Reads a colour picture that encodes heights.
pub(super) fn read(input: &mut Input, options: &Options) -> Result<Decoded, Error> {
    let encoding = asked(input.name, options)?;
    let picture = decode(input.name, &mut input.reader, options)?;
    let (w, h) = picture.dimensions();
    let count = input.samples([w, h].map(u64::from), options)?;
    let (mut heights, mut holes) = (vec![0.0; count], Holes::none(count));
    encoding.store(picture.as_raw(), 4, &mut heights, &mut holes, 0);
    let mut raster = Decoded::new(encoding.name(), [w, h], Samples::F32(heights));
    raster.holes = holes;
    raster.step = encoding.step();
    Ok(raster)
}

/// Decodes the picture of a tile.
pub(super) fn decode_bytes(name: &str, bytes: &[u8], options: &Options) -> Result<RgbaImage, Error> {
    decode(name, Cursor::new(bytes), options)
}

fn decode(name: &str, reader: impl input::ReadSeek, options: &Options) -> Result<RgbaImage, Error> {
    let error = |e: &dyn std::fmt::Display| Error::new(name, "picture", e);
    let reader = ImageReader::new(reader).with_guessed_format().map_err(|e| error(&e))?;
    if reader.format() == Some(ImageFormat::Png) {
        return png::colours(name, reader.into_inner(), options);
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
