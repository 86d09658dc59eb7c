//! The quadtree over a field: nothing but numbers, its nodes are made when asked for.

use std::sync::Arc;

use crate::height::Field;
use crate::height::bounds::{Bounds, Measure, Square};
use crate::view::{Aabb, Allowance};

/// A square of the quadtree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
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
    pub fn child(self, quadrant: u32) -> Node {
        let [i, j] = self.at;
        Node { level: self.level - 1, at: [2 * i + (quadrant & 1), 2 * j + (quadrant >> 1)] }
    }

    /// The node that it is a child of.
    pub fn parent(self) -> Node {
        Node { level: self.level + 1, at: self.at.map(|n| n / 2) }
    }

    /// The node of the same level beyond a side, if it is not before the field's first sample.
    pub fn beyond(self, side: usize) -> Option<Node> {
        let mut at = self.at;
        let n = &mut at[side & 1];
        *n = if side < 2 { n.checked_sub(1)? } else { *n + 1 };
        Some(Node { at, ..self })
    }
}

/// Where errors come from.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Errors {
    /// Measured against the samples.
    Measured,
    /// Judnich & Ling 2012, eq. 2: half the parent's; the root's is the range of heights, metres.
    Halved(f32),
}

/// The quadtree of a field.
pub struct Tree {
    bounds: Bounds,
    errors: Errors,
    spacing: [f64; 2],
    origin: [f64; 2],
    last: [u32; 2],
}

/// What is known of a node with land.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// The box around it.
    pub bounds: Aabb,
    /// ε, metres.
    pub error: f32,
}

impl Tree {
    /// Measures a field for blocks of `measure.cells` × `measure.cells` cells.
    pub fn new(field: &Arc<Field>, measure: Measure, halved: bool) -> Self {
        let bounds = Bounds::new(field, measure);
        let [low, high] = bounds.square(bounds.levels() - 1, [0, 0]).range;
        let errors = if halved { Errors::Halved((high - low).max(0.0)) } else { Errors::Measured };
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
    pub fn first(&self, node: Node) -> [u32; 2] {
        node.at.map(|n| n * self.bounds.side(node.level))
    }

    /// Whether a node has cells of the field.
    pub fn contains(&self, node: Node) -> bool {
        let first = self.first(node);
        (0..2).all(|k| first[k] < self.last[k])
    }

    /// Whether a node sticks out of the field.
    pub fn is_partial(&self, node: Node) -> bool {
        self.bounds.is_partial(node.level, node.at)
    }

    /// What is known of a node of the field; `None` if it has no land.
    pub fn known(&self, node: Node) -> Option<Known> {
        let square = self.bounds.square(node.level, node.at);
        square.has_land().then(|| {
            let side = self.bounds.side(node.level);
            let first = self.first(node);
            let at = |k: usize, n: u32| self.origin[k] + f64::from(n.min(self.last[k])) * self.spacing[k];
            let corner =
                |add: u32, y: f32| glam::DVec3::new(at(0, first[0] + add), f64::from(y), at(1, first[1] + add));
            let bounds = Aabb { min: corner(0, square.range[0]), max: corner(side, square.range[1]) };
            Known { bounds, error: self.error(node.level, square.error) }
        })
    }

    /// The most, metres, by which a node's surface is off the samples, whatever its error is taken for, and the
    /// most by which two samples in it differ.
    pub fn deviation(&self, node: Node) -> [f32; 2] {
        let Square { error, range: [low, high] } = self.bounds.square(node.level, node.at);
        let apart = (high - low).next_up();
        [if self.errors == Errors::Measured { error } else { apart }, apart]
    }

    /// Length of the longer side of a cell, metres.
    pub fn cell_m(&self, level: u32) -> f64 {
        self.spacing[0].max(self.spacing[1]) * f64::from(1u32 << level)
    }

    fn error(&self, level: u32, measured: f32) -> f32 {
        match self.errors {
            Errors::Measured => measured,
            Errors::Halved(root) => root / (1u64 << (self.root().level - level)) as f32,
        }
    }
}

/// What the tolerance allows in a node over what it has: below 1 it is too coarse.
pub fn ratio(allowance: &Allowance, known: &Known) -> f64 {
    allowance.error(&known.bounds) / f64::from(known.error.max(f32::MIN_POSITIVE))
}
