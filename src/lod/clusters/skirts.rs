//! Where blocks have skirts, and how deep.
//!
//! A side has one where the block beyond it is of another level, or has gone another way into its parent: elsewhere
//! both have the same edge. The depth is the most that the gap can be. Every drawn surface is within its own error of
//! the samples: that of its block at weight 0, and on the way to the parent's as far as the block has gone. Both edges
//! are straight between samples of the side, so that between them lies at most the sum of the two errors; and as
//! both go from sample to sample of the side, no more than the samples in the block are apart. Judnich & Ling 2012,
//! section V.A, know such a bound on the screen.
//!
//! A little more is for the rasteriser, which may miss pixels between edges that meet in space but not in their
//! vertices.
//!
//! `shaders/cluster_skirts.glsl` has the same functions, to the bit.

use super::lod_evaluator::LodEvaluator;
use super::refine::Refinement;
use super::tree::{Node, SIDES};
use crate::draw::skirts;
use crate::draw::weights::{self, FINER, ONE};

/// Rounding of heights on their way: as `height::bounds` has it.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// Finds the skirts of blocks.
pub struct Skirts<'a> {
    evaluator: &'a LodEvaluator<'a>,
    refinement: &'a Refinement,
}

/// What tells the edge of a block from others.
struct Edge {
    level: u32,
    /// How far the block has gone over into its parent.
    weight: u32,
    /// The most, metres, by which it is off the samples.
    error_m: f32,
}

impl<'a> Skirts<'a> {
    /// For a refinement in a view.
    pub fn new(evaluator: &'a LodEvaluator<'a>, refinement: &'a Refinement) -> Self {
        Self { evaluator, refinement }
    }

    /// The weights of an instance of a level that draws these blocks, each in a quadrant: words 1 and 2 are its
    /// skirts.
    pub fn weights(&self, level: u32, blocks: impl Iterator<Item = (u32, Node)>) -> [u32; 4] {
        let (mut inside, mut sides, mut depth) = ([0; 4], 0, 0.0f32);
        for (quadrant, block) in blocks {
            let finer = if block.level < level { FINER } else { 0 };
            inside[quadrant as usize] = self.edge(block).weight | finer;
            for side in SIDES {
                let Some(gap) = self.gap_m(block, side) else { continue };
                sides |= 1 << (4 * quadrant + side as u32);
                depth = depth.max(gap);
            }
        }
        let mut weights = [0; 4];
        (0..4).for_each(|quadrant| weights::set(&mut weights, weights::inside(quadrant), inside[quadrant]));
        skirts::set(&mut weights, sides, depth);
        weights
    }

    /// The most, metres, that a block can be apart from what is drawn beyond a side; `None` if it is not at all.
    fn gap_m(&self, block: Node, side: usize) -> Option<f32> {
        let tree = self.evaluator.tree;
        let (own, other) = (self.edge(block), self.edge_at(block.beyond(side)?)?);
        if (own.level, own.weight) == (other.level, other.weight) {
            return None;
        }
        let [low, high] = tree.square(block)?.range;
        let [_, apart] = tree.deviation(block);
        let gap = (own.error_m + other.error_m).min(apart) + ROUNDING * low.abs().max(high.abs());
        let second_target = self.evaluator.raster_m(block)?.min(tree.cell_m(block.level) as f32);
        Some((gap + second_target) * (1.0 + f32::EPSILON))
    }

    /// What is drawn at a node: it, its parent or the blocks in it. Beyond the root is nothing.
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
        // A root has no parent to go to.
        let error_m = if weight == 0 { own } else { own + (of(block.parent()) - own) * part };
        Edge { level: block.level, weight, error_m }
    }
}
