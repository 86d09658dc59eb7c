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
}

impl Default for PageTable {
    fn default() -> Self {
        Self::new()
    }
}
