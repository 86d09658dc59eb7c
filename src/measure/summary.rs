//! A quantity over many samples: count, root mean square, an exact high quantile, the largest and where it is.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::extended::{self, Extended};

/// A quantity over all samples in view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Summary {
    /// Root mean square.
    #[serde(with = "extended")]
    #[schemars(with = "Extended")]
    pub rms: f64,
    /// 99.9th percentile: of several frames, the largest of any frame.
    #[serde(with = "extended")]
    #[schemars(with = "Extended")]
    pub p999: f64,
    /// Largest value.
    #[serde(with = "extended")]
    #[schemars(with = "Extended")]
    pub max: f64,
}

impl Summary {
    /// The same in a unit of the given size.
    pub fn in_units_of(&self, unit: f64) -> Summary {
        Summary { rms: self.rms / unit, p999: self.p999 / unit, max: self.max / unit }
    }
}

/// A quantity over several frames.
#[derive(Clone, Copy, Debug, Default)]
pub struct Pool {
    count: u64,
    squares: f64,
    p999: f64,
    max: f64,
}

impl Pool {
    /// Adds a frame's summary of `count` samples.
    pub fn add(&mut self, count: u64, frame: &Summary) {
        self.count += count;
        if count > 0 {
            self.squares += count as f64 * frame.rms * frame.rms;
        }
        self.p999 = self.p999.max(frame.p999);
        self.max = self.max.max(frame.max);
    }

    /// True before the first sample.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Returns the root mean square over all samples, and the largest of the frames' percentiles and maxima.
    pub fn summary(&self) -> Summary {
        Summary { rms: (self.squares / self.count.max(1) as f64).sqrt(), p999: self.p999, max: self.max }
    }
}

/// A sample and the point drawn for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Lattice position.
    pub sample: [u32; 2],
    /// The sample's world position.
    pub truth: DVec3,
    /// The drawn point's world position.
    pub drawn: DVec3,
}

/// Sums one quantity up.
#[derive(Clone, Debug, Default)]
pub(super) struct Tally {
    pub count: u64,
    squares: f64,
    /// The largest counted values that are not 0, at most `capacity`, as bits: the order of non-negative
    /// numbers is that of their bits. Enough for the quantile above which `1 / denominator` of them lie.
    top: BinaryHeap<Reverse<u64>>,
    capacity: usize,
    denominator: u64,
    pub largest: f64,
    pub largest_at: Option<Place>,
}

impl Tally {
    /// For at most `samples` values, and the quantile above which one of `denominator` lies.
    pub fn new(samples: u64, denominator: u64) -> Self {
        Self { capacity: (samples / denominator) as usize + 1, denominator, ..Self::default() }
    }

    /// A value that is no negative number. One that does not count may be the largest all the same.
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

    fn keep(&mut self, value: Reverse<u64>) {
        if value.0 != 0 && self.top.len() < self.capacity {
            self.top.push(value);
        } else if let Some(mut smallest) = self.top.peek_mut()
            && smallest.0 < value.0
        {
            *smallest = value;
        }
    }

    pub fn merge(&mut self, other: Tally) {
        if other.largest > self.largest {
            (self.largest, self.largest_at) = (other.largest, other.largest_at);
        }
        self.count += other.count;
        self.squares += other.squares;
        other.top.into_iter().for_each(|value| self.keep(value));
    }

    /// Root of the mean square.
    pub fn rms(&self) -> f64 {
        (self.squares / self.count.max(1) as f64).sqrt()
    }

    /// The smallest value that all but one of `denominator` counted ones do not exceed.
    pub fn quantile(&self) -> f64 {
        self.quantile_above(self.denominator)
    }

    /// As [`Self::quantile`] with another denominator, not below its own.
    pub fn quantile_above(&self, denominator: u64) -> f64 {
        debug_assert!(denominator >= self.denominator);
        let mut top: Vec<u64> = self.top.iter().map(|value| value.0).collect();
        top.sort_unstable_by_key(|&bits| Reverse(bits));
        top.get((self.count / denominator) as usize).map_or(0.0, |&bits| f64::from_bits(bits))
    }

    /// With the quantile as 99.9th percentile.
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
