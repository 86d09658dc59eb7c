//! Squares of the field with the ranges of their heights: what is in sight is told by them.
//!
//! They are the same at every tolerance, so that a wider one never draws more. A wedge larger than a block is drawn if
//! it covers any block in sight. Where vertices collapse onto the field's edge, a wedge covers other blocks than its halves
//! do. All of these lie in one square ([`Lattice::edge_side`]), whose blocks are culled together.

use std::collections::BTreeMap;

use rayon::prelude::*;

use super::lattice::{Lattice, Place};
use crate::height::Field;
use crate::height::surface::has_land;
use crate::view::{Aabb, Containment, View};

/// The blocks of a field.
pub struct Blocks {
    /// Side of a block, cells: a power of two, at most the root square's.
    pub side: i32,
    /// Blocks along the axes.
    pub count: [i32; 2],
    /// By block: its box in the world, if it has land.
    bounds: Vec<Option<Aabb>>,
    /// By block: whether it may be in sight.
    seen: Vec<bool>,
    /// By square that the field's edge crosses: its blocks.
    edge_squares: Vec<Vec<usize>>,
}

impl Blocks {
    /// The blocks of a field.
    pub fn new(field: &Field, lattice: &Lattice) -> Self {
        if field.land().is_some() {
            // Wedges tell themselves whether they are in sight.
            return Self {
                side: lattice.side(),
                count: [0; 2],
                bounds: Vec::new(),
                seen: Vec::new(),
                edge_squares: Vec::new(),
            };
        }
        let side = lattice.block_side();
        let last = field.size().map(|n| n as i32 - 1);
        let count = last.map(|n| (n - 1) / side + 1);
        let of_block = |k: i32| bounds(field, last, side, [k % count[0], k / count[0]]);
        let bounds: Vec<_> = (0..count[0] * count[1]).into_par_iter().map(of_block).collect();
        let edge_squares = edge_squares(count, last, side, lattice.edge_side());
        Self { side, count, seen: vec![false; bounds.len()], bounds, edge_squares }
    }

    /// Finds the blocks in sight.
    pub fn look(&mut self, view: &View) {
        let frustum = view.frustum();
        for (seen, bounds) in self.seen.iter_mut().zip(&self.bounds) {
            *seen = bounds.as_ref().is_some_and(|bounds| frustum.contains(bounds) != Containment::Outside);
        }
        for blocks in &self.edge_squares {
            let is_seen = blocks.iter().any(|&block| self.seen[block]);
            blocks.iter().for_each(|&block| self.seen[block] = is_seen);
        }
    }

    /// The number of the block in sight around a wedge that lies in one.
    pub fn seen(&self, corners: [Place; 3]) -> Option<usize> {
        let [i, j] = [0, 1].map(|k| corners.iter().map(|at| at[k]).min().unwrap_or(0) / self.side);
        let block = (j * self.count[0] + i) as usize;
        (i < self.count[0] && j < self.count[1] && self.seen[block]).then_some(block)
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

/// The blocks of each square of this side that reaches beyond the last sample.
fn edge_squares(count: [i32; 2], last: Place, side: i32, edge_side: i32) -> Vec<Vec<usize>> {
    let mut squares = BTreeMap::<Place, Vec<usize>>::new();
    for block in 0..count[0] * count[1] {
        let square = [block % count[0], block / count[0]].map(|n| n * side / edge_side);
        if (0..2).any(|axis| (square[axis] + 1) * edge_side > last[axis]) {
            squares.entry(square).or_default().push(block as usize);
        }
    }
    squares.into_values().collect()
}

fn bounds(field: &Field, last: Place, side: i32, at: Place) -> Option<Aabb> {
    let first = at.map(|n| n * side);
    let end = [0, 1].map(|k| (first[k] + side).min(last[k]));
    if !has_land(field, first, end) {
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
