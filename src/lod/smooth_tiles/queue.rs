//! Which tiles get new chunks in a frame: few at most, so that no frame takes long (Larsen & Christensen, §3). What
//! waits keeps its chunk and its level, and neighbours stay within one level of each other all the while.

use super::chunk;
use super::pool::Pool;
use super::tiles::Tiles;

/// The most that a frame may rebuild.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Chunks.
    pub chunks: usize,
    /// Vertices of them all.
    pub vertices: usize,
}

/// A tile that gets a new chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Move {
    /// Which tile.
    pub tile: usize,
    /// The level of the chunk.
    pub level: u32,
    /// Where it lies in the buffer.
    pub first_vertex: u32,
}

/// The chunks that tiles stand on, and those to come.
pub struct Queue {
    cells: i32,
    /// Level of each tile's chunk.
    pub levels: Vec<u32>,
    /// First vertex of each tile's chunk.
    pub first_vertices: Vec<u32>,
    pool: Pool,
    /// What is left of the frame's budget.
    left: Budget,
    moves: Vec<Move>,
    changed: Vec<usize>,
    /// Chunks by level of the question at hand; kept so that no frame allocates it.
    counts: Vec<usize>,
    /// True if a chunk of the last frame found no room in the buffer.
    is_short: bool,
}

impl Queue {
    /// All tiles at their coarsest level, and at most so many vertices, if those fit.
    pub fn new(tiles: &Tiles, max_vertices: usize) -> Self {
        let sizes: Vec<_> = (0..tiles.levels).map(|level| chunk::vertices(tiles.cells, level)).collect();
        let (top, count) = (tiles.levels - 1, tiles.total());
        let all_at = |levels: &[u32]| -> Vec<usize> {
            (0..tiles.levels).map(|level| if levels.contains(&level) { count } else { 0 }).collect()
        };
        // All of the finest level that is used, twice, so that all may change in one frame; the coarsest at least.
        let whole = 2 * Pool::vertices_for(&sizes, &all_at(&[tiles.finest(), top]));
        let whole = whole.max(Pool::max_vertices(&sizes, count));
        let min = Pool::settled_vertices(&sizes, &all_at(&[top]));
        let counts = Vec::with_capacity(sizes.len());
        let mut pool = Pool::new(sizes, whole.min(max_vertices).max(min));
        let first_vertices =
            (0..count).map(|_| pool.take(top, 0).expect("the pool holds the coarsest level")).collect();
        let left = Budget { chunks: 0, vertices: 0 };
        let (levels, moves, changed) = (vec![top; count], Vec::new(), Vec::new());
        Self { cells: tiles.cells, levels, first_vertices, pool, left, moves, changed, counts, is_short: false }
    }

    /// Returns true if the buffer holds chunks of these levels, one a tile, with the pages for moves between them.
    pub fn holds(&mut self, levels: impl Iterator<Item = u32>) -> bool {
        self.count(levels);
        Pool::settled_vertices(self.pool.sizes(), &self.counts) <= self.vertices()
    }

    /// Counts chunks by level into `counts`.
    fn count(&mut self, levels: impl Iterator<Item = u32>) {
        self.counts.clear();
        self.counts.resize(self.pool.sizes().len(), 0);
        levels.for_each(|level| self.counts[level as usize] += 1);
    }

    /// True if a chunk of the last frame found no room in the buffer.
    pub fn is_short(&self) -> bool {
        self.is_short
    }

    /// Vertices that the buffer holds.
    pub fn vertices(&self) -> usize {
        self.pool.vertices()
    }

    /// Chunks in the buffer: one a tile.
    pub fn chunks(&self) -> usize {
        self.pool.held()
    }

    /// Vertices of all pages of the buffer that are in use.
    pub fn used_vertices(&self) -> usize {
        self.pool.used_vertices()
    }

    /// Whether the last frame rebuilt nothing: the next one will not either, for the same aims.
    pub fn is_at_rest(&self) -> bool {
        self.moves.is_empty()
    }

    /// Moves tiles towards their aims, which are within one level of their neighbours', as far as the budget goes:
    /// those that refine first, and of them those of the smallest `urgency`.
    pub fn advance<U: PartialOrd>(
        &mut self,
        tiles: &Tiles,
        aims: &[u32],
        budget: Budget,
        urgency: impl Fn(usize) -> U,
    ) -> &[Move] {
        self.left = budget;
        self.is_short = false;
        self.moves.clear();
        let mut changed = std::mem::take(&mut self.changed);
        changed.clear();
        changed.extend((0..aims.len()).filter(|&tile| aims[tile] != self.levels[tile]));
        if self.all_fit(&changed, aims) {
            changed.iter().for_each(|&tile| _ = self.rebuild(tile, aims[tile], 0));
        } else {
            self.advance_in_turn(tiles, aims, &mut changed, urgency);
        }
        self.changed = changed;
        // Who moved twice is written once, and what was taken and given back not at all.
        let (levels, first_vertices) = (&self.levels, &self.first_vertices);
        self.moves.retain(|m| (levels[m.tile], first_vertices[m.tile]) == (m.level, m.first_vertex));
        &self.moves
    }

    /// Whether all may change in this frame.
    fn all_fit(&mut self, changed: &[usize], aims: &[u32]) -> bool {
        self.count(changed.iter().map(|&tile| aims[tile]));
        let vertices: usize = self.pool.sizes().iter().zip(&self.counts).map(|(size, n)| size * n).sum();
        changed.len() <= self.left.chunks && vertices <= self.left.vertices && self.pool.holds(&self.counts, 0)
    }

    fn advance_in_turn<U: PartialOrd>(
        &mut self,
        tiles: &Tiles,
        aims: &[u32],
        changed: &mut [usize],
        urgency: impl Fn(usize) -> U,
    ) {
        // By tile within each half, as a stable sort would leave them, but without its buffer.
        changed.sort_unstable_by_key(|&tile| (aims[tile] > self.levels[tile], tile));
        let (refining, coarsening) =
            changed.split_at_mut(changed.partition_point(|&tile| aims[tile] < self.levels[tile]));
        refining.sort_unstable_by(|&a, &b| urgency(a).partial_cmp(&urgency(b)).unwrap_or(std::cmp::Ordering::Equal));
        for &mut tile in refining {
            self.refine(tiles, aims, tile, aims[tile]);
        }
        coarsening.sort_unstable_by_key(|&tile| aims[tile]);
        for &mut tile in coarsening {
            self.coarsen(tiles, aims, tile);
        }
    }

    /// Refines a tile to a level, at least its aim, and if its neighbours allow beyond it; neighbours that would be too
    /// coarse beside it before. Whether it is there.
    fn refine(&mut self, tiles: &Tiles, aims: &[u32], tile: usize, level: u32) -> bool {
        if self.left.chunks == 0 || self.levels[tile] <= level {
            return self.levels[tile] <= level;
        }
        let neighbours = tiles.neighbours(tile).into_iter().flatten();
        // Each time for a coarser level: it comes to an end.
        if !neighbours.clone().all(|other| self.refine(tiles, aims, other, level + 1)) {
            return false;
        }
        let finest = neighbours.map(|other| self.levels[other].saturating_sub(1)).fold(aims[tile], u32::max);
        // Some pages are left for what coarsens, which frees others.
        self.rebuild(tile, finest, tiles.levels as usize)
    }

    /// Brings a tile towards its coarser aim, as far as its neighbours allow.
    fn coarsen(&mut self, tiles: &Tiles, aims: &[u32], tile: usize) {
        let neighbours = tiles.neighbours(tile).into_iter().flatten();
        let level = neighbours.map(|other| self.levels[other] + 1).fold(aims[tile], u32::min);
        if level > self.levels[tile] {
            self.rebuild(tile, level, 0);
        }
    }

    /// Gives a tile a chunk of another level, if there is room for it, leaving so many pages empty.
    fn rebuild(&mut self, tile: usize, level: u32, spare: usize) -> bool {
        let vertices = chunk::vertices(self.cells, level);
        if self.left.chunks == 0 || self.left.vertices < vertices {
            return false;
        }
        let Some(first_vertex) = self.pool.take(level, spare) else {
            self.is_short = true;
            return false;
        };
        self.left = Budget { chunks: self.left.chunks - 1, vertices: self.left.vertices - vertices };
        self.pool.give(self.first_vertices[tile]);
        (self.levels[tile], self.first_vertices[tile]) = (level, first_vertex);
        self.moves.push(Move { tile, level, first_vertex });
        true
    }
}
