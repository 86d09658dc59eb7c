//! Which nodes of the quadtree are split in a view, and how far their blocks have gone over into them.
//!
//! A node's ratio is what the tolerance allows over its ε. It is split while that is below the end of its band, and
//! within the band the four blocks in it go over into it: their weight rises from 0 to 1. As ε grows from child to
//! parent by more than the band is wide, at most one of the nodes over a place is in its band.
//!
//! Neighbours are kept within one level of each other, weights included: a node's ratio is at most that of every
//! finer node on its sides. It is enough to pass the ratio of each split node to the two coarser neighbours of its
//! own outer sides, from the finest level up. Blocks of level 0 are never too coarse: stitched to a coarser neighbour
//! they are off the samples on the common side only, which the neighbour's ε covers.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use super::lod_evaluator::{LodEvaluator, NodeVisibility};
use super::tree::{Node, Squares, Tree};
use crate::draw::weights::ONE;
use crate::view::Containment;

/// A node that is split.
#[derive(Clone, Copy, Debug)]
pub struct Split {
    /// Which node.
    pub node: Node,
    /// What the tolerance allows over its ε.
    error_margin: f32,
    /// How it lies to what can be seen.
    containment: Containment,
    /// Which of its children are blocks in sight, a bit each.
    pub blocks: u32,
    /// Those of its children that are split, by their place among the split nodes.
    pub children: [Option<u32>; 4],
}

/// What is found under a node's parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// Nothing to be drawn.
    Nothing,
    /// A block in sight.
    Block,
    /// A split node, by its place.
    Split(u32),
}

/// The split nodes of a view.
pub struct Refinement {
    /// The most nodes that may be split.
    max: usize,
    /// The split nodes.
    pub splits: Vec<Split>,
    /// Their places by level.
    levels: Vec<Vec<u32>>,
    index: HashMap<u64, u32, BuildHasherDefault<NodeHasher>>,
    /// What is known of the children of a level's split nodes.
    squares: Vec<Squares>,
    /// What the root is.
    pub root: Found,
}

impl Refinement {
    /// With at most `max` split nodes.
    pub fn new(max: usize) -> Self {
        let (splits, levels, index, squares) = (Vec::new(), Vec::new(), HashMap::default(), Vec::new());
        Self { max, splits, levels, index, squares, root: Found::Nothing }
    }

    /// Finds the split nodes of a view. `false` if there would be too many.
    pub fn refine(&mut self, evaluator: &LodEvaluator) -> bool {
        let root = evaluator.tree.root();
        self.levels.resize_with(root.level as usize + 1, Vec::new);
        self.levels.iter_mut().for_each(Vec::clear);
        self.splits.clear();
        self.index.clear();
        self.descend(evaluator);
        for level in 1..root.level as usize {
            for k in 0..self.levels[level].len() {
                let Split { node, error_margin, .. } = self.splits[self.levels[level][k] as usize];
                self.restrict(evaluator, node, error_margin);
            }
        }
        self.splits.len() <= self.max
    }

    /// Splits what has to be, level by level.
    fn descend(&mut self, evaluator: &LodEvaluator) {
        let root = evaluator.tree.root();
        self.root = self.found(evaluator, root, evaluator.evaluate(root));
        for level in (1..=root.level as usize).rev() {
            // All of a level before any is looked at: what is far away in memory comes at the same time.
            self.squares.clear();
            let nodes = self.levels[level].iter().map(|&k| self.splits[k as usize].node);
            self.squares.extend(nodes.map(|node| evaluator.tree.squares(node)));
            for n in 0..self.levels[level].len() {
                self.look_into(evaluator, self.levels[level][n], self.squares[n]);
            }
        }
    }

    fn look_into(&mut self, evaluator: &LodEvaluator, k: u32, squares: Squares) {
        let Split { node, containment, .. } = self.splits[k as usize];
        for (quadrant, evaluate) in evaluator.evaluate_children(node, containment, &squares).into_iter().enumerate() {
            let found = self.found(evaluator, node.child(quadrant as u32), evaluate);
            self.splits[k as usize].hold(quadrant, found);
        }
    }

    /// What a node is that was looked at.
    fn found(&mut self, evaluator: &LodEvaluator, node: Node, evaluate: NodeVisibility) -> Found {
        let Some((containment, error_margin)) = evaluate else { return Found::Nothing };
        if containment == Containment::Outside && evaluator.view.culls != 0 {
            return Found::Nothing;
        }
        if error_margin >= evaluator.view.band_end || self.splits.len() > self.max {
            return block(is_in_view(evaluator, node, containment));
        }
        Found::Split(self.insert(evaluator, node, error_margin, containment))
    }

    fn insert(&mut self, evaluator: &LodEvaluator, node: Node, error_margin: f32, containment: Containment) -> u32 {
        let k = self.splits.len() as u32;
        if let Some(id) = node.id(evaluator.tree.root()) {
            self.index.insert(id, k);
        }
        self.levels[node.level as usize].push(k);
        self.splits.push(Split { node, error_margin, containment, blocks: 0, children: [None; 4] });
        k
    }

    /// Keeps the coarser neighbours on a node's own outer sides within a level of it.
    fn restrict(&mut self, evaluator: &LodEvaluator, node: Node, error_margin: f32) {
        for axis in 0..2 {
            // The first child's outer side is the first side.
            let side = axis + 2 * (node.at[axis] & 1) as usize;
            let Some(beyond) = node.beyond(side) else { continue };
            let coarser = beyond.parent();
            if let Some(k) = self.find(evaluator.tree, coarser) {
                let split = &mut self.splits[k as usize];
                split.error_margin = split.error_margin.min(error_margin);
            } else if evaluator.draws(coarser) {
                self.split_leaf(evaluator, coarser, error_margin);
            }
        }
    }

    /// Splits a node that was a leaf, or in one.
    fn split_leaf(&mut self, evaluator: &LodEvaluator, node: Node, error_margin: f32) {
        let k = self.insert(evaluator, node, error_margin, Containment::Crossing);
        for quadrant in 0..4 {
            let child = node.child(quadrant as u32);
            let found = match self.find(evaluator.tree, child) {
                Some(place) => Found::Split(place),
                None => block(self.is_leaf_in_view(evaluator, child)),
            };
            self.splits[k as usize].hold(quadrant, found);
        }
        // A parent that is split later finds it.
        if let Some(parent) = self.find(evaluator.tree, node.parent()) {
            self.splits[parent as usize].hold(node.quadrant() as usize, Found::Split(k));
        }
    }

    fn is_leaf_in_view(&self, evaluator: &LodEvaluator, node: Node) -> bool {
        evaluator.containment(node).is_some_and(|containment| is_in_view(evaluator, node, containment))
    }

    fn find(&self, tree: &Tree, node: Node) -> Option<u32> {
        self.index.get(&node.id(tree.root())?).copied()
    }

    /// How far the blocks in a node have gone over into it, below [`ONE`]; `None` if it is not split.
    pub fn weight(&self, evaluator: &LodEvaluator, node: Node) -> Option<u32> {
        let k = self.find(evaluator.tree, node)?;
        Some(self.splits[k as usize].weight(evaluator))
    }

    /// The weight of a side of a split node, the greater of its two nodes': from [`ONE`] on the other one is not
    /// split, and `ONE` stands for its own level. Where nothing is drawn beyond, the node's own.
    pub fn side_weight(&self, evaluator: &LodEvaluator, split: &Split, side: usize) -> u32 {
        let own = split.weight(evaluator);
        let Some(beyond) = split.node.beyond(side) else { return own };
        match self.weight(evaluator, beyond) {
            Some(weight) => own.max(weight),
            // Where all of a node is in sight, so is the side that the other one shares with it.
            None if evaluator.tree.square(beyond).is_none() => own,
            None if split.containment != Containment::Inside && !evaluator.draws(beyond) => own,
            None if evaluator.view.band_scale == 0.0 => ONE,
            None => ONE + self.weight(evaluator, beyond.parent()).unwrap_or(0),
        }
    }
}

impl Split {
    /// How far its blocks have gone over into it, below [`ONE`]. Where a node sticks out of the field midpoints are
    /// none, so there they stay.
    pub fn weight(&self, evaluator: &LodEvaluator) -> u32 {
        if evaluator.view.band_scale == 0.0 || evaluator.tree.is_partial(self.node) {
            return 0;
        }
        ((self.error_margin - 1.0) * evaluator.view.band_scale).clamp(0.0, (ONE - 1) as f32) as u32
    }

    fn hold(&mut self, quadrant: usize, found: Found) {
        self.blocks &= !(1 << quadrant);
        match found {
            Found::Nothing => {}
            Found::Block => self.blocks |= 1 << quadrant,
            Found::Split(place) => self.children[quadrant] = Some(place),
        }
    }
}

fn block(is_seen: bool) -> Found {
    if is_seen { Found::Block } else { Found::Nothing }
}

/// Whether any of the finest blocks in a node may be seen: with the box of the whole alone a coarse block might be
/// drawn where finer ones are not, and a wider tolerance would draw more.
fn is_in_view(evaluator: &LodEvaluator, node: Node, containment: Containment) -> bool {
    match containment {
        Containment::Outside => false,
        Containment::Inside => true,
        Containment::Crossing => {
            node.level == 0
                || (0u32..)
                    .zip(evaluator.contained_in(node))
                    .any(|(quadrant, containment)| is_in_view(evaluator, node.child(quadrant), containment))
        }
    }
}

/// A multiplication a node.
#[derive(Clone, Copy, Default)]
struct NodeHasher(u64);

impl Hasher for NodeHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.write_u64(byte.into()));
    }

    fn write_u64(&mut self, id: u64) {
        self.0 = (self.0 ^ id).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(26);
    }
}
