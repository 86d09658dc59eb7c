//! The page table of a virtual texture: a quadtree in an array of words, in which a fragment finds the finest
//! resident tile around it.
//!
//! A node is five words: 1 + the tile's cache slot, or 0 if the node has no tile; then the indices of its four
//! children (x first), or 0 for none. TileId 0 is the root, which always has a tile.

use super::tile_cache::ResolvedTile;

/// Words per node.
const WORDS: usize = 5;

/// The page table of one frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PageTable {
    words: Vec<u32>,
}

impl PageTable {
    /// Creates a table with the root alone, in slot 0.
    pub fn new() -> Self {
        Self { words: vec![1, 0, 0, 0, 0] }
    }

    /// Returns the maximum length, in words, of a table of `tiles` tiles at level `level` or coarser.
    pub fn max_words(tiles: usize, level: u32) -> usize {
        WORDS * (1 + tiles * level as usize)
    }

    /// Removes all nodes but the root.
    pub fn clear(&mut self) {
        self.words.clear();
        self.words.extend([1, 0, 0, 0, 0]);
    }

    /// Adds a resident tile and the nodes down to it.
    pub fn insert(&mut self, resolved: &ResolvedTile) {
        let ResolvedTile { tile, slot } = *resolved;
        let mut index = 0;
        for up in (0..tile.level).rev() {
            let [x, z] = tile.ancestor(up).at.map(|n| (n & 1) as usize);
            let child = WORDS * index + 1 + x + 2 * z;
            if self.words[child] == 0 {
                self.words[child] = (self.words.len() / WORDS) as u32;
                self.words.extend([0; WORDS]);
            }
            index = self.words[child] as usize;
        }
        self.words[WORDS * index] = slot + 1;
    }

    /// Returns the table as the shader reads it.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// Returns the level and the slot of the finest tile at a position in the root square, in units of 2^-32 of its
    /// side. CPU reference of `ground_at` in `shaders/shading.glsl`.
    pub fn find(&self, position: [u32; 2]) -> (u32, u32) {
        let (mut index, mut found) = (0, (0, self.words[0] - 1));
        for depth in 0..32 {
            if self.words[WORDS * index] > 0 {
                found = (depth, self.words[WORDS * index] - 1);
            }
            let [x, z] = position.map(|n| (n >> (31 - depth) & 1) as usize);
            match self.words[WORDS * index + 1 + x + 2 * z] {
                0 => break,
                child => index = child as usize,
            }
        }
        found
    }
}

impl Default for PageTable {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use std::collections::HashMap;

    use super::*;
    use crate::texture::working_set::TileId;

    /// Looks up random positions and compares with a search over all tiles.
    #[test]
    fn a_lookup_finds_the_finest_tile_around_a_position() {
        let mut dice = fastrand::Rng::with_seed(3);
        let mut table = PageTable::new();
        for _ in 0..40 {
            table.clear();
            let mut tiles = HashMap::from([(TileId { level: 0, at: [0, 0] }, 0)]);
            for slot in 1..60 {
                let level = dice.u32(1..14);
                // Close together, so that tiles contain others.
                let at = [0, 0].map(|_: u32| dice.u32(0..1 << level.min(3)));
                let tile = TileId { level, at };
                tiles.insert(tile, slot);
                table.insert(&ResolvedTile { tile, slot });
            }
            assert!(table.words().len() <= PageTable::max_words(59, 13));
            for _ in 0..500 {
                let near = dice.u32(0..32);
                let position = [dice.u32(..) >> near, dice.u32(..) >> near];
                let around =
                    |level: u32| TileId { level, at: position.map(|n| if level == 0 { 0 } else { n >> (32 - level) }) };
                let (level, slot) = (0..32).rev().find_map(|l| Some((l, *tiles.get(&around(l))?))).unwrap();
                assert_eq!(table.find(position), (level, slot));
            }
        }
    }
}
