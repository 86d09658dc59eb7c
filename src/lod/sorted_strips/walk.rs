//! Walks one row of pages, strip by strip and quad by quad, nearest first (Finch & Bishop, §4.4 to 4.7).
//!
//! A strip steps along the minor direction (`u`, to the right in the diagram) with its front edge on a line of constant
//! `v`:
//!
//! ```text
//!   ┌───────┬───────┐ · · behind: strips walked before       ─▸ u
//!   │       │   ┌───┤ rear fill-in strip, drawn when         │
//!   │   D   ├───┼───┤ the main strip splits after D          ▾ v
//!   │       │   │   │ the main strip goes on here
//!   └───────┴───┴───┘ front edge: stays where it is
//! ```
//!
//! - **Split.** If the square ahead is split, the quad before it is drawn with a middle on its leading side (D). A
//!   strip of half the size fills the rear half as far as it can. The main strip continues in the front half with half
//!   the step. A page begins as one strip of its own size, which splits at once if needed: the published start of
//!   strips (§4.7).
//! - **End.** A rear strip ends at the first place where the quad of twice its size need not be split, because it could
//!   only grow forward.
//! - **Merge.** There the strip in front of it doubles its step: its next quad covers both (E).
//! - **Match.** In front of a quad of twice the size, two quads are drawn at once (C), without the middle vertex that
//!   its front edge lacks. In front of quads of half the size the vertex between them is added (B).
//!
//! Vertices behind a strip are found in an array of marks: for each `u`, the last `v` at which a vertex was used. This
//! is the published map of vertices by frame, reduced to one entry per column, because no strip looks further back.
//! Rows of pages are walked independently. The front edge of the row behind follows from the level function. Its
//! vertices are generated again, as the paper copies them from page to page.

use super::blend::Blend;
use super::context::WalkContext;
use super::depth_sorter::{Crossing, DepthSorter};
use super::pages::{Pages, Row, Run, TraversalDirection, placed};
use super::shapes::{BACK, LEADING, Shape, TRAILING, slot};
use super::splits::Levels;
use super::stream::Stream;
use crate::draw::ExplicitVertex;

/// Buffers for walking rows, reused from frame to frame without allocation.
#[derive(Default)]
pub struct Worker {
    /// Output. Rows are appended until it is taken or cleared.
    pub stream: Stream,
    marks: Vec<Mark>,
    start: Vec<u32>,
    sorter: DepthSorter,
}

/// A vertex that is used but not generated yet.
const NO_VERTEX: u32 = u32::MAX;
/// Mark of a column without a used vertex.
const UNUSED: i32 = -1;

/// The last vertex used in a column.
#[derive(Clone, Copy)]
struct Mark {
    v: i32,
    vertex: u32,
}

/// A square by its level and place, counted from the run's first corner.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Square {
    level: u32,
    column: i32,
    row: i32,
}

impl Square {
    fn parent(self) -> Square {
        Square { level: self.level + 1, column: self.column >> 1, row: self.row >> 1 }
    }

    /// Returns one of the two children at the trailing side.
    fn child(self, is_front: bool) -> Square {
        Square { level: self.level - 1, column: 2 * self.column, row: 2 * self.row + i32::from(is_front) }
    }

    fn step(self, columns: i32) -> Square {
        Square { column: self.column + columns, ..self }
    }
}

/// Vertices of a quad's trailing side.
#[derive(Clone, Copy)]
struct Side {
    back: u32,
    middle: Option<u32>,
    front: u32,
}

/// State of the walk of one run.
struct Walk<'a, L> {
    context: &'a WalkContext<'a, L>,
    stream: Stream,
    /// First vertex of the row in the stream, from which indices count.
    first_vertex: usize,
    /// First corner: on the line behind the row, at the run's first side.
    origin: [i32; 2],
    /// Steps along the minor and the major direction, ±1.
    signs: [i32; 2],
    /// Origin of rays relative to the first corner, and the rays against the walk.
    crossing: Crossing,
    sorter: DepthSorter,
    /// Length of the run, samples.
    length: i32,
    /// Marks by column.
    marks: Vec<Mark>,
    /// Vertices on the run's first side.
    start: Vec<u32>,
    has_behind: bool,
    /// True if the page beside the first one is drawn too.
    has_beside: bool,
    /// True if (u, v) has the opposite orientation to (x, z).
    mirrored: bool,
    /// True if vertices may differ from their places in the shape: the run extends beyond the field, or vertices slide.
    is_moved: bool,
}

impl<L: Levels> WalkContext<'_, L> {
    /// Walks a row of pages and appends it to the worker's stream.
    pub fn walk_on(&self, row: &Row, worker: &mut Worker) {
        let side = self.pages.grid.side();
        let behind = |sign: i32, n: i32| (if sign > 0 { n } else { n + 1 }) * side;
        let longest = row.runs.iter().map(|run| run.pages * side).max().unwrap_or(0);
        let mut walk = Walk {
            context: self,
            first_vertex: worker.stream.vertices.len(),
            stream: std::mem::take(&mut worker.stream),
            origin: [0, behind(row.sign, row.row)],
            signs: [0, row.sign],
            crossing: Crossing::default(),
            sorter: std::mem::take(&mut worker.sorter),
            length: 0,
            marks: std::mem::take(&mut worker.marks),
            start: std::mem::take(&mut worker.start),
            has_behind: false,
            has_beside: false,
            mirrored: false,
            is_moved: false,
        };
        // Each run fills its own part of the marks.
        walk.marks.resize((longest as usize + 1).max(walk.marks.len()), Mark { v: UNUSED, vertex: NO_VERTEX });
        walk.start.resize(side as usize + 1, NO_VERTEX);
        let mut last_start = None;
        for run in &row.runs {
            walk.origin[0] = behind(run.sign, run.first);
            walk.signs[0] = run.sign;
            walk.length = run.pages * side;
            walk.crossing = self.traversal.crossing(walk.origin, walk.signs);
            // Two runs away from the same side share its vertices.
            if last_start != Some(walk.origin[0]) {
                walk.start.fill(NO_VERTEX);
            }
            last_start = Some(walk.origin[0]);
            walk.run(row, run);
        }
        *worker = Worker { stream: walk.stream, marks: walk.marks, start: walk.start, sorter: walk.sorter };
    }
}

impl<L: Levels> Walk<'_, L> {
    fn run(&mut self, row: &Row, run: &Run) {
        let WalkContext { pages, traversal: TraversalDirection { major, .. }, .. } = *self.context;
        let level = pages.grid.level;
        let page = |row: i32, column: i32| placed(major, row, column);
        // Positions grow with (u, v) or with (v, u).
        self.mirrored = (self.signs[0] * self.signs[1] > 0) == (major == 0);
        self.has_beside = pages.is_drawn(page(row.row, run.first - run.sign));
        let sticks_out = (0..2).any(|k| {
            let end = if k == major { row.row } else { run.first.max(run.first + run.sign * (run.pages - 1)) } + 1;
            end * pages.grid.side() > pages.grid.last[k]
        });
        self.is_moved = sticks_out || matches!(self.context.blend, Blend::End(_));
        self.marks[..=self.length as usize].fill(Mark { v: UNUSED, vertex: NO_VERTEX });
        for n in 0..run.pages {
            if row.has_behind && pages.is_drawn(page(row.row - row.sign, run.first + n * run.sign)) {
                self.mark_behind(Square { level, column: n, row: -1 });
            }
        }
        self.has_behind = row.has_behind;
        let side = Side { back: self.start_vertex(0), middle: None, front: self.start_vertex(pages.grid.side()) };
        self.strip(Square { level, column: 0, row: 0 }, side);
        self.sorter.finish(&mut self.stream.indices);
    }

    /// Marks the vertices of the front edges behind the row.
    fn mark_behind(&mut self, square: Square) {
        if self.is_split(square) {
            let child = square.child(true);
            self.mark_behind(child);
            return self.mark_behind(child.step(1));
        }
        for column in [square.column, square.column + 1] {
            self.marks[(column << square.level) as usize].v = 0;
        }
    }

    /// Draws a strip from a square on and returns its last back vertex. Each step is the published pseudocode of §4.6.
    fn strip(&mut self, mut square: Square, mut side: Side) -> u32 {
        // By level: the last vertex of the rear strip of that level behind this one.
        let mut rear_ends = [NO_VERTEX; 32];
        while square.column << square.level < self.length {
            if self.is_parent_whole(square) {
                if square.row & 1 == 0 {
                    return side.back;
                }
                side = Side { back: rear_ends[square.level as usize], middle: Some(side.back), front: side.front };
                square = square.parent();
            }
            if square.column == 0 {
                side.middle = self.start_middle(square);
            }
            if let (true, Some(middle)) = (self.is_split(square), side.middle) {
                let rear = Side { back: side.back, middle: None, front: middle };
                rear_ends[square.level as usize - 1] = self.strip(square.child(false), rear);
                side = Side { back: middle, middle: None, front: side.front };
                square = square.child(true);
            } else if self.matches_coarser(square) {
                side = self.pair(square, side);
                square = square.step(2);
            } else {
                side = self.quad(square, side);
                square = square.step(1);
            }
        }
        side.back
    }

    /// Returns true if the square of twice the size that begins here need not be split.
    #[inline]
    fn is_parent_whole(&self, square: Square) -> bool {
        square.column & 1 == 0 && square.level < self.context.pages.grid.level && !self.is_split(square.parent())
    }

    /// Returns true if the edge behind is that of a quad of twice the size, whose front edge lacks the vertex between
    /// this square and the next.
    #[inline]
    fn matches_coarser(&self, square: Square) -> bool {
        let (u, v) = ((square.column + 1) << square.level, square.row << square.level);
        let begins = square.level < self.context.pages.grid.level && square.column & 1 == 0 && square.row & 1 == 0;
        begins && self.marks[u as usize].v != v && self.has_terrain_behind(u, v)
    }

    /// Returns true if there is a quad behind a column of a strip. Beyond the field's edge all quads are flat, and the
    /// page behind the row may not be drawn, or only later.
    #[inline]
    fn has_terrain_behind(&self, u: i32, v: i32) -> bool {
        let Pages { grid, .. } = self.context.pages;
        let is_beyond =
            self.origin[1] + self.signs[1] * v >= grid.last[self.context.traversal.major] && self.signs[1] < 0;
        if v > 0 || is_beyond {
            return !is_beyond;
        }
        let [x, z] = self.world(Square { level: 0, column: u, row: -1 });
        self.has_behind && self.context.pages.is_drawn([x >> grid.level, z >> grid.level])
    }

    /// Returns the middle of a square's side on the run's first side, if either of the two adjacent squares is split.
    fn start_middle(&mut self, square: Square) -> Option<u32> {
        let is_needed = self.is_split(square) || self.has_beside && self.is_split(square.step(-1));
        is_needed.then(|| self.start_vertex((2 * square.row + 1) << (square.level - 1)))
    }

    /// Draws a quad and returns its leading side.
    #[inline]
    fn quad(&mut self, square: Square, trailing: Side) -> Side {
        let Square { level, column, row } = square;
        let (size, half) = (1 << level, (1 << level) >> 1);
        let [u, v] = [column << level, row << level];
        let middle_behind = if half > 0 { self.behind(u + half, v) } else { None };
        let back = self.behind(u + size, v).unwrap_or_else(|| self.vertex(u + size, v));
        let is_split_ahead = u + size < self.length && self.is_split(square.step(1));
        let middle = is_split_ahead.then(|| self.vertex(u + size, v + half));
        let front = self.front_vertex(u + size, v + size);
        let middles = [(middle_behind, BACK), (trailing.middle, TRAILING), (middle, LEADING)];
        let mask = middles.iter().map(|(middle, bit)| if middle.is_some() { *bit } else { 0 }).sum();
        let [e, f, g] = middles.map(|(middle, _)| middle.unwrap_or(NO_VERTEX));
        let shape = self.context.shapes.single(mask, self.is_rising(square));
        self.push(shape, [trailing.back, back, front, trailing.front, e, f, g, NO_VERTEX], square, false);
        Side { back, middle, front }
    }

    /// Draws two quads that match a coarser one behind and returns their leading side.
    fn pair(&mut self, square: Square, trailing: Side) -> Side {
        let Square { level, column, row } = square;
        let size = 1 << level;
        let [u, v] = [column << level, row << level];
        let back = self.behind(u + 2 * size, v).unwrap_or_else(|| self.vertex(u + 2 * size, v));
        let middle = self.front_vertex(u + size, v + size);
        let front = self.front_vertex(u + 2 * size, v + size);
        let mut slots = [NO_VERTEX; 8];
        slots[..4].copy_from_slice(&[trailing.back, back, front, trailing.front]);
        slots[slot::M] = middle;
        self.push(self.context.shapes.pair(), slots, square, true);
        Side { back, middle: None, front }
    }

    /// Appends the triangles of a quad, nearest first.
    #[inline]
    fn push(&mut self, shape: &Shape, slots: [u32; 8], square: Square, is_pair: bool) {
        let Square { level, column, row } = square;
        let (size, [u, v]) = (1 << level, [column << level, row << level]);
        let (to_halves, [x, z]) = (2.0 / f64::from(size), self.crossing.eye);
        let eye = [(x - f64::from(u)) * to_halves, (z - f64::from(v)) * to_halves];
        if self.crossing.is_any() {
            let page = self.context.pages.grid.level;
            let first = self.stream.indices.len();
            self.sorter.begin(&self.crossing, page, (level, [column, row]), is_pair, first);
        }
        if self.is_moved {
            return self.push_moved(shape, slots, [u, v], size, eye);
        }
        let (mirrored, indices) = (self.mirrored, &mut self.stream.indices);
        shape.visit_in_order(shape.places, eye, |[a, b, c]| {
            indices.extend(if mirrored { [a, c, b] } else { [a, b, c] }.map(|slot| slots[slot]));
        });
    }

    /// The same for vertices that may differ from their places in the shape; omits triangles without area.
    #[cold]
    fn push_moved(&mut self, shape: &Shape, slots: [u32; 8], [u, v]: [i32; 2], size: i32, eye: [f64; 2]) {
        let (major, unit) = (self.context.traversal.major, f64::from(1 << self.context.blend.fraction_bits()));
        let (mirrored, Stream { vertices, indices }) = (self.mirrored, &mut self.stream);
        let vertices = &vertices[self.first_vertex..];
        let place = |vertex: &ExplicitVertex| {
            let along = |k: usize, position: i32, first: i32| {
                let along = (f64::from(position) / unit - f64::from(self.origin[k])) * f64::from(self.signs[k]);
                (along - f64::from(first)) * 2.0 / f64::from(size)
            };
            [along(0, vertex.position[1 - major], u), along(1, vertex.position[major], v)]
        };
        // Slots that the shape does not use have no vertex.
        let places = slots.map(|slot| vertices.get(slot as usize).map_or([0.0; 2], place));
        shape.visit_in_order(&places, eye, |[a, b, c]| {
            let triangle = if mirrored { [a, c, b] } else { [a, b, c] }.map(|slot| slots[slot]);
            if has_area(vertices, triangle) {
                indices.extend(triangle);
            }
        });
    }

    /// Returns true if the diagonal is from B to D, see [`rtin`](crate::height::rtin).
    #[inline]
    fn is_rising(&self, square: Square) -> bool {
        let [x, z] = self.world(square);
        ((x + z) & 1 == 0) == (self.signs[0] * self.signs[1] < 0)
    }

    #[inline]
    fn is_split(&self, square: Square) -> bool {
        self.context.levels.is_split(square.level, self.world(square))
    }

    /// Returns a square's place on the lattice.
    #[inline]
    fn world(&self, square: Square) -> [i32; 2] {
        let place = |k: usize, n: i32| {
            let first = self.origin[k] >> square.level;
            if self.signs[k] > 0 { first + n } else { first - 1 - n }
        };
        placed(self.context.traversal.major, place(1, square.row), place(0, square.column))
    }

    /// Returns the vertex behind a position, if one is used there.
    #[inline]
    fn behind(&mut self, u: i32, v: i32) -> Option<u32> {
        let mark = self.marks[u as usize];
        if mark.v != v {
            return None;
        }
        if mark.vertex == NO_VERTEX {
            self.marks[u as usize].vertex = self.vertex(u, v);
        }
        Some(self.marks[u as usize].vertex)
    }

    /// Generates a vertex on the strip's front edge.
    #[inline]
    fn front_vertex(&mut self, u: i32, v: i32) -> u32 {
        let vertex = self.vertex(u, v);
        self.marks[u as usize] = Mark { v, vertex };
        vertex
    }

    fn start_vertex(&mut self, v: i32) -> u32 {
        if self.start[v as usize] == NO_VERTEX {
            self.start[v as usize] = self.vertex(0, v);
        }
        self.start[v as usize]
    }

    /// Generates a vertex. Vertices beyond the field collapse onto its edge.
    #[inline]
    fn vertex(&mut self, u: i32, v: i32) -> u32 {
        let [u, v] = [self.origin[0] + self.signs[0] * u, self.origin[1] + self.signs[1] * v];
        let (at, last) = (placed(self.context.traversal.major, v, u), self.context.pages.grid.last);
        let position = [at[0].min(last[0]), at[1].min(last[1])];
        self.stream.vertices.push(self.context.vertex(position));
        (self.stream.vertices.len() - self.first_vertex) as u32 - 1
    }
}

/// Returns true if a triangle has any area in plan.
fn has_area(vertices: &[ExplicitVertex], triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|k| vertices[k as usize].position.map(i64::from));
    (b[1] - a[1]) * (c[0] - a[0]) != (b[0] - a[0]) * (c[1] - a[1])
}
