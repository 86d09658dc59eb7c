//! The quadtree over a field: nothing but numbers, its nodes are made when asked for.

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
    /// Place among the nodes of its level.
    pub at: [u32; 2],
}

/// Sides of a node: x first, z first, x last, z last.
pub const SIDES: [usize; 4] = [0, 1, 2, 3];

impl Node {
    /// A child, number `q = (x half) + 2 (z half)`.
    #[inline]
    pub fn child(self, quadrant: u32) -> Node {
        let [i, j] = self.at;
        Node { level: self.level - 1, at: [2 * i + (quadrant & 1), 2 * j + (quadrant >> 1)] }
    }

    /// The node that it is a child of.
    #[inline]
    pub fn parent(self) -> Node {
        Node { level: self.level + 1, at: [self.at[0] / 2, self.at[1] / 2] }
    }

    /// Which child of its parent it is.
    #[inline]
    pub fn quadrant(self) -> u32 {
        (self.at[0] & 1) + 2 * (self.at[1] & 1)
    }

    /// The node of the same level beyond a side, if it is not before the field's first sample.
    #[inline]
    pub fn beyond(self, side: usize) -> Option<Node> {
        let mut at = self.at;
        let n = &mut at[side & 1];
        *n = if side < 2 { n.checked_sub(1)? } else { *n + 1 };
        Some(Node { at, ..self })
    }

    /// A number of its own among all nodes under a root: two bits for each level above it, and one. `None` beyond
    /// the root.
    #[inline]
    pub fn id(self, root: Node) -> Option<u64> {
        let above = root.level.checked_sub(self.level)?;
        let [i, j] = self.at;
        let is_under = (i | j) >> above == 0;
        is_under.then(|| 1 << (2 * above) | u64::from(j) << above | u64::from(i))
    }
}

/// Where errors come from.
#[derive(Clone, Debug, PartialEq)]
pub enum Errors {
    /// Measured against the samples.
    Measured,
    /// The same for all of a level, metres: measured against the samples, on the way into it too ([`ranges`]).
    ByLevel(Vec<f32>),
    /// Judnich & Ling 2012, eq. 2: half the parent's; the root's is the range of heights, metres.
    Halved(f32),
}

/// Four squares, a lane each, as [`Square`] has them.
#[derive(Clone, Copy, Debug)]
pub struct Squares {
    /// Errors, metres.
    pub error: Vec4,
    /// Lowest and highest samples, metres.
    pub range: [Vec4; 2],
}

impl Squares {
    /// Which of them have land, a bit each.
    #[inline]
    pub fn has_terrain(&self) -> u32 {
        self.range[0].cmple(self.range[1]).bitmask()
    }
}

/// The quadtree of a field.
pub struct Tree {
    /// What was measured of its squares.
    pub bounds: Bounds,
    /// Where its errors come from.
    pub errors: Errors,
    /// Distance of neighbouring samples (x, z), metres.
    pub spacing: [f64; 2],
    /// Where the first sample lies (x, z), world metres.
    pub origin: [f64; 2],
    /// The last sample.
    pub last: [u32; 2],
}

impl Tree {
    /// Measures a field for blocks of `measure.cells` × `measure.cells` cells. Without measured errors they are halved
    /// from level to level; else they may be those of whole levels.
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

    /// The node that holds the field.
    pub fn root(&self) -> Node {
        Node { level: self.bounds.levels() - 1, at: [0, 0] }
    }

    /// Bytes of what was measured.
    pub fn bytes(&self) -> usize {
        self.bounds.bytes()
    }

    /// Nodes of a level with cells of the field.
    pub fn nodes(&self, level: u32) -> usize {
        self.last.iter().map(|n| n.div_ceil(self.bounds.side(level)) as usize).product()
    }

    /// Lattice position of a node's first vertex.
    #[inline]
    pub fn first(&self, node: Node) -> [u32; 2] {
        let side = self.bounds.side(node.level);
        [node.at[0] * side, node.at[1] * side]
    }

    /// Lattice positions of a node's first and last vertex that are in the field.
    #[inline]
    pub fn corners(&self, node: Node) -> [[u32; 2]; 2] {
        let ([x, z], side) = (self.first(node), self.bounds.side(node.level));
        [[x, z], [(x + side).min(self.last[0]), (z + side).min(self.last[1])]]
    }

    /// Whether a node sticks out of the field.
    pub fn is_partial(&self, node: Node) -> bool {
        self.bounds.is_partial(node.level, node.at)
    }

    /// What is known of a node; `None` if it has no land.
    #[inline]
    pub fn square(&self, node: Node) -> Option<Square> {
        let [x, z] = self.first(node);
        if x >= self.last[0] || z >= self.last[1] {
            return None;
        }
        let square = self.bounds.square(node.level, node.at);
        square.has_terrain().then(|| Square { error: self.error(node.level, square.error), ..square })
    }

    /// What is known of a node's children, a lane each.
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

    /// The most, metres, by which a node's surface is off the samples, whatever its error is taken for, and the
    /// most by which two samples in it differ.
    pub fn deviation(&self, node: Node) -> [f32; 2] {
        let Square { error, range: [low, high] } = self.bounds.square(node.level, node.at);
        // Rounded up, and nothing stays nothing.
        let apart = (high - low) * (1.0 + f32::EPSILON);
        [if self.errors == Errors::Measured { error } else { apart }, apart]
    }

    /// Length of the longer side of a cell, metres.
    pub fn cell_m(&self, level: u32) -> f64 {
        self.spacing[0].max(self.spacing[1]) * f64::from(1u32 << level)
    }

    /// The error of a square of a level in which `measured` was measured.
    #[inline]
    pub fn error(&self, level: u32, measured: f32) -> f32 {
        match &self.errors {
            Errors::Measured => measured,
            Errors::ByLevel(errors) => errors[level as usize],
            Errors::Halved(root) => root / (1u64 << (self.root().level - level)) as f32,
        }
    }
}

/// What may be off, metres, while blocks go over into each level.
fn morph_errors(field: &Field, bounds: &Bounds) -> Vec<f32> {
    let (errors, displacements) =
        (level_errors::largest_errors(bounds), level_errors::largest_displacements(field, bounds));
    let [low, high] = bounds.square(bounds.levels() - 1, [0, 0]).range;
    let rounding = ROUNDING * low.abs().max(high.abs());
    let error = |level: usize| match level {
        0 => 0.0,
        // Sides of level 0 on the edges of level 1 are as far off as that level's vertices go.
        1 => errors[1].max(displacements[1] + displacements[1]) + rounding,
        _ => errors[level].max(errors[level - 1] + displacements[level]) + rounding,
    };
    (0..errors.len()).map(error).collect()
}
