//! Determines the split nodes of the quadtree in a view, and the morph weights of their blocks.
//!
//! A node's error margin is the allowed error divided by its error ε. It is split while the margin is below the end of
//! its band. Within the band its four blocks morph into it: their weight rises from 0 to 1. As ε grows from child to
//! parent by more than the band's width, at most one of the nodes over a place is in its band.
//!
//! Neighbours are kept within one level of each other, weights included: a node's margin is at most that of every finer
//! node on its sides. For this it suffices to pass the margin of each split node to the two coarser neighbours on its
//! outer sides, from the finest level up. Blocks of level 0 are never too coarse. Stitched to a coarser neighbour they
//! deviate from the samples only on the common side, which the neighbour's ε covers.

use std::collections::HashMap;
use std::hash::{BuildHasherDefault, Hasher};

use super::lod_evaluator::{LodEvaluator, NodeVisibility};
use super::tree::{Node, Squares, Tree};
use crate::draw::weights::ONE;
use crate::view::Containment;

/// A split node.
#[derive(Clone, Copy, Debug)]
pub struct Split {
    /// The node.
    pub node: Node,
    /// Allowed error divided by the node's error ε.
    error_margin: f32,
    /// Containment in the frustum.
    containment: Containment,
    /// Children that are visible blocks, as bits.
    pub blocks: u32,
    /// Indices of its split children in [`Refinement::splits`].
    pub children: [Option<u32>; 4],
}

/// Result of evaluating a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Found {
    /// Nothing to draw.
    Nothing,
    /// A visible block.
    Block,
    /// A split node, by its index.
    Split(u32),
}

/// Split nodes of a view.
pub struct Refinement {
    /// Maximum number of split nodes.
    max: usize,
    /// Split nodes.
    pub splits: Vec<Split>,
    /// Indices of the split nodes by level.
    levels: Vec<Vec<u32>>,
    index: HashMap<u64, u32, BuildHasherDefault<NodeHasher>>,
    /// Errors and height ranges of the children of a level's split nodes.
    squares: Vec<Squares>,
    /// Result for the root.
    pub root: Found,
}

impl Refinement {
    /// Creates an empty refinement for at most `max` split nodes.
    pub fn new(max: usize) -> Self {
        let (splits, levels, index, squares) = (Vec::new(), Vec::new(), HashMap::default(), Vec::new());
        Self { max, splits, levels, index, squares, root: Found::Nothing }
    }

    /// Finds the split nodes of a view. Returns false if they exceed the maximum.
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

    /// Splits nodes from the root down, level by level.
    fn descend(&mut self, evaluator: &LodEvaluator) {
        let root = evaluator.tree.root();
        self.root = self.classify(evaluator, root, evaluator.evaluate(root));
        for level in (1..=root.level as usize).rev() {
            // Loads the data of a whole level before evaluating it, so that cache misses overlap.
            self.squares.clear();
            let nodes = self.levels[level].iter().map(|&k| self.splits[k as usize].node);
            self.squares.extend(nodes.map(|node| evaluator.tree.squares(node)));
            for n in 0..self.levels[level].len() {
                self.evaluate_children(evaluator, self.levels[level][n], self.squares[n]);
            }
        }
    }

    fn evaluate_children(&mut self, evaluator: &LodEvaluator, k: u32, squares: Squares) {
        let Split { node, containment, .. } = self.splits[k as usize];
        for (quadrant, evaluate) in evaluator.evaluate_children(node, containment, &squares).into_iter().enumerate() {
            let found = self.classify(evaluator, node.child(quadrant as u32), evaluate);
            self.splits[k as usize].set_child(quadrant, found);
        }
    }

    /// Returns the result for an evaluated node, and stores it if it is split.
    fn classify(&mut self, evaluator: &LodEvaluator, node: Node, evaluate: NodeVisibility) -> Found {
        let Some((containment, error_margin)) = evaluate else { return Found::Nothing };
        if containment == Containment::Outside && evaluator.view.culls != 0 {
            return Found::Nothing;
        }
        if error_margin >= evaluator.view.band_end || self.splits.len() > self.max {
            return block(is_visible(evaluator, node, containment));
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

    /// Keeps the coarser neighbours on a node's outer sides within one level of it.
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

    /// Splits a node that was a leaf, or inside a leaf.
    fn split_leaf(&mut self, evaluator: &LodEvaluator, node: Node, error_margin: f32) {
        let k = self.insert(evaluator, node, error_margin, Containment::Crossing);
        for quadrant in 0..4 {
            let child = node.child(quadrant as u32);
            let found = match self.find(evaluator.tree, child) {
                Some(place) => Found::Split(place),
                None => block(self.is_leaf_visible(evaluator, child)),
            };
            self.splits[k as usize].set_child(quadrant, found);
        }
        // A parent that is split later finds the node in the index.
        if let Some(parent) = self.find(evaluator.tree, node.parent()) {
            self.splits[parent as usize].set_child(node.quadrant() as usize, Found::Split(k));
        }
    }

    fn is_leaf_visible(&self, evaluator: &LodEvaluator, node: Node) -> bool {
        evaluator.containment(node).is_some_and(|containment| is_visible(evaluator, node, containment))
    }

    fn find(&self, tree: &Tree, node: Node) -> Option<u32> {
        self.index.get(&node.id(tree.root())?).copied()
    }

    /// Returns the morph weight of the blocks in a node, below [`ONE`]; `None` if it is not split.
    pub fn weight(&self, evaluator: &LodEvaluator, node: Node) -> Option<u32> {
        let k = self.find(evaluator.tree, node)?;
        Some(self.splits[k as usize].weight(evaluator))
    }

    /// Returns the weight of a side of a split node, the greater of its two nodes'. From [`ONE`] on the other node is
    /// not split; the rest is that one's own weight. If nothing is drawn beyond the side, it is the node's own.
    pub fn side_weight(&self, evaluator: &LodEvaluator, split: &Split, side: usize) -> u32 {
        let own = split.weight(evaluator);
        let Some(beyond) = split.node.beyond(side) else { return own };
        match self.weight(evaluator, beyond) {
            Some(weight) => own.max(weight),
            // If all of a node is visible, so is the side that the other node shares with it.
            None if evaluator.tree.square(beyond).is_none() => own,
            None if split.containment != Containment::Inside && !evaluator.draws(beyond) => own,
            None if evaluator.view.band_scale == 0.0 => ONE,
            None => ONE + self.weight(evaluator, beyond.parent()).unwrap_or(0),
        }
    }
}

impl Split {
    /// Returns the morph weight of its blocks, below [`ONE`]. A node that extends beyond the field does not morph,
    /// because midpoints are not vertices there.
    pub fn weight(&self, evaluator: &LodEvaluator) -> u32 {
        if evaluator.view.band_scale == 0.0 || evaluator.tree.is_partial(self.node) {
            return 0;
        }
        ((self.error_margin - 1.0) * evaluator.view.band_scale).clamp(0.0, (ONE - 1) as f32) as u32
    }

    fn set_child(&mut self, quadrant: usize, found: Found) {
        self.blocks &= !(1 << quadrant);
        match found {
            Found::Nothing => {}
            Found::Block => self.blocks |= 1 << quadrant,
            Found::Split(place) => self.children[quadrant] = Some(place),
        }
    }
}

fn block(is_visible: bool) -> Found {
    if is_visible { Found::Block } else { Found::Nothing }
}

/// Returns true if any of the finest blocks in a node may be visible. Testing only the whole node's box could draw a
/// coarse block where finer ones are culled, so that a greater tolerance would draw more.
fn is_visible(evaluator: &LodEvaluator, node: Node, containment: Containment) -> bool {
    match containment {
        Containment::Outside => false,
        Containment::Inside => true,
        Containment::Crossing => {
            node.level == 0
                || (0u32..)
                    .zip(evaluator.contained_in(node))
                    .any(|(quadrant, containment)| is_visible(evaluator, node.child(quadrant), containment))
        }
    }
}

/// Multiplicative hash of node ids.
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
