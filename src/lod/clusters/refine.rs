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

use super::sight::{Look, Sight};
use super::tree::{Node, Squares, Tree};
use crate::draw::weights::ONE;
use crate::view::Containment;

/// A node that is split.
#[derive(Clone, Copy, Debug)]
pub struct Split {
    /// Which node.
    pub node: Node,
    /// What the tolerance allows over its ε.
    ratio: f32,
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
    most: usize,
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
    /// With at most `most` split nodes.
    pub fn new(most: usize) -> Self {
        let (splits, levels, index, squares) = (Vec::new(), Vec::new(), HashMap::default(), Vec::new());
        Self { most, splits, levels, index, squares, root: Found::Nothing }
    }

    /// Finds the split nodes of a view. `false` if there would be too many.
    pub fn refine(&mut self, sight: &Sight) -> bool {
        let root = sight.tree.root();
        self.levels.resize_with(root.level as usize + 1, Vec::new);
        self.levels.iter_mut().for_each(Vec::clear);
        self.splits.clear();
        self.index.clear();
        self.descend(sight);
        for level in 1..root.level as usize {
            for k in 0..self.levels[level].len() {
                let Split { node, ratio, .. } = self.splits[self.levels[level][k] as usize];
                self.restrict(sight, node, ratio);
            }
        }
        self.splits.len() <= self.most
    }

    /// Splits what has to be, level by level.
    fn descend(&mut self, sight: &Sight) {
        let root = sight.tree.root();
        self.root = self.found(sight, root, sight.look(root));
        for level in (1..=root.level as usize).rev() {
            // All of a level before any is looked at: what is far away in memory comes at the same time.
            self.squares.clear();
            let nodes = self.levels[level].iter().map(|&k| self.splits[k as usize].node);
            self.squares.extend(nodes.map(|node| sight.tree.squares(node)));
            for n in 0..self.levels[level].len() {
                self.look_into(sight, self.levels[level][n], self.squares[n]);
            }
        }
    }

    fn look_into(&mut self, sight: &Sight, k: u32, squares: Squares) {
        let Split { node, containment, .. } = self.splits[k as usize];
        for (quadrant, look) in sight.look_in(node, containment, &squares).into_iter().enumerate() {
            let found = self.found(sight, node.child(quadrant as u32), look);
            self.splits[k as usize].hold(quadrant, found);
        }
    }

    /// What a node is that was looked at.
    fn found(&mut self, sight: &Sight, node: Node, look: Look) -> Found {
        let Some((containment, ratio)) = look else { return Found::Nothing };
        if containment == Containment::Outside && sight.view.culls != 0 {
            return Found::Nothing;
        }
        if ratio >= sight.view.band_end || self.splits.len() > self.most {
            return block(is_in_sight(sight, node, containment));
        }
        Found::Split(self.insert(sight, node, ratio, containment))
    }

    fn insert(&mut self, sight: &Sight, node: Node, ratio: f32, containment: Containment) -> u32 {
        let k = self.splits.len() as u32;
        if let Some(id) = node.id(sight.tree.root()) {
            self.index.insert(id, k);
        }
        self.levels[node.level as usize].push(k);
        self.splits.push(Split { node, ratio, containment, blocks: 0, children: [None; 4] });
        k
    }

    /// Keeps the coarser neighbours on a node's own outer sides within a level of it.
    fn restrict(&mut self, sight: &Sight, node: Node, ratio: f32) {
        for axis in 0..2 {
            // The first child's outer side is the first side.
            let side = axis + 2 * (node.at[axis] & 1) as usize;
            let Some(beyond) = node.beyond(side) else { continue };
            let coarser = beyond.parent();
            if let Some(k) = self.find(sight.tree, coarser) {
                let split = &mut self.splits[k as usize];
                split.ratio = split.ratio.min(ratio);
            } else if sight.draws(coarser) {
                self.split_leaf(sight, coarser, ratio);
            }
        }
    }

    /// Splits a node that was a leaf, or in one.
    fn split_leaf(&mut self, sight: &Sight, node: Node, ratio: f32) {
        let k = self.insert(sight, node, ratio, Containment::Crossing);
        for quadrant in 0..4 {
            let child = node.child(quadrant as u32);
            let found = match self.find(sight.tree, child) {
                Some(place) => Found::Split(place),
                None => block(self.is_leaf_in_sight(sight, child)),
            };
            self.splits[k as usize].hold(quadrant, found);
        }
        // A parent that is split later finds it.
        if let Some(parent) = self.find(sight.tree, node.parent()) {
            self.splits[parent as usize].hold(node.quadrant() as usize, Found::Split(k));
        }
    }

    fn is_leaf_in_sight(&self, sight: &Sight, node: Node) -> bool {
        sight.containment(node).is_some_and(|containment| is_in_sight(sight, node, containment))
    }

    fn find(&self, tree: &Tree, node: Node) -> Option<u32> {
        self.index.get(&node.id(tree.root())?).copied()
    }

    /// How far the blocks in a node have gone over into it, below [`ONE`]; `None` if it is not split.
    pub fn weight(&self, sight: &Sight, node: Node) -> Option<u32> {
        let k = self.find(sight.tree, node)?;
        Some(self.splits[k as usize].weight(sight))
    }

    /// The weight of a side of a split node, the greater of its two nodes': from [`ONE`] on the other one is not
    /// split, and `ONE` stands for its own level. Where nothing is drawn beyond, the node's own.
    pub fn side_weight(&self, sight: &Sight, split: &Split, side: usize) -> u32 {
        let own = split.weight(sight);
        let Some(beyond) = split.node.beyond(side) else { return own };
        match self.weight(sight, beyond) {
            Some(weight) => own.max(weight),
            // Where all of a node is in sight, so is the side that the other one shares with it.
            None if sight.tree.square(beyond).is_none() => own,
            None if split.containment != Containment::Inside && !sight.draws(beyond) => own,
            None if sight.view.band_scale == 0.0 => ONE,
            None => ONE + self.weight(sight, beyond.parent()).unwrap_or(0),
        }
    }
}

impl Split {
    /// How far its blocks have gone over into it, below [`ONE`]. Where a node sticks out of the field midpoints are
    /// none, so there they stay.
    pub fn weight(&self, sight: &Sight) -> u32 {
        if sight.view.band_scale == 0.0 || sight.tree.is_partial(self.node) {
            return 0;
        }
        ((self.ratio - 1.0) * sight.view.band_scale).clamp(0.0, (ONE - 1) as f32) as u32
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
fn is_in_sight(sight: &Sight, node: Node, containment: Containment) -> bool {
    match containment {
        Containment::Outside => false,
        Containment::Inside => true,
        Containment::Crossing => {
            node.level == 0
                || (0u32..)
                    .zip(sight.contained_in(node))
                    .any(|(quadrant, containment)| is_in_sight(sight, node.child(quadrant), containment))
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
