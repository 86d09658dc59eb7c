//! The quadtree over a field. Nodes are plain coordinates, created on demand.

use std::sync::Arc;

use glam::Vec4;

use crate::height::bounds::{Bounds, Measure, ROUNDING, Square};
use crate::height::progress::Progress;
use crate::height::{Field, level_errors};

/// A square of the quadtree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Node {
    /// Level of the block that fills it.
    pub level: u32,
    /// Place among the nodes of its level, (x, z).
    pub at: [u32; 2],
}

/// Sides of a node: first x, first z, last x, last z.
pub const SIDES: [usize; 4] = [0, 1, 2, 3];

impl Node {
    /// Returns the child in quadrant `q = (x half) + 2 (z half)`.
    #[inline]
    pub fn child(self, quadrant: u32) -> Node {
        let [i, j] = self.at;
        Node { level: self.level - 1, at: [2 * i + (quadrant & 1), 2 * j + (quadrant >> 1)] }
    }

    /// Returns the parent node.
    #[inline]
    pub fn parent(self) -> Node {
        Node { level: self.level + 1, at: [self.at[0] / 2, self.at[1] / 2] }
    }

    /// Returns its quadrant in its parent.
    #[inline]
    pub fn quadrant(self) -> u32 {
        (self.at[0] & 1) + 2 * (self.at[1] & 1)
    }

    /// Returns the node of the same level beyond a side; `None` before the field's first sample.
    #[inline]
    pub fn beyond(self, side: usize) -> Option<Node> {
        let mut at = self.at;
        let n = &mut at[side & 1];
        *n = if side < 2 { n.checked_sub(1)? } else { *n + 1 };
        Some(Node { at, ..self })
    }

    /// Returns a unique number among all nodes under a root: two bits for each level below the root, and a leading one.
    /// `None` for nodes outside the root.
    #[inline]
    pub fn id(self, root: Node) -> Option<u64> {
        let above = root.level.checked_sub(self.level)?;
        let [i, j] = self.at;
        let is_under = (i | j) >> above == 0;
        is_under.then(|| 1 << (2 * above) | u64::from(j) << above | u64::from(i))
    }
}

/// Source of errors.
#[derive(Clone, Debug, PartialEq)]
pub enum Errors {
    /// Measured against the samples.
    Measured,
    /// One error per level, metres: measured against the samples, including the morph into the level
    /// ([`super::morph_ranges`]).
    ByLevel(Vec<f32>),
    /// Judnich & Ling 2012, eq. 2: half the parent's error. The root's is the range of heights, metres.
    Halved(f32),
}

/// Four squares, one per lane, like [`Square`].
#[derive(Clone, Copy, Debug)]
pub struct Squares {
    /// Errors, metres.
    pub error: Vec4,
    /// Lowest and highest samples, metres.
    pub range: [Vec4; 2],
}

impl Squares {
    /// Returns which of them have data, as bits.
    #[inline]
    pub fn has_terrain(&self) -> u32 {
        self.range[0].cmple(self.range[1]).bitmask()
    }
}

/// Quadtree of a field.
pub struct Tree {
    /// Measured errors and height ranges of its squares.
    pub bounds: Bounds,
    /// Source of its errors.
    pub errors: Errors,
    /// Distance of adjacent samples (x, z), metres.
    pub spacing: [f64; 2],
    /// World position of the first sample (x, z), metres.
    pub origin: [f64; 2],
    /// Last sample, (x, z).
    pub last: [u32; 2],
}

impl Tree {
    /// Measures a field for blocks of `measure.cells` × `measure.cells` cells. Without measured errors, errors are
    /// halved from level to level. With `by_level` they are those of whole levels.
    pub fn new(field: &Arc<Field>, measure: Measure, by_level: bool, progress: &Progress) -> Self {
        let bounds = Bounds::new(field, measure, progress);
        let [low, high] = bounds.square(bounds.levels() - 1, [0, 0]).range;
        let errors = match (measure.errors, by_level) {
            (false, _) => Errors::Halved((high - low).max(0.0)),
            (true, true) => Errors::ByLevel(morph_errors(field, &bounds)),
            (true, false) => Errors::Measured,
        };
        let last = field.size().map(|n| n - 1);
        Self { bounds, errors, spacing: field.spacing, origin: field.origin, last }
    }

    /// Returns the node that contains the field.
    pub fn root(&self) -> Node {
        Node { level: self.bounds.levels() - 1, at: [0, 0] }
    }

    /// Returns the size of the measured data, bytes.
    pub fn bytes(&self) -> usize {
        self.bounds.bytes()
    }

    /// Returns the number of nodes of a level that overlap the field.
    pub fn nodes(&self, level: u32) -> usize {
        self.last.iter().map(|n| n.div_ceil(self.bounds.side(level)) as usize).product()
    }

    /// Returns the lattice position of a node's first vertex.
    #[inline]
    pub fn first(&self, node: Node) -> [u32; 2] {
        let side = self.bounds.side(node.level);
        [node.at[0] * side, node.at[1] * side]
    }

    /// Returns the lattice positions of a node's first and last vertex within the field.
    #[inline]
    pub fn corners(&self, node: Node) -> [[u32; 2]; 2] {
        let ([x, z], side) = (self.first(node), self.bounds.side(node.level));
        [[x, z], [(x + side).min(self.last[0]), (z + side).min(self.last[1])]]
    }

    /// Returns true if a node extends beyond the field.
    pub fn is_partial(&self, node: Node) -> bool {
        self.bounds.is_partial(node.level, node.at)
    }

    /// Returns the error and height range of a node; `None` if it has no data.
    #[inline]
    pub fn square(&self, node: Node) -> Option<Square> {
        let [x, z] = self.first(node);
        if x >= self.last[0] || z >= self.last[1] {
            return None;
        }
        let square = self.bounds.square(node.level, node.at);
        square.has_terrain().then(|| Square { error: self.error(node.level, square.error), ..square })
    }

    /// Returns the errors and height ranges of a node's children, one per lane.
    #[inline]
    pub fn squares(&self, node: Node) -> Squares {
        let [a, b, c, d] = self.bounds.squares(node.level - 1, node.at);
        let lanes = |of: fn(&Square) -> f32| Vec4::new(of(&a), of(&b), of(&c), of(&d));
        let error = match self.errors {
            Errors::Measured => lanes(|square| square.error),
            Errors::Halved(_) | Errors::ByLevel(_) => Vec4::splat(self.error(node.level - 1, 0.0)),
        };
        Squares { error, range: [lanes(|square| square.range[0]), lanes(|square| square.range[1])] }
    }

    /// Returns the maximum deviation of a node's surface from the samples, metres, and the maximum difference of two
    /// samples in it, metres.
    pub fn deviation(&self, node: Node) -> [f32; 2] {
        let Square { error, range: [low, high] } = self.bounds.square(node.level, node.at);
        // Rounded up; zero stays zero.
        let apart = (high - low) * (1.0 + f32::EPSILON);
        [if self.errors == Errors::Measured { error } else { apart }, apart]
    }

    /// Returns the length of the longer side of a cell, metres.
    pub fn cell_m(&self, level: u32) -> f64 {
        self.spacing[0].max(self.spacing[1]) * f64::from(1u32 << level)
    }

    /// Returns the error of a square of a level, metres, given its measured error.
    #[inline]
    pub fn error(&self, level: u32, measured: f32) -> f32 {
        match &self.errors {
            Errors::Measured => measured,
            Errors::ByLevel(errors) => errors[level as usize],
            Errors::Halved(root) => root / (1u64 << (self.root().level - level)) as f32,
        }
    }
}

/// Returns the maximum error while blocks morph into each level, metres.
fn morph_errors(field: &Field, bounds: &Bounds) -> Vec<f32> {
    let (errors, displacements) =
        (level_errors::largest_errors(bounds), level_errors::largest_displacements(field, bounds));
    let [low, high] = bounds.square(bounds.levels() - 1, [0, 0]).range;
    let rounding = ROUNDING * low.abs().max(high.abs());
    let error = |level: usize| match level {
        0 => 0.0,
        // Sides of level 0 on edges of level 1 deviate as far as that level's vertices move.
        1 => errors[1].max(displacements[1] + displacements[1]) + rounding,
        _ => errors[level].max(errors[level - 1] + displacements[level]) + rounding,
    };
    (0..errors.len()).map(error).collect()
}
