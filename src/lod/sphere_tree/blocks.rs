//! Culls the field by square blocks with precomputed height ranges.
//!
//! Blocks are the same at every tolerance, so a greater tolerance never draws more. A wedge larger than a block is
//! drawn if it covers any visible block. Where vertices collapse onto the field's edge, a wedge covers other blocks
//! than its halves do. All of these lie in one square ([`Lattice::edge_side`]), which is culled and drawn as one block.

use rayon::prelude::*;

use super::lattice::{Lattice, Place};
use crate::height::Field;
use crate::height::surface::has_terrain;
use crate::view::{Aabb, Containment, View};

/// A unit of culling and drawing: a block, or a square of blocks that the field's edge crosses.
#[derive(Clone, Copy)]
struct Square {
    /// Index of its first block.
    first: usize,
    /// Cells along its side.
    side: i32,
}

/// Blocks of a field.
#[derive(Default)]
pub struct Blocks {
    /// Side of a block, cells: a power of two, at most the root square's side.
    pub side: i32,
    /// Number of blocks along (x, z).
    pub count: [i32; 2],
    /// World-space box of each block; `None` if it has no data.
    bounds: Vec<Option<Aabb>>,
    /// True for each block that may be visible in the current view.
    visible: Vec<bool>,
    /// Square with which each block is culled and drawn.
    squares: Vec<Square>,
}

impl Blocks {
    /// Computes the blocks of a field. Procedural terrain has none.
    pub fn new(field: &Field, lattice: &Lattice) -> Self {
        if field.procedural().is_some() {
            // Procedural terrain culls wedges instead.
            return Self { side: lattice.side(), ..Self::default() };
        }
        let side = lattice.block_side();
        let last = field.size().map(|n| n as i32 - 1);
        let count = last.map(|n| (n - 1) / side + 1);
        let of_block = |k: i32| bounds(field, last, side, [k % count[0], k / count[0]]);
        let bounds: Vec<_> = (0..count[0] * count[1]).into_par_iter().map(of_block).collect();
        let squares = squares(count, last, side, lattice.edge_side());
        Self { side, count, visible: vec![false; bounds.len()], bounds, squares }
    }

    /// Finds the blocks that may be visible in a view.
    pub fn update_visibility(&mut self, view: &View) {
        let frustum = view.frustum();
        self.visible.fill(false);
        for (bounds, square) in self.bounds.iter().zip(&self.squares) {
            self.visible[square.first] |=
                bounds.as_ref().is_some_and(|bounds| frustum.contains(bounds) != Containment::Outside);
        }
    }

    /// Returns the block with which a block is culled and drawn.
    pub fn drawn_with(&self, block: usize) -> usize {
        self.squares[block].first
    }

    /// Returns true if a wedge lies in one block or in one square that is drawn as a block, also beyond the field.
    pub fn contain(&self, corners: [Place; 3]) -> bool {
        let length = |k: usize| {
            let along = corners.map(|at| at[k]);
            along.into_iter().max().unwrap_or(0) - along.into_iter().min().unwrap_or(0)
        };
        let side = self.block_at(corners).map_or(i32::MAX, |block| self.squares[block].side);
        length(0).max(length(1)) <= side
    }

    /// Returns the visible block with which a wedge within one block is drawn.
    pub fn visible_block(&self, corners: [Place; 3]) -> Option<usize> {
        self.block_at(corners).map(|block| self.drawn_with(block)).filter(|&block| self.visible[block])
    }

    /// Returns the block at the north-western corner of a wedge's box.
    fn block_at(&self, corners: [Place; 3]) -> Option<usize> {
        let [i, j] = [0, 1].map(|k| corners.iter().map(|at| at[k]).min().unwrap_or(0) / self.side);
        (i < self.count[0] && j < self.count[1]).then_some((j * self.count[0] + i) as usize)
    }

    /// Returns true if a block may be visible.
    pub fn is_visible(&self, block: usize) -> bool {
        self.visible[block]
    }

    /// Makes exactly these blocks visible.
    #[cfg(test)]
    pub fn set_visible(&mut self, blocks: &[usize]) {
        self.visible.iter_mut().enumerate().for_each(|(block, visible)| *visible = blocks.contains(&block));
    }

    /// Returns the number of blocks.
    pub fn number(&self) -> usize {
        self.bounds.len()
    }
}

/// Returns the square of each block. Only squares that extend beyond the last sample are larger than a block.
fn squares(count: [i32; 2], last: Place, side: i32, edge_side: i32) -> Vec<Square> {
    let of_block = |block: i32| {
        let at = [block % count[0], block / count[0]];
        let first = at.map(|n| n * side / edge_side * edge_side);
        if (0..2).any(|k| first[k] + edge_side > last[k]) {
            return Square { first: (first[1] / side * count[0] + first[0] / side) as usize, side: edge_side };
        }
        Square { first: block as usize, side }
    };
    (0..count[0] * count[1]).map(of_block).collect()
}

fn bounds(field: &Field, last: Place, side: i32, at: Place) -> Option<Aabb> {
    let first = at.map(|n| n * side);
    let end = [0, 1].map(|k| (first[k] + side).min(last[k]));
    if !has_terrain(field, first, end) {
        return None;
    }
    let (mut lowest, mut highest) = (f32::INFINITY, f32::NEG_INFINITY);
    for (x, z) in (first[1]..=end[1]).flat_map(|z| (first[0]..=end[0]).map(move |x| (x, z))) {
        let height = field.height(x as u32, z as u32);
        (lowest, highest) = (lowest.min(height), highest.max(height));
    }
    let corner = |[x, z]: Place, y: f32| field.world_at(f64::from(x), f64::from(z), f64::from(y));
    Some(Aabb { min: corner(first, lowest), max: corner(end, highest) })
}
