//! Statistics of noisy times: medians and percentiles by rank, bootstrap intervals of medians, exact intervals of
//! ratios. Deterministic.

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
        let draws = sorted((0..RESAMPLES).map(|_| median(&resampled(values, &mut random))));
        let tail = (1.0 - CONFIDENCE) / 2.0;
        let [low, high] = [tail, 1.0 - tail].map(|share| percentile(&draws, share));
        Self { value: middle(values.iter().copied()), low, high }
    }

    /// The ratio of two independent sets of positive values: the median of all ratios of a value of `to` to one of
    /// `from`, and the ratios between which it lies unless something happened whose probability is `tail` on either
    /// side (Hodges, Lehmann 1963; Moses 1965). Exact whatever the noise; few values may be too few for a small tail,
    /// and then the interval holds all their ratios.
    pub fn ratio(from: &[f64], to: &[f64], tail: f64) -> Self {
        let ratios = sorted(to.iter().flat_map(|b| from.iter().map(move |a| b / a)));
        let probabilities = smaller_pairs(from.len(), to.len());
        let up_to = probabilities.iter().scan(0.0, |sum, p| {
            *sum += p;
            Some(*sum)
        });
        let k = up_to.take_while(|sum| *sum <= tail).count().saturating_sub(1);
        let low = ratios.get(k).copied().unwrap_or(0.0);
        let high = ratios.len().checked_sub(k + 1).map_or(f64::INFINITY, |k| ratios[k]);
        Self { value: median(&ratios), low, high }
    }
}

/// Of two sets of n and m values in random order, the probability of each number of pairs in which the value of the
/// second set is the smaller one (Mann, Whitney 1947: by which set holds the largest value).
fn smaller_pairs(n: usize, m: usize) -> Vec<f64> {
    let none = vec![1.0];
    let mut row = vec![none.clone(); m + 1];
    for i in 1..=n {
        row[0] = none.clone();
        for j in 1..=m {
            let (first, second) = (i as f64 / (i + j) as f64, j as f64 / (i + j) as f64);
            let mut sum = vec![0.0; i * j + 1];
            row[j].iter().enumerate().for_each(|(u, p)| sum[u + j] += first * p);
            row[j - 1].iter().enumerate().for_each(|(u, p)| sum[u] += second * p);
            row[j] = sum;
        }
    }
    row.swap_remove(m)
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

/// The mean of the middle three fifths: a few outliers do not move it; 0 of none.
pub fn trimmed_mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let sorted = sorted(values);
    let cut = sorted.len() / 5;
    Spread::of(sorted[cut..sorted.len() - cut].iter().copied()).mean
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
            let ratio = Estimate::ratio(&sample(10.0), &sample(13.0), 0.025);
            ratio.low <= 1.3 && 1.3 <= ratio.high
        });
        let ratios = holds.count();
        assert!((360..=396).contains(&medians) && (372..=396).contains(&ratios), "{medians} {ratios} of 400");
    }

    #[test]
    fn one_outlier_does_not_move_a_ratio_or_a_trimmed_mean() {
        let ratio = Estimate::ratio(&[10.0, 10.1, 9.9, 10.0, 50.0], &[20.0, 20.2, 19.8, 20.0, 20.1], 0.025);
        assert!((ratio.value - 2.0).abs() < 0.05 && ratio.low > 0.39 && ratio.high < 2.05, "{ratio:?}");
        assert!((trimmed_mean([1.0, 1.1, 0.9, 1.0, 9.0]) - 1.0333).abs() < 1e-3);
    }

    /// The published table for five and five: 1, 1, 2, 3, 5 ways of 252.
    #[test]
    fn pairs_are_counted_as_in_the_tables() {
        let ways: Vec<f64> = smaller_pairs(5, 5).iter().map(|p| (p * 252.0).round()).collect();
        assert_eq!((ways.len(), &ways[..5], ways.iter().sum::<f64>()), (26, &[1.0, 1.0, 2.0, 3.0, 5.0][..], 252.0));
        assert_eq!(smaller_pairs(3, 0), [1.0]);
        let (from, to) = ([1.0, 2.0, 4.0, 8.0, 16.0], [1.0; 5]);
        // Of the 25 ratios the third from either end: 4 of 252 lie beyond.
        let ratio = Estimate::ratio(&from, &to, 0.025);
        assert_eq!((ratio.value, ratio.low, ratio.high), (0.25, 0.0625, 1.0));
    }
}
