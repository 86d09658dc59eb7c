//! Measures the distance of a tile's surface from the samples, at each level and while it morphs.
//!
//! A triangle's heights depend on two weights: the tile's own, and that of the one side that it may touch. Between
//! whole weights they are affine in each, so the largest distances are at whole weights. These are a level without
//! morph, and one with its sides one level coarser. During a morph they are the inside fully morphed and the sides not,
//! or the sides two levels coarser and the inside not morphed. All other extremes are levels without morph.

use super::chunk::{self, Place};
use super::pattern::{self, Triangle};
use crate::draw::place::explicit_height;
use crate::draw::weights::{ONE, SlotWeights};
use crate::draw::{ExplicitVertex, Instance};
use crate::height::Field;
use crate::height::surface::{self, Corner};

/// Rounding bound of morphed heights, relative to the largest height: at most 12 half-ulps, six for each of the two
/// steps of `draw::place::explicit_height`.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// Minimum growth of the error from level to level in a tile that morphs. With equal errors a tile would morph through
/// both levels at once.
const GROWTH: f32 = 1.3;

/// A tile to measure.
pub struct Tile<'a> {
    field: &'a Field,
    place: Place,
}

impl<'a> Tile<'a> {
    /// Creates the tile at a place.
    pub fn new(field: &'a Field, place: Place) -> Self {
        Self { field, place }
    }

    fn last(&self) -> [i32; 2] {
        let size = self.field.size();
        [0, 1].map(|k| (self.place.origin[k] + self.place.cells).min(size[k] as i32 - 1))
    }

    /// Returns true if the tile extends beyond the field. The inside of such a tile does not morph, because the field's
    /// edge is not a vertex of the next level.
    pub fn is_partial(&self) -> bool {
        (0..2).any(|k| self.place.origin[k] + self.place.cells > self.last()[k])
    }

    /// Returns the range of heights, metres; `None` if no triangle of the finest level has data.
    pub fn range_of_terrain(&self) -> Option<[f32; 2]> {
        surface::has_terrain(self.field, self.place.origin, self.last()).then(|| self.range())
    }

    fn range(&self) -> [f32; 2] {
        let ([x0, z0], [x1, z1]) = (self.place.origin, self.last());
        let heights = (z0..=z1).flat_map(|z| (x0..=x1).map(move |x| self.field.height(x as u32, z as u32)));
        heights.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], y| [low.min(y), high.max(y)])
    }

    /// Returns the error ε by level, metres, rising. It bounds all that is drawn at the level and, if tiles morph, during
    /// the morph to it. It is 0 at level 0: there only a coarser side deviates from the samples, and the tile beyond that
    /// side accounts for it.
    pub fn errors(&self, morphs: bool) -> Vec<f32> {
        let mut largest = 0.0f32;
        let levels = 0..=self.place.cells.ilog2();
        let [low, high] = self.range();
        let rounding = if morphs { low.abs().max(high.abs()) * ROUNDING } else { 0.0 };
        let mut errors = Vec::new();
        let mut morphed = 0.0;
        for level in levels {
            let chunk = chunk::build(self.field, self.place, level);
            let own = if level == 0 { 0.0 } else { self.level_error(&chunk, level) };
            largest = if morphs { largest * GROWTH } else { largest }.max(own).max(morphed);
            // A level without error does not move at all.
            errors.push(if largest > 0.0 { largest + rounding } else { 0.0 });
            morphed = if morphs { self.morph_error(&chunk, level) } else { 0.0 };
        }
        errors
    }

    fn n(&self, level: u32) -> i32 {
        self.place.cells >> level
    }

    /// Returns the error of a level, metres, with and without coarser sides.
    fn level_error(&self, chunk: &[ExplicitVertex], level: u32) -> f32 {
        let n = self.n(level);
        let still = if n == 1 { self.single() } else { [pattern::centre(n), pattern::border(n, 0)].concat() };
        let stitched = if n == 1 { Vec::new() } else { pattern::border(n, 15) };
        self.error(chunk, n, [0, 0], &still).max(self.error(chunk, n, [0, ONE], &stitched))
    }

    /// Returns the largest error, metres, of the shapes that occur only during the morph to the next level.
    fn morph_error(&self, chunk: &[ExplicitVertex], level: u32) -> f32 {
        let n = self.n(level);
        let arrived = if n == 1 || self.is_partial() { Vec::new() } else { pattern::border(n, 0) };
        // Levels of two cells and fewer have no level two levels coarser.
        let behind = if n <= 2 { Vec::new() } else { pattern::border(n, 15) };
        self.error(chunk, n, [ONE, 0], &arrived).max(self.error(chunk, n, [0, 2 * ONE], &behind))
    }

    /// Returns the triangles of a tile of a single cell.
    fn single(&self) -> Vec<Triangle> {
        let odd = ((self.place.origin[0] + self.place.origin[1]) / self.place.cells) & 1;
        crate::height::rtin::cell(odd, 0).map(|triangle| triangle.map(|[x, z]| [x - odd, z])).into()
    }

    /// Returns the largest distance of triangles from the samples, metres, at these morph weights of the inside and of
    /// all sides.
    fn error(&self, chunk: &[ExplicitVertex], n: i32, [inside, side]: [u32; 2], triangles: &[Triangle]) -> f32 {
        let instance = Instance::default().with_weights(SlotWeights::uniform(inside, [side; 4]));
        let size = self.field.size();
        let corner = |[x, z]: [i32; 2]| {
            let vertex = &chunk[(z * (n + 1) + x) as usize];
            let [x, z] = [0, 1].map(|k| (self.place.origin[k] + vertex.position[k]).min(size[k] as i32 - 1));
            Corner { x, z, y: explicit_height(&instance, vertex) }
        };
        let corners = triangles.iter().map(|triangle| triangle.map(corner));
        let real = corners.filter(|corners| surface::doubled_area(corners) != 0);
        real.map(|corners| surface::deviation(self.field, &corners)).fold(0.0, f32::max)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::{Holes, Samples};

    const CELLS: i32 = 16;

    /// Returns a field of 2 × 2 tiles that is rough only near a column of samples, or near one sample.
    fn rough_near(x: u32, z: Option<u32>, random: &mut impl FnMut() -> f32) -> Field {
        let size = 2 * CELLS as u32 + 1;
        let near = |k: u32| (k % size).abs_diff(x) < 3 && z.is_none_or(|z| (k / size).abs_diff(z) < 3);
        let heights = (0..size * size).map(|k| if near(k) { 100.0 * random() } else { 0.0 });
        Field::new(Samples::F32(heights.collect()), [size; 2], [1.0; 2], Holes::none((size * size) as usize))
    }

    /// A sample half way between a rising vertex of the side and a falling one inside, where the inside morphs first.
    /// Levels 1 and 2 deviate by 1 m there, and the morph between them by 1.5 m.
    #[test]
    fn morph_error_can_exceed_both_levels() {
        let size = CELLS as u32 + 1;
        let height = |k: u32| match (k % size, k / size) {
            (0, 2) => -1.0,
            (1 | 2, 2) => 1.0,
            _ => 0.0,
        };
        let heights = (0..size * size).map(height).collect();
        let field = Field::new(Samples::F32(heights), [size; 2], [1.0; 2], Holes::none((size * size) as usize));
        let tile = Tile::new(&field, Place { origin: [0, 0], cells: CELLS });
        let ends = [1, 2].map(|level| tile.level_error(&chunk::build(&field, tile.place, level), level));
        assert!(ends.iter().all(|end| (end - 1.0).abs() < 1e-6), "{ends:?}");
        assert!((tile.morph_error(&chunk::build(&field, tile.place, 1), 1) - 1.5).abs() < 1e-6);
        let [morphing, still] = [true, false].map(|morphs| tile.errors(morphs)[2]);
        assert!(morphing >= 1.5 && still < 1.01, "{morphing} m, still {still} m");
    }

    /// Checks the bound of [`super::super::levels::ceiling`] at any weights of inside and sides, and that morphs do
    /// exceed the errors of still levels.
    #[test]
    fn morph_error_stays_within_the_ceiling_bound() {
        let mut seed = 3u32;
        let mut random = || {
            seed = seed.wrapping_mul(1664525).wrapping_add(1013904223);
            (seed >> 8) as f32 / (1 << 24) as f32
        };
        let (mut beyond_still, mut closest) = (0, 0.0f32);
        for k in 0..132 {
            let z = (k >= 66).then_some(14 + k / 7 % 5);
            let field = rough_near(k % 33, z, &mut random);
            let tile = Tile::new(&field, Place { origin: [k / 2 % 2, k % 2].map(|n| n as i32 * CELLS), cells: CELLS });
            let (errors, still) = (tile.errors(true), tile.errors(false));
            for (level, draw) in (0..4u32).flat_map(|level| (0..40).map(move |draw| (level, draw))) {
                let mut weight = |max: f32| if draw < 20 { max * random() } else { (max * random()).round() };
                let inside = weight(1.0);
                // Sides are at most one level beyond the inside.
                let side = weight(if level == 3 { 1.0 } else { 1.0 + inside });
                let (n, is_coarser) = (CELLS >> level, side >= 1.0);
                let triangles = [pattern::border(n, if is_coarser { 15 } else { 0 }), pattern::centre(n)].concat();
                let chunk = chunk::build(&field, tile.place, level);
                let weights = [inside, side].map(|w| (w * ONE as f32) as u32);
                let error = tile.error(&chunk, n, weights, &triangles);
                let own = if level == 0 && side > 0.0 {
                    tile.error(&chunk, n, [0, ONE], &pattern::border(n, 15))
                } else {
                    0.0
                };
                let [own, next] = [own.max(errors[level as usize]), errors[level as usize + 1]];
                let left = (1.0 - inside) * (1.0 - inside);
                let bound = left * own + (1.0 - left) * next.max(own);
                assert!(
                    error <= bound * 1.0001,
                    "level {level}, {inside} inside, sides {side}: {error} m of {bound} m"
                );
                beyond_still += usize::from(error > still[level as usize + 1]);
                closest = closest.max(error / bound.max(f32::MIN_POSITIVE));
            }
        }
        assert!(
            beyond_still > 0 && closest > 0.99,
            "{beyond_still} beyond the errors of still levels, {closest} of the bound"
        );
    }
}
