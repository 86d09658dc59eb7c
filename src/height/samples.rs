//! Heights in memory: floats, or 16-bit codes where these hold them without loss.

use std::ops::Range;

/// Heights in memory, row by row from the north-west corner.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Metres.
    F32(Vec<f32>),
    /// 16-bit codes: height = (code − zero) · scale, computed in f32 in that order.
    Coded {
        /// One code a sample.
        codes: Vec<u16>,
        /// The code of height 0, an integer within ±2^24.
        zero: f32,
        /// Metres per code.
        scale: f32,
    },
}

impl Samples {
    /// Codes for signed 16-bit metres.
    pub fn from_i16(values: impl IntoIterator<Item = i16>) -> Self {
        let codes = values.into_iter().map(|v| (v as u16) ^ 0x8000).collect();
        Samples::Coded { codes, zero: 32768.0, scale: 1.0 }
    }

    /// Returns the number of samples.
    pub fn len(&self) -> usize {
        match self {
            Samples::F32(heights) => heights.len(),
            Samples::Coded { codes, .. } => codes.len(),
        }
    }

    /// Returns true if there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Returns the height of sample `k`, metres.
    #[inline]
    pub fn height(&self, k: usize) -> f32 {
        match self {
            Samples::F32(heights) => heights[k],
            Samples::Coded { codes, zero, scale } => (f32::from(codes[k]) - zero) * scale,
        }
    }

    /// Appends the heights of a range of samples, metres.
    pub fn append(&self, range: Range<usize>, heights: &mut Vec<f64>) {
        match self {
            Samples::F32(samples) => heights.extend(samples[range].iter().map(|&h| f64::from(h))),
            Samples::Coded { codes, zero, scale } => {
                heights.extend(codes[range].iter().map(|&code| f64::from((f32::from(code) - zero) * scale)))
            }
        }
    }

    /// Extends a range of heights, metres, by those of samples.
    pub(super) fn range(&self, range: Range<usize>, start: [f32; 2]) -> [f32; 2] {
        let extend = |[low, high]: [f32; 2], height: f32| [low.min(height), high.max(height)];
        match self {
            Samples::F32(heights) => heights[range].iter().copied().fold(start, extend),
            Samples::Coded { codes, zero, scale } => {
                codes[range].iter().map(|&code| (f32::from(code) - zero) * scale).fold(start, extend)
            }
        }
    }

    /// Sets sample `k` to `height` metres, or to the nearest code.
    pub fn set(&mut self, k: usize, height: f32) {
        match self {
            Samples::F32(heights) => heights[k] = height,
            Samples::Coded { codes, zero, scale } => codes[k] = (height / *scale + *zero).round() as u16,
        }
    }

    /// Multiplies every height.
    pub fn multiply(&mut self, factor: f32) {
        match self {
            Samples::F32(heights) => heights.iter_mut().for_each(|h| *h *= factor),
            // Codes stay in the order of the heights.
            Samples::Coded { codes, zero, scale } if factor < 0.0 => {
                codes.iter_mut().for_each(|code| *code = u16::MAX - *code);
                (*zero, *scale) = (f32::from(u16::MAX) - *zero, *scale * -factor);
            }
            Samples::Coded { scale, .. } => *scale *= factor,
        }
    }

    /// Multiplies every height and adds an offset, metres. Codes stay codes if the offset is a whole number of steps.
    pub fn scale_and_shift(&mut self, factor: f64, offset: f64) {
        if let Samples::Coded { zero, scale, .. } = self {
            let step = (f64::from(*scale) * factor) as f32;
            let moved = f64::from(*zero) - offset / f64::from(step);
            if moved.fract() == 0.0 && moved.abs() <= f64::from(1 << 24) {
                (*zero, *scale) = (moved as f32, step);
                return;
            }
        }
        let heights = (0..self.len()).map(|k| (f64::from(self.height(k)) * factor + offset) as f32).collect();
        *self = Samples::F32(heights).compacted();
    }
}

impl Samples {
    /// Returns the same heights as 16-bit codes where that loses nothing: all are whole multiples of 2^-k metres for
    /// some k of 0..=8, and span no more than 65535 of them.
    pub fn compacted(self) -> Self {
        let Samples::F32(heights) = self else { return self };
        match compact_scale(&heights) {
            Some((low, scale)) => {
                let codes = heights.iter().map(|&h| (f64::from(h) / scale - low) as u16).collect();
                Samples::Coded { codes, zero: -low as f32, scale: scale as f32 }
            }
            None => Samples::F32(heights),
        }
    }
}

/// The lowest height in multiples of the scale, and the scale, of codes that hold all heights.
fn compact_scale(heights: &[f32]) -> Option<(f64, f64)> {
    let (mut min, mut max, mut finest) = (f64::INFINITY, f64::NEG_INFINITY, 1.0f64);
    for height in heights.iter().map(|&h| f64::from(h)) {
        while (height * finest).fract() != 0.0 {
            finest *= 2.0;
            if finest > 256.0 || !height.is_finite() {
                return None;
            }
        }
        (min, max) = (min.min(height), max.max(height));
    }
    let (low, high) = (min * finest, max * finest);
    let exact = f64::from(1 << 24);
    (high - low <= 65535.0 && low.abs() <= exact && high.abs() <= exact).then_some((low, 1.0 / finest))
}
