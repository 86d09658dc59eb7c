//! Statistics of a quantity over many samples: count, root mean square, an exact high quantile, and the maximum with
//! its position.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::extended::{self, Extended};

/// Statistics of a quantity over the samples in view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Summary {
    /// Root mean square.
    #[serde(with = "extended")]
    #[schemars(with = "Extended")]
    pub rms: f64,
    /// 99.9th percentile; over several frames, the largest one of any frame.
    #[serde(with = "extended")]
    #[schemars(with = "Extended")]
    pub p999: f64,
    /// Largest value.
    #[serde(with = "extended")]
    #[schemars(with = "Extended")]
    pub max: f64,
}

impl Summary {
    /// Divides all values by a unit.
    pub fn in_units_of(&self, unit: f64) -> Summary {
        Summary { rms: self.rms / unit, p999: self.p999 / unit, max: self.max / unit }
    }
}

/// Statistics of a quantity over several frames.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pool {
    /// Number of samples.
    count: u64,
    /// Sum of squares.
    squares: f64,
    p999: f64,
    max: f64,
}

impl Pool {
    /// Adds the summary of a frame with `count` samples.
    pub fn add(&mut self, count: u64, frame: &Summary) {
        self.count += count;
        if count > 0 {
            self.squares += count as f64 * frame.rms * frame.rms;
        }
        self.p999 = self.p999.max(frame.p999);
        self.max = self.max.max(frame.max);
    }

    /// Returns true if no samples were added.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Returns the root mean square over all samples, and the largest percentile and maximum of any frame.
    pub fn summary(&self) -> Summary {
        Summary { rms: (self.squares / self.count.max(1) as f64).sqrt(), p999: self.p999, max: self.max }
    }
}

/// A sample and the point drawn for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Column and row of the sample.
    pub sample: [u32; 2],
    /// World position of the sample, metres.
    pub truth: DVec3,
    /// World position of the drawn point, metres.
    pub drawn: DVec3,
}

/// Accumulates the statistics of one quantity.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    /// Number of counted values.
    pub count: u64,
    /// Sum of their squares.
    squares: f64,
    /// Bits of the largest counted values above 0, at most `capacity` of them: enough for the quantile. The bits of
    /// non-negative numbers have the order of the numbers.
    top: BinaryHeap<Reverse<u64>>,
    capacity: usize,
    /// The quantile is the value that one in `denominator` values exceeds.
    denominator: u64,
    /// Largest value, including those not counted.
    pub largest: f64,
    /// Sample with the largest value.
    pub largest_at: Option<Place>,
}

impl Tally {
    /// Creates an empty tally for at most `samples` values. The quantile is the value that one in `denominator`
    /// exceeds: 100 for the 99th percentile.
    pub fn new(samples: u64, denominator: u64) -> Self {
        Self { capacity: (samples / denominator) as usize + 1, denominator, ..Self::default() }
    }

    /// Adds a non-negative value. If `counts` is false, it only affects the maximum.
    pub fn add(&mut self, value: f64, counts: bool, place: Place) {
        if value > self.largest {
            (self.largest, self.largest_at) = (value, Some(place));
        }
        if counts {
            self.count += 1;
            self.squares += value * value;
            self.keep(Reverse(value.to_bits()));
        }
    }

    /// Adds the bits of a value to the largest ones, if it belongs to them.
    fn keep(&mut self, value: Reverse<u64>) {
        if value.0 != 0 && self.top.len() < self.capacity {
            self.top.push(value);
        } else if let Some(mut smallest) = self.top.peek_mut()
            && smallest.0 < value.0
        {
            *smallest = value;
        }
    }

    /// Adds the values of another tally.
    pub fn merge(&mut self, other: Tally) {
        if other.largest > self.largest {
            (self.largest, self.largest_at) = (other.largest, other.largest_at);
        }
        self.count += other.count;
        self.squares += other.squares;
        other.top.into_iter().for_each(|value| self.keep(value));
    }

    /// Returns the root mean square; 0 without values.
    pub fn rms(&self) -> f64 {
        (self.squares / self.count.max(1) as f64).sqrt()
    }

    /// Returns the quantile by nearest rank: at most one in `denominator` counted values exceeds it.
    pub fn quantile(&self) -> f64 {
        self.quantile_above(self.denominator)
    }

    /// Returns the quantile for another denominator, which must not be smaller than the tally's own.
    pub fn quantile_above(&self, denominator: u64) -> f64 {
        debug_assert!(denominator >= self.denominator);
        let mut top: Vec<u64> = self.top.iter().map(|value| value.0).collect();
        top.sort_unstable_by_key(|&bits| Reverse(bits));
        top.get((self.count / denominator) as usize).map_or(0.0, |&bits| f64::from_bits(bits))
    }

    /// Returns the summary of a tally with the denominator 1000, whose quantile is the 99.9th percentile.
    pub fn summary(&self) -> Summary {
        debug_assert_eq!(self.denominator, 1000);
        Summary { rms: self.rms(), p999: self.quantile(), max: self.largest }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const NOWHERE: Place = Place { sample: [0, 0], truth: DVec3::ZERO, drawn: DVec3::ZERO };

    #[test]
    fn quantiles_of_parts_are_those_of_the_whole() {
        let value = |k: u64| (k.wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f64;
        for (count, denominator) in [(1, 100), (99, 100), (100, 100), (12_345, 100), (54_321, 1000)] {
            let mut whole = Tally::new(count, denominator);
            for part in 0..7 {
                let mut tally = Tally::new(count, denominator);
                (0..count).filter(|k| k % 7 == part).for_each(|k| tally.add(value(k), true, NOWHERE));
                whole.merge(tally);
            }
            let mut sorted: Vec<f64> = (0..count).map(value).collect();
            sorted.sort_by(f64::total_cmp);
            let rank = count - count / denominator;
            assert_eq!(whole.quantile(), sorted[rank as usize - 1], "{count} values");
            let rank = count - count / 5000;
            assert_eq!(whole.quantile_above(5000), sorted[rank as usize - 1], "{count} values");
            assert_eq!(whole.largest, sorted[count as usize - 1]);
        }
    }

    #[test]
    fn frames_are_weighted_by_their_samples() {
        let mut pool = Pool::default();
        assert!(pool.is_empty());
        pool.add(0, &Summary::default());
        pool.add(3, &Summary { rms: 1.0, p999: 4.0, max: 5.0 });
        pool.add(1, &Summary { rms: 3.0, p999: 2.0, max: 9.0 });
        assert_eq!(pool.summary(), Summary { rms: 3f64.sqrt(), p999: 4.0, max: 9.0 });
    }
}
