//! Medians with distribution-free confidence intervals.

use serde::{Deserialize, Serialize};

/// Smallest probability that the interval contains the true median.
const CONFIDENCE: f64 = 0.95;

/// A median and its 95 % confidence interval.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// Median.
    pub median: f64,
    /// Lower end of the interval.
    pub low: f64,
    /// Upper end of the interval.
    pub high: f64,
}

impl Estimate {
    /// Computes the median of at most 1000 values; zeros without values. The ends of the interval are two of the
    /// values, whose ranks follow from the binomial distribution (Thompson 1936). They hold for any distribution. Below
    /// six values the interval is the whole range.
    pub fn of(values: impl IntoIterator<Item = f64>) -> Self {
        let mut sorted: Vec<f64> = values.into_iter().collect();
        sorted.sort_unstable_by(f64::total_cmp);
        let n = sorted.len();
        if n == 0 {
            return Self::default();
        }
        let inward = cut(n);
        let median = (sorted[(n - 1) / 2] + sorted[n / 2]) / 2.0;
        Self { median, low: sorted[inward], high: sorted[n - 1 - inward] }
    }

    /// Rounds all numbers to thousandths: times in microseconds to nanoseconds.
    pub fn rounded(self) -> Self {
        let Self { median, low, high } = self;
        Self { median: rounded(median), low: rounded(low), high: rounded(high) }
    }
}

/// Rounds a number to thousandths.
pub fn rounded(value: f64) -> f64 {
    (value * 1e3).round() / 1e3
}

/// Returns the number of values to drop at either end of `n` sorted ones to get the 95 % interval of the median: the
/// largest k for which at most k of n values lie below the median with a probability of at most 2.5 %, or 0.
fn cut(n: usize) -> usize {
    let mut chance = 0.5f64.powi(n as i32);
    let mut beyond = chance;
    let mut cut = 0;
    while 2.0 * (beyond + chance * (n - cut) as f64 / (cut + 1) as f64) <= 1.0 - CONFIDENCE {
        chance *= (n - cut) as f64 / (cut + 1) as f64;
        beyond += chance;
        cut += 1;
    }
    cut
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_those_of_the_tables() {
        // Ranks (from 1) of the lower end: Conover, Practical Nonparametric Statistics, sign test at 5 %.
        for (n, rank) in [(1, 1), (5, 1), (6, 1), (8, 1), (9, 2), (11, 2), (12, 3), (15, 4), (20, 6), (25, 8)] {
            assert_eq!(cut(n) + 1, rank, "{n} values");
        }
        let of = Estimate::of((1..=25).rev().map(f64::from));
        assert_eq!(of, Estimate { median: 13.0, low: 8.0, high: 18.0 });
        assert_eq!(Estimate::of([4.0, 1.0]), Estimate { median: 2.5, low: 1.0, high: 4.0 });
        assert_eq!(Estimate::of([]), Estimate::default());
    }

    #[test]
    fn an_outlier_moves_neither_the_median_nor_its_interval() {
        let quiet = Estimate::of((0..15).map(f64::from));
        let noisy = Estimate::of((0..14).map(f64::from).chain([1e9]));
        assert_eq!(quiet, noisy);
    }
}
