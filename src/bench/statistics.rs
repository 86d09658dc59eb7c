//! Statistics of noisy times: medians, percentiles by rank, and bootstrap intervals of medians. Random numbers have a
//! fixed seed, so equal values give equal results.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::measure::extended;

/// Number of bootstrap resamples.
const RESAMPLES: usize = 4000;
/// Confidence level of intervals.
pub const CONFIDENCE: f64 = 0.95;

/// Median, two high percentiles and maximum of some values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = extended::non_negative)]
pub struct Percentiles {
    /// Median.
    pub p50: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Largest value.
    pub max: f64,
}

/// Mean and maximum of some values.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = extended::non_negative)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Largest value.
    pub max: f64,
}

/// An estimate with its confidence interval.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = extended::non_negative)]
pub struct Estimate {
    /// The estimate.
    pub value: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

impl Percentiles {
    /// Computes the percentiles of these values; zeros without values.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let sorted = sorted(values);
        let at = |share| percentile(&sorted, share);
        Self { p50: median(&sorted), p95: at(0.95), p99: at(0.99), max: at(1.0) }
    }
}

impl Spread {
    /// Computes mean and maximum of these values, which must not be negative; zeros without values.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let (count, sum, max) =
            values.into_iter().fold((0.0, 0.0, 0.0f64), |(n, sum, max), v| (n + 1.0, sum + v, max.max(v)));
        Self { mean: sum / f64::max(count, 1.0), max }
    }
}

impl Estimate {
    /// Returns the median of these values with its 95 % interval (percentile bootstrap, Efron 1979).
    pub fn median(values: &[f64]) -> Self {
        let mut random = fastrand::Rng::with_seed(1);
        let draws = sorted((0..RESAMPLES).map(|_| median(&resampled(values, &mut random))));
        let tail = (1.0 - CONFIDENCE) / 2.0;
        let [low, high] = [tail, 1.0 - tail].map(|share| percentile(&draws, share));
        Self { value: middle(values.iter().copied()), low, high }
    }
}

/// Sorts values in ascending order.
pub fn sorted(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_unstable_by(f64::total_cmp);
    values
}

/// Draws as many values as given, with replacement, and sorts them.
fn resampled(values: &[f64], random: &mut fastrand::Rng) -> Vec<f64> {
    sorted((0..values.len()).map(|_| values[random.usize(..values.len())]))
}

/// Returns a percentile of sorted values by nearest rank. `share` is 0.95 for the 95th one. 0 without values.
pub fn percentile(sorted: &[f64], share: f64) -> f64 {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
}

/// Returns the median of sorted values; 0 without values.
fn median(sorted: &[f64]) -> f64 {
    match sorted.len() {
        0 => 0.0,
        n => (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0,
    }
}

/// Returns the median of values in any order; 0 without values.
pub fn middle(values: impl IntoIterator<Item = f64>) -> f64 {
    median(&sorted(values))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_ranks() {
        let p = Percentiles::of((1..=1000).rev().map(f64::from));
        assert_eq!(p, Percentiles { p50: 500.5, p95: 950.0, p99: 990.0, max: 1000.0 });
        assert_eq!(Percentiles::of([7.0]), Percentiles { p50: 7.0, p95: 7.0, p99: 7.0, max: 7.0 });
        assert_eq!(Percentiles::of([]), Percentiles::default());
        assert_eq!(Spread::of([1.0, 2.0, 6.0]), Spread { mean: 3.0, max: 6.0 });
        assert_eq!(middle([4.0, 1.0, 3.0, 9.0]), 3.5);
    }

    /// About 95 % of the intervals from 400 samples of 15 values around 10 must contain 10.
    #[test]
    fn intervals_hold_the_truth_as_often_as_they_say() {
        let mut random = fastrand::Rng::with_seed(3);
        let mut sample = || -> Vec<f64> { (0..15).map(|_| 10.0 * (0.5 + random.f64())).collect() };
        let holds = (0..400).filter(|_| {
            let median = Estimate::median(&sample());
            median.low <= 10.0 && 10.0 <= median.high
        });
        let medians = holds.count();
        assert!((360..=396).contains(&medians), "{medians} of 400");
    }
}
