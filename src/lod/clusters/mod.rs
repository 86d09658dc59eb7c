//! Symmetric cluster sets: a quadtree of blocks, drawn as a few batches of at most 23 kinds.
//!
//! Based on J. Judnich and N. Ling, "Symmetric Cluster Set Level of Detail for Real-Time Terrain Rendering" (2012). A
//! leaf of the quadtree is a block of n × n cells. A node and the two levels below it form a cluster; each of its
//! quadrants is empty, a block, or 2 × 2 blocks. These are 80 states, of which 23 differ under quarter turns. Each is a
//! range of indices into one grid of vertices that the height texture displaces. A quarter turn exchanges integer
//! coordinates on the lattice.
//!
//! Differences from the paper:
//! - Level 0 is the finest, as everywhere in this crate.
//! - The 23 kinds are 23 instanced draws in one indirect submission, instead of one draw per cluster (variant
//!   `draw-per-cluster`). With `gpu-driven` the device selects the clusters. The baseline `draw-per-block` draws the
//!   same triangles with one draw per block.
//! - Under the metric `certified` the error is a bound; that of eq. 1 is not one off the view axis.
//! - Neighbours are within one level of each other, and a side that meets a coarser block snaps to its edge. No skirts
//!   are needed. `seams=skirts` is as published except for the skirts' depth, which follows from the errors of both
//!   sides and is 0 where they do not differ.
//! - With `morph=on` the blocks in a node morph into it by eq. 3 and 4. Each quadrant has a weight v: α = ½ (1 − v) for
//!   a quadrant of one block, α = ½ + ½ (1 − v) for one of four. Sides have their own weights, those of the coarser of
//!   their two blocks, so that both agree (not with skirts).
//! - With `morph=distance` every vertex has a weight by its own distance, so edges agree by construction. The errors
//!   are then those of whole levels (module `morph_ranges`), and finer levels extend further than needed at most
//!   places.
//! - A block that extends beyond the field does not morph, because the field's edge is not a vertex of the next level.
//!
//! Invariants: watertight (with skirts: every gap is hidden by one); the field is covered once; error within tolerance
//! (`error=measured`); no state between views.

mod collapse;
mod gpu_selection;
pub mod layout;
mod lod_evaluator;
pub mod mesh;
mod morph_ranges;
mod refine;
mod skirts;
pub mod states;
mod tree;

use std::sync::Arc;

use self::collapse::Collapse;
use self::lod_evaluator::LodEvaluator;
use self::mesh::Mesh;
use self::refine::Refinement;
use self::skirts::Skirts;
use self::states::{MAX_SEEDS, Seeds};
use self::tree::Tree;
use super::entry::{Entry, Variant};
use super::settings::{Need, Setting, Settings, Values};
use super::technique::{Diagnostics, SelectOnGpu, Technique};
use super::within_limits::select_within_limits;
use crate::draw::{
    Draw, DrawList, Geometry, GpuSelection, Instance, Limits, Morph, PipelineRequirements, Seams, Source, Submission,
    Topology,
};
use crate::height::bounds::Measure;
use crate::height::{Field, MAX_SIDE};
use crate::view::View;

/// End of the morph band: blocks start to morph where the allowed error reaches their parent's, and have morphed at
/// this multiple of it. A wider band draws finer levels for longer, a narrower one is noticeable.
const MORPH_RATIO: f32 = 1.3;

/// Maximum number of blocks drawn, for which buffers are allocated. The tolerance is scaled until they suffice.
const MAX_BLOCKS: usize = 1 << 16;

/// Row of [`super::TECHNIQUES`].
pub const ENTRY: Entry = Entry {
    name: "clusters",
    about: "quadtree of blocks, drawn as clusters of 23 kinds and their rotations",
    paper: "Judnich & Ling 2012",
    variants: &[
        Variant { name: "draw-per-block", about: "one recorded draw per block: the paper's baseline, CLOD" },
        Variant { name: "draw-per-cluster", about: "one recorded draw per cluster, as published" },
        Variant { name: "gpu-driven", about: "the device selects the clusters; constant work on the host" },
    ],
    settings: &[
        Setting {
            key: "block",
            values: Values::Words(&["8", "16", "32", "64", "128"]),
            default: "32",
            about: "cells along a side of a block",
        },
        Setting {
            key: "error",
            values: Values::Words(&["measured", "halved"]),
            default: "measured",
            about: "error of a block: measured against the samples, or half its parent's (eq. 2)",
        },
        Setting {
            key: "morph",
            values: Values::Words(&["off", "on", "distance"]),
            default: "off",
            about: "off: blocks change at once; on: they morph into their parent; distance: each vertex by its distance (no skirts)",
        },
        Setting {
            key: "seams",
            values: Values::Words(&["stitched", "skirts"]),
            default: "stitched",
            about: "borders between blocks: stitched to common edges, or hidden by skirts, as published",
        },
    ],
    // Vertices that morph by distance always share their edges.
    needs: &[Need { key: "seams", other: "morph", words: &["off", "on"] }],
    max_samples: u64::MAX,
    max_side: MAX_SIDE,
    takes_endless: false,
    build: |field, settings| Box::new(Clusters::new(&field, settings)),
};

/// Submission of clusters to the device.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Mode {
    DrawPerBlock,
    DrawPerCluster,
    Indirect,
    GpuDriven,
}

/// Morph of blocks into their parent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Morphing {
    /// None: at once.
    Off,
    /// Per block, by its parent's error.
    Blocks,
    /// Per vertex, by its distance.
    Vertices,
}

struct Clusters {
    /// Maximum number of clusters, or blocks, in a list.
    max_drawn: usize,
    gpu_selection: Option<GpuSelection>,
    tree: Tree,
    seeds: Seeds,
    mesh: Mesh,
    refinement: Refinement,
    mode: Mode,
    cells: u32,
    morph: Morphing,
    seams: Seams,
    measured: bool,
    /// Seed and instance of each cluster to draw.
    drawn: Vec<(u32, Instance)>,
}

impl Clusters {
    fn new(field: &Arc<Field>, settings: &Settings) -> Self {
        let cells = settings.number("block") as u32;
        let morph = match settings.word("morph") {
            "off" => Morphing::Off,
            "on" => Morphing::Blocks,
            _ => Morphing::Vertices,
        };
        let is_skirted = settings.word("seams") == "skirts" && morph != Morphing::Vertices;
        let seams = if is_skirted { Seams::Skirts } else { Seams::Shared };
        let measured = settings.word("error") == "measured";
        let mode = match settings.variant() {
            Some("draw-per-block") => Mode::DrawPerBlock,
            Some("draw-per-cluster") => Mode::DrawPerCluster,
            Some("gpu-driven") => Mode::GpuDriven,
            _ => Mode::Indirect,
        };
        // Slightly above the band's width, so that rounding never puts two nodes over one place into their bands.
        let growth = if morph == Morphing::Blocks { MORPH_RATIO * 1.001 } else { 1.0 };
        let measure = Measure { cells, growth, errors: measured, morph: morph == Morphing::Blocks };
        let tree = Tree::new(field, measure, morph == Morphing::Vertices, &settings.progress);
        let seeds = Seeds::new(mode == Mode::DrawPerBlock);
        let mesh = Mesh::new(cells as i32, &seeds.states, seams);
        // A quadtree has at most three more leaves per split node.
        let max_splits = (1..=tree.root().level).map(|level| tree.nodes(level)).sum::<usize>().min(MAX_BLOCKS / 3);
        let max_drawn = match mode {
            Mode::DrawPerBlock => tree.nodes(0).min(3 * max_splits + 1),
            // Each split node draws at most one cluster; a lone root is one too.
            _ => max_splits.max(1),
        };
        let selects_on_gpu = mode == Mode::GpuDriven;
        let gpu_selection = selects_on_gpu
            .then(|| gpu_selection::gpu_selection(&tree, cells, seams, &seeds, &mesh, max_splits))
            .flatten();
        let (refinement, drawn) = (Refinement::new(max_splits), Vec::new());
        Self { max_drawn, gpu_selection, tree, seeds, mesh, refinement, mode, cells, morph, seams, measured, drawn }
    }

    /// Refines the quadtree under the first tolerance at which the blocks fit, and collects its clusters. Returns the
    /// tolerance's scale.
    fn collapse(&mut self, view: &View) -> f64 {
        let (evaluator, tolerance_scale) = select_within_limits(view, |wider| {
            let evaluator = evaluator(&self.tree, self.morph, wider);
            self.refinement.refine(&evaluator).then_some(evaluator)
        });
        let (refinement, seeds, single) = (&self.refinement, &self.seeds, self.mode == Mode::DrawPerBlock);
        let skirts = (self.seams == Seams::Skirts).then(|| Skirts::new(&evaluator, refinement));
        self.drawn.clear();
        Collapse { evaluator: &evaluator, refinement, seeds, cells: self.cells, single, skirts }.run(&mut self.drawn);
        tolerance_scale
    }

    /// Appends one draw for each kind of cluster that occurs.
    fn draw_instanced(&self, list: &mut DrawList) {
        let mut ends = [0u32; MAX_SEEDS + 1];
        self.drawn.iter().for_each(|&(seed, _)| ends[seed as usize + 1] += 1);
        (1..ends.len()).for_each(|seed| ends[seed] += ends[seed - 1]);
        let mut next = ends;
        list.instances.resize(self.drawn.len(), Instance::default());
        for &(seed, instance) in &self.drawn {
            let place = &mut next[seed as usize];
            list.instances[*place as usize] = Instance { batch: *place, ..instance };
            *place += 1;
        }
        for (seed, instances) in ends.windows(2).enumerate().filter(|(_, ends)| ends[0] < ends[1]) {
            self.push(list, seed, instances[0]..instances[1]);
        }
    }

    /// Appends one draw for each cluster or block, as published.
    fn draw_each(&self, list: &mut DrawList) {
        list.submission = Submission::Direct;
        for (batch, &(seed, instance)) in (0u32..).zip(&self.drawn) {
            list.instances.push(Instance { batch, ..instance });
            self.push(list, seed as usize, batch..batch + 1);
        }
    }

    fn push(&self, list: &mut DrawList, seed: usize, instances: std::ops::Range<u32>) {
        let indices = self.mesh.ranges[seed].clone();
        list.draws.push(Draw {
            source: Source::Lattice,
            topology: Topology::Triangles,
            indices,
            instances,
            first_vertex: 0,
        });
    }
}

fn evaluator<'a>(tree: &'a Tree, morph: Morphing, view: &View) -> LodEvaluator<'a> {
    match morph {
        Morphing::Off => LodEvaluator::new(tree, view, 1.0, true),
        Morphing::Blocks => LodEvaluator::new(tree, view, MORPH_RATIO, false),
        Morphing::Vertices => LodEvaluator::by_distance(tree, view),
    }
}

impl Technique for Clusters {
    fn resident(&self) -> &Geometry {
        &self.mesh.geometry
    }

    fn limits(&self) -> Limits {
        let is_instanced = matches!(self.mode, Mode::Indirect | Mode::GpuDriven);
        let draws = if is_instanced { self.mesh.ranges.len() } else { self.max_drawn };
        Limits { draws, instances: self.max_drawn, ..Limits::default() }
    }

    fn select(&mut self, view: &View, list: &mut DrawList) {
        list.tolerance_scale = self.collapse(view);
        match self.mode {
            Mode::Indirect | Mode::GpuDriven => self.draw_instanced(list),
            Mode::DrawPerBlock | Mode::DrawPerCluster => self.draw_each(list),
        }
    }

    fn keeps_tolerance(&self) -> bool {
        self.measured
    }

    fn pipeline_requirements(&self) -> PipelineRequirements {
        let morph = match self.morph {
            Morphing::Vertices => Morph::ByDistance,
            // Required without morphing too, because sides that meet a coarser block snap to its edge.
            Morphing::Off | Morphing::Blocks => Morph::ByInstance,
        };
        PipelineRequirements { morph, seams: self.seams, ..PipelineRequirements::default() }
    }

    fn on_gpu(&self) -> Option<&dyn SelectOnGpu> {
        self.gpu_selection.is_some().then_some(self as _)
    }

    fn diagnostics(&self) -> Option<&dyn Diagnostics> {
        Some(self)
    }
}

impl SelectOnGpu for Clusters {
    fn selection(&self) -> &GpuSelection {
        self.gpu_selection.as_ref().expect("only techniques with a selection say so")
    }

    fn parameters(&self, view: &View, words: &mut Vec<u32>) {
        let evaluator = evaluator(&self.tree, self.morph, view);
        words.extend_from_slice(bytemuck::cast_slice(bytemuck::bytes_of(&evaluator.view)));
        words.extend(evaluator.ranges.ranges.map(f32::to_bits));
    }
}

impl Diagnostics for Clusters {
    fn stats(&self) -> Vec<(&'static str, f64, &'static str)> {
        vec![
            ("kinds of clusters", self.mesh.ranges.len() as f64, ""),
            ("index bytes", size_of_val(self.mesh.geometry.indices.as_slice()) as f64, "B"),
            ("vertex bytes", size_of_val(self.mesh.geometry.lattice.as_slice()) as f64, "B"),
            ("bytes of ranges and errors", self.tree.bytes() as f64, "B"),
        ]
    }
}
