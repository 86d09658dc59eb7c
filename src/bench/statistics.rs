//! Statistics of noisy times: medians and percentiles by rank, bootstrap intervals, ratios. Deterministic.

use serde::{Deserialize, Serialize};

/// Draws of a bootstrap.
const RESAMPLES: usize = 4000;
/// Share of the distribution that a quoted interval holds.
pub const CONFIDENCE: f64 = 0.95;

/// Values that half, 95 % and 99 % do not exceed, and the largest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Percentiles {
    /// Median.
    pub p50: f64,
    /// 95 %.
    pub p95: f64,
    /// 99 %.
    pub p99: f64,
    /// Largest.
    pub max: f64,
}

/// Mean and largest.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    /// Mean.
    pub mean: f64,
    /// Largest.
    pub max: f64,
}

/// A value and the interval that holds it with a given confidence.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The value.
    pub value: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Percentiles {
    /// Of these values; zeros if there is none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let sorted = sorted(values);
        let at = |share| percentile(&sorted, share);
        Self { p50: median(&sorted), p95: at(0.95), p99: at(0.99), max: at(1.0) }
    }
}

impl Spread {
    /// Of these values; zeros if there is none.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let (count, sum, max) =
            values.into_iter().fold((0.0, 0.0, 0.0f64), |(n, sum, max), v| (n + 1.0, sum + v, max.max(v)));
        Self { mean: sum / f64::max(count, 1.0), max }
    }
}

impl Estimate {
    /// The median of these values with its bootstrap 95 % interval (percentile method, Efron 1979).
    pub fn median(values: &[f64]) -> Self {
        let mut random = fastrand::Rng::with_seed(1);
        Self::bootstrap(median(&sorted(values.iter().copied())), CONFIDENCE, || median(&resampled(values, &mut random)))
    }

    /// The ratio of two independent sets of positive values: the median of all ratios of a value of `to` to a value
    /// of `from` (Hodges and Lehmann 1963, on logarithms), which a few outliers do not move.
    pub fn ratio(from: &[f64], to: &[f64], confidence: f64) -> Self {
        let [from, to] = [from, to].map(|values| values.iter().map(|v| v.ln()).collect::<Vec<_>>());
        let Self { value, low, high } = Self::difference(&from, &to, confidence);
        Self { value: value.exp(), low: low.exp(), high: high.exp() }
    }

    /// The shift between two independent sets: the median of all differences of a value of `to` and one of `from`.
    pub fn difference(from: &[f64], to: &[f64], confidence: f64) -> Self {
        let shift = |from: &[f64], to: &[f64]| median(&sorted(to.iter().flat_map(|b| from.iter().map(move |a| b - a))));
        let mut random = fastrand::Rng::with_seed(1);
        Self::bootstrap(shift(from, to), confidence, || {
            shift(&resampled(from, &mut random), &resampled(to, &mut random))
        })
    }

    fn bootstrap(value: f64, confidence: f64, draw: impl FnMut() -> f64) -> Self {
        let draws = sorted(std::iter::repeat_with(draw).take(RESAMPLES));
        let tail = (1.0 - confidence) / 2.0;
        Self { value, low: percentile(&draws, tail), high: percentile(&draws, 1.0 - tail) }
    }
}

fn sorted(values: impl IntoIterator<Item = f64>) -> Vec<f64> {
    let mut values: Vec<f64> = values.into_iter().collect();
    values.sort_unstable_by(f64::total_cmp);
    values
}

/// As many values again, each drawn from all, sorted.
fn resampled(values: &[f64], random: &mut fastrand::Rng) -> Vec<f64> {
    sorted((0..values.len()).map(|_| values[random.usize(..values.len())]))
}

/// The smallest of the sorted values that this share of them does not exceed; 0 of none.
fn percentile(sorted: &[f64], share: f64) -> f64 {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.saturating_sub(1)).copied().unwrap_or(0.0)
}

/// The middle of the sorted values; 0 of none.
fn median(sorted: &[f64]) -> f64 {
    match sorted.len() {
        0 => 0.0,
        n => (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0,
    }
}

/// The middle value; 0 of none.
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

    /// Of 400 samples of 15 values around 10, about 95 % have an interval that holds 10.
    #[test]
    fn intervals_hold_the_truth_as_often_as_they_say() {
        let mut random = fastrand::Rng::with_seed(3);
        let mut sample = |scale: f64| -> Vec<f64> { (0..15).map(|_| scale * (0.5 + random.f64())).collect() };
        let holds = (0..400).filter(|_| {
            let median = Estimate::median(&sample(10.0));
            median.low <= 10.0 && 10.0 <= median.high
        });
        let medians = holds.count();
        let holds = (0..400).filter(|_| {
            let ratio = Estimate::ratio(&sample(10.0), &sample(13.0), CONFIDENCE);
            ratio.low <= 1.3 && 1.3 <= ratio.high
        });
        let ratios = holds.count();
        assert!((360..=396).contains(&medians) && (360..=396).contains(&ratios), "{medians} {ratios} of 400");
    }

    #[test]
    fn one_outlier_does_not_move_a_ratio() {
        let ratio = Estimate::ratio(&[10.0, 10.1, 9.9, 10.0, 50.0], &[20.0, 20.2, 19.8, 20.0, 20.1], CONFIDENCE);
        assert!((ratio.value - 2.0).abs() < 0.05, "{ratio:?}");
        assert_eq!(ratio, Estimate::ratio(&[10.0, 10.1, 9.9, 10.0, 50.0], &[20.0, 20.2, 19.8, 20.0, 20.1], CONFIDENCE));
    }
}
