//! Options for reading height files.

use super::encoding::Encoding;
use super::raw_layout::RawLayout;

/// Treatment of samples without data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum HoleFill {
    /// They stay holes.
    #[default]
    No,
    /// They get the heights interpolated from around them and count as data.
    Interpolate,
}

/// Options for reading a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Options {
    /// Distance of neighbouring samples (x, z), metres, instead of what the file says.
    pub spacing: Option<[f64; 2]>,
    /// Multiplies every height.
    pub height_scale: Option<f64>,
    /// Added to every height after that, metres.
    pub height_offset: f64,
    /// The value that means "no data", instead of what the file says.
    pub nodata: Option<f64>,
    /// The file is bare samples of this layout.
    pub raw: Option<RawLayout>,
    /// The part to keep: x, z, width, height in samples.
    pub crop: Option<[u32; 4]>,
    /// Repetitions of the field along (x, z).
    pub tiles: Option<[u32; 2]>,
    /// Treatment of samples without data.
    pub hole_fill: HoleFill,
    /// Encoding of heights in the colours of a picture.
    pub encoding: Option<Encoding>,
    /// The band of a file of several, from 1; by default the first, or the colours of a picture.
    pub band: Option<u32>,
    /// Zoom level of a tile directory; by default the highest complete one.
    pub zoom: Option<u32>,
    /// Files that claim more samples are refused.
    pub max_samples: u64,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            spacing: None,
            height_scale: None,
            height_offset: 0.0,
            nodata: None,
            raw: None,
            crop: None,
            tiles: None,
            hole_fill: HoleFill::No,
            encoding: None,
            band: None,
            zoom: None,
            max_samples: 1 << 30,
        }
    }
}
