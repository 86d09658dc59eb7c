//! Encodings of heights in the colours of a picture.

use std::str::FromStr;

use crate::height::holes::Holes;

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
