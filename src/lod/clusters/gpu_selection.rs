//! GPU-driven selection: the quadtree as a table, and the sequence of compute shaders.
//!
//! From the root down, level by level, the children of split nodes are tested with one invocation each. From the finest
//! level up, their coarser neighbours are split too. Then each split node determines its cluster, is counted with those
//! of its seed, and writes its instance after theirs. Split nodes are stored in a hash table with open addressing
//! (linear probing, at most half full), which invocations fill by compare and swap. Error margins only ever decrease,
//! so the result does not depend on the order of execution and equals the host's.
//!
//! If there are more split nodes than the table holds, a flag is set and the root is drawn as one block.

use super::layout::{ClusterScratch, ClusterTree, ClusterView};
use super::mesh::Mesh;
use super::morph_ranges::MORPH_RANGES;
use super::states::Seeds;
use super::tree::{Errors, Tree};
use crate::draw::Seams;
use crate::draw::gpu_selection::{GpuSelection, Groups, Step};

const PROGRAMS: &[&str] = &[
    "cluster_refine.comp",
    "cluster_restrict.comp",
    "cluster_blocks.comp",
    "cluster_states.comp",
    "cluster_commands.comp",
    "cluster_instances.comp",
];
const REFINE: usize = 0;
const RESTRICT: usize = 1;
/// Runs once for each split node.
const BLOCKS: usize = 2;
const STATES: usize = 3;
const COMMANDS: usize = 4;
const INSTANCES: usize = 5;

/// Words of a level's row in the scratch buffer, and the offsets of the group counts for the children of its split
/// nodes and for these nodes; as in `shaders/cluster_splits.glsl`.
const ROW: u32 = 8;
const CHILDREN: u32 = 1;
const NODES: u32 = 4;

/// Maximum number of levels, so that the ids of nodes that may be split fit one word.
const MAX_LEVELS: u32 = 17;

/// Sequential allocator of scratch memory, in words.
struct ScratchLayout(u32);

impl ScratchLayout {
    fn take(&mut self, words: usize) -> u32 {
        let first = self.0;
        self.0 += words as u32;
        first
    }
}

/// Builds the selection for a quadtree, with at most `max` split nodes. `None` if it exceeds what every device
/// supports.
pub fn gpu_selection(
    tree: &Tree,
    cells: u32,
    seams: Seams,
    seeds: &Seeds,
    mesh: &Mesh,
    max: usize,
) -> Option<GpuSelection> {
    let root = tree.root().level;
    if root >= MAX_LEVELS {
        return None;
    }
    let mut scratch = ScratchLayout(0);
    let places = (2 * max).next_power_of_two().max(64);
    let mut head = ClusterTree {
        last: tree.last.map(|n| n as i32),
        period: tree.bounds.period().map(|n| n.unwrap_or(0)),
        cells,
        root,
        skirts: match (seams, &tree.errors) {
            (Seams::Shared, _) => 0,
            (Seams::Skirts, Errors::Halved(_)) => 2,
            (Seams::Skirts, _) => 1,
        },
        max_splits: max as u32,
        places: places as u32,
        seeds: mesh.ranges.len() as u32,
        rows: scratch.take(ROW as usize * (root as usize + 1)),
        counts: scratch.take(2 * mesh.ranges.len()),
        list: scratch.take(max),
        clusters: scratch.take(2 * max),
        keys: scratch.take(places),
        error_margins: scratch.take(places),
        blocks: scratch.take(places),
        ..ClusterTree::default()
    };
    let table = table(tree, seeds, mesh, &mut head, &mut scratch);
    let gpu_selection = GpuSelection {
        programs: PROGRAMS,
        table,
        parameters: size_of::<ClusterView>() / 4 + MORPH_RANGES,
        scratch: HEAD + scratch.0 as usize,
        steps: steps(&head),
        draws: mesh.ranges.len(),
        instances: max.max(1),
    };
    gpu_selection.fits().then_some(gpu_selection)
}

/// Words before the scratch buffer's allocated part.
const HEAD: usize = size_of::<ClusterScratch>() / 4;

/// Returns the table: header, levels, states, index ranges and squares. Allocates scratch memory for the split nodes of
/// each level.
fn table(tree: &Tree, seeds: &Seeds, mesh: &Mesh, head: &mut ClusterTree, scratch: &mut ScratchLayout) -> Vec<u32> {
    let mut levels: Vec<u32> = Vec::new();
    let mut squares: Vec<u32> = Vec::new();
    head.states = 5 * (head.root + 1);
    head.ranges = head.states + 81;
    let before = head.ranges + 2 * head.seeds;
    // Devices need not support infinities.
    let finite = |metres: f32| metres.clamp(f32::MIN, f32::MAX).to_bits();
    for level in 0..=head.root {
        let ([x, z], held) = tree.bounds.held(level);
        let max = if level == 0 { 0 } else { tree.nodes(level).min(head.max_splits as usize) };
        levels.extend([before + squares.len() as u32, x, z, scratch.take(max), finite(tree.bounds.cut(level))]);
        squares.extend(held.iter().flat_map(|square| {
            let [low, high] = square.range.map(finite);
            [tree.error(level, square.error).to_bits(), low, high]
        }));
    }
    let states = seeds.all().map(|(seed, rotation)| u32::from(seed) | u32::from(rotation) << 8);
    let ranges = mesh.ranges.iter().flat_map(|range| [range.start, range.end - range.start]);
    let head: &[u32] = bytemuck::cast_slice(bytemuck::bytes_of(head));
    head.iter().copied().chain(levels).chain(states).chain(ranges).chain(squares).collect()
}

fn steps(head: &ClusterTree) -> Vec<Step> {
    let words = |first: u32, count: u32| HEAD + first as usize..HEAD + (first + count) as usize;
    let row = |level: u32, word: u32| Groups::Counted(HEAD + (head.rows + ROW * level + word) as usize);
    let run = |program, groups, argument| Step::Run { program, groups, argument };
    let all = Groups::Counted(std::mem::offset_of!(ClusterScratch, groups) / 4);
    let mut steps = vec![
        Step::Fill(0..HEAD + head.list as usize, 0),
        Step::Fill(words(head.keys, head.places), 0),
        Step::Fill(words(head.error_margins, head.places), u32::MAX),
        run(REFINE, Groups::One, head.root),
    ];
    steps.extend((1..head.root).rev().map(|level| run(REFINE, row(level + 1, CHILDREN), level)));
    steps.extend((1..head.root).map(|level| run(RESTRICT, row(level, NODES), level)));
    steps.extend([(BLOCKS, all), (STATES, all), (COMMANDS, Groups::One), (INSTANCES, all)].map(|(p, n)| run(p, n, 0)));
    steps
}
