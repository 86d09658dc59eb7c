//! Determines the sides of blocks that need skirts, and the skirts' depth.
//!
//! A side needs a skirt if the block beyond it has another level or another morph weight; otherwise both blocks have
//! the same edge. The depth is the maximum gap. Every drawn surface is within its error of the samples: that of its
//! block at weight 0, moving towards the parent's with the weight. Both edges are piecewise linear between samples of
//! the side, so the gap is at most the sum of the two errors. Both edges interpolate samples of the side, so it is also
//! at most the block's height range. Judnich & Ling 2012, section V.A, have such a bound in screen space.
//!
//! A small margin is added for the rasteriser, which may miss pixels between edges that coincide in space but have
//! different vertices.
//!
//! `shaders/cluster_skirts.glsl` has the same functions with bit-identical results.

use super::lod_evaluator::LodEvaluator;
use super::refine::Refinement;
use super::tree::{Node, SIDES};
use crate::draw::weights::{FINER, ONE, SkirtWeights};

/// Rounding of morphed heights, as in `height::bounds`.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// Computes the skirts of blocks.
pub struct Skirts<'a> {
    evaluator: &'a LodEvaluator<'a>,
    refinement: &'a Refinement,
}

/// Properties that determine a block's edge.
struct Edge {
    level: u32,
    /// Morph weight of the block towards its parent.
    weight: u32,
    /// Maximum deviation from the samples, metres.
    error_m: f32,
}

impl<'a> Skirts<'a> {
    /// Creates the computation for a refinement in a view.
    pub fn new(evaluator: &'a LodEvaluator<'a>, refinement: &'a Refinement) -> Self {
        Self { evaluator, refinement }
    }

    /// Returns the weights of an instance of a level that draws these blocks, each in a quadrant. Words 1 and 2
    /// describe its skirts.
    pub fn weights(&self, level: u32, blocks: impl Iterator<Item = (u32, Node)>) -> SkirtWeights {
        let (mut inside, mut sides, mut depth_m) = ([0; 4], 0, 0.0f32);
        for (quadrant, block) in blocks {
            let finer = if block.level < level { FINER } else { 0 };
            inside[quadrant as usize] = (self.edge(block).weight | finer) as u8;
            for side in SIDES {
                let Some(gap) = self.gap_m(block, side) else { continue };
                sides |= 1 << (4 * quadrant + side as u32);
                depth_m = depth_m.max(gap);
            }
        }
        SkirtWeights { inside: u32::from_le_bytes(inside), sides, depth_m }
    }

    /// Returns the maximum gap between a block and the surface beyond a side, metres; `None` if the edges are the same.
    fn gap_m(&self, block: Node, side: usize) -> Option<f32> {
        let tree = self.evaluator.tree;
        let (own, other) = (self.edge(block), self.edge_at(block.beyond(side)?)?);
        if (own.level, own.weight) == (other.level, other.weight) {
            return None;
        }
        let [low, high] = tree.square(block)?.range;
        let [_, apart] = tree.deviation(block);
        let gap = (own.error_m + other.error_m).min(apart) + ROUNDING * low.abs().max(high.abs());
        let raster_gap = self.evaluator.raster_m(block)?.min(tree.cell_m(block.level) as f32);
        Some((gap + raster_gap) * (1.0 + f32::EPSILON))
    }

    /// Returns the edge drawn at a node: its own, its parent's, or that of the blocks in it. `None` beyond the root.
    fn edge_at(&self, node: Node) -> Option<Edge> {
        if node.level == self.evaluator.tree.root().level {
            return None;
        }
        let is_split = |node| self.refinement.weight(self.evaluator, node).is_some();
        if is_split(node) {
            let children = (0..4)
                .map(|quadrant| node.child(quadrant))
                .filter(|child| self.evaluator.tree.square(*child).is_some());
            let edges = children.map(|child| self.edge(child));
            return edges.reduce(|a, b| Edge { error_m: a.error_m.max(b.error_m), ..a });
        }
        let block = if is_split(node.parent()) { node } else { node.parent() };
        self.evaluator.draws(block).then(|| self.edge(block))
    }

    fn edge(&self, block: Node) -> Edge {
        let of = |node| self.evaluator.tree.deviation(node)[0];
        let weight = self.refinement.weight(self.evaluator, block.parent()).unwrap_or(0);
        let (own, part) = (of(block), weight as f32 / ONE as f32);
        // A root has no parent to morph into.
        let error_m = if weight == 0 { own } else { own + (of(block.parent()) - own) * part };
        Edge { level: block.level, weight, error_m }
    }
}
