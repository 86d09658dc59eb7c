//! Sorted strips: a stream of triangles in the order of sight, made anew for each frame.
//!
//! After M. Finch and L. Bishop, "Sorted Height Field Rendering" (1998). The part of the field in the view's footprint
//! is walked in strips one quad wide; a level function says how large quads are, and five shapes of quads join what
//! differs. Triangles come out nearest first, at a bounded amount of work for each, while nothing but the last strip is
//! remembered. The paper's figures are lost: the shapes here follow from its rule that a quad's back edge uses exactly
//! the vertices of the front edges behind it ([`shapes`], [`walk`]).
//!
//! Where this differs from the paper, and why:
//! - the level of a place is that of the *square* ahead, not of the vertex ahead, so that a bound can be kept over all
//!   of it; for `level=uniform` that is the published table by squared distance, its condition checked and repaired
//!   ([`table`]); for `level=certified` errors measured for every shape that a square may take ([`measure`],
//!   [`certified`]), the set closed over squares that touch ([`splits`]);
//! - shapes are combined where finer quads are on several sides of one: the published five are not enough there;
//! - strips are walked outward from the eye on both sides of it, front to back, where the paper walks back to front in
//!   one direction. `order=back` turns the list round: both orders are the same triangles. `order=painter` draws it so
//!   without a depth buffer, and the picture is the same to the pixel;
//! - a quad's triangles are ordered too, by the eye's side of the lines between them, and so are quads in the eye's own
//!   row and column of pages, where some rays go against the walk ([`order`]);
//! - the far plane that comes closer as the eye comes down (§4.10, `far`) takes whole pages away: what is left out is land in
//!   sight, which the list says ([`DrawList::reach_m`]) and the prover takes into account. It is not needed to hold the
//!   load: by apparent size it hardly grows on the way down. Over 4097 × 4097 samples of 10 m, pages of 16, `level=uniform`,
//!   `edge=8`, 1280 × 720 pixels, from 1000 m down to 15 m, 221 k to 253 k triangles are drawn, with `far=32` 220 k to
//!   134 k, with `far=8` 145 k to 32 k;
//! - vertices go over into the next level only with `level=uniform`: a bound would be spent on it;
//! - squares beside the picture are as fine as those in it, in a band ([`certified::guarded`]). On a circle flown in 24
//!   frames over 1025 × 1025 samples, 1280 × 720 pixels, 1 px, a band of a quarter takes the largest jump from 78 px to
//!   3.0 px and the 99.9th percentile from 26 px to 1.05 px, for a quarter more triangles (282 k to 351 k); a band
//!   without end has the same jumps and 371 k;
//! - pages are culled by boxes around their land, and those without land are no part of the footprint: holes stay.
//!
//! The surface is made of the samples at quads' corners and middles; plain quads have the crate's alternating
//! diagonals, but a quad next to finer ones is a fan: the surface is no right-triangle mesh, and which of two levels
//! gives way where they meet depends on the direction of the walk. The bound covers all of it.
//!
//! Laws kept: watertight, covered once, error within tolerance (`level=certified`), no state between views.

pub mod blend;
pub mod cave;
pub mod certified;
pub mod context;
mod depth_sorter;
pub mod footprint;
mod limits;
pub mod measure;
pub mod pages;
pub mod parts;
pub mod sequence;
pub mod shapes;
pub mod splits;
pub mod table;
pub mod topology;
pub mod walk;

use std::sync::Arc;
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

use rayon::prelude::*;

use self::blend::Blend;
use self::cave::CaveStrips;
use self::certified::{Certified, bounds, guarded};
use self::context::WalkContext;
use self::footprint::Footprint;
use self::limits::{MAX_PAGES, MAX_TRIANGLES, NAME};
use self::measure::Errors;
use self::pages::{Grid, Pages, Row, TraversalDirection};
use self::sequence::Sequence;
use self::shapes::Shapes;
use self::splits::{Levels, Splits};
use self::table::{Radial, above_m};
use self::walk::{Stream, Worker, join_streams};
use super::{Entry, Need, Setting, Settings, Technique, Values, Variant, select_within_limits};
use crate::draw::{
    DepthMode, Draw, DrawKinds, DrawList, Geometry, Instance, Limits, PipelineRequirements, Source, Topology,
};
use crate::height::Field;
use crate::height::cave::Cave;
use crate::view::{Containment, Lens, View};

/// Triangles of the frame before from which on rows are walked on all cores: for fewer it takes longer to share them out.
const MIN_PARALLEL: usize = 20_000;

/// The row of the table.
pub const ENTRY: Entry = Entry {
    name: NAME,
    about: "triangles streamed in the order of sight, strip by strip",
    paper: "Finch & Bishop 1998",
    variants: &[Variant { name: "serial", about: "walked on one core, row after row: the same list" }],
    settings: &[
        Setting {
            key: "level",
            values: Values::Words(&["certified", "uniform"]),
            default: "certified",
            about: "what sets a quad's level: its error, or its distance by a table, as published",
        },
        Setting {
            key: "page",
            values: Values::Words(&["16", "64", "256"]),
            default: "64",
            about: "cells along a side of a page: no quad is larger",
        },
        Setting {
            key: "order",
            values: Values::Words(Sequence::WORDS),
            default: "front",
            about: "the nearest triangle first, or the furthest; painter: the furthest, and no depth buffer; or in no order",
        },
        Setting {
            key: "topology",
            values: Values::Words(topology::WORDS),
            default: "list",
            about: "three indices a triangle, or strips that end where the order of sight leaves them",
        },
        Setting {
            key: "parts",
            values: Values::Number(1.0, 64.0),
            default: "1",
            about: "parts of a frame with level=certified, each drawn while the next is walked: in pictures and times, not in the window",
        },
        Setting {
            key: "guard",
            values: Values::Number(0.0, 1000.0),
            default: "0.25",
            about: "width of a band around the picture, in parts of it, as fine for level=certified as the picture",
        },
        Setting {
            key: "far",
            values: Values::Number(0.0, 1e6),
            default: "0",
            about: "land is drawn as far as so many heights of the eye above it and lengths of a page together; 0: all of it is",
        },
        Setting {
            key: "edge",
            values: Values::Number(0.01, 1e4),
            default: "20",
            about: "length of a triangle's side on the screen for level=uniform, in tolerances",
        },
        Setting {
            key: "blend",
            values: Values::Words(Blend::WORDS),
            default: "off",
            about: "how vertices of level=uniform go over into the next level: at once, up or down, or into an end of its edge",
        },
    ],
    needs: &[
        Need { key: "parts", other: "level", words: &["certified"] },
        Need { key: "guard", other: "level", words: &["certified"] },
        Need { key: "edge", other: "level", words: &["uniform"] },
        Need { key: "blend", other: "level", words: &["uniform"] },
    ],
    max_samples: u64::MAX,
    // The walk has a mark for each sample along a row of pages.
    max_side: 1 << 22,
    takes_endless: false,
    build: |field, settings| match Cave::of(&field) {
        Some(cave) => Box::new(CaveStrips::new(Arc::new(cave), settings)),
        None => Box::new(SortedStrips::new(field, settings)),
    },
};

struct SortedStrips {
    field: Arc<Field>,
    errors: Errors,
    shapes: Shapes,
    pages: Pages,
    splits: Splits,
    /// One a row of pages; if rows are walked one after the other, the first is for all.
    workers: Vec<Worker>,
    /// Length of a triangle's side, tolerances, if levels are uniform.
    edge: Option<f64>,
    /// Width of the band around the picture that is as fine as the picture, pictures.
    guard: f64,
    /// Heights of the eye, and lengths of a page, up to which land is drawn; 0: all of it is.
    far: f64,
    blend: Blend,
    sequence: Sequence,
    topology: Topology,
    /// The most parts of a frame, and one of them.
    parts: usize,
    part: DrawList,
    is_serial: bool,
    /// Of the last frame.
    triangles_before: usize,
    /// Indices of a frame as they are walked: three a triangle.
    max_indices: usize,
    limits: Limits,
    nothing: Geometry,
}

impl SortedStrips {
    fn new(field: Arc<Field>, settings: &Settings) -> Self {
        let grid = Grid::new(&field, (settings.number("page") as u32).ilog2(), MAX_PAGES);
        let cells = grid.side() as usize;
        let pages = (grid.count[0] * grid.count[1]) as usize;
        let topology = topology::of(settings.word("topology"));
        let sequence = Sequence::of(settings.word("order"));
        let level_is_certified = settings.word("level") == "certified";
        // Others need all triangles at once, or have a level function whose triangles nobody counts before.
        let comes_in_parts = level_is_certified && topology == Topology::Triangles && sequence != Sequence::Shuffled;
        let parts = if comes_in_parts { settings.number("parts") as usize } else { 1 };
        let [vertices, triangles] = if parts > 1 {
            [parts::max_triangles(pages, pages * cells * cells / 3); 2]
        } else {
            [pages * (cells + 1) * (cells + 1), 2 * pages * cells * cells]
        };
        let max_indices = 3 * triangles.min(MAX_TRIANGLES);
        let rows = grid.count[0].max(grid.count[1]) as usize;
        let limits = Limits {
            draws: rows,
            instances: rows,
            vertices: vertices.min(MAX_TRIANGLES),
            indices: topology::max_indices(topology, max_indices),
            ..Limits::default()
        };
        Self {
            errors: Errors::new(&field, grid.level),
            field,
            shapes: Shapes::default(),
            pages: Pages::none(grid),
            splits: Splits::new(grid),
            workers: Vec::new(),
            edge: (!level_is_certified).then(|| settings.number("edge")),
            guard: settings.number("guard"),
            far: settings.number("far"),
            blend: if level_is_certified { Blend::Off } else { Blend::of(settings.word("blend"), &grid) },
            sequence,
            topology,
            parts,
            part: DrawList::default(),
            is_serial: settings.variant() == Some("serial"),
            triangles_before: 0,
            max_indices,
            limits,
            nothing: Geometry::default(),
        }
    }

    /// Finds the pages in sight.
    fn look(&mut self, view: &View) {
        let (field, grid, errors) = (&*self.field, self.pages.grid, &self.errors);
        let (mut seen, range) = (Vec::new(), errors.range());
        let frustum = view.frustum().within(view.eye, self.reach_m(view));
        if range[0] <= range[1] {
            Footprint::new(field, view, range).visit_pages(&grid, |at| {
                let page = errors.square(grid.level, at);
                let bounds = bounds(field, grid.level, at, page.range);
                if errors.has_terrain(at) && frustum.contains(&bounds) != Containment::Outside {
                    seen.push(at);
                }
            });
        }
        self.pages.set(seen);
    }

    /// How far land is drawn (Finch & Bishop, §4.10), metres in plan.
    fn reach_m(&self, view: &View) -> f64 {
        if self.far == 0.0 || matches!(view.lens, Lens::Orthographic { .. }) {
            return f64::INFINITY;
        }
        let page_m = f64::from(self.pages.grid.side()) * self.field.spacing[0].max(self.field.spacing[1]);
        self.far * (above_m(&self.field, view) + page_m)
    }

    /// Walks the rows of a frame, each into a worker of its own in parallel, or one after the other into the only one;
    /// how many vertices and indices each has. `None` if they would not fit the limits.
    fn walk(
        &self,
        levels: &impl Levels,
        traversal: &TraversalDirection,
        rows: &[Row],
        workers: &mut [Worker],
    ) -> Option<Vec<[usize; 2]>> {
        let (field, pages, shapes) = (&*self.field, &self.pages, &self.shapes);
        let context = WalkContext { field, pages, levels, shapes, traversal: *traversal, blend: self.blend };
        let has_room =
            |[vertices, indices]: [usize; 2]| vertices <= self.limits.vertices && indices <= self.max_indices;
        if let [worker] = workers {
            let walk = |row: &Row| {
                let before = worker.stream.lengths();
                context.walk_on(row, worker);
                let after = worker.stream.lengths();
                has_room(after).then(|| [0, 1].map(|k| after[k] - before[k]))
            };
            return rows.iter().map(walk).collect();
        }
        let sums = [AtomicUsize::new(0), AtomicUsize::new(0)];
        let walk = |(row, worker): (&Row, &mut Worker)| {
            // Once there is too much, no further row is begun.
            if !has_room(sums.each_ref().map(|sum| sum.load(Relaxed))) {
                return None;
            }
            context.walk_on(row, worker);
            let own = worker.stream.lengths();
            has_room([0, 1].map(|k| sums[k].fetch_add(own[k], Relaxed) + own[k])).then_some(own)
        };
        rows.par_iter().zip(workers).map(walk).collect()
    }

    /// The frame's strips under the view's tolerance, as [`Self::walk`] leaves them.
    fn strips(
        &mut self,
        view: &View,
        traversal: &TraversalDirection,
        rows: &[Row],
        workers: &mut [Worker],
    ) -> Option<Vec<[usize; 2]>> {
        for worker in &mut *workers {
            worker.stream.clear();
        }
        if let Some(edge) = self.edge {
            let edge_px = edge * view.tolerance.px;
            let levels = Radial::uniform(&self.field, view, edge_px, self.pages.grid.level, self.blend);
            return self.walk(&levels, traversal, rows, workers);
        }
        if self.split(view) { self.walk(&self.splits, traversal, rows, workers) } else { None }
    }

    /// Splits the squares that the view's tolerance needs split; `false` if there are too many.
    fn split(&mut self, view: &View) -> bool {
        self.splits.clear();
        let seen = guarded(view, self.guard);
        // A split square has at least six triangles more.
        let max = self.max_indices / 18 + 1;
        Certified::new(&self.field, &self.errors, &self.pages, [view, &seen], max).split(&mut self.splits)
    }

    /// Splits what the view's tolerance needs; whether the frame fits its limits whatever comes of that.
    fn surely_fits(&mut self, view: &View) -> bool {
        let fits = self.split(view);
        let max = parts::max_triangles(self.pages.list().len(), self.splits.count());
        fits && 3 * max <= self.max_indices && max <= self.limits.vertices
    }

    /// Walks group after group of rows; what is to be walked was split.
    fn fill_in_parts(
        &mut self,
        (traversal, rows): (&TraversalDirection, &[Row]),
        workers: &mut [Worker],
        list: &mut DrawList,
        ready: &mut dyn FnMut(&DrawList),
    ) {
        let mut part = std::mem::take(&mut self.part);
        let groups = parts::groups(rows, self.parts, self.sequence);
        for (k, group) in groups.iter().enumerate() {
            workers.iter_mut().for_each(|worker| worker.stream.clear());
            let lengths = self.walk(&self.splits, traversal, group, workers).expect("room for all that may come");
            part.clear();
            self.fill(&lengths, workers, &mut part);
            parts::append(&part, list);
            if k + 1 < groups.len() {
                ready(list);
            }
        }
        self.part = part;
    }

    fn fill(&self, lengths: &[[usize; 2]], workers: &mut [Worker], list: &mut DrawList) {
        let streamed = &mut list.streamed;
        if let [worker] = workers {
            std::mem::swap(&mut streamed.vertices, &mut worker.stream.vertices);
            std::mem::swap(&mut streamed.indices, &mut worker.stream.indices);
        } else {
            let streams: Vec<&Stream> = workers[..lengths.len()].iter().map(|worker| &worker.stream).collect();
            join_streams(&streams, streamed);
        }
        let [mut first_vertex, mut first] = [0; 2];
        for (batch, [vertices, indices]) in (0u32..).zip(lengths.iter().map(|own| own.map(|n| n as u32))) {
            list.instances.push(Instance { batch, ..Instance::default() });
            let (source, topology) = (Source::Streamed, Topology::Triangles);
            let (indices, instances) = (first..first + indices, batch..batch + 1);
            first = indices.end;
            list.draws.push(Draw { source, topology, indices, instances, first_vertex });
            first_vertex += vertices;
        }
        list.fraction_bits = self.blend.fraction_bits();
        self.sequence.arrange(list);
        topology::arrange(self.topology, list);
    }
}

impl Technique for SortedStrips {
    fn resident(&self) -> &Geometry {
        &self.nothing
    }

    fn limits(&self) -> Limits {
        self.limits
    }

    fn select(&mut self, view: &View, list: &mut DrawList) {
        self.select_in_parts(view, list, &mut |_| ());
    }

    fn select_in_parts(&mut self, view: &View, list: &mut DrawList, ready: &mut dyn FnMut(&DrawList)) {
        self.look(view);
        list.reach_m = self.reach_m(view);
        let traversal = TraversalDirection::new(&self.field, view);
        let rows = self.pages.rows(&traversal);
        let mut workers = std::mem::take(&mut self.workers);
        workers.resize_with(rows.len().max(workers.len()).max(1), Worker::default);
        let is_serial = self.is_serial || self.triangles_before < MIN_PARALLEL;
        let of_frame = if is_serial { &mut workers[..1] } else { &mut workers[..] };
        if self.parts > 1 && self.surely_fits(view) {
            self.fill_in_parts((&traversal, &rows), of_frame, list, ready);
        } else {
            let (lengths, tolerance_scale) =
                select_within_limits(view, |wider| self.strips(wider, &traversal, &rows, of_frame));
            self.fill(&lengths, of_frame, list);
            list.tolerance_scale = tolerance_scale;
        }
        self.workers = workers;
        self.triangles_before = list.triangles() as usize;
    }

    fn keeps_tolerance(&self) -> bool {
        self.edge.is_none()
    }

    fn pipeline_requirements(&self) -> PipelineRequirements {
        let draws = DrawKinds::explicit(self.topology);
        // Where vertices slide the order is not that of every ray.
        let is_in_order = !matches!(self.blend, Blend::End(_));
        let depth_mode = if is_in_order { self.sequence.depth_mode() } else { DepthMode::Buffer };
        PipelineRequirements { draws, depth_mode, ..PipelineRequirements::default() }
    }

    fn stats(&self) -> Vec<(&'static str, f64, &'static str)> {
        let pages = self.pages.grid.count.map(f64::from);
        vec![
            ("pages", pages[0] * pages[1], ""),
            ("pages in sight", self.pages.list().len() as f64, ""),
            ("cells along a side of a page", f64::from(self.pages.grid.side()), ""),
            ("bytes of errors", self.errors.bytes() as f64, "B"),
        ]
    }
}
