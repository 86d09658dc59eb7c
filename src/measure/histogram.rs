//! Counts of non-negative values by powers of two.

use serde::{Deserialize, Serialize};

/// Bin 0 counts values below 2^`lowest`, 0 among them; bin k ≥ 1 those from 2^(`lowest` + k − 1) up to, but not
/// including, 2^(`lowest` + k); the last one all from its lower end on, infinity too.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Histogram {
    /// Power of two at which bin 1 begins.
    pub lowest: i32,
    /// One count a bin.
    pub counts: Vec<u64>,
}

impl Histogram {
    /// Empty, with ends at 2^`lowest`, …, 2^`highest`.
    pub fn new(lowest: i32, highest: i32) -> Self {
        Self { lowest, counts: vec![0; (highest - lowest) as usize + 2] }
    }

    /// Counts a value that is no negative number.
    pub fn add(&mut self, value: f64) {
        let last = self.counts.len() as i32 - 1;
        // The exponent of the number itself: no logarithm that could round across a bin's end.
        let exponent = (value.to_bits() >> 52 & 0x7ff) as i32 - 1023;
        self.counts[(exponent - self.lowest + 1).clamp(0, last) as usize] += 1;
    }

    /// Adds the counts of another histogram with the same bins.
    ///
    /// # Panics
    /// If the bins differ.
    pub fn merge(&mut self, other: &Histogram) {
        assert_eq!((self.lowest, self.counts.len()), (other.lowest, other.counts.len()), "the same bins");
        self.counts.iter_mut().zip(&other.counts).for_each(|(mine, theirs)| *mine += theirs);
    }

    /// Where a bin begins, inclusive.
    pub fn begin(&self, bin: usize) -> f64 {
        if bin == 0 { 0.0 } else { 2f64.powi(self.lowest + bin as i32 - 1) }
    }

    /// All values counted.
    pub fn total(&self) -> u64 {
        self.counts.iter().sum()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_fall_between_their_bins_ends() {
        let mut histogram = Histogram::new(-2, 3);
        for value in [0.0, 1e-300, 0.25f64.next_down(), 0.25, 0.3, 1.0, 2f64.next_down(), 7.9, 8.0, f64::INFINITY] {
            let before = histogram.counts.clone();
            histogram.add(value);
            let bin = (0..before.len()).find(|&k| histogram.counts[k] > before[k]).unwrap();
            let end = if bin + 1 < before.len() { histogram.begin(bin + 1) } else { f64::INFINITY };
            assert!(histogram.begin(bin) <= value && (value < end || end.is_infinite()), "{value} in bin {bin}");
        }
        assert_eq!(histogram.counts, [3, 2, 0, 2, 0, 1, 2]);
    }
}
