//! The diamonds that have split, and the plain way to find them: look at every one again.

use super::by_index::ByIndex;
use super::lattice::Place;
use super::measure::Measured;
use super::reach::Viewpoint;

/// A set of split diamonds: none without its parents.
#[derive(Clone, Debug, Default)]
pub struct Splits {
    words: Words,
    count: usize,
    changes: Changes,
}

/// What has split or merged since it was last asked for.
#[derive(Clone, Debug, Default)]
pub struct Changes {
    /// Maybe all, and not only what follows.
    pub all: bool,
    /// Middles of diamonds.
    pub middles: Vec<Place>,
}

/// One bit a diamond, by index.
#[derive(Clone, Debug)]
enum Words {
    /// Of all diamonds.
    All(Vec<u64>),
    /// Of a tree too deep for that: those that are not 0.
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

/// What a pass over all diamonds found.
#[derive(Clone, Debug, Default)]
pub struct Found {
    /// The diamonds that have split: middles and indices, parents first.
    pub split: Vec<(Place, usize)>,
    /// Diamonds looked at.
    pub visited: usize,
    /// The set before.
    before: Splits,
}

impl Splits {
    /// No split diamond.
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

    /// What has split or merged since the last call.
    pub fn changes(&mut self) -> Changes {
        std::mem::take(&mut self.changes)
    }

    /// Whether a diamond has split, by index.
    #[inline]
    pub fn contains(&self, index: usize) -> bool {
        self.words.get(index / 64) >> (index % 64) & 1 != 0
    }

    /// How many have.
    pub fn count(&self) -> usize {
        self.count
    }

    /// Adds one that has not.
    pub(super) fn insert(&mut self, at: Place, index: usize) {
        debug_assert!(!self.contains(index));
        self.note(at);
        self.words.flip(index / 64, 1 << (index % 64));
        self.count += 1;
    }

    /// Removes one.
    pub(super) fn remove(&mut self, at: Place, index: usize) {
        debug_assert!(self.contains(index));
        self.note(at);
        self.words.flip(index / 64, 1 << (index % 64));
        self.count -= 1;
    }

    fn note(&mut self, at: Place) {
        if !self.changes.all {
            self.changes.middles.push(at);
        }
    }

    /// Whether all parents of a diamond have split.
    pub fn is_ready(&self, measured: &Measured, at: Place) -> bool {
        measured.lattice.parents(at).all(|(_, parent)| self.contains(parent))
    }

    /// Whether a child of a diamond has split.
    pub fn is_needed(&self, measured: &Measured, at: Place) -> bool {
        measured.lattice.children(at).any(|(_, child)| self.contains(child))
    }

    /// Looks at every diamond that could have split, from the root on, and makes this the set for the viewpoint.
    /// It gives up, and says so, beyond `max` diamonds.
    pub fn refill(&mut self, measured: &Measured, from: &Viewpoint, found: &mut Found, max: usize) -> bool {
        std::mem::swap(self, &mut found.before);
        self.clear(measured);
        found.split.clear();
        found.visited = 0;
        let mut open: Vec<_> =
            measured.lattice.root().and_then(|at| Some((at, measured.lattice.index(at)?))).into_iter().collect();
        while !open.is_empty() {
            // Level by level, so that what is not known yet is worked out side by side.
            measured.look_ahead(&open);
            for (at, index) in std::mem::take(&mut open) {
                found.visited += 1;
                let known = measured.known(at, index);
                let was_split = from.hold > 1.0 && found.before.contains(index);
                let slack = from.slack(&known, was_split);
                if (slack > 0.0) != was_split {
                    continue;
                }
                if self.count == max {
                    return false;
                }
                self.insert(at, index);
                found.split.push((at, index));
                // The last of its parents to split opens a diamond.
                let children = measured.lattice.children(at);
                open.extend(
                    children.filter(|&(at, child)| measured.matters(&from.reach, child) && self.is_ready(measured, at)),
                );
            }
        }
        true
    }
}
