//! The page table of a virtual texture: the CPU reference of its lookup, against a search over all tiles.

use std::collections::HashMap;

use cuesta::internal::texture::page_table::PageTable;
use cuesta::internal::texture::tile_cache::ResolvedTile;
use cuesta::internal::texture::working_set::TileId;

/// Words per node.
const WORDS: usize = 5;

/// Returns the level and the slot of the finest tile at a position in the root square, in units of 2^-32 of its
/// side. CPU reference of `ground_at` in `shaders/shading.glsl`.
pub fn find(words: &[u32], position: [u32; 2]) -> (u32, u32) {
    let (mut index, mut found) = (0, (0, words[0] - 1));
    for depth in 0..32 {
        if words[WORDS * index] > 0 {
            found = (depth, words[WORDS * index] - 1);
        }
        let [x, z] = position.map(|n| (n >> (31 - depth) & 1) as usize);
        match words[WORDS * index + 1 + x + 2 * z] {
            0 => break,
            child => index = child as usize,
        }
    }
    found
}

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
            assert_eq!(find(table.words(), position), (level, slot));
        }
    }
}
