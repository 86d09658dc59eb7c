//! Statistics of heights.

use super::holes::Holes;
use super::samples::Samples;

/// Lowest, highest and mean height of the samples that are no holes, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Lowest.
    pub min: f32,
    /// Highest.
    pub max: f32,
    /// Mean.
    pub mean: f64,
}

impl Statistics {
    /// Returns the statistics of the samples that are no holes; zeros if all are holes.
    pub(super) fn of(samples: &Samples, holes: &Holes) -> Self {
        let (mut min, mut max, mut sum, mut count) = (f32::INFINITY, f32::NEG_INFINITY, 0.0, 0u64);
        for k in 0..samples.len() {
            if holes.count() == 0 || !holes.contains(k) {
                let h = samples.height(k);
                (min, max, sum, count) = (min.min(h), max.max(h), sum + f64::from(h), count + 1);
            }
        }
        match count {
            0 => Statistics { min: 0.0, max: 0.0, mean: 0.0 },
            _ => Statistics { min, max, mean: sum / count as f64 },
        }
    }
}
