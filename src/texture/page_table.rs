//! The nodes that serve in a frame as one table of words, in which a fragment goes down the map's quadtree to the smallest
//! one around it.
//!
//! Five words a node: 1 and the slot of its texels, or 0 where it has none of its own, and the numbers of its four
//! children, x first, or 0 where there is none. The root comes first and always has texels.

use super::tile_cache::ResolvedTile;

/// Words a node.
const WORDS: usize = 5;

/// The table of a frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PageTable {
    words: Vec<u32>,
}

impl PageTable {
    /// The root alone, in slot 0.
    pub fn new() -> Self {
        Self { words: vec![1, 0, 0, 0, 0] }
    }

    /// Words of a table of so many nodes with texels at this level or above.
    pub fn max_words(nodes: usize, level: u32) -> usize {
        WORDS * (1 + nodes * level as usize)
    }

    /// Forgets all but the root.
    pub fn clear(&mut self) {
        self.words.clear();
        self.words.extend([1, 0, 0, 0, 0]);
    }

    /// Adds what serves a node.
    pub fn enter(&mut self, resolved: &ResolvedTile) {
        let ResolvedTile { node, slot } = *resolved;
        let mut number = 0;
        for up in (0..node.level).rev() {
            let [x, z] = node.above(up).at.map(|n| (n & 1) as usize);
            let child = WORDS * number + 1 + x + 2 * z;
            if self.words[child] == 0 {
                self.words[child] = (self.words.len() / WORDS) as u32;
                self.words.extend([0; WORDS]);
            }
            number = self.words[child] as usize;
        }
        self.words[WORDS * number] = slot + 1;
    }

    /// The words.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// What a fragment finds at a place of the root square, in parts of 2^-32 of its side: the level and the slot
    /// (`shaders/shading.glsl`, `ground_at`).
    pub fn find(&self, place: [u32; 2]) -> (u32, u32) {
        let (mut number, mut found) = (0, (0, self.words[0] - 1));
        for depth in 0..32 {
            if self.words[WORDS * number] > 0 {
                found = (depth, self.words[WORDS * number] - 1);
            }
            let [x, z] = place.map(|n| (n >> (31 - depth) & 1) as usize);
            match self.words[WORDS * number + 1 + x + 2 * z] {
                0 => break,
                child => number = child as usize,
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
    use crate::texture::working_set::Node;

    /// Wherever a fragment lies, it finds the smallest node with texels around it.
    #[test]
    fn the_smallest_node_around_a_place_is_found() {
        let mut dice = fastrand::Rng::with_seed(3);
        let mut table = PageTable::new();
        for _ in 0..40 {
            table.clear();
            let mut nodes = HashMap::from([(Node { level: 0, at: [0, 0] }, 0)]);
            for slot in 1..60 {
                let level = dice.u32(1..14);
                // Near one another, or there would be none within others.
                let at = [0, 0].map(|_: u32| dice.u32(0..1 << level.min(3)));
                let node = Node { level, at };
                nodes.insert(node, slot);
                table.enter(&ResolvedTile { node, slot });
            }
            assert!(table.words().len() <= PageTable::max_words(59, 13));
            for _ in 0..500 {
                let near = dice.u32(0..32);
                let place = [dice.u32(..) >> near, dice.u32(..) >> near];
                let around =
                    |level: u32| Node { level, at: place.map(|n| if level == 0 { 0 } else { n >> (32 - level) }) };
                let (level, slot) = (0..32).rev().find_map(|l| Some((l, *nodes.get(&around(l))?))).unwrap();
                assert_eq!(table.find(place), (level, slot));
            }
        }
    }
}
