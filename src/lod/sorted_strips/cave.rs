//! Draws the floor and the ceiling of a cave as one stream of triangles in front-to-back order.
//!
//! Finch & Bishop mention a second height field, whose triangles face down, as an extension. Both fields are walked at
//! once over one set of split squares that keeps the error bound of both. Each ceiling triangle therefore lies above a
//! floor triangle:
//! - **Order**: rays meet these pairs in the same order as the quads of one field. Within a pair the ceiling comes
//!   first if the eye is above its plane, otherwise the floor. A ray from an eye between the two meets only one of
//!   them. Nothing needs to be sorted.
//! - **Seam**: a rock vertex ([`Cave`]) is shared by both surfaces. Triangles with three rock vertices are omitted.
//!   Floor and ceiling end in the same edge there, at any levels.
//!
//! The error bound of each surface is relative to its own welded samples. A coarse triangle may be omitted over a
//! narrow cave: floor and ceiling are then both within their bounds of the omitted triangle, and the cave is closed
//! there.

use std::sync::Arc;

use rayon::prelude::*;

use super::blend::Blend;
use super::certified::{Certified, bounds, guarded};
use super::context::WalkContext;
use super::footprint::Footprint;
use super::measure::Errors;
use super::pages::{Grid, MAX_PAGES, Pages, Row, TraversalDirection};
use super::sequence::Sequence;
use super::shapes::Shapes;
use super::splits::Splits;
use super::stream::{self, MAX_TRIANGLES, Stream};
use super::topology;
use super::walk::Worker;
use crate::draw::{DrawKinds, DrawList, ExplicitVertex, Geometry, Limits, PipelineRequirements, Topology};
use crate::height::Field;
use crate::height::cave::Cave;
use crate::lod::settings::Settings;
use crate::lod::technique::{Diagnostics, Technique};
use crate::lod::within_limits::select_within_limits;
use crate::view::{Containment, Lens, View};

/// Sorted strips over a floor and a ceiling.
pub struct CaveStrips {
    cave: Arc<Cave>,
    /// Errors of floor and ceiling.
    errors: [Errors; 2],
    /// True for each page that contains anything but rock.
    is_open: Vec<bool>,
    shapes: Shapes,
    pages: Pages,
    splits: Splits,
    /// One for each row of pages.
    rows: Vec<RowWorker>,
    sequence: Sequence,
    topology: Topology,
    /// Maximum number of indices of a frame as a triangle list, three per triangle.
    max_indices: usize,
    limits: Limits,
    /// Width of the band that is as fine as the picture, in parts of the picture's size.
    guard: f64,
    empty: Geometry,
}

/// Checks that sorted strips with these settings draw caves.
///
/// # Errors
/// Returns one line that states the expected setting.
pub fn can_draw(settings: &Settings) -> Result<(), String> {
    if settings.word("order") == "painter" {
        return Err(
            "a ceiling: expected order=front, back or shuffled, found order=painter: it needs depth".to_string()
        );
    }
    match settings.word("level") {
        "certified" => Ok(()),
        level => Err(format!("a ceiling: expected level=certified, found level={level}")),
    }
}

/// Buffers of one row.
#[derive(Default)]
struct RowWorker {
    worker: Worker,
    pairs: Pairs,
}

impl CaveStrips {
    /// Measures both fields. Uses the settings `page`, `order`, `topology` and `guard`; levels are certified.
    pub fn new(cave: Arc<Cave>, settings: &Settings) -> Self {
        let grid = Grid::new(cave.floor(), (settings.number("page") as u32).ilog2(), MAX_PAGES);
        let (pages, cells) = (grid.count[0] as usize * grid.count[1] as usize, grid.side() as usize);
        let rows = grid.count[0].max(grid.count[1]) as usize;
        let topology = topology::of(settings.word("topology"));
        let max_indices = 3 * (4 * pages * cells * cells).min(MAX_TRIANGLES);
        let limits = Limits {
            draws: rows,
            instances: rows,
            vertices: (2 * pages * (cells + 1) * (cells + 1)).min(MAX_TRIANGLES),
            indices: topology::max_indices(topology, max_indices),
            ..Limits::default()
        };
        Self {
            errors: [cave.floor(), cave.ceiling()].map(|field| Errors::new(field, grid.level)),
            is_open: (0..pages as u32).into_par_iter().map(|k| is_open(&cave, &grid, k)).collect(),
            cave,
            shapes: Shapes::default(),
            pages: Pages::none(grid),
            splits: Splits::new(grid),
            rows: Vec::new(),
            sequence: Sequence::of(settings.word("order")),
            topology,
            max_indices,
            limits,
            guard: settings.number("guard"),
            empty: Geometry::default(),
        }
    }

    /// Finds the visible pages.
    fn find_pages(&mut self, view: &View) {
        let (field, grid, errors) = (self.cave.floor(), self.pages.grid, &self.errors);
        let (mut visible, frustum) = (Vec::new(), view.frustum());
        let range = joined(errors.each_ref().map(Errors::range));
        Footprint::new(field, view, range).visit_pages(&grid, |at| {
            let range = joined(errors.each_ref().map(|errors| errors.square(grid.level, at).range));
            let is_open = grid.index(at).is_some_and(|k| self.is_open[k]);
            if is_open && frustum.contains(&bounds(field, grid.level, at, range)) != Containment::Outside {
                visible.push(at);
            }
        });
        self.pages.set(visible);
    }

    /// Splits the squares that either field requires; returns false if they exceed the limits of any frame.
    fn split(&mut self, view: &View) -> bool {
        self.splits.clear();
        // A split square adds at least six triangles to the floor, and as many to the ceiling.
        let max = self.max_indices / 18 + 1;
        let visible = guarded(view, self.guard);
        [self.cave.floor(), self.cave.ceiling()].into_iter().zip(&self.errors).all(|(field, errors)| {
            Certified::new(field, errors, &self.pages, [view, &visible], max).split(&mut self.splits)
        })
    }

    /// Walks the rows of a frame; returns false if they exceed the limits.
    fn walk(&mut self, view: &View, traversal: &TraversalDirection, rows: &[Row]) -> bool {
        let (field, rays) = (&**self.cave.floor(), RaySource::new(self.cave.floor(), view));
        let (pages, levels, shapes) = (&self.pages, &self.splits, &self.shapes);
        let context = WalkContext { field, pages, levels, shapes, traversal: *traversal, blend: Blend::Off };
        rows.par_iter().zip(&mut self.rows).for_each(|(row, RowWorker { worker, pairs })| {
            worker.stream.clear();
            context.walk_on(row, worker);
            pairs.fill(&self.cave, &rays, &worker.stream);
        });
        let streams = || self.rows[..rows.len()].iter().map(|row| &row.pairs.stream);
        streams().map(|s| s.vertices.len()).sum::<usize>() <= self.limits.vertices
            && streams().map(|s| s.indices.len()).sum::<usize>() <= self.max_indices
    }

    fn fill(&self, rows: usize, list: &mut DrawList) {
        let streams: Vec<&Stream> = self.rows[..rows].iter().map(|row| &row.pairs.stream).collect();
        let lengths: Vec<_> = streams.iter().map(|stream| stream.lengths()).collect();
        stream::join(&streams, &mut list.streamed);
        stream::push_draws(&lengths, list);
        self.sequence.arrange(list);
        topology::arrange(self.topology, list);
    }
}

impl Technique for CaveStrips {
    fn resident(&self) -> &Geometry {
        &self.empty
    }

    fn limits(&self) -> Limits {
        self.limits
    }

    fn select(&mut self, view: &View, list: &mut DrawList) {
        self.find_pages(view);
        let traversal = TraversalDirection::new(self.cave.floor(), view);
        let rows = self.pages.rows(&traversal);
        self.rows.resize_with(rows.len().max(self.rows.len()), RowWorker::default);
        let fits = |wider: &View| (self.split(wider) && self.walk(wider, &traversal, &rows)).then_some(());
        list.tolerance_scale = select_within_limits(view, fits).1;
        self.fill(rows.len(), list);
    }

    fn pipeline_requirements(&self) -> PipelineRequirements {
        PipelineRequirements { draws: DrawKinds::explicit(self.topology), ..PipelineRequirements::default() }
    }

    fn keeps_tolerance(&self) -> bool {
        true
    }

    fn diagnostics(&self) -> Option<&dyn Diagnostics> {
        Some(self)
    }
}

impl Diagnostics for CaveStrips {
    fn stats(&self) -> Vec<(&'static str, f64, &'static str)> {
        let open = self.is_open.iter().filter(|is_open| **is_open).count();
        let bytes = self.errors.iter().map(Errors::bytes).sum::<usize>();
        vec![("pages", open as f64, ""), ("bytes of errors", bytes as f64, "B")]
    }
}

fn joined([a, b]: [[f32; 2]; 2]) -> [f32; 2] {
    [a[0].min(b[0]), a[1].max(b[1])]
}

/// Returns true if a page contains anything but rock.
fn is_open(cave: &Cave, grid: &Grid, page: u32) -> bool {
    let at = [page % grid.count[0], page / grid.count[0]];
    let samples = |k: usize| at[k] << grid.level..=((at[k] + 1) << grid.level).min(grid.last[k] as u32);
    samples(1).any(|j| samples(0).any(|i| !cave.is_rock(i, j)))
}

/// Origin of rays, in samples and metres: a point, or the direction opposite to parallel rays.
struct RaySource {
    from: [f64; 3],
    is_point: bool,
}

impl RaySource {
    fn new(field: &Field, view: &View) -> Self {
        let ([dx, dz], [x, z]) = (field.spacing, field.origin);
        let (eye, forward) = (view.eye, view.forward());
        match view.lens {
            Lens::Perspective { .. } => Self { from: [(eye.x - x) / dx, eye.y, (eye.z - z) / dz], is_point: true },
            Lens::Orthographic { .. } => Self { from: [-forward.x / dx, -forward.y, -forward.z / dz], is_point: false },
        }
    }

    /// Returns true if rays come from above the plane of a triangle that faces up.
    fn is_above(&self, triangle: [&ExplicitVertex; 3]) -> bool {
        let [a, b, c] = triangle.map(|v| [f64::from(v.position[0]), f64::from(v.height), f64::from(v.position[1])]);
        let from_a = |p: [f64; 3]| [0, 1, 2].map(|k| p[k] - a[k]);
        let ([bx, by, bz], [cx, cy, cz]) = (from_a(b), from_a(c));
        let [x, y, z] = if self.is_point { from_a(self.from) } else { self.from };
        x * (by * cz - bz * cy) + y * (bz * cx - bx * cz) + z * (bx * cy - by * cx) > 0.0
    }
}

/// Triangles of one row, each floor triangle with the ceiling triangle above it.
#[derive(Default)]
struct Pairs {
    stream: Stream,
    /// Index of the ceiling vertex above each floor vertex; the same vertex at rock.
    ceiling_vertices: Vec<u32>,
}

impl Pairs {
    fn fill(&mut self, cave: &Cave, rays: &RaySource, floor: &Stream) {
        let Self { stream: Stream { vertices, indices }, ceiling_vertices } = self;
        vertices.clear();
        vertices.extend_from_slice(&floor.vertices);
        ceiling_vertices.clear();
        indices.clear();
        for (k, vertex) in (0u32..).zip(&floor.vertices) {
            let [i, j] = vertex.position.map(|n| n as u32);
            if cave.is_rock(i, j) {
                ceiling_vertices.push(k);
            } else {
                let height = cave.ceiling().height(i, j);
                ceiling_vertices.push(vertices.len() as u32);
                vertices.push(ExplicitVertex { height, target: height, ..*vertex });
            }
        }
        let is_flat = |t: &[u32; 3]| {
            let [[ax, az], [bx, bz], [cx, cz]] = t.map(|k| floor.vertices[k as usize].position.map(i64::from));
            (bx - ax) * (cz - az) == (bz - az) * (cx - ax)
        };
        for low in floor.indices.as_chunks::<3>().0 {
            let high = low.map(|k| ceiling_vertices[k as usize]);
            if *low == high || is_flat(low) {
                continue;
            }
            let down = [high[0], high[2], high[1]];
            let is_above = rays.is_above(high.map(|k| &vertices[k as usize]));
            indices.extend(if is_above { [down, *low] } else { [*low, down] }.as_flattened());
        }
    }
}
