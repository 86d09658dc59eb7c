//! Sorted strips: a stream of triangles in front-to-back order, generated anew for each frame.
//!
//! Based on M. Finch and L. Bishop, "Sorted Height Field Rendering" (1998). The part of the field in the view's
//! footprint is walked in strips one quad wide. A level function gives the size of quads, and five shapes of quads join
//! different sizes. Triangles are generated nearest first, with bounded work per triangle and memory of the last strip
//! only. The paper's figures are lost. The shapes here follow from its rule that a quad's back edge uses exactly the
//! vertices of the front edges behind it ([`shapes`], [`walk`]).
//!
//! Differences from the paper:
//! - The level of a place is that of the *square* ahead, not of the vertex ahead. An error bound can then hold over all
//!   of the square. With `level=uniform` it is the published table by squared distance; its Lipschitz condition is
//!   checked and repaired ([`table`]). With `level=certified` it follows from errors measured for every shape that a
//!   square may take ([`measure`], [`certified`]). That set is closed over squares that touch ([`splits`]).
//! - Shapes are combined where finer quads are on several sides of one, for which the published five do not suffice.
//! - Strips are walked outward from the eye on both sides of it, front to back; the paper walks back to front in one
//!   direction. `order=back` reverses the list; both orders have the same triangles. `order=painter` draws back to
//!   front without a depth buffer, and the picture is identical to the pixel.
//! - A quad's triangles are sorted too, by the eye's side of the lines between them. So are quads in the eye's own row
//!   and column of pages, where some rays run against the walk ([`depth_sorter`]).
//! - The far plane that approaches as the eye descends (§4.10, setting `far`) omits whole pages, including visible
//!   terrain. [`DrawList::reach_m`] states the distance, and the watertightness check respects it. Limiting the load
//!   does not require it: at constant screen-space size the load hardly grows on descent. Measured over 4097 × 4097
//!   samples of 10 m, pages of 16, `level=uniform`, `edge=8`, 1280 × 720 pixels, from 1000 m down to 15 m. Without a
//!   far plane 221 k to 253 k triangles are drawn; `far=32` draws 220 k to 134 k; `far=8` draws 145 k to 32 k.
//! - Vertices morph to the next level only with `level=uniform`, because a morph would use up part of an error bound.
//! - Squares in a band around the picture are as fine as those in it ([`certified::guarded`]). Measured on a circle
//!   flown in 24 frames over 1025 × 1025 samples, 1280 × 720 pixels, 1 px: a band of a quarter reduces the largest jump
//!   between frames from 78 px to 3.0 px and the 99.9th percentile from 26 px to 1.05 px. It adds a quarter more
//!   triangles (282 k to 351 k). An infinite band has the same jumps and 371 k triangles.
//! - Pages are culled by boxes around their terrain. Pages without data are not part of the footprint, so holes stay
//!   holes.
//!
//! The surface consists of the samples at quads' corners and middles. Plain quads have the crate's alternating
//! diagonals, but a quad next to finer ones is a fan, so the surface is not a right-triangle mesh. Which of two levels
//! is modified where they meet depends on the direction of the walk. The error bound covers all cases.
//!
//! Invariants: watertight; the field is covered once; error within tolerance (`level=certified`); no state between
//! views.

pub mod blend;
pub mod cave;
pub mod certified;
pub mod context;
pub mod depth_sorter;
pub mod footprint;
pub mod measure;
pub mod pages;
pub mod parts;
pub mod sequence;
pub mod shapes;
pub mod splits;
pub mod stream;
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
use self::measure::Errors;
use self::pages::{Grid, MAX_PAGES, Pages, Row, TraversalDirection};
use self::sequence::Sequence;
use self::shapes::Shapes;
use self::splits::{Levels, Splits};
use self::stream::{MAX_TRIANGLES, Stream};
use self::table::{Radial, eye_height_m};
use self::walk::Worker;
use super::entry::{Entry, Variant};
use super::settings::{Need, Setting, Settings, Values};
use super::technique::{Diagnostics, SelectInParts, Technique};
use super::within_limits::select_within_limits;
use crate::draw::{DepthMode, DrawKinds, DrawList, Geometry, Limits, PipelineRequirements, Topology};
use crate::height::Field;
use crate::height::cave::Cave;
use crate::view::{Containment, Lens, View};

/// Number of triangles in the last frame from which rows are walked on all cores. Below it, distributing them costs
/// more.
const MIN_PARALLEL: usize = 20_000;

/// Row of [`super::TECHNIQUES`].
pub const ENTRY: Entry = Entry {
    name: "sorted-strips",
    about: "triangles streamed nearest first, strip by strip",
    paper: "Finch & Bishop 1998",
    variants: &[Variant { name: "serial", about: "walks rows serially on one core; same list" }],
    settings: &[
        Setting {
            key: "level",
            values: Values::Words(&["certified", "uniform"]),
            default: "certified",
            about: "certified: level by measured error; uniform: level by distance from a table, as published",
        },
        Setting {
            key: "page",
            values: Values::Words(&["16", "64", "256"]),
            default: "64",
            about: "cells along a side of a page, the largest quad",
        },
        Setting {
            key: "order",
            values: Values::Words(Sequence::WORDS),
            default: "front",
            about: "order of triangles: nearest first, furthest first, furthest first without a depth buffer, or random",
        },
        Setting {
            key: "topology",
            values: Values::Words(topology::WORDS),
            default: "list",
            about: "list: three indices per triangle; strip: triangle strips that end where the order requires it",
        },
        Setting {
            key: "parts",
            values: Values::Number(1.0, 64.0),
            default: "1",
            about: "parts of a frame with level=certified, each drawn while the next is walked; not in the viewer",
        },
        Setting {
            key: "guard",
            values: Values::Number(0.0, 1000.0),
            default: "0.25",
            about: "width of a band around the picture that is as fine, in parts of its size; for level=certified",
        },
        Setting {
            key: "far",
            values: Values::Number(0.0, 1e6),
            default: "0",
            about: "draw distance as a multiple of eye height plus page length; 0 = unlimited",
        },
        Setting {
            key: "edge",
            values: Values::Number(0.01, 1e4),
            default: "20",
            about: "length of a triangle's side on the screen for level=uniform, as a multiple of the tolerance",
        },
        Setting {
            key: "blend",
            values: Values::Words(Blend::WORDS),
            default: "off",
            about: "morph of vertices with level=uniform: none, vertical, or along the edge into one of its ends",
        },
    ],
    needs: &[
        Need { key: "parts", other: "level", words: &["certified"] },
        Need { key: "guard", other: "level", words: &["certified"] },
        Need { key: "edge", other: "level", words: &["uniform"] },
        Need { key: "blend", other: "level", words: &["uniform"] },
    ],
    max_samples: u64::MAX,
    // The walk stores a mark for each sample along a row of pages.
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
    /// One for each row of pages. If rows are walked serially, the first is used for all.
    workers: Vec<Worker>,
    /// Length of a triangle's side in multiples of the tolerance; `None` with `level=certified`.
    edge: Option<f64>,
    /// Width of the band that is as fine as the picture, in parts of the picture's size.
    guard: f64,
    /// Draw distance in multiples of the sum of eye height and page length; 0 = unlimited.
    far: f64,
    blend: Blend,
    sequence: Sequence,
    topology: Topology,
    /// Maximum number of parts of a frame, and a buffer for one of them.
    parts: usize,
    part: DrawList,
    is_serial: bool,
    /// Number of triangles of the last frame.
    triangles_before: usize,
    /// Maximum number of indices of a frame as a triangle list, three per triangle.
    max_indices: usize,
    limits: Limits,
    empty: Geometry,
}

impl SortedStrips {
    fn new(field: Arc<Field>, settings: &Settings) -> Self {
        let grid = Grid::new(&field, (settings.number("page") as u32).ilog2(), MAX_PAGES);
        let cells = grid.side() as usize;
        let pages = (grid.count[0] * grid.count[1]) as usize;
        let topology = topology::of(settings.word("topology"));
        let sequence = Sequence::of(settings.word("order"));
        let level_is_certified = settings.word("level") == "certified";
        // Other settings need all triangles at once, or have a level function without a bound on the number of
        // triangles.
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
            empty: Geometry::default(),
        }
    }

    /// Finds the visible pages.
    fn find_pages(&mut self, view: &View) {
        let (field, grid, errors) = (&*self.field, self.pages.grid, &self.errors);
        let (mut visible, range) = (Vec::new(), errors.range());
        let frustum = view.frustum().within(view.eye, self.reach_m(view));
        if range[0] <= range[1] {
            Footprint::new(field, view, range).visit_pages(&grid, |at| {
                let page = errors.square(grid.level, at);
                let bounds = bounds(field, grid.level, at, page.range);
                if errors.has_terrain(at) && frustum.contains(&bounds) != Containment::Outside {
                    visible.push(at);
                }
            });
        }
        self.pages.set(visible);
    }

    /// Returns the draw distance in plan, metres (Finch & Bishop, §4.10).
    fn reach_m(&self, view: &View) -> f64 {
        if self.far == 0.0 || matches!(view.lens, Lens::Orthographic { .. }) {
            return f64::INFINITY;
        }
        let page_m = f64::from(self.pages.grid.side()) * self.field.spacing[0].max(self.field.spacing[1]);
        self.far * (eye_height_m(&self.field, view) + page_m)
    }

    /// Walks the rows of a frame: in parallel with one worker each, or serially with a single worker. Returns the
    /// number of vertices and indices of each row; `None` if they exceed the limits.
    fn walk(
        &self,
        levels: &impl Levels,
        traversal: &TraversalDirection,
        rows: &[Row],
        workers: &mut [Worker],
    ) -> Option<Vec<[usize; 2]>> {
        let (field, pages, shapes) = (&*self.field, &self.pages, &self.shapes);
        let context = WalkContext { field, pages, levels, shapes, traversal: *traversal, blend: self.blend };
        let fits = |[vertices, indices]: [usize; 2]| vertices <= self.limits.vertices && indices <= self.max_indices;
        if let [worker] = workers {
            let walk = |row: &Row| {
                let before = worker.stream.lengths();
                context.walk_on(row, worker);
                let after = worker.stream.lengths();
                fits(after).then(|| [0, 1].map(|k| after[k] - before[k]))
            };
            return rows.iter().map(walk).collect();
        }
        let sums = [AtomicUsize::new(0), AtomicUsize::new(0)];
        let walk = |(row, worker): (&Row, &mut Worker)| {
            // Begins no further row once the limits are exceeded.
            if !fits(sums.each_ref().map(|sum| sum.load(Relaxed))) {
                return None;
            }
            context.walk_on(row, worker);
            let own = worker.stream.lengths();
            fits([0, 1].map(|k| sums[k].fetch_add(own[k], Relaxed) + own[k])).then_some(own)
        };
        rows.par_iter().zip(workers).map(walk).collect()
    }

    /// Walks the frame's strips under the view's tolerance; returns the same as [`Self::walk`].
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

    /// Splits the squares that the view's tolerance requires; returns false if they are too many.
    fn split(&mut self, view: &View) -> bool {
        self.splits.clear();
        let visible = guarded(view, self.guard);
        // A split square adds at least six triangles.
        let max = self.max_indices / 18 + 1;
        Certified::new(&self.field, &self.errors, &self.pages, [view, &visible], max).split(&mut self.splits)
    }

    /// Splits the squares that the tolerance requires. Returns true if the frame fits the limits whatever triangles
    /// result.
    fn certainly_fits(&mut self, view: &View) -> bool {
        let is_split = self.split(view);
        let max = parts::max_triangles(self.pages.list().len(), self.splits.count());
        is_split && 3 * max <= self.max_indices && max <= self.limits.vertices
    }

    /// Walks one group of rows after the other over the squares already split, and calls `ready` after each but the
    /// last.
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
            let lengths = self.walk(&self.splits, traversal, group, workers).expect("the upper bound fits the limits");
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
            stream::join(&streams, streamed);
        }
        stream::push_draws(lengths, list);
        list.fraction_bits = self.blend.fraction_bits();
        self.sequence.arrange(list);
        topology::arrange(self.topology, list);
    }
}

impl Technique for SortedStrips {
    fn resident(&self) -> &Geometry {
        &self.empty
    }

    fn limits(&self) -> Limits {
        self.limits
    }

    fn select(&mut self, view: &View, list: &mut DrawList) {
        self.select_in_parts(view, list, &mut |_| ());
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

    fn in_parts(&mut self) -> Option<&mut dyn SelectInParts> {
        Some(self)
    }

    fn diagnostics(&self) -> Option<&dyn Diagnostics> {
        Some(self)
    }
}

impl SelectInParts for SortedStrips {
    fn select_in_parts(&mut self, view: &View, list: &mut DrawList, ready: &mut dyn FnMut(&DrawList)) {
        self.find_pages(view);
        list.reach_m = self.reach_m(view);
        let traversal = TraversalDirection::new(&self.field, view);
        let rows = self.pages.rows(&traversal);
        let mut workers = std::mem::take(&mut self.workers);
        workers.resize_with(rows.len().max(workers.len()).max(1), Worker::default);
        let is_serial = self.is_serial || self.triangles_before < MIN_PARALLEL;
        let of_frame = if is_serial { &mut workers[..1] } else { &mut workers[..] };
        if self.parts > 1 && self.certainly_fits(view) {
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
}

impl Diagnostics for SortedStrips {
    fn stats(&self) -> Vec<(&'static str, f64, &'static str)> {
        let pages = self.pages.grid.count.map(f64::from);
        vec![
            ("pages", pages[0] * pages[1], ""),
            ("visible pages", self.pages.list().len() as f64, ""),
            ("cells along a side of a page", f64::from(self.pages.grid.side()), ""),
            ("bytes of errors", self.errors.bytes() as f64, "B"),
        ]
    }
}
