//! Bounds of a quadtree over a field, measured before any view: the height range of each square, and the distance of its
//! surface from the samples.
//!
//! A square of level ℓ is `cells` × `cells` cells with vertices on every 2^ℓ-th sample. A tiled field is measured on its
//! stored samples only. If its period is a multiple of a square's side, or the other way round, equal squares are
//! measured once. Otherwise the vertices of a square may lie on any samples, and [`levels::detail`] bounds its error for
//! all of them, less tightly.

mod cuts;
mod measure;
mod square;

use rayon::prelude::*;

use super::disk_cache::DiskCache;
use super::field::Field;
use super::levels::{self, Patch};
use super::progress::Progress;
use super::surface;
use measure::is_aligned;

pub use measure::{Measure, ROUNDING};
pub use square::Square;

/// Stored samples from which on bounds are cached on disk; smaller fields are measured in a moment.
pub(crate) const KEPT_FROM: u64 = 1 << 23;

/// Samples up to which a tiled field with holes is measured whole.
///
/// Only a whole measurement tells which squares have terrain where the field's end or a square's edge cuts a period.
const WHOLE_UP_TO: u64 = 1 << 22;

/// All squares of a field.
pub struct Bounds {
    measure: Measure,
    last: [u32; 2],
    period: [Option<u32>; 2],
    levels: Vec<BoundsLevel>,
    /// By level, the error of the cells that the end of a tiled field cuts; 0 where errors are not measured.
    cuts: Vec<f32>,
}

/// The squares of one level. Along a tiled axis they begin at every multiple of the side within the period.
struct BoundsLevel {
    side: u32,
    count: [u32; 2],
    squares: Vec<Square>,
}

impl Bounds {
    /// Measures a field in parallel, or reads the bounds from the disk cache.
    pub fn new(field: &Field, measure: Measure, progress: &Progress) -> Self {
        let (stored, size) = (field.stored(), field.size());
        let samples = |size: [u32; 2]| size.iter().map(|&n| u64::from(n)).product::<u64>();
        let is_whole = field.holes().count() > 0 && samples(size) <= WHOLE_UP_TO;
        let period = [0, 1].map(|k| (size[k] > stored[k] && !is_whole).then_some(stored[k]));
        let mut bounds = Self { measure, last: size.map(|n| n - 1), period, levels: Vec::new(), cuts: Vec::new() };
        bounds.lay_out(size[0].max(size[1]) - 1);
        bounds.cuts.resize(bounds.levels.len(), 0.0);
        let is_large = samples(stored) >= KEPT_FROM;
        let cache = is_large.then(|| DiskCache::new(field, &measure.name())).flatten();
        if cache.as_ref().and_then(DiskCache::read).is_some_and(|content| bounds.fill(&content)) {
            return bounds;
        }
        // Each level reads all samples, so all levels take about as long.
        progress.expect(bounds.levels.iter().map(|level| level.samples()).sum());
        (0..bounds.levels()).for_each(|level| bounds.measure_level(field, level, progress));
        if measure.errors && period != [None; 2] {
            let [low, high] = bounds.square(bounds.levels() - 1, [0, 0]).range;
            bounds.cuts = cuts::errors(field, measure, bounds.levels(), low.abs().max(high.abs()));
        }
        cache.inspect(|cache| cache.write(&bounds.content()));
        bounds
    }

    /// Allocates the levels, up to the one whose square covers the longer side of the field.
    fn lay_out(&mut self, longest: u32) {
        loop {
            let side = self.side(self.levels());
            let count = [0, 1].map(|k| self.period[k].unwrap_or(self.last[k]).div_ceil(side));
            let squares = vec![Square::NOTHING; (count[0] * count[1]) as usize];
            self.levels.push(BoundsLevel { side, count, squares });
            if side >= longest {
                return;
            }
        }
    }

    /// Returns all squares, level by level, and then the errors of cut cells, as bytes.
    fn content(&self) -> Vec<u8> {
        let squares = self.levels.iter().flat_map(|level| bytemuck::cast_slice::<_, u8>(&level.squares));
        squares.chain(bytemuck::cast_slice(&self.cuts)).copied().collect()
    }

    /// Restores the bytes of [`Self::content`]; returns false if their number does not fit this layout.
    fn fill(&mut self, content: &[u8]) -> bool {
        if content.len() != self.bytes() + size_of_val(self.cuts.as_slice()) {
            return false;
        }
        let mut rest = content;
        for level in &mut self.levels {
            let (own, after) = rest.split_at(size_of_val(level.squares.as_slice()));
            bytemuck::cast_slice_mut(&mut level.squares).copy_from_slice(own);
            rest = after;
        }
        bytemuck::cast_slice_mut(&mut self.cuts).copy_from_slice(rest);
        true
    }

    /// Returns the number of levels; one square of the last covers the field.
    #[inline]
    pub fn levels(&self) -> u32 {
        self.levels.len() as u32
    }

    /// Returns the measured squares of a level: their number (x, z), and all of them row by row. Along a tiled axis
    /// they begin at every multiple of the side within the period.
    pub fn held(&self, level: u32) -> ([u32; 2], &[Square]) {
        let level = &self.levels[level as usize];
        (level.count, &level.squares)
    }

    /// Returns the period of the field along (x, z), samples; `None` along an axis that is measured whole.
    pub fn period(&self) -> [Option<u32>; 2] {
        self.period
    }

    /// Returns the error, metres, of the cells of a level that the end of a tiled field cuts.
    ///
    /// It is infinite where no bound was found. The height range of a cell bounds its error as well.
    pub fn cut(&self, level: u32) -> f32 {
        self.cuts[level as usize]
    }

    /// Returns the size of all squares in bytes.
    pub fn bytes(&self) -> usize {
        self.levels.iter().map(|level| size_of_val(level.squares.as_slice())).sum()
    }

    /// Returns the samples along a side of a square of a level.
    #[inline]
    pub fn side(&self, level: u32) -> u32 {
        self.measure.cells << level
    }

    /// Returns true if a square extends beyond the field.
    pub fn is_partial(&self, level: u32, at: [u32; 2]) -> bool {
        let side = self.side(level);
        (at[0] + 1) * side > self.last[0] || (at[1] + 1) * side > self.last[1]
    }

    /// Returns the square at a position among those of its level.
    #[inline]
    pub fn square(&self, level: u32, at: [u32; 2]) -> Square {
        if let [None, None] = self.period {
            let held = &self.levels[level as usize];
            return held.squares[(at[1] * held.count[0] + at[0]) as usize];
        }
        self.tiled_square(level, at)
    }

    /// Returns the four squares in a square of the level above; those beyond the field have no terrain.
    #[inline]
    pub fn squares(&self, level: u32, [i, j]: [u32; 2]) -> [Square; 4] {
        let (side, last) = (self.side(level), self.last);
        let square = |i: u32, j: u32| {
            let is_beyond = i * side >= last[0] || j * side >= last[1];
            if is_beyond { Square::NOTHING } else { self.square(level, [i, j]) }
        };
        let (i, j) = (2 * i, 2 * j);
        [square(i, j), square(i + 1, j), square(i, j + 1), square(i + 1, j + 1)]
    }

    fn tiled_square(&self, level: u32, at: [u32; 2]) -> Square {
        let side = self.side(level);
        let square = self.covering(level, at.map(|n| n * side), [side; 2]);
        if !square.has_terrain() || !self.is_partial(level, at) {
            return square;
        }
        // The end of a tiled field cuts squares that are measured whole.
        let [low, high] = square.range;
        Square { error: square.error.max(self.cut(level).min(high - low)), ..square }
    }

    /// Returns common bounds of all squares of a level that a rectangle of samples touches.
    pub fn covering(&self, level: u32, first: [u32; 2], side: [u32; 2]) -> Square {
        let held = &self.levels[level as usize];
        let [(x, x_count), (z, z_count)] = [0, 1].map(|k| held.touched(k, self.period[k], first[k], side[k]));
        let mut all = Square::NOTHING;
        for j in (z..z + z_count).map(|j| j % held.count[1]) {
            for i in (x..x + x_count).map(|i| i % held.count[0]) {
                all = all.union(held.squares[(j * held.count[0] + i) as usize]);
            }
        }
        all
    }

    fn measure_level(&mut self, field: &Field, level: u32, progress: &Progress) {
        let BoundsLevel { side, count, .. } = self.levels[level as usize];
        let squares = (0..count[0] * count[1]).into_par_iter().map(|k| {
            let first = [k % count[0], k / count[0]].map(|n| n * side);
            let square = self.measured(field, level, first);
            progress.advance(u64::from(side) * u64::from(side));
            square
        });
        self.levels[level as usize].squares = squares.collect();
    }

    fn measured(&self, field: &Field, level: u32, first: [u32; 2]) -> Square {
        let side = self.side(level);
        // At most one period, or up to the end.
        let reach = [0, 1].map(|k| self.period[k].map_or((self.last[k] - first[k]).min(side), |n| n.min(side)));
        let children = match level {
            0 => Square { error: 0.0, range: range_of_terrain(field, first, reach) },
            _ => self.covering(level - 1, first, reach),
        };
        if !children.has_terrain() {
            return Square::NOTHING;
        }
        let [low, high] = children.range;
        let aligned = (0..2).all(|k| self.period[k].is_none_or(|n| is_aligned(n, level, side)));
        let own = if !self.measure.errors || level == 0 {
            0.0
        } else if aligned {
            self.error(field, level, first)
        } else {
            // Level 1 is the first that differs from the samples. The sides may be of the next level.
            let levels = if level == 1 { 1..=2 } else { level + 1..=level + 1 };
            children.error + levels.map(|level| levels::detail(field, first, reach, level)).sum::<f32>()
        };
        let rounding = if self.measure.morph && own > 0.0 { low.abs().max(high.abs()) * ROUNDING } else { 0.0 };
        Square { error: (own + rounding).max(children.error * self.measure.growth), range: children.range }
    }

    /// Returns the error of a square whose vertices lie on known samples, metres.
    fn error(&self, field: &Field, level: u32, first: [u32; 2]) -> f32 {
        let last = [0, 1].map(|k| if self.period[k].is_some() { u32::MAX } else { self.last[k] });
        // Cells beyond the field collapse; one period stands for all.
        let length = self.period.map(|period| period.unwrap_or(u32::MAX).min(self.side(level)));
        let patch = |level: u32| Patch { field, first, cells: length.map(|n| n >> level), level, last };
        let own = patch(level).deviation();
        // Children that morph into the square have sides two levels coarser than themselves.
        let way = if self.measure.morph { patch(level - 1).stitched_deviation(2) } else { 0.0 };
        own.max(way).max(patch(level).stitched_deviation(1))
    }
}

impl BoundsLevel {
    /// Returns the number of samples that measuring its squares reads.
    fn samples(&self) -> u64 {
        [self.count[0], self.count[1], self.side, self.side].map(u64::from).iter().product()
    }

    /// Returns the squares along an axis that a length of samples touches: the first and the number, modulo their count.
    fn touched(&self, axis: usize, period: Option<u32>, first: u32, length: u32) -> (u32, u32) {
        let (side, count) = (self.side, self.count[axis]);
        let Some(period) = period else {
            let last = ((first + length - 1) / side).min(count - 1);
            return (first / side, last + 1 - first / side);
        };
        let (at, end) = (first % period, first % period + length - 1);
        if length >= period {
            (0, count)
        } else if end < period {
            (at / side, end / side + 1 - at / side)
        } else {
            (at / side, (count - at / side + (end - period) / side + 1).min(count))
        }
    }
}

fn range_of_terrain(field: &Field, first: [u32; 2], reach: [u32; 2]) -> [f32; 2] {
    let last = [0, 1].map(|k| first[k] + reach[k]);
    if !surface::has_terrain(field, first.map(|n| n as i32), last.map(|n| n as i32)) {
        return Square::NOTHING.range;
    }
    field.range_of(first, last)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::surface::{Corner, deviation};
    use crate::height::{Holes, Samples, rtin};

    const MEASURE: Measure = Measure { cells: 8, growth: 1.0, errors: true, morph: false };

    fn rough(size: [u32; 2], seed: u32) -> Field {
        let count = (size[0] * size[1]) as usize;
        let mut state = seed;
        let mut random = || {
            state = state.wrapping_mul(1664525).wrapping_add(1013904223);
            (state >> 8) as f32 / (1 << 24) as f32
        };
        let heights = (0..count as u32).map(|k| {
            let wave = ((k % size[0]) as f32 / 5.0).sin() + ((k / size[0]) as f32 / 9.0).cos();
            20.0 * wave + 3.0 * random()
        });
        Field::new(Samples::F32(heights.collect()), size, [1.0; 2], Holes::none(count))
    }

    /// Returns the same terrain with every sample of every tile in memory.
    fn held(field: &Field) -> Field {
        let [w, h] = field.size();
        let heights = (0..w * h).map(|k| field.height(k % w, k / w)).collect();
        Field::new(Samples::F32(heights), [w, h], field.spacing, Holes::none((w * h) as usize))
    }

    fn squares(bounds: &Bounds) -> Vec<(u32, [u32; 2])> {
        let count = |level: u32, k: usize| bounds.last[k].div_ceil(bounds.side(level));
        let of = |level: u32| {
            let [w, h] = [count(level, 0), count(level, 1)];
            (0..w * h).map(move |k| (level, [k % w, k / w]))
        };
        (0..bounds.levels()).flat_map(of).collect()
    }

    /// The error of a square's own triangles the slow way, its sides on or off the next level.
    fn slow_error(field: &Field, level: u32, at: [u32; 2], stitched: bool) -> f32 {
        let last = field.size().map(|n| n as i32 - 1);
        let corner = |[i, j]: [i32; 2]| {
            let fall = |n: i32, on: bool| if stitched && on { n & !1 } else { n };
            let (on_x, on_z) = (i == 0 || i == 8, j == 0 || j == 8);
            let place = [fall(i, on_z && !on_x), fall(j, on_x && !on_z)];
            let [x, z] = [0, 1].map(|k| ((at[k] as i32 * 8 + place[k]) << level).min(last[k]));
            Corner { x, z, y: field.height(x as u32, z as u32) }
        };
        let triangles = (0..8).flat_map(|j| (0..8).flat_map(move |i| rtin::cell(i, j)));
        let triangles = triangles.map(|t| t.map(corner)).filter(|t| surface::doubled_area(t) != 0);
        triangles.map(|t| deviation(field, &t)).fold(0.0, f32::max)
    }

    #[test]
    fn progress_ends_at_its_end_and_not_before() {
        let progress = Progress::default();
        assert_eq!(progress.share(), None);
        let bounds = Bounds::new(&rough([75, 52], 3), MEASURE, &progress);
        assert_eq!(progress.share(), Some(1.0));
        progress.expect(bounds.levels.iter().map(BoundsLevel::samples).sum());
        assert_eq!(progress.share(), Some(0.5));
    }

    #[test]
    fn errors_are_those_of_the_triangles() {
        let field = rough([75, 52], 3);
        let bounds = Bounds::new(&field, MEASURE, &Progress::default());
        assert_eq!(bounds.levels(), 5);
        for (level, at) in squares(&bounds) {
            // Level 0 has none of its own.
            let shapes = [false, true].into_iter().filter(|_| level > 0);
            let slow = shapes.map(|stitched| slow_error(&field, level, at, stitched)).fold(0.0, f32::max);
            let inner = (0..4).filter(|_| level > 0).map(|k| [2 * at[0] + k % 2, 2 * at[1] + k / 2]);
            let inside = inner.filter(|child| (0..2).all(|k| child[k] * bounds.side(level - 1) < bounds.last[k]));
            let slow = inside.map(|child| bounds.square(level - 1, child).error).fold(slow, f32::max);
            let error = bounds.square(level, at).error;
            assert!((error - slow).abs() <= 1e-5 * slow, "level {level} at {at:?}: {error} m, slowly {slow} m");
        }
    }

    /// Returns the error of the four children the slow way, with sides two levels coarser.
    fn slow_way(field: &Field, level: u32, at: [u32; 2]) -> f32 {
        let last = field.size().map(|n| n as i32 - 1);
        let sample = |[i, j]: [i32; 2]| {
            let [x, z] = [(i, 0), (j, 1)].map(|(n, k)| ((at[k] as i32 * 16 + n) << (level - 1)).min(last[k]));
            Corner { x, z, y: field.height(x as u32, z as u32) }
        };
        let corner = |[i, j]: [i32; 2]| {
            let along = match (i % 16 == 0, j % 16 == 0) {
                (true, false) => 1,
                (false, true) => 0,
                _ => return sample([i, j]),
            };
            let with = |n: i32| if along == 0 { [n, j] } else { [i, n] };
            // On the edge from one fourth vertex to the next; odd vertices fall onto the one before.
            let n = [i, j][along] & !1;
            let ends = [n & !3, (n & !3) + 4].map(|end| sample(with(end)).y);
            Corner { y: ends[0] + (ends[1] - ends[0]) * (n & 3) as f32 / 4.0, ..sample(with(n)) }
        };
        let triangles = (0..16).flat_map(|j| (0..16).flat_map(move |i| rtin::cell(i, j)));
        let triangles = triangles.map(|t| t.map(corner)).filter(|t| surface::doubled_area(t) != 0);
        triangles.map(|t| deviation(field, &t)).fold(0.0, f32::max)
    }

    #[test]
    fn while_squares_go_over_into_theirs_the_error_holds_too() {
        // Beside the first side: both ends of the morph are within 1.1 m of these, but 1.3 m lie between them.
        let ridge = [-1.0, -1.2, 0.2, -0.5, -0.8, -0.6, -0.4, -0.2];
        let height = |k: usize| if k % 65 == 4 { ridge.get(k / 65).copied().unwrap_or(0.0) } else { 0.0 };
        let field = Field::new(Samples::F32((0..65 * 65).map(height).collect()), [65, 65], [1.0; 2], Holes::none(0));
        let ends = [false, true].map(|stitched| slow_error(&field, 2, [0, 0], stitched));
        let way = slow_way(&field, 2, [0, 0]);
        assert!(ends.iter().all(|end| *end < 1.15) && way > 1.25, "{ends:?} {way}");
        for field in [field, rough([129, 97], 11)] {
            let bounds = Bounds::new(&field, Measure { morph: true, ..MEASURE }, &Progress::default());
            for (level, at) in squares(&bounds).into_iter().filter(|(level, _)| *level > 0) {
                let (way, error) = (slow_way(&field, level, at), bounds.square(level, at).error);
                assert!(error >= way * (1.0 - 1e-6), "level {level} at {at:?}: {error} m, on the way {way} m");
            }
        }
    }

    #[test]
    fn what_was_kept_is_what_was_measured() {
        let bounds = Bounds::new(&rough([75, 52], 3), MEASURE, &Progress::default());
        let content = bounds.content();
        let mut again = Bounds::new(&rough([75, 52], 4), MEASURE, &Progress::default());
        assert_ne!(again.content(), content);
        assert!(again.fill(&content));
        squares(&bounds)
            .into_iter()
            .for_each(|(level, at)| assert_eq!(again.square(level, at), bounds.square(level, at)));
        assert!(!again.fill(&content[..content.len() - 1]));
        assert!(!Bounds::new(&rough([75, 152], 3), MEASURE, &Progress::default()).fill(&content));
    }

    #[test]
    fn what_is_known_of_a_tiled_field_holds_in_every_tile() {
        let fields =
            [([41, 30], [3, 4]), ([32, 64], [3, 2]), ([33, 57], [4, 1]), ([16, 16], [9, 9]), ([64, 64], [3, 3])];
        let morphing = Measure { morph: true, growth: 1.3, ..MEASURE };
        for ((size, tiles), measure) in fields.into_iter().flat_map(|field| [MEASURE, morphing].map(|m| (field, m))) {
            let field = rough(size, 9).tiled(tiles);
            let [tiled, whole] = [&field, &held(&field)].map(|field| Bounds::new(field, measure, &Progress::default()));
            assert!(tiled.bytes() < whole.bytes());
            for (level, at) in squares(&whole) {
                let (general, exact) = (tiled.square(level, at), whole.square(level, at));
                let what = format!("{size:?} {tiles:?} level {level} at {at:?}: {general:?} {exact:?}");
                assert!(general.error >= exact.error * (1.0 - 1e-6), "{what}");
                assert!(general.range[0] <= exact.range[0] && general.range[1] >= exact.range[1], "{what}");
                let (aligned, partial) =
                    (size.iter().all(|n| n.is_multiple_of(8 << level)), whole.is_partial(level, at));
                assert!(!aligned || partial || general == exact, "{what}");
                // What is cut is known, too: no worse than the worst of the level.
                let of_level = || squares(&whole).into_iter().filter(|(other, _)| *other == level);
                let worst = || of_level().map(|(_, at)| whole.square(level, at).error).fold(0.0, f32::max);
                let is_known = aligned && partial && tiled.cut(level).is_finite();
                assert!(!is_known || general.error <= 1.5 * worst(), "{what}");
            }
        }
    }
}
