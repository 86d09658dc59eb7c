//! From the split nodes of the quadtree to clusters, in one pass.

use super::refine::{Found, Refinement, Split};
use super::sight::Sight;
use super::skirts::Skirts;
use super::states::{Seeds, State};
use super::tree::{Node, SIDES};
use crate::draw::weights::{self, FINER, ONE, STITCHED};
use crate::draw::{self, Instance};

/// What a quadrant of a cluster holds.
const NOTHING: u8 = 0;
const BLOCK: u8 = 1;
const FOUR_BLOCKS: u8 = 2;

/// The seam between two quadrants: its byte, the quadrants, and on which side of the first the second lies.
const SEAMS: [(u32, [u32; 2], usize); 4] = [(0, [0, 1], 2), (1, [2, 3], 2), (2, [0, 2], 3), (3, [1, 3], 3)];

/// The pass over a refined quadtree.
pub struct Collapse<'a> {
    /// What the refinement was made from.
    pub sight: &'a Sight<'a>,
    /// The split nodes.
    pub refinement: &'a Refinement,
    /// The clusters.
    pub seeds: &'a Seeds,
    /// Cells along a side of a block.
    pub cells: u32,
    /// Whether each block is an instance of its own.
    pub single: bool,
    /// The skirts, if blocks have them.
    pub skirts: Option<Skirts<'a>>,
}

impl Collapse<'_> {
    /// Appends the clusters in sight: seed and instance.
    pub fn run(&self, drawn: &mut Vec<(u32, Instance)>) {
        if self.refinement.root == Found::Block {
            // A lone block is a quadrant of a parent that is not there.
            drawn.push((0, self.block(self.sight.tree.root())));
        }
        for split in &self.refinement.splits {
            if self.single {
                let blocks = (0..4).filter(|quadrant| split.blocks >> quadrant & 1 == 1);
                drawn.extend(blocks.map(|quadrant| (0, self.block(split.node.child(quadrant)))));
            } else {
                self.push_cluster(split, drawn);
            }
        }
    }

    /// What the quadrants of a split node hold that it draws itself: four blocks it leaves to its parent.
    fn state(&self, split: &Split) -> State {
        const ALL: u32 = 0b1111;
        if split.blocks == ALL && split.node != self.sight.tree.root() {
            return [NOTHING; 4];
        }
        let holds = |quadrant: usize| match split.children[quadrant] {
            _ if split.blocks >> quadrant & 1 == 1 => BLOCK,
            Some(child) if self.refinement.splits[child as usize].blocks == ALL => FOUR_BLOCKS,
            _ => NOTHING,
        };
        [holds(0), holds(1), holds(2), holds(3)]
    }

    fn push_cluster(&self, split: &Split, drawn: &mut Vec<(u32, Instance)>) {
        let (node, state) = (split.node, self.state(split));
        if state == [NOTHING; 4] {
            return;
        }
        let (seed, turns) = self.seeds.of(state);
        let level = node.level - 1;
        let instance = match &self.skirts {
            Some(skirts) => Instance { turns, ..self.skirted(skirts, node, level, blocks(node, state)) },
            None => {
                let weights = self.weights(node, state);
                Instance { turns, cells: 4 * self.cells, weights, ..self.placed(node, level) }
            }
        };
        drawn.push((seed as u32, instance));
    }

    /// A block by itself: the first quadrant of a cluster, as if the cluster ended with it.
    fn block(&self, node: Node) -> Instance {
        let parent = node.parent();
        if let Some(skirts) = &self.skirts {
            return self.skirted(skirts, node, node.level, std::iter::once((0, node)));
        }
        let weight = |node| self.refinement.weight(self.sight, node).unwrap_or(0);
        let inside = if node == self.sight.tree.root() { 0 } else { weight(parent) };
        let side = |side: usize| {
            let sibling = node.beyond(side).is_some_and(|beyond| beyond.parent() == parent);
            let root = node == self.sight.tree.root();
            if sibling || root { inside } else { self.refinement.side_weight(self.sight, parent, side) }
        };
        let weights = weights::uniform(inside, SIDES.map(side));
        Instance { cells: 2 * self.cells, weights, ..self.placed(node, node.level) }
    }

    /// Blocks at a node, each in a quadrant, with their skirts. Quadrants have weights of their own alone: one of blocks
    /// of weight v is the paper's α = ½ (1 − v), and α = ½ + ½ (1 − v) if there are four in it.
    fn skirted(&self, skirts: &Skirts, node: Node, level: u32, blocks: impl Iterator<Item = (u32, Node)>) -> Instance {
        let cells = draw::skirts::cells(2 * self.cells);
        Instance { cells, weights: skirts.weights(level, blocks), ..self.placed(node, level) }
    }

    /// An instance at a node's first vertex, two mesh units a cell of a level.
    fn placed(&self, node: Node, level: u32) -> Instance {
        let [x, z] = self.sight.tree.first(node);
        let origin = [x as i32, z as i32];
        Instance { origin, level, shift: level as i32 - 1, ..Instance::default() }
    }

    /// The weights of a cluster in a node. Blocks go over into their parent: that of a single one is the cluster's
    /// node, that of four is their quadrant.
    fn weights(&self, node: Node, state: State) -> [u32; 4] {
        let mut weights = [0; 4];
        let weight = |node| self.refinement.weight(self.sight, node).unwrap_or(0);
        for quadrant in (0..4).filter(|&quadrant| state[quadrant as usize] != NOTHING) {
            let fine = state[quadrant as usize] == FOUR_BLOCKS;
            let parent = if fine { node.child(quadrant) } else { node };
            let finer = if fine { FINER } else { 0 };
            weights::set(&mut weights, weights::inside(quadrant as usize), weight(parent) | finer);
            for (slot, side) in outer_sides(quadrant) {
                weights::set(&mut weights, slot, self.refinement.side_weight(self.sight, parent, side));
            }
        }
        for (byte, [first, second], side) in SEAMS {
            weights::set(&mut weights, (3, byte), self.seam_weight(node, state, [first, second], side));
        }
        weights
    }

    /// The weight between two quadrants: beside one of four blocks that of its side.
    fn seam_weight(&self, node: Node, state: State, quadrants: [u32; 2], side: usize) -> u32 {
        let fine = |k: usize| state[quadrants[k] as usize] == FOUR_BLOCKS;
        let weight = match (fine(0), fine(1)) {
            (true, _) => self.refinement.side_weight(self.sight, node.child(quadrants[0]), side),
            (_, true) => self.refinement.side_weight(self.sight, node.child(quadrants[1]), side ^ 2),
            _ => self.refinement.weight(self.sight, node).unwrap_or(0),
        };
        if weight < ONE { weight } else { STITCHED }
    }
}

/// The blocks of a state in a node, each with its quadrant.
fn blocks(node: Node, state: State) -> impl Iterator<Item = (u32, Node)> {
    (0..4).flat_map(move |quadrant| {
        let (child, what) = (node.child(quadrant), state[quadrant as usize]);
        let count = [0, 1, 4][usize::from(what)];
        (0..count).map(move |k| (quadrant, if what == BLOCK { child } else { child.child(k) }))
    })
}

/// The halves of outer sides that a quadrant has: slot and side.
fn outer_sides(quadrant: u32) -> [(weights::Slot, usize); 2] {
    let [right, lower] = [quadrant & 1, quadrant >> 1];
    [((1 + right as usize, lower), 2 * right as usize), ((1 + lower as usize, 2 + right), 1 + 2 * lower as usize)]
}
