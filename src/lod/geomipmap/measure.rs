//! Measures the distance of a block's surface from the samples, at each level and while it morphs.
//!
//! A block that morphs from level l to l + 1 has a weight v inside and a weight e on each side. e is 0 at level l, 1 at
//! level l + 1 and 2 at level l + 2. A vertex moves on a straight line with the one weight it depends on. Inside next
//! to a side, it moves with v and with the e of the sides that contain the ends of its target. The drawn height at a
//! sample is therefore affine in each weight between whole numbers. The largest distance is at a corner of that cube: v
//! in {0, 1}, each e in {0, 1, 2}. Each corner is a fixed shape, and these shapes are measured.
//!
//! A triangle depends on one side only, also at a block's corners, where cells have their diagonals from that corner at
//! both levels. All sides are therefore measured at the same e. Most corners of the cube are shapes that a level draws
//! anyway, stitched or not. Two are new. v = 0 with e = 2 is level l inside and two levels coarser on the sides. v = 1
//! with e = 0 is level l + 1 inside and level l on the sides.

use super::mesh;
use crate::draw::Instance;
use crate::draw::layout::Frame;
use crate::draw::place::{lattice_height, lattice_position, turned_position};
use crate::draw::weights::{ONE, SlotWeights};
use crate::height::Field;
use crate::height::surface::{self, Corner, Triangle};

/// Rounding bound of morphed heights, relative to the largest height: at most 12 half-ulps, six for each of the two
/// steps of `draw::place::lattice_height`.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// Triangles of a block at a level and at whole morph weights.
pub struct Shape {
    level: u32,
    morph: u32,
    edge_morph: [u32; 4],
    triangles: Vec<[[i32; 2]; 3]>,
}

impl Shape {
    /// Returns all shapes that a block may draw at a level, and during the morph to it from the one before, that may
    /// deviate from the samples.
    pub fn up_to(cells: i32, level: u32, morph: bool) -> Vec<Shape> {
        let still = Shape { level, morph: 0, edge_morph: [0; 4], triangles: pattern(cells, level) };
        let morphing = if morph && level > 0 { Self::during_morph(cells, level - 1) } else { Vec::new() };
        std::iter::once(still).chain(morphing).collect()
    }

    /// Returns the new corners described in the module's text, from `level` to the next.
    fn during_morph(cells: i32, level: u32) -> Vec<Shape> {
        let n = cells >> level;
        let shape = |(morph, side): (u32, u32)| {
            let mask = if side < ONE { 0 } else { 15 };
            let triangles = [mesh::border(n, mask), mesh::inner_border(n)].concat();
            Shape { level, morph, edge_morph: [side; 4], triangles }
        };
        // Levels of two cells and fewer have no level two levels coarser.
        let corners = [(ONE, 0), (0, 2 * ONE)].into_iter().filter(|(_, side)| *side < 2 * ONE || n > 2);
        corners.map(shape).collect()
    }
}

/// Returns every triangle that a block may draw at a level and that may deviate from the samples, for any mask. A
/// border triangle depends on one side only, so the masks with no side and with all sides contain them all. At the
/// finest level only stitched borders deviate.
fn pattern(cells: i32, level: u32) -> Vec<[[i32; 2]; 3]> {
    let n = cells >> level;
    let stitched = if n > 1 { mesh::border(n, 15) } else { Vec::new() };
    if level == 0 { stitched } else { [mesh::centre(n), mesh::border(n, 0), stitched].concat() }
}

/// A block to measure.
pub struct Block<'a> {
    field: &'a Field,
    frame: Frame,
    cells: i32,
    at: [i32; 2],
}

impl<'a> Block<'a> {
    /// Creates the block at a place among the blocks.
    pub fn new(field: &'a Field, cells: i32, at: [i32; 2]) -> Self {
        let last = field.size().map(|n| n as i32 - 1);
        Self { field, frame: Frame::of_lattice(last), cells, at }
    }

    /// Returns the first and the last sample.
    fn ends(&self) -> [[i32; 2]; 2] {
        let first = self.at.map(|n| n * self.cells);
        [first, [0, 1].map(|k| (first[k] + self.cells).min(self.frame.heights.last[k]))]
    }

    /// Returns true if the block extends beyond the field.
    fn is_partial(&self) -> bool {
        (0..2).any(|k| (self.at[k] + 1) * self.cells > self.frame.heights.last[k])
    }

    /// Returns the range of all heights, including those of holes, metres.
    fn range(&self) -> [f32; 2] {
        let [first, last] = self.ends();
        let rows = (first[1]..=last[1]).flat_map(|j| (first[0]..=last[0]).map(move |i| (i, j)));
        rows.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], (i, j)| {
            let y = self.field.height(i as u32, j as u32);
            [low.min(y), high.max(y)]
        })
    }

    /// Returns the range of heights, metres; `None` if no triangle of the finest level has data at its three corners.
    pub fn range_of_terrain(&self) -> Option<[f32; 2]> {
        let [first, last] = self.ends();
        surface::has_terrain(self.field, first, last).then(|| self.range())
    }

    /// Returns the error ε by level, metres, never falling with the level.
    pub fn errors(&self, shapes: &[Vec<Shape>]) -> Vec<f32> {
        let mut saturated = 0.0f32;
        let error = |shapes: &Vec<Shape>| {
            saturated = shapes.iter().map(|shape| self.error(shape)).fold(saturated, f32::max);
            saturated
        };
        let mut errors: Vec<f32> = shapes.iter().map(error).collect();
        if shapes.iter().any(|shapes| shapes.len() > 1) {
            let [low, high] = self.range();
            let rounding = low.abs().max(high.abs()) * ROUNDING;
            // A level without error does not move at all.
            errors.iter_mut().filter(|error| **error > 0.0).for_each(|error| *error += rounding);
        }
        errors
    }

    fn error(&self, shape: &Shape) -> f32 {
        // The inside of a block that extends beyond the field does not morph.
        if shape.morph > 0 && self.is_partial() {
            return 0.0;
        }
        let instance = Instance {
            origin: self.at.map(|n| n * self.cells),
            cells: self.cells as u32,
            rotation: single_cell_rotation(self.at, self.cells >> shape.level),
            level: shape.level,
            ..Instance::default()
        };
        let weights = SlotWeights::uniform(shape.morph, shape.edge_morph);

        shape.triangles.iter().map(|t| self.deviation(&instance, &weights, t)).fold(0.0, f32::max)
    }

    fn deviation(&self, instance: &Instance, weights: &SlotWeights, triangle: &[[i32; 2]; 3]) -> f32 {
        let corners: Triangle = triangle.map(|at| {
            let turned = turned_position(instance, at.map(|n| n << instance.level));
            let [x, z] = lattice_position(&self.frame, instance, turned);
            Corner { x, z, y: lattice_height(self.field, &self.frame, instance, weights, turned) }
        });
        if surface::doubled_area(&corners) == 0 { 0.0 } else { surface::deviation(self.field, &corners) }
    }
}

/// Returns the quarter turns of a block of a single cell: its diagonal depends on its own parity among the blocks.
pub fn single_cell_rotation(at: [i32; 2], n: i32) -> u32 {
    u32::from(n == 1 && (at[0] + at[1]) & 1 == 1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::{Holes, Samples};

    const CELLS: i32 = 16;

    /// Returns a field of 2 × 2 blocks that is rough only near a column of samples, or near one sample.
    fn rough_near(x: u32, z: Option<u32>, random: &mut impl FnMut() -> f32) -> Field {
        let size = 2 * CELLS as u32 + 1;
        let near = |k: u32| (k % size).abs_diff(x) < 3 && z.is_none_or(|z| (k / size).abs_diff(z) < 3);
        let heights = (0..size * size).map(|k| if near(k) { 100.0 * random() } else { 0.0 });
        Field::new(Samples::F32(heights.collect()), [size; 2], [1.0; 2], Holes::none((size * size) as usize))
    }

    /// Returns the error of everything a block draws at these weights.
    fn drawn_error(block: &Block, level: u32, morph: u32, edge_morph: [u32; 4]) -> f32 {
        let (n, mask) = (CELLS >> level, (0..4).filter(|&k| edge_morph[k] >= ONE).map(|k| 1 << k).sum());
        let triangles = [mesh::border(n, mask), mesh::centre(n)].concat();
        block.error(&Shape { level, morph, edge_morph, triangles })
    }

    #[test]
    fn morph_error_stays_within_the_bound() {
        let mut seed = 3u32;
        let mut random = || {
            seed = seed.wrapping_mul(1664525).wrapping_add(1013904223);
            (seed >> 8) as f32 / (1 << 24) as f32
        };
        let (mut beyond_still, mut closest) = (0, 0.0f32);
        for k in 0..132 {
            let z = (k >= 66).then_some(14 + k / 7 % 5);
            let field = rough_near(k % 33, z, &mut random);
            let block = Block::new(&field, CELLS, [(k / 2 % 2) as i32, (k % 2) as i32]);
            let errors =
                |morph| block.errors(&(0..5).map(|level| Shape::up_to(CELLS, level, morph)).collect::<Vec<_>>());
            let (errors, still) = (errors(true), errors(false));
            for (level, draw) in (0..4).flat_map(|level| (0..20).map(move |draw| (level, draw))) {
                let furthest = if level == 3 { 1 } else { 2 };
                // Half of them at the corners.
                let mut weight = |max: u32| {
                    let whole = max as f32 * random();
                    (if draw < 10 { whole * ONE as f32 } else { whole.round() * ONE as f32 }) as u32
                };
                let (v, e) = (weight(1), [0; 4].map(|_| weight(furthest)));
                let (error, bound) = (drawn_error(&block, level, v, e), errors[level as usize + 1]);
                assert!(error <= bound, "level {level}, {v} inside, sides {e:?}: {error} m of {bound} m");
                beyond_still += usize::from(error > still[level as usize + 1]);
                closest = closest.max(error / bound.max(f32::MIN_POSITIVE));
            }
        }
        // The shapes during morphs are necessary, and the bound is tight.
        assert!(beyond_still > 10 && closest > 0.999, "{beyond_still} beyond what levels draw, {closest} of the bound");
    }
}
