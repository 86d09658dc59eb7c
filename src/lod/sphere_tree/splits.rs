//! The set of split diamonds, and its computation by checking every diamond.

use super::by_index::ByIndex;
use super::lattice::Place;
use super::measure::Measured;
use super::reach::Viewpoint;

/// A set of split diamonds; the parents of each are in it too.
#[derive(Clone, Debug, Default)]
pub struct Splits {
    words: Words,
    count: usize,
    changes: Changes,
}

/// Diamonds that split or merged since the last query.
#[derive(Clone, Debug, Default)]
pub struct Changes {
    /// True if any diamond may have changed, not only `middles`.
    pub all: bool,
    /// Middles of diamonds.
    pub middles: Vec<Place>,
}

/// Bit set of diamonds by index.
#[derive(Clone, Debug)]
enum Words {
    /// Words of all diamonds.
    All(Vec<u64>),
    /// Nonzero words only, for a tree too deep to store all.
    Some(ByIndex<u64>),
}

impl Default for Words {
    fn default() -> Self {
        Words::All(Vec::new())
    }
}

impl Words {
    fn none(measured: &Measured) -> Self {
        if measured.is_endless() {
            Words::Some(ByIndex::default())
        } else {
            Words::All(vec![0; measured.lattice.size().div_ceil(64)])
        }
    }

    #[inline]
    fn get(&self, k: usize) -> u64 {
        match self {
            Words::All(words) => words[k],
            Words::Some(words) => words.get(&(k as u64)).copied().unwrap_or(0),
        }
    }

    #[inline]
    fn flip(&mut self, k: usize, bit: u64) {
        match self {
            Words::All(words) => words[k] ^= bit,
            Words::Some(words) => {
                let word = words.entry(k as u64).or_default();
                *word ^= bit;
                if *word == 0 {
                    words.remove(&(k as u64));
                }
            }
        }
    }
}

/// Result of a pass over all diamonds.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// Split diamonds with their indices, parents first.
    pub split: Vec<(Place, usize)>,
    /// Number of diamonds checked.
    pub visited: usize,
    /// Previous set.
    before: Splits,
}

impl Splits {
    /// Creates an empty set.
    pub fn none(measured: &Measured) -> Self {
        Self { words: Words::none(measured), count: 0, changes: Changes::default() }
    }

    fn clear(&mut self, measured: &Measured) {
        match &mut self.words {
            Words::All(words) if !measured.is_endless() => {
                words.clear();
                words.resize(measured.lattice.size().div_ceil(64), 0);
            }
            Words::Some(words) => words.clear(),
            words => *words = Words::none(measured),
        }
        self.count = 0;
        self.changes.middles.clear();
        self.changes.all = true;
    }

    /// Returns the diamonds that split or merged since the last call.
    pub fn changes(&mut self) -> Changes {
        std::mem::take(&mut self.changes)
    }

    /// Returns true if the diamond with this index has split.
    #[inline]
    pub fn contains(&self, index: usize) -> bool {
        self.words.get(index / 64) >> (index % 64) & 1 != 0
    }

    /// Returns the number of split diamonds.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Adds a diamond that has not split.
    pub(super) fn insert(&mut self, at: Place, index: usize) {
        debug_assert!(!self.contains(index));
        self.record(at);
        self.words.flip(index / 64, 1 << (index % 64));
        self.count += 1;
    }

    /// Removes a split diamond.
    pub(super) fn remove(&mut self, at: Place, index: usize) {
        debug_assert!(self.contains(index));
        self.record(at);
        self.words.flip(index / 64, 1 << (index % 64));
        self.count -= 1;
    }

    fn record(&mut self, at: Place) {
        if !self.changes.all {
            self.changes.middles.push(at);
        }
    }

    /// Returns true if all parents of a diamond have split.
    pub fn is_ready(&self, measured: &Measured, at: Place) -> bool {
        measured.lattice.parents(at).all(|(_, parent)| self.contains(parent))
    }

    /// Returns true if a child of a diamond has split.
    pub fn is_needed(&self, measured: &Measured, at: Place) -> bool {
        measured.lattice.children(at).any(|(_, child)| self.contains(child))
    }

    /// Computes the set for a viewpoint by checking, from the root, every diamond that could have split. Returns false
    /// if more than `max` diamonds would split.
    pub fn refill(&mut self, measured: &Measured, from: &Viewpoint, found: &mut Found, max: usize) -> bool {
        std::mem::swap(self, &mut found.before);
        self.clear(measured);
        found.split.clear();
        found.visited = 0;
        let mut open: Vec<_> =
            measured.lattice.root().and_then(|at| Some((at, measured.lattice.index(at)?))).into_iter().collect();
        while !open.is_empty() {
            // Level by level, so that sizes not cached yet are computed in parallel.
            measured.precompute(&open);
            for (at, index) in std::mem::take(&mut open) {
                found.visited += 1;
                let diamond = measured.diamond(at, index);
                let was_split = from.hold > 1.0 && found.before.contains(index);
                let slack = from.slack(&diamond, was_split);
                if (slack > 0.0) != was_split {
                    continue;
                }
                if self.count == max {
                    return false;
                }
                self.insert(at, index);
                found.split.push((at, index));
                // A diamond becomes ready when the last of its parents splits.
                let children = measured.lattice.children(at);
                open.extend(
                    children
                        .filter(|&(at, child)| measured.has_sphere(&from.reach, child) && self.is_ready(measured, at)),
                );
            }
        }
        true
    }
}
