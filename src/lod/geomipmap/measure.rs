//! How far the shapes of a block are from the samples.
//!
//! A block that morphs from level l to l + 1 has a weight v inside and one on each side, e, which goes from 0
//! (level l) over 1 (level l + 1) to 2 (level l + 2). A vertex moves on a straight line with the one weight it
//! depends on, or, inside next to a side, with v and with the e of the sides that its target's ends lie on. So
//! above any sample the drawn height is affine in each weight while the others stay, between whole numbers, and
//! the largest distance from the sample is at a corner of that cube: v in {0, 1}, each e in {0, 1, 2}. The
//! corners are shapes, and the shapes are measured. Most of them are what a level draws anyway, stitched or
//! not; new are
//! - v = 0 where e = 2: level l inside and two levels coarser on the side;
//! - v = 1 where e = 0: level l + 1 inside and level l on the side. Only here a triangle, near a corner of the
//!   block, depends on two sides at once.

use super::mesh::{self, side};
use crate::draw::Instance;
use crate::draw::layout::Frame;
use crate::draw::place::{lattice_height, lattice_position, turned_position};
use crate::height::Field;
use crate::height::surface::{self, Corner, Triangle};

/// Heights between two shapes are rounded: a drawn height is off by at most 12 half-ulps of the largest height
/// around, six for each of the two steps of `draw::place::lattice_height`.
const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// Triangles of a block at a level and at whole morph weights.
pub struct Shape {
    level: u32,
    morph: f32,
    edge_morph: [f32; 4],
    triangles: Vec<[[i32; 2]; 3]>,
}

impl Shape {
    /// All that a block may draw at a level, and on the way to it from the one before if it morphs, as far as it
    /// may be off the samples.
    pub fn up_to(cells: i32, level: u32, morph: bool) -> Vec<Shape> {
        let still = Shape { level, morph: 0.0, edge_morph: [0.0; 4], triangles: pattern(cells, level) };
        let way = if morph && level > 0 { Self::on_the_way(cells, level - 1) } else { Vec::new() };
        std::iter::once(still).chain(way).collect()
    }

    /// The corners of the module's text from `level` to the next.
    fn on_the_way(cells: i32, level: u32) -> Vec<Shape> {
        let n = cells >> level;
        let shape = |morph: f32, [upright, level_ones]: [f32; 2]| {
            let edge_morph = [upright, level_ones, upright, level_ones];
            let mask = [side::LEFT, side::TOP, side::RIGHT, side::BOTTOM].iter().zip(edge_morph);
            let mask = mask.filter(|(_, e)| *e >= 1.0).map(|(bit, _)| bit).sum();
            let mut triangles = [mesh::border(n, mask), mesh::inner_border(n)].concat();
            if upright != level_ones {
                let near = |k: i32| k <= 2 || k >= n - 2;
                triangles.retain(|t| t.iter().all(|at| near(at[0]) && near(at[1])));
            }
            Shape { level, morph, edge_morph, triangles }
        };
        let ways = [[0.0, 0.0], [0.0, 1.0], [1.0, 0.0], [0.0, 2.0], [2.0, 0.0]].map(|e| shape(1.0, e));
        // No level is two levels coarser than that of two cells.
        let has_second = |s: &Shape| n > 2 || s.edge_morph.iter().all(|e| *e < 2.0);
        ways.into_iter().chain([shape(0.0, [2.0, 2.0])]).filter(has_second).collect()
    }
}

/// Every triangle that a block may draw at a level and that may be off the samples, whatever its mask: a border
/// triangle depends on one side only, so the masks with no side and with all sides have them all. At the finest
/// level only stitched borders are off.
fn pattern(cells: i32, level: u32) -> Vec<[[i32; 2]; 3]> {
    let n = cells >> level;
    let stitched = if n > 1 { mesh::border(n, 15) } else { Vec::new() };
    if level == 0 { stitched } else { [mesh::centre(n), mesh::border(n, 0), stitched].concat() }
}

/// One block while it is measured.
pub struct Block<'a> {
    field: &'a Field,
    frame: Frame,
    cells: i32,
    at: [i32; 2],
}

impl<'a> Block<'a> {
    /// The block at a place among the blocks.
    pub fn new(field: &'a Field, cells: i32, at: [i32; 2]) -> Self {
        let last = field.size().map(|n| n as i32 - 1);
        Self { field, frame: Frame { last, ..Frame::default() }, cells, at }
    }

    /// First and last sample.
    fn ends(&self) -> [[i32; 2]; 2] {
        let first = self.at.map(|n| n * self.cells);
        [first, [0, 1].map(|k| (first[k] + self.cells).min(self.frame.last[k]))]
    }

    /// Whether it sticks out of the field.
    fn is_partial(&self) -> bool {
        (0..2).any(|k| (self.at[k] + 1) * self.cells > self.frame.last[k])
    }

    /// Range of all heights, those under holes included.
    fn range(&self) -> [f32; 2] {
        let [first, last] = self.ends();
        let rows = (first[1]..=last[1]).flat_map(|j| (first[0]..=last[0]).map(move |i| (i, j)));
        rows.fold([f32::INFINITY, f32::NEG_INFINITY], |[low, high], (i, j)| {
            let y = self.field.height(i as u32, j as u32);
            [low.min(y), high.max(y)]
        })
    }

    /// The range, or `None` if no triangle of the finest level has data at its three corners.
    pub fn range_of_land(&self) -> Option<[f32; 2]> {
        let [first, last] = self.ends();
        surface::has_land(self.field, first, last).then(|| self.range())
    }

    /// ε by level, saturated.
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
            // Where nothing is off the samples, nothing moves.
            errors.iter_mut().filter(|error| **error > 0.0).for_each(|error| *error += rounding);
        }
        errors
    }

    fn error(&self, shape: &Shape) -> f32 {
        // The inside of a block that sticks out does not morph.
        if shape.morph > 0.0 && self.is_partial() {
            return 0.0;
        }
        let instance = Instance {
            origin: self.at.map(|n| n * self.cells),
            cells: self.cells as u32,
            turns: coarsest_turn(self.at, self.cells >> shape.level),
            level: shape.level,
            morph: shape.morph,
            edge_morph: shape.edge_morph,
            ..Instance::default()
        };
        shape.triangles.iter().map(|t| self.deviation(&instance, t)).fold(0.0, f32::max)
    }

    fn deviation(&self, instance: &Instance, triangle: &[[i32; 2]; 3]) -> f32 {
        let corners: Triangle = triangle.map(|at| {
            let turned = turned_position(instance, at.map(|n| n << instance.level));
            let [x, z] = lattice_position(&self.frame, instance, turned);
            Corner { x, z, y: lattice_height(self.field, &self.frame, instance, turned) }
        });
        if surface::doubled_area(&corners) == 0 { 0.0 } else { surface::deviation(self.field, &corners) }
    }
}

/// A block of a single cell takes its diagonal from its own parity among the blocks.
pub fn coarsest_turn(at: [i32; 2], n: i32) -> u32 {
    u32::from(n == 1 && (at[0] + at[1]) & 1 == 1)
}
