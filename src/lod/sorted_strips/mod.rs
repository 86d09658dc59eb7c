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
//!   one direction. `order=back` turns the list round: both orders are the same triangles;
//! - a quad's triangles are ordered too, by the eye's side of the lines between them, and so are quads in the eye's own
//!   row and column of pages, where some rays go against the walk ([`order`]);
//! - blending moves heights only, and only with `level=uniform`: the neck has no vertices between samples, which the
//!   paper's variant in three dimensions needs, and a bound would be spent on it;
//! - pages are culled by boxes around their land, and those without land are no part of the footprint: holes stay.
//!
//! The surface is made of the samples at quads' corners and middles; plain quads have the crate's alternating
//! diagonals, but a quad next to finer ones is a fan: the surface is no right-triangle mesh, and which of two levels
//! gives way where they meet depends on the direction of the walk. The bound covers all of it.
//!
//! Laws kept: watertight, covered once, error within tolerance (`level=certified`), no state between views.

pub mod cave;
pub mod certified;
pub mod footprint;
pub mod join;
pub mod measure;
pub mod order;
pub mod pages;
pub mod shapes;
pub mod splits;
pub mod table;
pub mod walk;

use std::sync::Arc;
use std::sync::atomic::AtomicUsize;
use std::sync::atomic::Ordering::Relaxed;

use rayon::prelude::*;

use self::cave::CaveStrips;
use self::certified::{Certified, bounds};
use self::footprint::Footprint;
use self::join::{join, starts};
use self::measure::Errors;
use self::pages::{Gaze, Grid, Pages, Row};
use self::shapes::Shapes;
use self::splits::{Levels, Splits};
use self::table::Radial;
use self::walk::{Ground, Stream, Worker};
use super::{Entry, Setting, Settings, Technique, Values, Variant, widened};
use crate::draw::{Draw, DrawList, Geometry, Instance, Limits, Source, Topology};
use crate::height::Field;
use crate::height::cave::Cave;
use crate::view::{Containment, View};

/// The most triangles of a frame, whatever the tolerance: buffers are made for them. Beyond it the tolerance is
/// widened.
const MOST_TRIANGLES: usize = 1 << 21;
/// The most pages: beyond it they are made larger.
const MOST_PAGES: u64 = 1 << 16;

/// The row of the table.
pub const ENTRY: Entry = Entry {
    name: "sorted-strips",
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
            values: Values::Words(&["front", "back"]),
            default: "front",
            about: "whether the nearest triangle comes first, or the furthest",
        },
        Setting {
            key: "edge",
            values: Values::Number(0.01, 1e4),
            default: "20",
            about: "length of a triangle's side on the screen for level=uniform, in tolerances",
        },
        Setting {
            key: "blend",
            values: Values::Words(&["off", "height"]),
            default: "off",
            about: "whether vertices of level=uniform go over into the next level, or are there at once",
        },
    ],
    most_samples: u64::MAX,
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
    /// One a row of pages, or one for all.
    workers: Vec<Worker>,
    /// Length of a triangle's side, tolerances, if levels are uniform.
    edge: Option<f64>,
    blends: bool,
    is_back_to_front: bool,
    is_serial: bool,
    limits: Limits,
    nothing: Geometry,
}

impl SortedStrips {
    fn new(field: Arc<Field>, settings: &Settings) -> Self {
        let grid = Grid::new(&field, (settings.number("page") as u32).ilog2(), MOST_PAGES);
        let cells = grid.side() as usize;
        let pages = (grid.count[0] * grid.count[1]) as usize;
        let limits = Limits {
            draws: grid.count[0].max(grid.count[1]) as usize,
            instances: grid.count[0].max(grid.count[1]) as usize,
            vertices: (pages * (cells + 1) * (cells + 1)).min(MOST_TRIANGLES),
            indices: 3 * (2 * pages * cells * cells).min(MOST_TRIANGLES),
            upload_bytes: 0,
        };
        Self {
            errors: Errors::new(&field, grid.level),
            field,
            shapes: Shapes::default(),
            pages: Pages::none(grid),
            splits: Splits::new(grid),
            workers: Vec::new(),
            edge: (settings.word("level") == "uniform").then(|| settings.number("edge")),
            blends: settings.word("blend") == "height" && settings.word("level") == "uniform",
            is_back_to_front: settings.word("order") == "back",
            is_serial: settings.variant() == Some("serial"),
            limits,
            nothing: Geometry::default(),
        }
    }

    /// Finds the pages in sight.
    fn look(&mut self, view: &View) {
        let (field, grid, errors) = (&*self.field, self.pages.grid, &self.errors);
        let (mut seen, frustum, range) = (Vec::new(), view.frustum(), errors.range());
        if range[0] <= range[1] {
            Footprint::new(field, view, range).visit_pages(&grid, |at| {
                let page = errors.square(grid.level, at);
                let bounds = bounds(field, grid.level, at, page.range);
                if errors.has_land(at) && frustum.contains(&bounds) != Containment::Outside {
                    seen.push(at);
                }
            });
        }
        self.pages.set(seen);
    }

    /// Walks the rows of a frame, each into a worker of its own in parallel, or one after the other into the first; its
    /// last index by row. `None` if they would not fit the limits.
    fn walk(&self, levels: &impl Levels, gaze: &Gaze, rows: &[Row], workers: &mut [Worker]) -> Option<Vec<usize>> {
        let (field, pages, shapes, limits) = (&*self.field, &self.pages, &self.shapes, self.limits);
        let ground = Ground { field, pages, levels, shapes, gaze: *gaze, blends: self.blends };
        let has_room = |vertices: usize, indices: usize| vertices <= limits.vertices && indices <= limits.indices;
        if self.is_serial {
            let worker = &mut workers[0];
            let walk = |row: &Row| {
                ground.walk_on(row, worker);
                let Stream { vertices, indices } = &worker.stream;
                has_room(vertices.len(), indices.len()).then_some(indices.len())
            };
            return rows.iter().map(walk).collect();
        }
        let (vertices, indices) = (AtomicUsize::new(0), AtomicUsize::new(0));
        let walk = |(row, worker): (&Row, &mut Worker)| {
            // Once there is too much, no further row is begun.
            if !has_room(vertices.load(Relaxed), indices.load(Relaxed)) {
                return None;
            }
            ground.walk_on(row, worker);
            let Stream { vertices: v, indices: i } = &worker.stream;
            let [v, i] = [(&vertices, v.len()), (&indices, i.len())].map(|(sum, n)| (sum.fetch_add(n, Relaxed) + n, n));
            has_room(v.0, i.0).then_some(i.1)
        };
        rows.par_iter().zip(workers).map(walk).collect()
    }

    /// The frame's strips under the view's tolerance, as [`Self::walk`] leaves them.
    fn strips(&mut self, view: &View, gaze: &Gaze, rows: &[Row], workers: &mut [Worker]) -> Option<Vec<usize>> {
        for worker in &mut *workers {
            worker.stream.clear();
        }
        if let Some(edge) = self.edge {
            let levels = Radial::uniform(&self.field, view, edge * view.tolerance.px, self.pages.grid.level);
            let levels = if self.blends { levels.blending(self.pages.grid.level) } else { levels };
            return self.walk(&levels, gaze, rows, workers);
        }
        self.splits.clear();
        // A split square has at least six triangles more.
        let most = self.limits.indices / 18 + 1;
        let certified = Certified::new(&self.field, &self.errors, &self.pages, view, most);
        if certified.split(&mut self.splits) { self.walk(&self.splits, gaze, rows, workers) } else { None }
    }

    fn fill(&self, ends: &[usize], workers: &mut [Worker], list: &mut DrawList) {
        let streamed = &mut list.streamed;
        if self.is_serial {
            let Stream { vertices, indices } = &mut workers[0].stream;
            std::mem::swap(&mut streamed.vertices, vertices);
            std::mem::swap(&mut streamed.indices, indices);
        } else {
            let streams: Vec<&Stream> = workers[..ends.len()].iter().map(|worker| &worker.stream).collect();
            join_streams(&streams, streamed);
        }
        let mut first = 0;
        for (batch, &end) in (0u32..).zip(ends) {
            list.instances.push(Instance { batch, ..Instance::default() });
            let end = if self.is_serial { end as u32 } else { first + end as u32 };
            let (source, topology) = (Source::Streamed, Topology::Triangles);
            let instances = batch..batch + 1;
            list.draws.push(Draw { source, topology, indices: first..end, instances, first_vertex: 0 });
            first = end;
        }
        if self.is_back_to_front {
            turn_round(list);
        }
    }
}

/// All streams, one after the other.
fn join_streams(streams: &[&Stream], into: &mut Geometry) {
    let vertices: Vec<_> = streams.iter().map(|stream| stream.vertices.as_slice()).collect();
    let indices: Vec<_> = streams.iter().map(|stream| stream.indices.as_slice()).collect();
    let bases = starts(vertices.iter().map(|of_row| of_row.len()));
    join(&vertices, &mut into.vertices, |_, vertex| vertex);
    join(&indices, &mut into.indices, |row, index| bases[row] as u32 + index);
}

/// Turns the order of all triangles round.
fn turn_round(list: &mut DrawList) {
    let count = list.streamed.indices.len() as u32;
    list.streamed.indices.reverse();
    // Each triangle's own three too: they turn as before.
    list.streamed.indices.chunks_exact_mut(3).for_each(|t| t.reverse());
    list.draws.reverse();
    list.draws.iter_mut().for_each(|draw| draw.indices = count - draw.indices.end..count - draw.indices.start);
}

impl Technique for SortedStrips {
    fn resident(&self) -> &Geometry {
        &self.nothing
    }

    fn limits(&self) -> Limits {
        self.limits
    }

    fn select(&mut self, view: &View, list: &mut DrawList) {
        self.look(view);
        let gaze = Gaze::new(&self.field, view);
        let rows = self.pages.rows(&gaze);
        let mut workers = std::mem::take(&mut self.workers);
        let count = if self.is_serial { 1 } else { rows.len() };
        workers.resize_with(count.max(workers.len()), Worker::default);
        let (ends, widening) = widened(view, |wider| self.strips(wider, &gaze, &rows, &mut workers));
        self.fill(&ends, &mut workers, list);
        self.workers = workers;
        list.widening = widening;
    }

    fn keeps_tolerance(&self) -> bool {
        self.edge.is_none()
    }

    fn figures(&self) -> Vec<(&'static str, f64, &'static str)> {
        let pages = self.pages.grid.count.map(f64::from);
        vec![
            ("pages", pages[0] * pages[1], ""),
            ("pages in sight", self.pages.list().len() as f64, ""),
            ("cells along a side of a page", f64::from(self.pages.grid.side()), ""),
            ("bytes of errors", self.errors.bytes() as f64, "B"),
        ]
    }
}
