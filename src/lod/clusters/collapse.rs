//! Converts the split nodes of the quadtree to clusters, in one pass.

use super::lod_evaluator::LodEvaluator;
use super::refine::{Found, Refinement, Split};
use super::skirts::Skirts;
use super::states::{Seeds, State};
use super::tree::{Node, SIDES};
use crate::draw::layout::{FIRST_SIDE, LAST_SIDE, SEAM};
use crate::draw::weights::{FINER, ONE, STITCHED, Slot, SlotWeights};
use crate::draw::{self, Instance};

/// Contents of a quadrant of a cluster.
const NOTHING: u8 = 0;
const BLOCK: u8 = 1;
const FOUR_BLOCKS: u8 = 2;

/// Seams between two quadrants: the byte, the quadrants, and the side of the first at which the second lies.
const SEAMS: [(u32, [u32; 2], usize); 4] = [(0, [0, 1], 2), (1, [2, 3], 2), (2, [0, 2], 3), (3, [1, 3], 3)];

/// Inputs of the pass over a refined quadtree.
pub struct Collapse<'a> {
    /// Evaluator that the refinement was computed with.
    pub evaluator: &'a LodEvaluator<'a>,
    /// Split nodes.
    pub refinement: &'a Refinement,
    /// Kinds of clusters.
    pub seeds: &'a Seeds,
    /// Cells along a side of a block.
    pub cells: u32,
    /// True if each block is its own instance.
    pub single: bool,
    /// Skirts, if blocks have them.
    pub skirts: Option<Skirts<'a>>,
}

impl Collapse<'_> {
    /// Appends the visible clusters: seed and instance.
    pub fn run(&self, drawn: &mut Vec<(u32, Instance)>) {
        if self.refinement.root == Found::Block {
            // A lone block is the first quadrant of a parent that does not exist.
            drawn.push((0, self.lone_block(self.evaluator.tree.root())));
        }
        for split in &self.refinement.splits {
            if self.single {
                let blocks = (0..4).filter(|quadrant| split.blocks >> quadrant & 1 == 1);
                drawn.extend(blocks.map(|quadrant| (0, self.block_in(split, split.node.child(quadrant)))));
            } else {
                self.push_cluster(split, drawn);
            }
        }
    }

    /// Returns the contents of the quadrants that a split node draws itself. A node of four blocks is drawn by its
    /// parent.
    fn state(&self, split: &Split) -> State {
        const ALL: u32 = 0b1111;
        if split.blocks == ALL && split.node != self.evaluator.tree.root() {
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
        let (seed, rotation) = self.seeds.of(state);
        let level = node.level - 1;
        let instance = match &self.skirts {
            Some(skirts) => Instance { rotation, ..self.skirted(skirts, node, level, blocks(node, state)) },
            None => {
                let instance = Instance { rotation, cells: 4 * self.cells, ..self.placed(node, level) };
                match self.evaluator.is_by_distance() {
                    true => instance.with_weights(self.evaluator.ranges.weights(level, 0, finer(state))),
                    false => instance.with_weights(self.weights(split, state)),
                }
            }
        };
        drawn.push((seed as u32, instance));
    }

    /// Returns the instance of a lone root block: the first quadrant of a parent that does not exist.
    fn lone_block(&self, root: Node) -> Instance {
        match &self.skirts {
            Some(skirts) => self.skirted(skirts, root, root.level, std::iter::once((0, root))),
            None => {
                let instance = Instance { cells: 2 * self.cells, ..self.placed(root, root.level) };
                match self.evaluator.is_by_distance() {
                    true => instance.with_weights(self.evaluator.ranges.weights(root.level, 0, 0)),
                    false => instance,
                }
            }
        }
    }

    /// Returns the instance of a single block of a split node: the first quadrant of a cluster that ends with it.
    fn block_in(&self, split: &Split, node: Node) -> Instance {
        if let Some(skirts) = &self.skirts {
            return self.skirted(skirts, node, node.level, std::iter::once((0, node)));
        }
        let is_sibling = |side: usize| node.beyond(side).is_some_and(|beyond| beyond.parent() == split.node);
        let inside = split.weight(self.evaluator);
        let side = |side: usize| {
            if is_sibling(side) { inside } else { self.refinement.side_weight(self.evaluator, split, side) }
        };
        let instance = Instance { cells: 2 * self.cells, ..self.placed(node, node.level) };
        if self.evaluator.is_by_distance() {
            let staying = SIDES.map(|side| u32::from(is_sibling(side)) << side).iter().sum();
            return instance.with_weights(self.evaluator.ranges.weights(node.level, staying, 0));
        }
        instance.with_weights(SlotWeights::uniform(inside, SIDES.map(side)))
    }

    /// Returns the instance of blocks at a node, each in a quadrant, with their skirts. Only quadrants have weights: a
    /// quadrant of one block of weight v is the paper's α = ½ (1 − v), one of four is α = ½ + ½ (1 − v).
    fn skirted(&self, skirts: &Skirts, node: Node, level: u32, blocks: impl Iterator<Item = (u32, Node)>) -> Instance {
        let cells = draw::skirts::cells(2 * self.cells);
        Instance { cells, ..self.placed(node, level) }.with_weights(skirts.weights(level, blocks))
    }

    /// Returns an instance at a node's first vertex, with two mesh units per cell of a level.
    fn placed(&self, node: Node, level: u32) -> Instance {
        let [x, z] = self.evaluator.tree.first(node);
        let origin = [x as i32, z as i32];
        Instance { origin, level, shift: level as i32 - 1, ..Instance::default() }
    }

    /// Returns the weights of a cluster in a node. Blocks morph into their parent: for a single one the cluster's node,
    /// for four their quadrant.
    fn weights(&self, split: &Split, state: State) -> SlotWeights {
        let mut weights = SlotWeights::default();
        // Sides that two quadrants share are computed once.
        let mut sides = [None; 4];
        for quadrant in (0..4).filter(|&quadrant| state[quadrant as usize] != NOTHING) {
            let fine = self.four_blocks(split, state, quadrant);
            let inside = fine.unwrap_or(split).weight(self.evaluator) | if fine.is_some() { FINER } else { 0 };
            weights.set(Slot::inside(quadrant), inside);
            for (slot, side) in outer_sides(quadrant) {
                let weight = match fine {
                    Some(fine) => self.refinement.side_weight(self.evaluator, fine, side),
                    None => {
                        *sides[side].get_or_insert_with(|| self.refinement.side_weight(self.evaluator, split, side))
                    }
                };
                weights.set(slot, weight);
            }
        }
        for (byte, quadrants, side) in SEAMS {
            weights.set(Slot { line: SEAM, byte }, self.seam_weight(split, state, quadrants, side));
        }
        weights
    }

    /// Returns the split node in a quadrant of four blocks.
    fn four_blocks(&self, split: &Split, state: State, quadrant: u32) -> Option<&Split> {
        let child = split.children[quadrant as usize].filter(|_| state[quadrant as usize] == FOUR_BLOCKS)?;
        Some(&self.refinement.splits[child as usize])
    }

    /// Returns the weight of the seam between two quadrants; beside a quadrant of four blocks it is that of its side.
    fn seam_weight(&self, split: &Split, state: State, quadrants: [u32; 2], side: usize) -> u32 {
        let weight = match quadrants.map(|quadrant| self.four_blocks(split, state, quadrant)) {
            [Some(fine), _] => self.refinement.side_weight(self.evaluator, fine, side),
            [None, Some(fine)] => self.refinement.side_weight(self.evaluator, fine, side ^ 2),
            _ => split.weight(self.evaluator),
        };
        if weight < ONE { weight } else { STITCHED }
    }
}

/// Returns the blocks of a state in a node, each with its quadrant.
fn blocks(node: Node, state: State) -> impl Iterator<Item = (u32, Node)> {
    (0..4).flat_map(move |quadrant| {
        let (child, what) = (node.child(quadrant), state[quadrant as usize]);
        let count = [0, 1, 4][usize::from(what)];
        (0..count).map(move |k| (quadrant, if what == BLOCK { child } else { child.child(k) }))
    })
}

/// Returns the quadrants of a state whose blocks are one level finer, as bits.
fn finer(state: State) -> u32 {
    (0..4).map(|quadrant| u32::from(state[quadrant] == FOUR_BLOCKS) << quadrant).sum()
}

/// Returns the halves of outer sides that belong to a quadrant, as slot and side.
fn outer_sides(quadrant: u32) -> [(Slot, usize); 2] {
    let [right, lower] = [quadrant & 1, quadrant >> 1];
    let slot = |is_last: u32, byte: u32| Slot { line: if is_last == 0 { FIRST_SIDE } else { LAST_SIDE }, byte };
    [(slot(right, lower), 2 * right as usize), (slot(lower, 2 + right), 1 + 2 * lower as usize)]
}
