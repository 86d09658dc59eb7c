//! The walk: one row of pages, strip by strip, quad by quad, nearest first (Finch & Bishop, §4.4 to 4.7).
//!
//! A strip steps along the minor direction (`u`, to the right below), its front edge on one line of constant `v`:
//!
//! ```text
//!   ┌───────┬───────┐ · · behind: strips walked before       ─▸ u
//!   │       │   ┌───┤ rear fill-in strip, drawn when         │
//!   │   D   ├───┼───┤ the main strip splits after D          ▾ v
//!   │       │   │   │ the main strip goes on here
//!   └───────┴───┴───┘ front edge: stays where it is
//! ```
//!
//! - **Split.** Where the square ahead is split, the quad before it is drawn with a middle on its leading side (D), a
//!   strip of half the size fills the rear half as far as it can, and the strip goes on with half the step in the front
//!   half. A page is begun as one strip of its own size, which splits at once where it must: that is the published
//!   start of strips (§4.7).
//! - **End.** A rear strip ends at the first place where the quad of twice its size need not be split: it could only
//!   grow forward.
//! - **Merge.** There the strip in front of it doubles its step: its next quad reaches back over both (E).
//! - **Match.** In front of a quad of twice the size, two quads are drawn at once (C), which leave out the vertex that
//!   its front edge has not. In front of quads of half the size the vertex between them is added (B).
//!
//! Which vertices are behind is asked of a line of marks: for each `u` the last `v` at which a vertex was used. It is
//! the published map of vertices by frame, which needs one entry for each column only, as no strip looks further back.
//! Rows of pages are walked independently: the front edge of the row behind follows from the level function, and its
//! vertices are made again, as the paper copies them from page to page.

use super::blend::Blend;
use super::context::WalkContext;
use super::depth_sorter::{Crossing, DepthSorter};
use super::pages::{Pages, Row, Run, TraversalDirection, placed};
use super::shapes::{BACK, LEADING, Shape, TRAILING, slot};
use super::splits::Levels;
use crate::draw::{ExplicitVertex, Geometry};

/// Vertices and indices of a part of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stream {
    /// Vertices, each once.
    pub vertices: Vec<ExplicitVertex>,
    /// Three a triangle, nearest first, counted from the first vertex of their row.
    pub indices: Vec<u32>,
}

impl Stream {
    /// How many vertices and indices it has.
    pub fn lengths(&self) -> [usize; 2] {
        [self.vertices.len(), self.indices.len()]
    }

    /// Empties it and keeps its memory.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.indices.clear();
    }
}

/// All streams, one after the other; indices count from the first vertex of their own. Both are about as many bytes: one
/// core copies the vertices, and one the indices.
pub fn join_streams(streams: &[&Stream], into: &mut Geometry) {
    let Geometry { vertices, indices, .. } = into;
    vertices.clear();
    indices.clear();
    rayon::join(
        || streams.iter().for_each(|stream| vertices.extend_from_slice(&stream.vertices)),
        || streams.iter().for_each(|stream| indices.extend_from_slice(&stream.indices)),
    );
}

/// What walking a row needs and leaves: kept from frame to frame, it allocates nothing.
#[derive(Default)]
pub struct Worker {
    /// What was walked: rows follow each other in it until it is taken or cleared.
    pub stream: Stream,
    marks: Vec<Mark>,
    start: Vec<u32>,
    sorter: DepthSorter,
}

/// A vertex that is used but not made yet.
const UNMADE: u32 = u32::MAX;
/// No vertex is used in a column.
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

    /// One of the two children at the trailing side.
    fn child(self, is_front: bool) -> Square {
        Square { level: self.level - 1, column: 2 * self.column, row: 2 * self.row + i32::from(is_front) }
    }

    fn step(self, columns: i32) -> Square {
        Square { column: self.column + columns, ..self }
    }
}

/// The vertices of a quad's trailing side.
#[derive(Clone, Copy)]
struct Side {
    back: u32,
    middle: Option<u32>,
    front: u32,
}

/// The run that is being walked.
struct Walk<'a, L> {
    context: &'a WalkContext<'a, L>,
    stream: Stream,
    /// The row's first vertex in the stream: indices count from it.
    first_vertex: usize,
    /// The first corner: on the line behind the row, at the run's first side.
    origin: [i32; 2],
    /// Steps along the minor and the major direction, ±1.
    signs: [i32; 2],
    /// Where rays come from, counted from the first corner, and which of them the walk is not away from.
    crossing: Crossing,
    sorter: DepthSorter,
    /// Length of the run.
    length: i32,
    /// By column.
    marks: Vec<Mark>,
    /// Vertices on the run's first side.
    start: Vec<u32>,
    has_behind: bool,
    /// Whether the page beside the first one is drawn too.
    has_beside: bool,
    /// Whether (u, v) turns the other way than (x, z).
    mirrored: bool,
    /// Whether vertices may lie elsewhere than in their shape: the run sticks out of the field, or they slide.
    is_moved: bool,
}

impl<L: Levels> WalkContext<'_, L> {
    /// Walks a row of pages.
    pub fn walk(&self, row: &Row) -> Stream {
        let mut worker = Worker::default();
        self.walk_on(row, &mut worker);
        worker.stream
    }

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
        walk.marks.resize((longest as usize + 1).max(walk.marks.len()), Mark { v: UNUSED, vertex: UNMADE });
        walk.start.resize(side as usize + 1, UNMADE);
        let mut last_start = None;
        for run in &row.runs {
            walk.origin[0] = behind(run.sign, run.first);
            walk.signs[0] = run.sign;
            walk.length = run.pages * side;
            walk.crossing = self.traversal.crossing(walk.origin, walk.signs);
            // Two runs away from the same side share its vertices.
            if last_start != Some(walk.origin[0]) {
                walk.start.fill(UNMADE);
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
        self.marks[..=self.length as usize].fill(Mark { v: UNUSED, vertex: UNMADE });
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

    /// Draws a strip from a square on; its last back vertex. What it does at each square is the published pseudocode
    /// of §4.6.
    fn strip(&mut self, mut square: Square, mut side: Side) -> u32 {
        // By level: where the rear strip of that level ended that lies behind this one.
        let mut ended = [UNMADE; 32];
        while square.column << square.level < self.length {
            if self.is_parent_whole(square) {
                if square.row & 1 == 0 {
                    return side.back;
                }
                side = Side { back: ended[square.level as usize], middle: Some(side.back), front: side.front };
                square = square.parent();
            }
            if square.column == 0 {
                side.middle = self.start_middle(square);
            }
            if let (true, Some(middle)) = (self.is_split(square), side.middle) {
                let rear = Side { back: side.back, middle: None, front: middle };
                ended[square.level as usize - 1] = self.strip(square.child(false), rear);
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

    /// Whether the square of twice the size that begins here need not be split.
    #[inline]
    fn is_parent_whole(&self, square: Square) -> bool {
        square.column & 1 == 0 && square.level < self.context.pages.grid.level && !self.is_split(square.parent())
    }

    /// Whether the edge behind is that of a quad of twice the size: its front edge lacks the vertex between this
    /// square and the next.
    #[inline]
    fn matches_coarser(&self, square: Square) -> bool {
        let (u, v) = ((square.column + 1) << square.level, square.row << square.level);
        let begins = square.level < self.context.pages.grid.level && square.column & 1 == 0 && square.row & 1 == 0;
        begins && self.marks[u as usize].v != v && self.has_terrain_behind(u, v)
    }

    /// Whether there is a quad behind a column of a strip: beyond the field's edge all are flat, and the page behind
    /// the row may not be drawn, or later.
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

    /// The middle of a square's side on the run's first side, if either of its two squares is split.
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
        let [e, f, g] = middles.map(|(middle, _)| middle.unwrap_or(UNMADE));
        let shape = self.context.shapes.single(mask, self.is_rising(square));
        self.push(shape, [trailing.back, back, front, trailing.front, e, f, g, UNMADE], square, false);
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
        let mut slots = [UNMADE; 8];
        slots[..4].copy_from_slice(&[trailing.back, back, front, trailing.front]);
        slots[slot::M] = middle;
        self.push(self.context.shapes.pair(), slots, square, true);
        Side { back, middle: None, front }
    }

    /// The triangles of a quad, nearest first.
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

    /// The same where vertices may lie elsewhere than in their shape: triangles without area are left out.
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
        // Slots that the shape has not are none of a vertex.
        let places = slots.map(|slot| vertices.get(slot as usize).map_or([0.0; 2], place));
        shape.visit_in_order(&places, eye, |[a, b, c]| {
            let triangle = if mirrored { [a, c, b] } else { [a, b, c] }.map(|slot| slots[slot]);
            if has_area(vertices, triangle) {
                indices.extend(triangle);
            }
        });
    }

    /// Whether the diagonal goes from B to D, see [`rtin`](crate::height::rtin).
    #[inline]
    fn is_rising(&self, square: Square) -> bool {
        let [x, z] = self.world(square);
        ((x + z) & 1 == 0) == (self.signs[0] * self.signs[1] < 0)
    }

    #[inline]
    fn is_split(&self, square: Square) -> bool {
        self.context.levels.is_split(square.level, self.world(square))
    }

    /// A square's place on the lattice.
    #[inline]
    fn world(&self, square: Square) -> [i32; 2] {
        let place = |k: usize, n: i32| {
            let first = self.origin[k] >> square.level;
            if self.signs[k] > 0 { first + n } else { first - 1 - n }
        };
        placed(self.context.traversal.major, place(1, square.row), place(0, square.column))
    }

    /// The vertex behind, if it is used.
    #[inline]
    fn behind(&mut self, u: i32, v: i32) -> Option<u32> {
        let mark = self.marks[u as usize];
        if mark.v != v {
            return None;
        }
        if mark.vertex == UNMADE {
            self.marks[u as usize].vertex = self.vertex(u, v);
        }
        Some(self.marks[u as usize].vertex)
    }

    /// A new vertex on the strip's front edge.
    #[inline]
    fn front_vertex(&mut self, u: i32, v: i32) -> u32 {
        let vertex = self.vertex(u, v);
        self.marks[u as usize] = Mark { v, vertex };
        vertex
    }

    fn start_vertex(&mut self, v: i32) -> u32 {
        if self.start[v as usize] == UNMADE {
            self.start[v as usize] = self.vertex(0, v);
        }
        self.start[v as usize]
    }

    /// A new vertex: what sticks out of the field collapses onto its edge.
    #[inline]
    fn vertex(&mut self, u: i32, v: i32) -> u32 {
        let [u, v] = [self.origin[0] + self.signs[0] * u, self.origin[1] + self.signs[1] * v];
        let (at, last) = (placed(self.context.traversal.major, v, u), self.context.pages.grid.last);
        let position = [at[0].min(last[0]), at[1].min(last[1])];
        self.stream.vertices.push(self.context.vertex(position));
        (self.stream.vertices.len() - self.first_vertex) as u32 - 1
    }
}

/// Whether a triangle has any area in plan.
fn has_area(vertices: &[ExplicitVertex], triangle: [u32; 3]) -> bool {
    let [a, b, c] = triangle.map(|k| vertices[k as usize].position.map(i64::from));
    (b[1] - a[1]) * (c[0] - a[0]) != (b[0] - a[0]) * (c[1] - a[1])
}
