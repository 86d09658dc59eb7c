//! Measures the error of the quads of each level against the samples, in advance.
//!
//! A square of level l is drawn as one quad, with or without middles on its sides, or as half of a pair that matches a
//! coarser quad. All triangles that it may be part of are measured, for every direction of the walk. Level 0 is exact
//! except for pairs, which deviate only along the coarser quad's edge; that deviation is in the coarser quad's error.

use rayon::prelude::*;

use super::shapes::{Shape, Shapes};
use crate::height::Field;
use crate::height::bounds::{KEPT_FROM, Square};
use crate::height::disk_cache::DiskCache;
use crate::height::surface::{self, Corner};

/// Maximum number of samples measured of a tiled field whose squares never repeat within a tile.
const MAX_SAMPLES: u64 = 1 << 22;

/// Errors and height ranges of all squares of a field up to a level.
pub struct Errors {
    last: [i32; 2],
    /// True for each axis that repeats.
    is_tiled: [bool; 2],
    /// From level 1.
    levels: Vec<PageErrors>,
    /// True for each square of the last level in which a triangle of the full-resolution surface has data.
    terrain: Vec<bool>,
}

/// Squares of a level. Those of a tiled axis are stored once.
struct PageErrors {
    count: [u32; 2],
    squares: Vec<Square>,
}

/// Corners in half sides from a square's first corner, by the parity of its place and by its quarter of its parent.
type Patterns = [[Vec<[[i32; 2]; 3]>; 4]; 2];

impl Errors {
    /// Measures a field up to level `max` in parallel, or reads the result from the disk cache.
    pub fn new(field: &Field, max: u32) -> Self {
        let (size, stored) = (field.size(), field.stored());
        let is_tiled = [0, 1].map(|k| size[k] > stored[k]);
        let mut errors = Self { last: size.map(|n| n as i32 - 1), is_tiled, levels: Vec::new(), terrain: Vec::new() };
        let is_large = stored.iter().map(|&n| u64::from(n)).product::<u64>() >= KEPT_FROM;
        let cache = is_large.then(|| DiskCache::new(field, &format!("strips-{max}"))).flatten();
        if cache.as_ref().and_then(DiskCache::read).is_some_and(|content| errors.fill(field, max, &content)) {
            return errors;
        }
        errors.measure(field, max);
        cache.inspect(|cache| cache.write(&errors.content()));
        errors
    }

    fn measure(&mut self, field: &Field, max: u32) {
        let patterns = patterns();
        for level in 1..=max {
            let level = self.measure_level(field, level, &patterns);
            self.levels.push(level);
        }
        self.terrain = self.measure_terrain(field, max);
    }

    /// Returns the measured data as bytes for the disk cache.
    fn content(&self) -> Vec<u8> {
        let squares = self.levels.iter().flat_map(|level| bytemuck::cast_slice(&level.squares));
        squares.copied().chain(self.terrain.iter().map(|&is_terrain| is_terrain.into())).collect()
    }

    /// Reads the data of a field of the same size. Returns false and changes nothing if the length does not match.
    fn fill(&mut self, field: &Field, max: u32, content: &[u8]) -> bool {
        let counts: Vec<_> = (1..=max).map(|level| self.count(field, level).unwrap_or([1, 1])).collect();
        let squares = |[x, z]: [u32; 2]| x as usize * z as usize;
        let lengths = counts.iter().map(|&count| squares(count) * size_of::<Square>());
        let terrain = counts.last().map_or(0, |&count| squares(count));
        if lengths.clone().sum::<usize>() + terrain != content.len() {
            return false;
        }
        let mut rest = content;
        for (&count, length) in counts.iter().zip(lengths) {
            let (own, after) = rest.split_at(length);
            self.levels.push(PageErrors { count, squares: bytemuck::pod_collect_to_vec(own) });
            rest = after;
        }
        self.terrain = rest.iter().map(|&byte| byte != 0).collect();
        true
    }

    fn measure_terrain(&self, field: &Field, level: u32) -> Vec<bool> {
        let count = self.levels[level as usize - 1].count;
        let is_terrain = |at: [u32; 2]| {
            let first = at.map(|n| (n as i32) << level);
            let last = [0, 1].map(|k| (first[k] + (1 << level)).min(self.last[k]));
            // Squares shared by many places have data if the field has.
            let anywhere = count == [1, 1] && self.is_tiled != [false; 2];
            if anywhere {
                surface::has_terrain(field, [0; 2], self.last)
            } else {
                surface::has_terrain(field, first, last)
            }
        };
        places(count).map(is_terrain).collect()
    }

    /// Returns true if a triangle of the full-resolution surface has data in a square of the last level.
    pub fn has_terrain(&self, at: [i32; 2]) -> bool {
        self.terrain[self.index(self.levels.len() as u32, at)]
    }

    /// Returns the size of the data, bytes.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|level| size_of_val(level.squares.as_slice())).sum()
    }

    /// Returns the error and height range of a square of a level from 1 on.
    #[inline]
    pub fn square(&self, level: u32, at: [i32; 2]) -> Square {
        let square = self.stored(level, at);
        if square.has_terrain() && self.is_tiled != [false; 2] && self.is_cut(level, at) {
            let parent =
                if self.levels.len() > level as usize { self.stored(level + 1, at.map(|n| n >> 1)) } else { square };
            return Square { error: parent.range[1] - parent.range[0], ..square };
        }
        square
    }

    #[inline]
    fn stored(&self, level: u32, at: [i32; 2]) -> Square {
        self.levels[level as usize - 1].squares[self.index(level, at)]
    }

    #[inline]
    fn index(&self, level: u32, at: [i32; 2]) -> usize {
        let count = self.levels[level as usize - 1].count;
        // A single shared square is used along an axis without tiling too.
        let repeats = |k: usize| self.is_tiled[k] || count[k] == 1;
        let [x, z] = [0, 1].map(|k| if repeats(k) { at[k] as u32 % count[k] } else { at[k] as u32 });
        z as usize * count[0] as usize + x as usize
    }

    /// Returns true if the end of a tiled field cuts a square, or the pair of it and the next, which were measured
    /// whole.
    fn is_cut(&self, level: u32, at: [i32; 2]) -> bool {
        (0..2).any(|k| self.is_tiled[k] && ((at[k] >> 1) + 1) << (level + 1) > self.last[k])
    }

    /// Returns the range of all heights, metres; the lowest exceeds the highest if there is no data.
    pub fn range(&self) -> [f32; 2] {
        self.levels.last().into_iter().flat_map(|level| &level.squares).fold(Square::NOTHING, |a, b| a.union(*b)).range
    }

    /// Returns the number of stored squares of a level along (x, z); `None` if they are too many to measure. Along a
    /// tiled axis they are stored until their position in the tile, and that of pairs of them, repeats, or up to the
    /// field's end.
    fn count(&self, field: &Field, level: u32) -> Option<[u32; 2]> {
        let stored = field.stored();
        let length = |k: usize| {
            let (side, stored, last) = (2u64 << level, u64::from(stored[k]), self.last[k] as u64);
            // Sides are powers of two, so their common factor with the tile is the tile's power of two.
            let repeats_after = stored * (side >> stored.trailing_zeros().min(level + 1));
            if self.is_tiled[k] { repeats_after.min(last) } else { last }
        };
        let lengths = [length(0), length(1)];
        let tile = stored.iter().map(|&n| u64::from(n)).product::<u64>();
        let fits = lengths[0] * lengths[1] <= tile.max(MAX_SAMPLES);
        fits.then(|| lengths.map(|length| length.div_ceil(1 << level) as u32))
    }

    fn measure_level(&self, field: &Field, level: u32, patterns: &Patterns) -> PageErrors {
        let Some(count) = self.count(field, level) else { return self.unbounded(field) };
        let squares = places(count).map(|at| self.measure_square(field, level, at.map(|n| n as i32), patterns));
        PageErrors { count, squares: squares.collect() }
    }

    /// Returns one square for all places: its triangles lie between the lowest and the highest sample.
    fn unbounded(&self, field: &Field) -> PageErrors {
        let heights = (0..field.samples().len()).map(|k| field.samples().height(k));
        let range = heights.fold(Square::NOTHING.range, |[low, high], y| [low.min(y), high.max(y)]);
        PageErrors { count: [1, 1], squares: vec![Square { error: range[1] - range[0], range }] }
    }

    fn measure_square(&self, field: &Field, level: u32, at: [i32; 2], patterns: &Patterns) -> Square {
        let inner = self.union_of_children(field, level, at);
        if !inner.has_terrain() {
            return inner;
        }
        let parity = ((at[0] + at[1]) & 1) as usize;
        let quarter = ((at[0] & 1) + 2 * (at[1] & 1)) as usize;
        let error = patterns[parity][quarter].iter().map(|t| self.deviation(field, level, at, t)).fold(0.0, f32::max);
        Square { error: error.max(inner.error), ..inner }
    }

    /// Returns the union of a square's four children.
    fn union_of_children(&self, field: &Field, level: u32, [x, z]: [i32; 2]) -> Square {
        if level == 1 {
            let first = [x << 1, z << 1];
            let last = [0, 1].map(|k| self.clamped(k, first[k] + 2));
            return Square { error: 0.0, range: range_of_data(field, first, last) };
        }
        let exists = |at: &[i32; 2]| (0..2).all(|k| self.is_tiled[k] || at[k] << (level - 1) < self.last[k]);
        let children = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[i, j]| [2 * x + i, 2 * z + j]);
        let stored = &self.levels[level as usize - 2];
        let child = |at: [i32; 2]| {
            let [x, z] = [0, 1].map(|k| at[k] as u32 % stored.count[k]);
            stored.squares[z as usize * stored.count[0] as usize + x as usize]
        };
        children.into_iter().filter(exists).map(child).fold(Square::NOTHING, Square::union)
    }

    /// Returns a coordinate along an axis; places beyond the field collapse onto its edge.
    fn clamped(&self, axis: usize, n: i32) -> i32 {
        if self.is_tiled[axis] { n } else { n.min(self.last[axis]) }
    }

    fn deviation(&self, field: &Field, level: u32, at: [i32; 2], triangle: &[[i32; 2]; 3]) -> f32 {
        let corners = triangle.map(|halves| {
            let [x, z] = [0, 1].map(|k| self.clamped(k, (2 * at[k] + halves[k]) << (level - 1)));
            Corner { x, z, y: field.height(x as u32, z as u32) }
        });
        if surface::doubled_area(&corners) == 0 { 0.0 } else { surface::deviation(field, &corners) }
    }
}

/// Returns the places of a level's squares, row by row.
fn places([x_count, z_count]: [u32; 2]) -> impl IndexedParallelIterator<Item = [u32; 2]> {
    let count = x_count as usize * z_count as usize;
    (0..count).into_par_iter().map(move |k| [k % x_count as usize, k / x_count as usize].map(|n| n as u32))
}

/// Returns the range of all heights between two positions if any sample there has data; it may be alone among holes.
fn range_of_data(field: &Field, first: [i32; 2], last: [i32; 2]) -> [f32; 2] {
    let samples = || (first[1]..=last[1]).flat_map(|j| (first[0]..=last[0]).map(move |i| (i as u32, j as u32)));
    if field.holes().count() > 0 && samples().all(|(i, j)| field.is_hole(i, j)) {
        return Square::NOTHING.range;
    }
    samples().map(|(i, j)| field.height(i, j)).fold(Square::NOTHING.range, |[low, high], y| [low.min(y), high.max(y)])
}

/// Returns the eight maps of (along the strip, forward) onto (x, z): mirrored along either axis, and exchanged.
fn orientations() -> impl Iterator<Item = (bool, [bool; 2])> {
    (0..8).map(|k| (k & 1 != 0, [k & 2 != 0, k & 4 != 0]))
}

/// Maps corners inside a square of `size` half sides onto the lattice, facing up.
fn orient(corners: [[i32; 2]; 3], size: i32, (exchanged, mirrored): (bool, [bool; 2])) -> [[i32; 2]; 3] {
    let mut corners = corners.map(|[u, v]| {
        let [x, z] = if exchanged { [v, u] } else { [u, v] };
        [if mirrored[0] { size - x } else { x }, if mirrored[1] { size - z } else { z }]
    });
    if exchanged ^ mirrored[0] ^ mirrored[1] {
        corners.swap(1, 2);
    }
    corners
}

/// Returns every triangle that a square may be part of.
fn patterns() -> Patterns {
    let shapes = Shapes::default();
    let corners = |shape: &Shape| shape.triangles.iter().map(|&t| shape.corners(t)).collect::<Vec<_>>();
    let single = |parity: usize| {
        let shapes = &shapes;
        orientations().flat_map(move |orientation| {
            // Mirroring flips the diagonal, exchanging the axes does not.
            let rising = (parity == 0) == (orientation.1[0] ^ orientation.1[1]);
            let triangles: Vec<_> = shapes.singles(rising).iter().flat_map(corners).collect();
            triangles.into_iter().map(move |t| orient(t, 2, orientation)).collect::<Vec<_>>()
        })
    };
    // A pair fills the half of its parent beside the coarser quad.
    let pair = |quarter: i32| {
        orientations()
            .flat_map(move |orientation| {
                corners(Shapes::default().pair()).into_iter().map(move |t| orient(t, 4, orientation))
            })
            .map(move |t| t.map(|[x, z]| [x - 2 * (quarter & 1), z - 2 * (quarter >> 1)]))
    };
    [0, 1].map(|parity| {
        [0, 1, 2, 3].map(|quarter| {
            // Keeps only triangles that overlap the square; pairs on its parent's other sides do not.
            let touches = |t: &[[i32; 2]; 3]| (0..2).all(|k| t.iter().any(|p| p[k] > 0) && t.iter().any(|p| p[k] < 2));
            let mut all: Vec<_> = single(parity).chain(pair(quarter).filter(touches)).map(rotated).collect();
            all.sort_unstable();
            all.dedup();
            all
        })
    })
}

/// Returns the triangle rotated to begin with its smallest corner.
fn rotated([a, b, c]: [[i32; 2]; 3]) -> [[i32; 2]; 3] {
    [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap_or([a, b, c])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::{Holes, Samples};

    #[test]
    fn patterns_face_up() {
        for triangles in patterns().as_flattened() {
            assert!((12..30).contains(&triangles.len()), "{}", triangles.len());
            for [a, b, c] in triangles {
                assert!((b[1] - a[1]) * (c[0] - a[0]) > (b[0] - a[0]) * (c[1] - a[1]));
            }
        }
    }

    #[test]
    fn cache_content_round_trips() {
        let rough = |size: [u32; 2], by: u32| {
            let heights = (0..size[0] * size[1]).map(|k| ((k * by) % 1009) as f32).collect();
            Field::new(Samples::F32(heights), size, [1.0; 2], Holes::none((size[0] * size[1]) as usize))
        };
        for field in [rough([75, 52], 7919), rough([64, 32], 7919).tiled([2, 2]), rough([41, 32], 7919).tiled([2, 1])] {
            let measured = Errors::new(&field, 4);
            let content = measured.content();
            let mut again = Errors { levels: Vec::new(), terrain: Vec::new(), ..Errors::new(&field, 1) };
            assert!(again.fill(&field, 4, &content));
            assert_eq!(again.content(), content);
            let last = field.size().map(|n| (n as i32 - 2) >> 2);
            assert_eq!(again.square(2, last), measured.square(2, last));
            let mut short = Errors { levels: Vec::new(), terrain: Vec::new(), ..Errors::new(&field, 1) };
            assert!(!short.fill(&field, 4, &content[1..]) && !short.fill(&field, 3, &content));
        }
    }

    /// Compares a tiled field with a stored copy of all its tiles. The tiled one may use at most 1/`share` of the
    /// bytes.
    fn check_against_stored(size: [u32; 2], tiles: [u32; 2], share: usize) {
        let heights = (0..size[0] * size[1]).map(|k| ((k * 7919) % 1009) as f32).collect::<Vec<_>>();
        let field = Field::new(Samples::F32(heights), size, [1.0; 2], Holes::none(0)).tiled(tiles);
        let [w, h] = field.size();
        let stored = (0..w * h).map(|k| field.height(k % w, k / w)).collect();
        let stored = Field::new(Samples::F32(stored), [w, h], [1.0; 2], Holes::none(0));
        let (tiled, whole) = (Errors::new(&field, 4), Errors::new(&stored, 4));
        assert!(tiled.bytes() <= whole.bytes() / share);
        for level in 1..=4 {
            for (x, z) in (0..w as i32 >> level).flat_map(|x| (0..h as i32 >> level).map(move |z| (x, z))) {
                let (of_tiled, exact) = (tiled.square(level, [x, z]), whole.square(level, [x, z]));
                assert!(of_tiled.error >= exact.error && of_tiled.range[0] <= exact.range[0]);
                let is_inside = (x / 2 + 1) << (level + 1) < w as i32 && (z / 2 + 1) << (level + 1) < h as i32;
                assert!(!is_inside || of_tiled == exact, "level {level} at ({x}, {z})");
            }
        }
    }

    #[test]
    fn tiled_fields_are_measured_once() {
        check_against_stored([64, 32], [3, 2], 3);
    }

    /// Squares whose position differs in every tile are measured in each tile.
    #[test]
    fn tiles_of_any_period_are_measured_exactly() {
        for (size, tiles) in [([41, 30], [4, 5]), ([64, 24], [3, 6]), ([3, 2], [20, 31]), ([17, 32], [40, 3])] {
            check_against_stored(size, tiles, 1);
        }
    }
}
