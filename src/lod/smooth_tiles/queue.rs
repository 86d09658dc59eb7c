//! Chooses the tiles whose chunks are rebuilt in a frame, a limited number of them (Larsen & Christensen, §3). A
//! pending tile keeps its chunk and level; neighbours stay within one level of each other.

use super::chunk;
use super::pool::Pool;
use super::tiles::Tiles;

/// Maximum that a frame may rebuild.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Number of chunks.
    pub chunks: usize,
    /// Number of vertices of all chunks.
    pub vertices: usize,
}

/// A tile that gets a new chunk.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Move {
    /// Index of the tile.
    pub tile: usize,
    /// Level of the new chunk.
    pub level: u32,
    /// Its first vertex in the buffer.
    pub first_vertex: u32,
}

/// Current chunks of all tiles, and their pending changes.
pub struct Queue {
    cells: i32,
    /// Level of each tile's chunk.
    pub levels: Vec<u32>,
    /// First vertex of each tile's chunk.
    pub first_vertices: Vec<u32>,
    pool: Pool,
    /// Rest of the frame's budget.
    left: Budget,
    moves: Vec<Move>,
    changed: Vec<usize>,
    /// Chunks by level; stored so that frames do not allocate.
    counts: Vec<usize>,
    /// True if the buffer could not hold a chunk of the last frame.
    is_short: bool,
}

impl Queue {
    /// Creates a queue with all tiles at their coarsest level. The buffer has at most `max_vertices` vertices, or more
    /// if the coarsest level requires it.
    pub fn new(tiles: &Tiles, max_vertices: usize) -> Self {
        let sizes: Vec<_> = (0..tiles.levels).map(|level| chunk::vertices(tiles.cells, level)).collect();
        let (top, count) = (tiles.levels - 1, tiles.total());
        let all_at = |levels: &[u32]| -> Vec<usize> {
            (0..tiles.levels).map(|level| if levels.contains(&level) { count } else { 0 }).collect()
        };
        // Twice the finest level in use, so that all tiles may change in one frame; at least the coarsest level.
        let whole = 2 * Pool::vertices_for(&sizes, &all_at(&[tiles.finest(), top]));
        let whole = whole.max(Pool::max_vertices(&sizes, count));
        let counts = Vec::with_capacity(sizes.len());
        let min = Pool::settled_vertices(&sizes, &all_at(&[top]));
        let mut pool = Pool::new(sizes, whole.min(max_vertices).max(min));
        let first_vertices =
            (0..count).map(|_| pool.take(top, 0).expect("the pool holds the coarsest level")).collect();
        let left = Budget { chunks: 0, vertices: 0 };
        let (levels, moves, changed) = (vec![top; count], Vec::new(), Vec::new());
        Self { cells: tiles.cells, levels, first_vertices, pool, left, moves, changed, counts, is_short: false }
    }

    /// Returns true if the buffer holds one chunk of these levels for each tile, with spare pages to change between
    /// them.
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

    /// Returns true if the buffer could not hold a chunk of the last frame.
    pub fn is_short(&self) -> bool {
        self.is_short
    }

    /// Returns the capacity of the buffer, vertices.
    pub fn vertices(&self) -> usize {
        self.pool.vertices()
    }

    /// Returns the number of chunks in the buffer, one for each tile.
    pub fn chunks(&self) -> usize {
        self.pool.held()
    }

    /// Returns the number of vertices of the pages in use.
    pub fn used_vertices(&self) -> usize {
        self.pool.used_vertices()
    }

    /// Returns true if the last frame rebuilt nothing. With the same aims the next one will not either.
    pub fn is_at_rest(&self) -> bool {
        self.moves.is_empty()
    }

    /// Moves tiles towards their aims within the budget: those that refine first, in order of rising `urgency`. Aims of
    /// neighbours must be within one level of each other.
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
        // Keeps only the last move of each tile, so that nothing is written twice.
        let (levels, first_vertices) = (&self.levels, &self.first_vertices);
        self.moves.retain(|m| (levels[m.tile], first_vertices[m.tile]) == (m.level, m.first_vertex));
        &self.moves
    }

    /// Returns true if all changes fit into this frame.
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
        // Tiles are unique, so this order equals that of a stable sort, which would allocate.
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

    /// Refines a tile to `level` or finer, towards its aim as far as its neighbours allow. First refines neighbours
    /// that would be too coarse beside it. Returns true if the tile has reached `level`.
    fn refine(&mut self, tiles: &Tiles, aims: &[u32], tile: usize, level: u32) -> bool {
        if self.left.chunks == 0 || self.levels[tile] <= level {
            return self.levels[tile] <= level;
        }
        let neighbours = tiles.neighbours(tile).into_iter().flatten();
        // Ends because each recursion requests a coarser level.
        if !neighbours.clone().all(|other| self.refine(tiles, aims, other, level + 1)) {
            return false;
        }
        let finest = neighbours.map(|other| self.levels[other].saturating_sub(1)).fold(aims[tile], u32::max);
        // Leaves some pages for tiles that coarsen, which then free others.
        self.rebuild(tile, finest, tiles.levels as usize)
    }

    /// Coarsens a tile towards its aim, as far as its neighbours allow.
    fn coarsen(&mut self, tiles: &Tiles, aims: &[u32], tile: usize) {
        let neighbours = tiles.neighbours(tile).into_iter().flatten();
        let level = neighbours.map(|other| self.levels[other] + 1).fold(aims[tile], u32::min);
        if level > self.levels[tile] {
            self.rebuild(tile, level, 0);
        }
    }

    /// Replaces a tile's chunk by one of another level, keeping `spare` pages empty. Returns false if the budget or the
    /// buffer is exhausted.
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
