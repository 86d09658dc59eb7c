//! Frame times: a histogram of constant size for percentiles, and smoothed values for display.

use serde::Serialize;

/// Ratio of successive class limits: the relative error of a percentile.
const STEP: f64 = 1.02;
/// Lower limit of the first class, milliseconds.
const FIRST_MS: f64 = 0.01;
/// Number of classes; the last one begins at about a quarter of an hour.
const CLASSES: usize = 926;

/// A histogram of frame times.
pub struct Times {
    counts: Vec<u64>,
    max: f64,
}

/// Percentiles and maximum of frame times, milliseconds.
#[derive(Clone, Copy, Debug, Default, Serialize)]
pub struct Percentiles {
    /// Median.
    pub p50: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Maximum.
    pub max: f64,
}

impl Default for Times {
    fn default() -> Self {
        Self { counts: vec![0; CLASSES], max: 0.0 }
    }
}

impl Times {
    /// Adds a frame time, milliseconds.
    pub fn add(&mut self, ms: f64) {
        let class = (ms / FIRST_MS).max(1.0).log(STEP) as usize;
        self.counts[class.min(CLASSES - 1)] += 1;
        self.max = self.max.max(ms);
    }

    /// Returns the number of frames.
    pub fn count(&self) -> u64 {
        self.counts.iter().sum()
    }

    /// Returns the percentiles; zeros if there was no frame.
    pub fn percentiles(&self) -> Percentiles {
        let at = |share: f64| {
            let rank = (share * self.count() as f64).ceil() as u64;
            let mut below = 0;
            let class = self.counts.iter().position(|count| {
                below += count;
                below >= rank
            });
            let upper = FIRST_MS * STEP.powi(class.unwrap_or(0) as i32 + 1);
            upper.min(self.max)
        };
        Percentiles { p50: at(0.5), p95: at(0.95), p99: at(0.99), max: self.max }
    }
}

/// An exponentially smoothed value with a time constant of 0.5 s, for display.
#[derive(Clone, Copy, Debug, Default)]
pub struct Smoothed(Option<f64>);

impl Smoothed {
    /// Adds a value that lasted for `dt` seconds.
    pub fn add(&mut self, value: f64, dt: f64) {
        let share = 1.0 - (-dt / 0.5).exp();
        self.0 = Some(self.0.map_or(value, |old| old + (value - old) * share));
    }

    /// Returns the smoothed value; 0 before the first.
    pub fn get(&self) -> f64 {
        self.0.unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_accurate_to_a_class() {
        let mut times = Times::default();
        (1..=1000).for_each(|k| times.add(f64::from(k) / 10.0));
        let p = times.percentiles();
        for (found, expected) in [(p.p50, 50.0), (p.p95, 95.0), (p.p99, 99.0)] {
            assert!((expected..expected * STEP * STEP).contains(&found), "{found} for {expected}");
        }
        assert_eq!((p.max, times.count()), (100.0, 1000));
    }

    #[test]
    fn empty_and_extreme_inputs_give_finite_percentiles() {
        assert_eq!(Times::default().percentiles().p99, 0.0);
        let mut times = Times::default();
        [0.0, 1e-9, 1e9, f64::NAN].into_iter().for_each(|ms| times.add(ms));
        assert_eq!(times.count(), 4);
        assert!(times.percentiles().p50.is_finite());
    }
}
