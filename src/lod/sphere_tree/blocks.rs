//! Squares of the field with the ranges of their heights: what is in sight is told by them.
//!
//! They are the same at every tolerance, so that a wider one never draws more. A wedge larger than a block is drawn if
//! it covers any block in sight. Where vertices collapse onto the field's edge, a wedge covers other blocks than its halves
//! do. All of these lie in one square ([`Lattice::edge_side`]), which is culled and drawn as one block.

use rayon::prelude::*;

use super::lattice::{Lattice, Place};
use crate::height::Field;
use crate::height::surface::has_terrain;
use crate::view::{Aabb, Containment, View};

/// A unit of culling and drawing: a block, or a square that the field's edge crosses.
#[derive(Clone, Copy)]
struct Square {
    /// Its first block.
    first: usize,
    /// Cells along its side.
    side: i32,
}

/// The blocks of a field.
#[derive(Default)]
pub struct Blocks {
    /// Side of a block, cells: a power of two, at most the root square's.
    pub side: i32,
    /// Blocks along the axes.
    pub count: [i32; 2],
    /// By block: its box in the world, if it has land.
    bounds: Vec<Option<Aabb>>,
    /// By block: whether it may be in sight.
    seen: Vec<bool>,
    /// By block: the square that it is culled and drawn with.
    squares: Vec<Square>,
}

impl Blocks {
    /// The blocks of a field.
    pub fn new(field: &Field, lattice: &Lattice) -> Self {
        if field.procedural().is_some() {
            // Wedges tell themselves whether they are in sight.
            return Self { side: lattice.side(), ..Self::default() };
        }
        let side = lattice.block_side();
        let last = field.size().map(|n| n as i32 - 1);
        let count = last.map(|n| (n - 1) / side + 1);
        let of_block = |k: i32| bounds(field, last, side, [k % count[0], k / count[0]]);
        let bounds: Vec<_> = (0..count[0] * count[1]).into_par_iter().map(of_block).collect();
        let squares = squares(count, last, side, lattice.edge_side());
        Self { side, count, seen: vec![false; bounds.len()], bounds, squares }
    }

    /// Finds the blocks in sight.
    pub fn look(&mut self, view: &View) {
        let frustum = view.frustum();
        self.seen.fill(false);
        for (bounds, square) in self.bounds.iter().zip(&self.squares) {
            self.seen[square.first] |=
                bounds.as_ref().is_some_and(|bounds| frustum.contains(bounds) != Containment::Outside);
        }
    }

    /// The block that a block is culled and drawn with.
    pub fn drawn_with(&self, block: usize) -> usize {
        self.squares[block].first
    }

    /// Returns true if a wedge lies in one block or in a square that is drawn as one, also beyond the field.
    pub fn hold(&self, corners: [Place; 3]) -> bool {
        let length = |k: usize| {
            let along = corners.map(|at| at[k]);
            along.into_iter().max().unwrap_or(0) - along.into_iter().min().unwrap_or(0)
        };
        let side = self.around(corners).map_or(i32::MAX, |block| self.squares[block].side);
        length(0).max(length(1)) <= side
    }

    /// The number of the block in sight with which a wedge within one is drawn.
    pub fn seen(&self, corners: [Place; 3]) -> Option<usize> {
        self.around(corners).map(|block| self.drawn_with(block)).filter(|&block| self.seen[block])
    }

    /// The block around the north-western corner of a wedge's box.
    fn around(&self, corners: [Place; 3]) -> Option<usize> {
        let [i, j] = [0, 1].map(|k| corners.iter().map(|at| at[k]).min().unwrap_or(0) / self.side);
        (i < self.count[0] && j < self.count[1]).then_some((j * self.count[0] + i) as usize)
    }

    /// Whether a block may be in sight.
    pub fn is_seen(&self, block: usize) -> bool {
        self.seen[block]
    }

    /// Sees these blocks only.
    #[cfg(test)]
    pub fn see(&mut self, blocks: &[usize]) {
        self.seen.iter_mut().enumerate().for_each(|(block, seen)| *seen = blocks.contains(&block));
    }

    /// The number of blocks.
    pub fn number(&self) -> usize {
        self.bounds.len()
    }
}

/// By block: its square. Only squares that reach beyond the last sample are larger than a block.
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
