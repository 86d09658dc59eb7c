//! Set of split squares: the restricted quadtree that strips are walked over, stored as bits.
//!
//! A square of level l has a side of 2^l samples; a *split* square is drawn by finer quads. A set is *closed* if
//! squares that touch, also at a corner, are drawn within one level of each other. This is the Lipschitz condition of
//! Finch & Bishop's level function (§4.5). [`Splits::close`] establishes it by splitting more squares.

use std::collections::HashMap;

use super::pages::{Grid, Pages};

/// Maximum number of words of a page in dense storage: 4 MiB, for pages of 4096 samples a side. Larger pages, which
/// only fields of millions of samples a side have, use sparse storage.
const MAX_PAGE_WORDS: usize = 1 << 19;

/// A level function.
pub trait Levels: Sync {
    /// Returns true if a square of a level is to be drawn by quads of finer levels. Must be true for every square that
    /// contains a split one, or that touches a split one of the level below. Level 0 is never split.
    fn is_split(&self, level: u32, at: [i32; 2]) -> bool;

    /// Returns the morph weight, 0 to 1, of the vertex at a position towards its place in the next level; `level` is
    /// the coarsest level that has the vertex. Must be 1 if a square of the next level that contains or touches it is
    /// not split.
    fn weight(&self, _level: u32, _at: [i32; 2]) -> f32 {
        0.0
    }
}

/// Bits of all pages, 64 in a word.
enum Words {
    /// All words of each page that has a place, page after page.
    Dense {
        /// Number of words of a page.
        per_page: usize,
        /// The words.
        words: Vec<u64>,
    },
    /// Nonzero words only, by place of the page and index in it.
    Sparse(HashMap<(u32, usize), u64>),
}

impl Words {
    fn new(per_page: usize) -> Self {
        if per_page > MAX_PAGE_WORDS {
            Self::Sparse(HashMap::new())
        } else {
            Self::Dense { per_page, words: Vec::new() }
        }
    }

    fn clear(&mut self) {
        match self {
            Self::Dense { words, .. } => words.clear(),
            Self::Sparse(words) => words.clear(),
        }
    }

    /// Allocates page `k` and returns its place.
    fn place(&mut self, k: usize) -> u32 {
        match self {
            Self::Dense { per_page, words } => {
                words.resize(words.len() + *per_page, 0);
                (words.len() / *per_page) as u32
            }
            Self::Sparse(_) => k as u32 + 1,
        }
    }

    /// Returns a word of the page at a place.
    #[inline]
    fn get(&self, place: u32, word: usize) -> u64 {
        match self {
            Self::Dense { per_page, words } => words[(place as usize - 1) * per_page + word],
            Self::Sparse(words) => words.get(&(place, word)).copied().unwrap_or(0),
        }
    }

    /// Returns the same word, writable.
    fn get_mut(&mut self, place: u32, word: usize) -> &mut u64 {
        match self {
            Self::Dense { per_page, words } => &mut words[(place as usize - 1) * *per_page + word],
            Self::Sparse(words) => words.entry((place, word)).or_default(),
        }
    }
}

/// A set of split squares.
pub struct Splits {
    grid: Grid,
    /// Place of each page in `words`, counted from 1; 0 if none of its squares is split.
    places: Vec<u32>,
    words: Words,
    /// First bit in a page, by level.
    first_bits: Vec<usize>,
    /// Split squares by level.
    lists: Vec<Vec<[i32; 2]>>,
}

impl Splits {
    /// Creates an empty set.
    pub fn new(grid: Grid) -> Self {
        let bits = |level: u32| 1usize << (2 * (grid.level - level));
        // From the page down; level 0 has no bits.
        let mut first_bits = vec![0; grid.level as usize + 1];
        (1..grid.level as usize).rev().for_each(|l| first_bits[l] = first_bits[l + 1] + bits(l as u32 + 1));
        let words_per_page = (first_bits.get(1).copied().unwrap_or(0) + bits(1)).div_ceil(64);
        let pages = (grid.count[0] * grid.count[1]) as usize;
        let lists = vec![Vec::new(); grid.level as usize + 1];
        Self { grid, places: vec![0; pages], words: Words::new(words_per_page), first_bits, lists }
    }

    /// Empties the set and keeps its memory.
    pub fn clear(&mut self) {
        let Self { grid, places, lists, .. } = self;
        for (level, list) in lists.iter_mut().enumerate() {
            for at in list.drain(..) {
                let page = at.map(|n| n >> (grid.level - level as u32));
                grid.index(page).into_iter().for_each(|k| places[k] = 0);
            }
        }
        self.words.clear();
    }

    /// Returns the number of split squares.
    pub fn count(&self) -> usize {
        self.lists.iter().map(Vec::len).sum()
    }

    /// Returns the word and the bit of a square in its page.
    #[inline]
    fn bit(&self, level: u32, at: [i32; 2]) -> (usize, u64) {
        let above = self.grid.level - level;
        let [x, z] = at.map(|n| (n & ((1 << above) - 1)) as usize);
        let bit = self.first_bits[level as usize] + (z << above) + x;
        (bit / 64, 1 << (bit % 64))
    }

    /// Splits a square of a page to be drawn. Returns false if it was split before, or its page is not drawn.
    pub fn insert(&mut self, pages: &Pages, level: u32, at: [i32; 2]) -> bool {
        let page = at.map(|n| n >> (self.grid.level - level));
        let Some(k) = self.grid.index(page).filter(|_| pages.is_drawn(page)) else { return false };
        let (word, bit) = self.bit(level, at);
        if self.places[k] == 0 {
            self.places[k] = self.words.place(k);
        }
        let word = self.words.get_mut(self.places[k], word);
        if *word & bit != 0 {
            return false;
        }
        *word |= bit;
        self.lists[level as usize].push(at);
        true
    }

    /// Closes the set: from the finest level up, splits the parent of each split square and the three other squares of
    /// the parent's level that it touches. This extends less than a page beyond a split square.
    pub fn close(&mut self, pages: &Pages) {
        for level in 1..self.grid.level {
            let mut k = 0;
            while let Some(&[x, z]) = self.lists[level as usize].get(k) {
                for (x, z) in [(x - 1, z - 1), (x + 1, z - 1), (x - 1, z + 1), (x + 1, z + 1)] {
                    self.insert(pages, level + 1, [x >> 1, z >> 1]);
                }
                k += 1;
            }
        }
    }
}

impl Levels for Splits {
    #[inline]
    fn is_split(&self, level: u32, at: [i32; 2]) -> bool {
        let Some(k) = self.grid.index(at.map(|n| n >> (self.grid.level - level))) else { return false };
        if level == 0 || self.places[k] == 0 {
            return false;
        }
        let (word, bit) = self.bit(level, at);
        self.words.get(self.places[k], word) & bit != 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid { level: 4, count: [3, 3], last: [47, 47] };

    fn everywhere() -> Pages {
        let mut pages = Pages::none(GRID);
        pages.set((0..9).map(|k| [k % 3, k / 3]));
        pages
    }

    /// Returns the level of the quad over a cell.
    fn level(splits: &Splits, [x, z]: [i32; 2]) -> u32 {
        (0..GRID.level)
            .rev()
            .find(|&l| splits.is_split(l + 1, [x >> (l + 1), z >> (l + 1)]))
            .map_or(GRID.level, |l| (0..=l).rev().find(|&l| !splits.is_split(l, [x >> l, z >> l])).unwrap_or(0))
    }

    #[test]
    fn closed_sets_have_quads_that_touch_within_one_level() {
        let pages = everywhere();
        let mut seed = 5u32;
        let mut random = |n: u32| {
            seed = seed.wrapping_mul(1664525).wrapping_add(1013904223);
            (seed >> 8) % n
        };
        let mut splits = Splits::new(GRID);
        for round in 0..300 {
            splits.clear();
            for _ in 0..round % 7 {
                let l = 1 + random(3);
                splits.insert(&pages, l, [random(48 >> l) as i32, random(48 >> l) as i32]);
            }
            splits.close(&pages);
            for (x, z) in (0..47).flat_map(|x| (0..47).map(move |z| (x, z))) {
                for (dx, dz) in [(1, 0), (0, 1), (1, 1), (1, -1)] {
                    let [one, other] = [[x, z], [x + dx, (z + dz).max(0)]].map(|at| level(&splits, at));
                    assert!(one.abs_diff(other) <= 1, "levels {one} and {other} touch at ({x}, {z})");
                }
            }
        }
    }

    #[test]
    fn sparse_pages_equal_dense_ones() {
        let pages = everywhere();
        let mut random = fastrand::Rng::with_seed(7);
        let (mut dense, mut sparse) =
            (Splits::new(GRID), Splits { words: Words::new(MAX_PAGE_WORDS + 1), ..Splits::new(GRID) });
        assert!(matches!((&dense.words, &sparse.words), (Words::Dense { .. }, Words::Sparse(_))));
        for _ in 0..50 {
            [&mut dense, &mut sparse].into_iter().for_each(Splits::clear);
            for _ in 0..random.usize(1..12) {
                let level = random.u32(1..=4);
                let at = [0, 1].map(|_| random.i32(0..48 >> level));
                assert_eq!(dense.insert(&pages, level, at), sparse.insert(&pages, level, at));
            }
            [&mut dense, &mut sparse].into_iter().for_each(|splits| splits.close(&pages));
            assert_eq!(dense.lists, sparse.lists);
            for level in 0..=4 {
                let squares = (0..48 >> level).flat_map(|x| (0..48 >> level).map(move |z| [x, z]));
                let differ = |at: &[i32; 2]| dense.is_split(level, *at) != sparse.is_split(level, *at);
                assert_eq!(squares.into_iter().find(differ), None, "level {level}");
            }
        }
    }

    #[test]
    fn clear_empties_the_set() {
        let pages = everywhere();
        let sparse = Splits { words: Words::new(MAX_PAGE_WORDS + 1), ..Splits::new(GRID) };
        for mut splits in [Splits::new(GRID), sparse] {
            assert!(splits.insert(&pages, 1, [9, 9]) && !splits.insert(&pages, 1, [9, 9]));
            splits.close(&pages);
            assert!(splits.is_split(4, [1, 1]) && splits.count() >= 4);
            splits.clear();
            assert_eq!(splits.count(), 0);
            assert!((1..=4).all(|l| !splits.is_split(l, [18 >> l, 18 >> l])));
        }
    }
}
