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

use super::tree::{Known, Node, Tree, ratio};
use crate::draw::weights::ONE;
use crate::view::{Allowance, Containment, Frustum};

/// A node that is split.
#[derive(Clone, Copy, Debug)]
struct Split {
    at: [u32; 2],
    ratio: f64,
}

/// The split nodes of a view.
pub struct Refinement {
    /// The end of the band that begins at 1.
    end: f64,
    /// The most nodes that may be split.
    most: usize,
    count: usize,
    /// By level.
    splits: Vec<Vec<Split>>,
    index: HashMap<Node, u32, BuildHasherDefault<NodeHasher>>,
}

/// What a refinement is made from.
#[derive(Clone, Copy)]
pub struct Sight<'a> {
    /// The quadtree.
    pub tree: &'a Tree,
    /// The view's tolerance.
    pub allowance: &'a Allowance,
    /// Nodes outside it are left as they are; `None`: none are, so that no turn of the eye changes what is seen.
    pub frustum: Option<&'a Frustum>,
}

impl Refinement {
    /// With a band from 1 to `end`, and at most `most` split nodes.
    pub fn new(end: f64, most: usize) -> Self {
        Self { end, most, count: 0, splits: Vec::new(), index: HashMap::default() }
    }

    /// Finds the split nodes of a view. `false` if there would be too many.
    pub fn refine(&mut self, sight: &Sight) -> bool {
        let root = sight.tree.root();
        self.splits.resize_with(root.level as usize + 1, Vec::new);
        self.splits.iter_mut().for_each(Vec::clear);
        self.index.clear();
        self.count = 0;
        self.descend(sight, root, sight.frustum.is_none());
        for level in 1..root.level {
            for k in 0..self.splits[level as usize].len() {
                let Split { at, ratio } = self.splits[level as usize][k];
                self.restrict(sight, Node { level, at }, ratio);
            }
        }
        self.count <= self.most
    }

    fn descend(&mut self, sight: &Sight, node: Node, inside: bool) {
        if node.level == 0 || self.count > self.most || !sight.tree.contains(node) {
            return;
        }
        let Some(known) = sight.tree.known(node) else { return };
        let inside = inside
            || match sight.frustum.map(|frustum| frustum.contains(&known.bounds)) {
                Some(Containment::Outside) => return,
                Some(Containment::Crossing) => false,
                Some(Containment::Inside) | None => true,
            };
        let ratio = ratio(sight.allowance, &known);
        if ratio >= self.end {
            return;
        }
        self.insert(node, ratio);
        (0..4).for_each(|quadrant| self.descend(sight, node.child(quadrant), inside));
    }

    fn insert(&mut self, node: Node, ratio: f64) {
        let splits = &mut self.splits[node.level as usize];
        self.count += 1;
        self.index.insert(node, splits.len() as u32);
        splits.push(Split { at: node.at, ratio });
    }

    /// Keeps the coarser neighbours on a node's own outer sides within a level of it.
    fn restrict(&mut self, sight: &Sight, node: Node, ratio: f64) {
        for axis in 0..2 {
            // The first child's outer side is the first side.
            let side = axis + 2 * (node.at[axis] & 1) as usize;
            let Some(beyond) = node.beyond(side) else { continue };
            let coarser = beyond.parent();
            if let Some(&k) = self.index.get(&coarser) {
                let split = &mut self.splits[coarser.level as usize][k as usize];
                split.ratio = split.ratio.min(ratio);
            } else if sight.draws(coarser) {
                self.insert(coarser, ratio);
            }
        }
    }

    /// How far the blocks in a split node have gone over into it, below [`ONE`]; `None` if it is not split. Where
    /// a node sticks out of the field midpoints are none, so there they stay.
    pub fn weight(&self, tree: &Tree, node: Node) -> Option<u32> {
        let k = *self.index.get(&node)?;
        let ratio = self.splits[node.level as usize][k as usize].ratio;
        let part = ((ratio - 1.0) / (self.end - 1.0)).clamp(0.0, 1.0);
        let stays = self.end == 1.0 || tree.is_partial(node);
        Some(if stays { 0 } else { ((part * f64::from(ONE)) as u32).min(ONE - 1) })
    }

    /// The weight of a side of a split node, the greater of its two nodes': from [`ONE`] on the other one is not
    /// split, and `ONE` stands for its own level. Where nothing is drawn beyond, the node's own.
    pub fn side_weight(&self, sight: &Sight, node: Node, side: usize) -> u32 {
        let own = self.weight(sight.tree, node).unwrap_or(0);
        let Some(beyond) = node.beyond(side) else { return own };
        match self.weight(sight.tree, beyond) {
            Some(weight) => own.max(weight),
            None if !sight.draws(beyond) => own,
            None => ONE + self.weight(sight.tree, beyond.parent()).unwrap_or(0),
        }
    }
}

impl Sight<'_> {
    /// Whether a node has land, in sight if that matters.
    pub fn draws(&self, node: Node) -> bool {
        let in_sight =
            |known: Known| self.frustum.is_none_or(|frustum| frustum.contains(&known.bounds) != Containment::Outside);
        self.tree.contains(node) && self.tree.known(node).is_some_and(in_sight)
    }
}

/// A multiplication a word: nodes are few and small.
#[derive(Clone, Copy, Default)]
struct NodeHasher(u64);

impl Hasher for NodeHasher {
    fn finish(&self) -> u64 {
        self.0
    }

    fn write(&mut self, bytes: &[u8]) {
        bytes.iter().for_each(|&byte| self.write_u32(u32::from(byte)));
    }

    fn write_u32(&mut self, word: u32) {
        self.0 = (self.0 ^ u64::from(word)).wrapping_mul(0x9e37_79b9_7f4a_7c15).rotate_left(26);
    }

    fn write_usize(&mut self, word: usize) {
        self.write_u32(word as u32);
    }
}
