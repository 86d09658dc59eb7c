//! GeoMipMapping: blocks of one flat mesh that the vertex shader displaces by the height texture.
//!
//! Based on W. H. de Boer, "Fast terrain rendering using geometrical mipmapping" (2000), and A. Tabaković, "3D Terrain
//! with Level of Detail" (ATLOD, 2023). Blocks have (2^n + 1)² vertices and share one flat mesh. Its indices are stored
//! per level as a centre and, per border mask, a border.
//!
//! Differences from ATLOD:
//! - Level 0 is the finest, as everywhere in this crate.
//! - Neighbours are brought within one level by propagation. Distance alone does not ensure that on steep terrain.
//! - Partial blocks at the far edges are drawn, not dropped. Vertices beyond the field collapse onto its edge.
//! - The six border classes of its outlook are the default, its sixteen masks an option. Its levels by distance exist
//!   beside levels by error.
//! - `morph=on` adds the vertex morphing of its outlook. Levels are continuous numbers (see [`levels`]), and a side has
//!   the coarser level of its two blocks. Vertices that the next level lacks move to their places in it.
//! - Blocks are culled by a quadtree and drawn instanced in one indirect call. The variant `draw-per-block` records two
//!   draws for each block.
//!
//! Invariants: watertight; the field is covered once; error within tolerance (`distance=error`); no state between
//! views.

pub mod blocks;
pub mod levels;
mod measure;
pub mod mesh;

use std::sync::Arc;

use self::blocks::Blocks;
use self::levels::{Distance, ONE};
use self::mesh::{BlockMesh, Masks, side};
use super::entry::{Entry, Variant};
use super::settings::{Need, Setting, Settings, Values};
use super::technique::{Diagnostics, Omitted, Technique};
use crate::draw::{
    Draw, DrawList, Geometry, Instance, Limits, Morph, PipelineRequirements, Source, Submission, Topology,
    weights::{self, SlotWeights},
};
use crate::height::{Field, MAX_SIDE};
use crate::view::View;

/// Row of [`super::TECHNIQUES`].
pub const ENTRY: Entry = Entry {
    name: "geomipmap",
    about: "blocks of one flat mesh, level by error or distance, borders stitched by their indices",
    paper: "de Boer 2000; Tabaković 2023 (ATLOD)",
    variants: &[Variant { name: "draw-per-block", about: "two recorded draws per block, as published" }],
    settings: &[
        Setting {
            key: "block",
            values: Values::Words(&["9", "17", "33", "65", "129", "257"]),
            default: "65",
            about: "vertices along a side of a block",
        },
        Setting {
            key: "distance",
            values: Values::Words(&["error", "linear", "exponential"]),
            default: "error",
            about: "level of a block: by its error and the tolerance, or by its centre's distance",
        },
        Setting {
            key: "base",
            values: Values::Number(1e-3, 1e9),
            default: "400",
            about: "base distance of linear and exponential levels, in samples",
        },
        Setting {
            key: "masks",
            values: Values::Words(&["6", "16"]),
            default: "6",
            about: "stored border masks: six classes and their rotations, or all sixteen",
        },
        Setting {
            key: "morph",
            values: Values::Words(&["off", "on"]),
            default: "off",
            about: "on: levels morph into each other; off: they change at once",
        },
    ],
    needs: &[Need { key: "base", other: "distance", words: &["linear", "exponential"] }],
    max_samples: 1 << 34,
    max_side: MAX_SIDE,
    takes_endless: false,
    build: |field, settings| Box::new(GeoMipMap::new(&field, settings)),
};

struct GeoMipMap {
    blocks: Blocks,
    mesh: BlockMesh,
    /// Finest level that is ever drawn.
    finest: u32,
    masks: Masks,
    distance: Distance,
    morph: bool,
    draw_per_block: bool,
    /// Bytes of indices with six classes and with sixteen masks.
    index_bytes: [usize; 2],
    /// Level of every block in the current view, fixed-point.
    levels: Vec<u32>,
    /// Visible blocks, with the key that sorts them into draws.
    visible: Vec<(u32, u32)>,
}

impl GeoMipMap {
    fn new(field: &Arc<Field>, settings: &Settings) -> Self {
        let cells = settings.number("block") as i32 - 1;
        let morph = settings.word("morph") == "on";
        let base = settings.number("base") * field.spacing[0].max(field.spacing[1]);
        let masks = if settings.word("masks") == "16" { Masks::Sixteen } else { Masks::Six };
        let bytes = |masks| size_of_val(BlockMesh::new(cells, masks).geometry.indices.as_slice());
        let distance = match settings.word("distance") {
            "linear" => Distance::Linear(base),
            "exponential" => Distance::Exponential(base),
            _ => Distance::Error,
        };
        let blocks = Blocks::new(field, cells, morph, &settings.progress);
        let finest = if distance == Distance::Error { blocks.finest() } else { 0 };
        Self {
            mesh: BlockMesh::used(cells, masks, finest, blocks.count == [1, 1]),
            finest,
            blocks,
            masks,
            distance,
            morph,
            draw_per_block: settings.variant() == Some("draw-per-block"),
            index_bytes: [bytes(Masks::Six), bytes(Masks::Sixteen)],
            levels: Vec::new(),
            visible: Vec::new(),
        }
    }

    /// Returns the whole level at which a block is drawn.
    fn level(&self, block: usize) -> u32 {
        self.levels[block] / ONE
    }

    /// Returns the blocks to the left, top, right and bottom; at the field's border the block itself.
    fn neighbours(&self, block: usize) -> [usize; 4] {
        let [w, h] = self.blocks.count.map(|n| n as usize);
        let (i, j) = (block % w, block / w);
        let inside = |exists: bool, neighbour: usize| if exists { neighbour } else { block };
        [
            inside(i > 0, block.wrapping_sub(1)),
            inside(j > 0, block.wrapping_sub(w)),
            inside(i + 1 < w, block + 1),
            inside(j + 1 < h, block + w),
        ]
    }

    /// Returns the sides on which a block meets a coarser one, as bits.
    fn mask(&self, block: usize) -> u8 {
        let bits = self.neighbours(block).into_iter().zip([side::LEFT, side::TOP, side::RIGHT, side::BOTTOM]);
        bits.filter(|&(neighbour, _)| self.level(neighbour) > self.level(block)).map(|(_, bit)| bit).sum()
    }

    /// Returns the morph weights of a block's inside and sides, relative to its whole level. A side has the coarser
    /// level of its two blocks; the other block is at most one level finer, so its error bound covers it. The inside of
    /// a block that extends beyond the field does not morph, because midpoints are not vertices there. Nor does a side
    /// between two such blocks.
    fn weights(&self, block: usize) -> SlotWeights {
        let base = self.level(block) * ONE;
        let partial = |block| self.blocks.is_partial(block);
        let weight = |level: u32, stays: bool| {
            let level = if stays { level / ONE * ONE } else { level };
            (level - base) / (ONE / weights::ONE)
        };
        let edge = |other: usize| weight(self.levels[block].max(self.levels[other]), partial(block) && partial(other));
        SlotWeights::uniform(weight(self.levels[block], partial(block)), self.neighbours(block).map(edge))
    }

    fn instance(&self, block: usize) -> Instance {
        let (i, j) = (block as u32 % self.blocks.count[0], block as u32 / self.blocks.count[0]);
        let level = self.level(block);
        let (_, rotation) = self.masks.border(self.mask(block));
        let at = [i as i32, j as i32];
        let instance = Instance {
            origin: at.map(|n| n * self.blocks.cells),
            cells: self.blocks.cells as u32,
            rotation: rotation.max(measure::single_cell_rotation(at, self.blocks.cells >> level)),
            level,
            ..Instance::default()
        };
        if self.morph { instance.with_weights(self.weights(block)) } else { instance }
    }

    /// Sorts the visible blocks into runs of the same level and border and appends their instances.
    fn fill_instances(&mut self, view: &View, list: &mut DrawList) {
        let mut visible = std::mem::take(&mut self.visible);
        visible.clear();
        self.blocks.visit_visible(&view.frustum(), &mut |block| {
            let (border, _) = self.masks.border(self.mask(block));
            let key = self.level(block) * self.masks.count() as u32 + border as u32;
            visible.push((key, block as u32));
        });
        visible.sort_unstable();
        list.instances.extend(visible.iter().map(|&(_, block)| self.instance(block as usize)));
        self.visible = visible;
    }

    /// Appends one draw for the borders of each level and mask, and one for the centres of each level.
    fn draw_instanced(&self, list: &mut DrawList) {
        let masks = self.masks.count() as u32;
        let mut first = 0u32;
        for run in self.visible.chunk_by(|a, b| a.0 / masks == b.0 / masks) {
            let level = (run[0].0 / masks) as usize;
            let mut border_first = first;
            for border_run in run.chunk_by(|a, b| a.0 == b.0) {
                let instances = border_first..border_first + border_run.len() as u32;
                border_first = instances.end;
                let border = (border_run[0].0 % masks) as usize;
                push(list, &self.mesh.borders[level][border], instances);
            }
            push(list, &self.mesh.centres[level], first..border_first);
            first = border_first;
        }
    }

    /// Appends two draws per block, its centre and its border, as published.
    fn draw_per_block(&self, list: &mut DrawList) {
        let masks = self.masks.count() as u32;
        list.submission = Submission::Direct;
        for (k, &(key, _)) in (0u32..).zip(&self.visible) {
            let (level, border) = ((key / masks) as usize, (key % masks) as usize);
            push(list, &self.mesh.centres[level], k..k + 1);
            push(list, &self.mesh.borders[level][border], k..k + 1);
        }
    }
}

fn push(list: &mut DrawList, indices: &std::ops::Range<u32>, instances: std::ops::Range<u32>) {
    if indices.is_empty() {
        return;
    }
    for instance in &mut list.instances[instances.start as usize..instances.end as usize] {
        instance.batch = list.draws.len() as u32;
    }
    let indices = indices.clone();
    list.draws.push(Draw {
        source: Source::Lattice,
        topology: Topology::Triangles,
        indices,
        instances,
        first_vertex: 0,
    });
}

impl Technique for GeoMipMap {
    fn resident(&self) -> &Geometry {
        &self.mesh.geometry
    }

    fn limits(&self) -> Limits {
        let blocks = (self.blocks.count[0] * self.blocks.count[1]) as usize;
        let instanced = self.blocks.levels as usize * (self.masks.count() + 1);
        let draws = if self.draw_per_block { 2 * blocks } else { instanced };
        Limits { draws, instances: blocks, ..Limits::default() }
    }

    fn select(&mut self, view: &View, list: &mut DrawList) {
        self.distance.levels(&self.blocks, view, self.morph, &mut self.levels);
        self.fill_instances(view, list);
        if self.draw_per_block {
            self.draw_per_block(list);
        } else {
            self.draw_instanced(list);
        }
    }

    fn keeps_tolerance(&self) -> bool {
        self.distance == Distance::Error
    }

    fn pipeline_requirements(&self) -> PipelineRequirements {
        PipelineRequirements {
            morph: if self.morph { Morph::ByInstance } else { Morph::No },
            ..PipelineRequirements::default()
        }
    }

    fn diagnostics(&self) -> Option<&dyn Diagnostics> {
        Some(self)
    }
}

impl Diagnostics for GeoMipMap {
    fn omitted(&self) -> Vec<Omitted> {
        let indices = |finest: u32, alone: bool| {
            let mesh = BlockMesh::used(self.blocks.cells, self.masks, finest, alone);
            size_of_val(mesh.geometry.indices.as_slice()) as u64
        };
        let mut omitted = Vec::new();
        if self.finest > 0 {
            let reason = format!("every block is exact at level {}", self.finest);
            let bytes = indices(0, false) - indices(self.finest, false);
            omitted.push(Omitted { what: "indices of finer levels", reason, bytes });
        }
        if self.blocks.count == [1, 1] {
            let reason = "one block holds the field".to_string();
            let bytes = indices(self.finest, false) - indices(self.finest, true);
            omitted.push(Omitted { what: "indices of stitched borders", reason: reason.clone(), bytes });
            omitted.push(Omitted { what: "quadtree", reason, bytes: 0 });
        }
        omitted
    }

    fn stats(&self) -> Vec<(&'static str, f64, &'static str)> {
        vec![
            ("blocks", f64::from(self.blocks.count[0] * self.blocks.count[1]), ""),
            ("index bytes, six classes", self.index_bytes[0] as f64, "B"),
            ("index bytes, sixteen masks", self.index_bytes[1] as f64, "B"),
        ]
    }
}
