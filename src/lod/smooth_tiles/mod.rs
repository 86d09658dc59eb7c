//! Smooth tiles: chunks of vertices in device memory, morphed between levels by the vertex shader.
//!
//! Based on B. D. Larsen and N. J. Christensen, "Real-time Terrain Rendering using Smooth Hardware Optimized Level of
//! Detail" (2003). Tiles of (2^w + 1)² vertices are the leaves of a quadtree. De Boer's metric gives each tile a level.
//! Each tile has one chunk of vertices on the device; every vertex also stores its place at the next level and morphs
//! towards it. A chunk is rebuilt when its tile changes level, a limited number per frame.
//!
//! Differences from the paper:
//! - Levels of tiles are continuous numbers. A shared side always uses the coarser level of its two tiles. All four
//!   rows of table 4 follow from this: of two equal tiles, the one that coarsens moves the side and the one that
//!   refines does not; between unequal tiles only the refining coarser one moves it. Any number of neighbours may
//!   change in one frame.
//! - The border of the *finer* tile is modified, as in the paper's figures (§2.2 says the coarser one's).
//! - A tile has one chunk instead of a centre and four borders. Vertices of a side also store the level after the next.
//!   A border selects other indices when a neighbour's level changes, so nothing is rebuilt for a neighbour. Five
//!   chunks would rebuild two borders for each tile that changes level. Measured over 600 frames of five paths over
//!   real terrain at 2 px, that is 66 % more uploaded bytes with tiles of 9 vertices a side, 39 % with 17 and 20 % with
//!   33. It also takes five draws a tile instead of two, and 4n more vertices in a tile of n × n cells.
//! - Under the metric `certified` the error bound overrides the clock, and a morph begins only where the next level
//!   keeps the bound. Only tiles whose refined chunk is not built yet may exceed it; [`DrawList::pending`] counts those
//!   in view.
//! - The inside of a tile that extends beyond the field does not morph, because the field's edge is not a vertex of the
//!   next level.
//!
//! Invariants: watertight, and neighbours within one level, in every frame and at every morph weight; the field is
//! covered once; error within tolerance once nothing is pending; the same list for the same view once it has settled.

pub mod chunk;
pub mod clock;
pub mod levels;
mod measure;
pub mod pattern;
pub mod pool;
pub mod queue;
pub mod tiles;

use std::sync::Arc;

use rayon::prelude::*;

use self::clock::{Clock, Drive, Step};
use self::levels::ONE;
use self::pattern::Patterns;
use self::queue::{Budget, Queue};
use self::tiles::Tiles;
use super::entry::Entry;
use super::settings::{Need, Setting, Settings, Values};
use super::technique::{Diagnostics, Gradual, Omitted, Technique};
use super::within_limits::select_within_limits;
use crate::draw::{
    Draw, DrawKinds, DrawList, ExplicitVertex, Geometry, Instance, Limits, Normals, PipelineRequirements, Source,
    Topology, Upload, VertexNormals,
    weights::{self, SlotWeights},
};
use crate::height::{Field, MAX_SIDE};
use crate::view::View;

/// Maximum number of bytes uploaded in a frame. Each frame in flight has a staging buffer of this size.
const UPLOAD_BYTES: usize = 64 << 20;

/// Row of [`super::TECHNIQUES`].
pub const ENTRY: Entry = Entry {
    name: "smooth-tiles",
    about: "tiles with vertex chunks in device memory, each morphing into its next level",
    paper: "Larsen & Christensen 2003",
    variants: &[],
    settings: &[
        Setting {
            key: "tile",
            values: Values::Words(&["9", "17", "33", "65"]),
            default: "33",
            about: "vertices along a side of a tile",
        },
        Setting {
            key: "morph",
            values: Values::Words(&["on", "off"]),
            default: "on",
            about: "on: levels morph into each other; off: they change at once",
        },
        Setting {
            key: "normals",
            values: Values::Words(&["texture", "vertex"]),
            default: "texture",
            about: "source of normals: texture = heights around each pixel; vertex = normals in the vertices, which morph too",
        },
        Setting {
            key: "clock",
            values: Values::Words(&["speed", "time", "frames"]),
            default: "speed",
            about: "what advances morphs: the viewer's movement, the scene's time, or frames",
        },
        Setting {
            key: "rebuild",
            values: Values::Number(1.0, 100_000.0),
            default: "100000",
            about: "maximum chunks rebuilt per frame (the paper: 1); uploads never exceed 64 MiB",
        },
        Setting {
            key: "memory",
            values: Values::Number(1.0, 65536.0),
            default: "512",
            about: "maximum size of all chunks on the device, MiB",
        },
    ],
    needs: &[Need { key: "clock", other: "morph", words: &["on"] }],
    max_samples: 1 << 30,
    max_side: MAX_SIDE,
    takes_endless: false,
    build: |field, settings| Box::new(SmoothTiles::new(field, settings)),
};

/// Names of the statistics of table 2: the share of triangles that a level saves over level 0.
const REDUCTIONS: [&str; 6] = [
    "reduction at level 1",
    "reduction at level 2",
    "reduction at level 3",
    "reduction at level 4",
    "reduction at level 5",
    "reduction at level 6",
];

/// Vertices of one tile at one level.
struct Chunk {
    vertices: Vec<ExplicitVertex>,
    /// One per vertex; empty unless vertices carry normals.
    normals: Vec<VertexNormals>,
}

/// Returns the bytes of one vertex on the device.
fn vertex_bytes(has_normals: bool) -> usize {
    size_of::<ExplicitVertex>() + if has_normals { size_of::<VertexNormals>() } else { 0 }
}

struct SmoothTiles {
    field: Arc<Field>,
    tiles: Tiles,
    patterns: Patterns,
    resident: Geometry,
    queue: Queue,
    clock: Clock,
    budget: Budget,
    morphs: bool,
    has_normals: bool,
    /// Side of a tile, metres.
    side_m: f64,
    /// Drawn level of each tile, in units of [`ONE`].
    levels: Vec<u32>,
    /// Maximum level that each tile's error bound allows, in units of [`ONE`]: of the tile alone, and restricted by its
    /// neighbours.
    ceilings: [Vec<u32>; 2],
    /// Whole level that each tile's chunk should have.
    aims: Vec<u32>,
    visible: Vec<usize>,
    is_visible: Vec<bool>,
}

impl SmoothTiles {
    fn new(field: Arc<Field>, settings: &Settings) -> Self {
        let cells = settings.number("tile") as i32 - 1;
        let drive = match (settings.word("morph"), settings.word("clock")) {
            ("off", _) => Drive::AtOnce,
            (_, "time") => Drive::Time,
            (_, "frames") => Drive::Frames,
            _ => Drive::Speed,
        };
        let morphs = drive != Drive::AtOnce;
        let tiles = Tiles::new(&field, cells, morphs);
        let has_normals = settings.word("normals") == "vertex";
        let vertex = vertex_bytes(has_normals);
        let queue = Queue::new(&tiles, (settings.number("memory") * 1048576.0) as usize / vertex);
        let chunks = settings.number("rebuild") as usize;
        let vertices = queue.vertices().min(UPLOAD_BYTES / vertex);
        let patterns = Patterns::new(cells, tiles.finest(), tiles.total() == 1);
        let side_m = f64::from(cells) * field.spacing[0].max(field.spacing[1]);
        let (top, count) = (tiles.levels - 1, tiles.total());
        let mut technique = Self {
            resident: Geometry {
                vertices: vec![ExplicitVertex::default(); queue.vertices()],
                normals: vec![VertexNormals::default(); if has_normals { queue.vertices() } else { 0 }],
                indices: patterns.indices.clone(),
                ..Geometry::default()
            },
            clock: Clock::new(drive, side_m),
            budget: Budget { chunks, vertices: vertices.min(chunks.saturating_mul(chunk::vertices(cells, 0))) },
            morphs,
            has_normals,
            side_m,
            levels: vec![top * ONE; count],
            ceilings: [Vec::new(), Vec::new()],
            aims: Vec::new(),
            visible: Vec::new(),
            is_visible: vec![false; count],
            field,
            tiles,
            patterns,
            queue,
        };
        technique.build_coarsest(top);
        technique
    }

    fn build_coarsest(&mut self, top: u32) {
        for tile in 0..self.tiles.total() {
            let chunk = self.chunk(tile, top);
            self.write(self.queue.first_vertices[tile], &chunk);
        }
    }

    fn chunk(&self, tile: usize, level: u32) -> Chunk {
        let place = self.tiles.place(tile);
        let normals = if self.has_normals { chunk::build_normals(&self.field, place, level) } else { Vec::new() };
        Chunk { vertices: chunk::build(&self.field, place, level), normals }
    }

    fn write(&mut self, first_vertex: u32, Chunk { vertices, normals }: &Chunk) {
        let first = first_vertex as usize;
        self.resident.vertices[first..first + vertices.len()].copy_from_slice(vertices);
        if self.has_normals {
            self.resident.normals[first..first + normals.len()].copy_from_slice(normals);
        }
    }

    /// Computes how coarse each tile may be in a view.
    fn find_ceilings(&mut self, view: &View) {
        let [own, restricted] = &mut self.ceilings;
        let allowance = view.allowance();
        let ceiling = if self.morphs { levels::ceiling } else { levels::whole_ceiling };
        let allowed = |tile: usize| allowance.error(&self.tiles.bounds(tile));
        own.clear();
        own.extend((0..self.tiles.total()).map(|tile| ceiling(self.tiles.errors(tile), allowed(tile))));
        restricted.clone_from(own);
        levels::restrict(restricted, self.tiles.count);
    }

    /// Finds the first tolerance at which the buffer holds all tiles, and their ceilings there. Returns its scale.
    fn fit_tolerance(&mut self, view: &View) -> f64 {
        select_within_limits(view, |wider| {
            self.find_ceilings(wider);
            self.queue.holds(self.ceilings[1].iter().map(|level| level / ONE)).then_some(())
        })
        .1
    }

    /// Moves levels towards their aims, limited by the clock and the error bound.
    fn move_levels(&mut self, view: &View) {
        let clock = self.clock.step(view);
        // A full buffer frees memory only when tiles coarsen, so they coarsen at once.
        let step = if self.queue.is_short() { Step::AT_ONCE } else { clock };
        let ceilings = &self.ceilings[1];
        for (tile, level) in self.levels.iter_mut().enumerate() {
            let distance_m = self.tiles.bounds(tile).distance(view.eye).max(self.side_m);
            *level = levels::moved(*level, ceilings[tile], step.at(distance_m));
        }
        // Steps differ from tile to tile, so neighbours may have moved apart.
        levels::restrict(&mut self.levels, self.tiles.count);
        self.aims.clear();
        self.aims.extend(self.levels.iter().map(|level| level / ONE));
    }

    fn find_visible(&mut self, view: &View) {
        let (visible, is_visible) = (&mut self.visible, &mut self.is_visible);
        visible.iter().for_each(|&tile| is_visible[tile] = false);
        visible.clear();
        self.tiles.visit_visible(&view.frustum(), &mut |tile| visible.push(tile));
        visible.iter().for_each(|&tile| is_visible[tile] = true);
    }

    /// Rebuilds chunks of tiles that change level, within the frame's budget.
    fn rebuild(&mut self, view: &View, uploads: &mut Vec<Upload>) {
        let (tiles, is_visible) = (&self.tiles, &self.is_visible);
        let urgency = |tile: usize| (!is_visible[tile], tiles.bounds(tile).distance(view.eye));
        let moves = self.queue.advance(tiles, &self.aims, self.budget, urgency).to_vec();
        let chunks: Vec<_> = moves.par_iter().map(|moved| self.chunk(moved.tile, moved.level)).collect();
        for (moved, chunk) in moves.iter().zip(chunks) {
            self.write(moved.first_vertex, &chunk);
            uploads.push(Upload::Vertices(moved.first_vertex, chunk.vertices));
            if self.has_normals {
                uploads.push(Upload::Normals(moved.first_vertex, chunk.normals));
            }
        }
    }

    /// Appends the draws of a tile: its centre, and the border for its neighbours' levels.
    fn push(&self, tile: usize, list: &mut DrawList) {
        let (level, batch) = (self.queue.levels[tile], list.instances.len() as u32);
        let place = self.tiles.place(tile);
        let (mask, weights) = self.border(tile);
        let (origin, cells) = (place.origin, place.cells as u32);
        list.instances.push(Instance { origin, cells, level, batch, ..Instance::default() }.with_weights(weights));
        let border = self.patterns.border(level, mask, self.tiles.is_odd(tile));
        for indices in [self.patterns.centres[level as usize].clone(), border] {
            if !indices.is_empty() {
                let (source, topology) = (Source::Resident, Topology::Triangles);
                let first_vertex = self.queue.first_vertices[tile];
                list.draws.push(Draw { source, topology, indices, instances: batch..batch + 1, first_vertex });
            }
        }
    }

    /// Returns the set of sides that meet coarser tiles (bit q: side q), and the morph weights of the inside and the
    /// sides.
    fn border(&self, tile: usize) -> (usize, SlotWeights) {
        let base = self.queue.levels[tile];
        let is_partial = self.tiles.is_partial(tile);
        let weight = |level: u32| (level - base * ONE) / (ONE / weights::ONE);
        let mut mask = 0;
        let mut sides = [0; 4];
        for (side, other) in self.tiles.neighbours(tile).into_iter().enumerate() {
            let other = other.unwrap_or(tile);
            let coarser = self.queue.levels[other].max(base);
            mask |= usize::from(coarser > base) << side;
            // Between two tiles that extend beyond the field, middles of edges are not vertices of the coarser level.
            let stays = is_partial && self.tiles.is_partial(other);
            sides[side] = weight(if stays { coarser * ONE } else { self.levels[tile].max(self.levels[other]) });
        }
        let inside = if is_partial { 0 } else { weight(self.levels[tile]) };
        (mask, SlotWeights::uniform(inside, sides))
    }
}

impl Technique for SmoothTiles {
    fn resident(&self) -> &Geometry {
        &self.resident
    }

    fn limits(&self) -> Limits {
        let count = self.tiles.total();
        let upload_bytes = self.budget.vertices * vertex_bytes(self.has_normals);
        Limits { draws: 2 * count, instances: count, upload_bytes, ..Limits::default() }
    }

    fn select(&mut self, view: &View, list: &mut DrawList) {
        list.tolerance_scale = self.fit_tolerance(view);
        self.move_levels(view);
        self.find_visible(view);
        self.rebuild(view, &mut list.uploads);
        // A tile whose chunk is pending is drawn between its current level and the next one.
        for (level, &current) in self.levels.iter_mut().zip(&self.queue.levels) {
            *level = (*level).clamp(current * ONE, (current + 1) * ONE);
        }
        let is_pending = |&&tile: &&usize| self.levels[tile] > self.ceilings[0][tile];
        list.pending = self.visible.iter().filter(is_pending).count();
        self.visible.iter().for_each(|&tile| self.push(tile, list));
    }

    fn keeps_tolerance(&self) -> bool {
        true
    }

    fn pipeline_requirements(&self) -> PipelineRequirements {
        let normals = if self.has_normals { Normals::Vertices } else { Normals::Texture };
        PipelineRequirements { draws: DrawKinds::EXPLICIT, normals, ..PipelineRequirements::default() }
    }

    fn gradual(&self) -> Option<&dyn Gradual> {
        Some(self)
    }

    fn diagnostics(&self) -> Option<&dyn Diagnostics> {
        Some(self)
    }
}

impl Gradual for SmoothTiles {
    fn is_settled(&self) -> bool {
        // The viewer's way is over where the view stays the same.
        let is_still = self.clock.drive() == Drive::Speed;
        let stands = |tile: usize| {
            let (aim, standing) = (self.ceilings[1][tile] / ONE, self.queue.levels[tile]);
            self.levels[tile] == ONE * aim.clamp(standing, standing + 1)
        };
        self.queue.is_at_rest() && !self.queue.is_short() && (is_still || (0..self.tiles.total()).all(stands))
    }
}

impl Diagnostics for SmoothTiles {
    fn omitted(&self) -> Vec<Omitted> {
        let indices = |finest: u32, alone: bool| {
            size_of_val(Patterns::new(self.tiles.cells, finest, alone).indices.as_slice()) as u64
        };
        let (finest, is_alone) = (self.tiles.finest(), self.tiles.total() == 1);
        let mut omitted = Vec::new();
        if finest > 0 {
            let reason = format!("every tile is exact at level {finest}");
            let bytes = indices(0, false) - indices(finest, false);
            omitted.push(Omitted { what: "indices of finer levels", reason, bytes });
        }
        if is_alone {
            let reason = "one tile holds the field".to_string();
            let bytes = indices(finest, false) - indices(finest, true);
            omitted.push(Omitted { what: "indices of stitched borders", reason, bytes });
        }
        omitted
    }

    fn stats(&self) -> Vec<(&'static str, f64, &'static str)> {
        let bytes = |count: usize| (count * vertex_bytes(self.has_normals)) as f64;
        let whole = [
            ("tiles", self.tiles.total() as f64, ""),
            ("chunks in use", self.queue.chunks() as f64, ""),
            ("vertex bytes on the device", bytes(self.queue.vertices()), "B"),
            ("vertex bytes in use", bytes(self.queue.used_vertices()), "B"),
            ("index bytes", size_of_val(self.patterns.indices.as_slice()) as f64, "B"),
        ];
        let all = Patterns::new(self.tiles.cells, 0, false);
        let reduction = |(level, name): (u32, &'static str)| {
            let share = f64::from(all.triangles(level)) / f64::from(all.triangles(0));
            (name, 100.0 * (1.0 - share), "%")
        };
        whole.into_iter().chain((1..self.tiles.levels).zip(REDUCTIONS).map(reduction)).collect()
    }
}
