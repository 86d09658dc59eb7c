//! Histograms of non-negative values with bins between powers of two.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::extended::{self, Extended};

/// One bin of a histogram.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Bin {
    /// Lower end, inclusive.
    pub from: f64,
    /// Upper end, exclusive; infinite for the last bin.
    #[serde(with = "extended")]
    #[schemars(with = "Extended")]
    pub to: f64,
    /// Number of values.
    pub count: u64,
}

/// Counts by bins in ascending order.
///
/// The first bin starts at 0 and ends at the lowest power of two. Each further one doubles its start. The last one has
/// no end and counts infinity too.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(transparent)]
pub struct Histogram {
    /// The bins.
    pub bins: Vec<Bin>,
}

impl Histogram {
    /// Returns an empty histogram with bin ends at 2^`lowest`, …, 2^`highest`.
    pub fn new(lowest: i32, highest: i32) -> Self {
        let ends: Vec<f64> = (lowest..=highest).map(|power| 2f64.powi(power)).collect();
        let from = [0.0].into_iter().chain(ends.iter().copied());
        let to = ends.iter().copied().chain([f64::INFINITY]);
        Self { bins: from.zip(to).map(|(from, to)| Bin { from, to, count: 0 }).collect() }
    }

    /// Counts a value, which must not be negative or NaN.
    pub fn add(&mut self, value: f64) {
        // Compares binary exponents, as a logarithm could round across the end of a bin.
        let exponent = |value: f64| (value.to_bits() >> 52 & 0x7ff) as i32;
        let bin = exponent(value) - exponent(self.bins[0].to) + 1;
        let last = self.bins.len() as i32 - 1;
        self.bins[bin.clamp(0, last) as usize].count += 1;
    }

    /// Adds the counts of another histogram with the same bins.
    ///
    /// # Panics
    /// If the bins differ.
    pub fn merge(&mut self, other: &Histogram) {
        assert_eq!(self.bins.len(), other.bins.len(), "the same bins");
        for (mine, theirs) in self.bins.iter_mut().zip(&other.bins) {
            assert_eq!((mine.from, mine.to), (theirs.from, theirs.to), "the same bins");
            mine.count += theirs.count;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_fall_between_their_bins_ends() {
        let mut histogram = Histogram::new(-2, 3);
        for value in [0.0, 1e-300, 0.25f64.next_down(), 0.25, 0.3, 1.0, 2f64.next_down(), 7.9, 8.0, f64::INFINITY] {
            let before = histogram.clone();
            histogram.add(value);
            let grown = |(after, before): &(&Bin, &Bin)| after.count > before.count;
            let (bin, _) = histogram.bins.iter().zip(&before.bins).find(grown).unwrap();
            assert!(bin.from <= value && (value < bin.to || bin.to.is_infinite()), "{value} in {bin:?}");
        }
        let counts: Vec<u64> = histogram.bins.iter().map(|bin| bin.count).collect();
        assert_eq!(counts, [3, 2, 0, 2, 0, 1, 2]);
    }
}
