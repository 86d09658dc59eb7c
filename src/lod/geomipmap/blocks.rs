//! What is known of every block before any view: its heights' range and, for each level, how far its surface
//! is from the samples.

use rayon::prelude::*;

use super::mesh;
use crate::height::Field;
use crate::height::surface::{self, Corner, Triangle};
use crate::view::{Aabb, Containment, Frustum};

/// All blocks of a field, and the quadtree over them.
pub struct Blocks {
    /// Cells along a side of a block; the last ones may stick out of the field.
    pub cells: i32,
    /// Levels of a block, log2(cells) + 1.
    pub levels: u32,
    /// Blocks along (x, z).
    pub count: [u32; 2],
    /// ε by block, then level, metres: saturated, and true for every border mask.
    errors: Vec<f32>,
    /// Range of heights, from the blocks (level 0) up to one node; `None` where there is no land at all.
    ranges: Vec<Level>,
    spacing: [f64; 2],
    origin: [f64; 2],
    last: [u32; 2],
}

/// One level of the quadtree: each node covers 2 × 2 of the level below, fewer at the field's far edges.
struct Level {
    count: [u32; 2],
    ranges: Vec<Option<[f32; 2]>>,
}

impl Blocks {
    /// Measures a field.
    pub fn new(field: &Field, cells: i32) -> Self {
        let levels = cells.ilog2() + 1;
        let count = field.size().map(|n| (n - 1).div_ceil(cells as u32));
        let patterns: Vec<_> = (0..levels).map(|level| pattern(cells, level)).collect();
        let (ranges, errors): (Vec<_>, Vec<_>) = (0..count[0] * count[1])
            .into_par_iter()
            .map(|k| {
                let block = Block { field, cells, at: [k % count[0], k / count[0]].map(|n| n as i32) };
                (block.range(), block.errors(&patterns))
            })
            .unzip();
        let mut tree = vec![Level { count, ranges }];
        while tree.last().is_some_and(|level| level.ranges.len() > 1) {
            tree.push(tree[tree.len() - 1].parent());
        }
        Self {
            cells,
            levels,
            count,
            errors: errors.concat(),
            ranges: tree,
            spacing: field.spacing,
            origin: field.origin,
            last: field.size().map(|n| n - 1),
        }
    }

    /// ε of a block by level, metres.
    pub fn errors(&self, block: usize) -> &[f32] {
        let levels = self.levels as usize;
        &self.errors[block * levels..(block + 1) * levels]
    }

    /// The box around a block; a block without land has one of no height.
    pub fn bounds(&self, block: usize) -> Aabb {
        let (i, j) = (block as u32 % self.count[0], block as u32 / self.count[0]);
        self.node_bounds(0, i, j, self.ranges[0].ranges[block].unwrap_or_default())
    }

    fn node_bounds(&self, level: usize, i: u32, j: u32, range: [f32; 2]) -> Aabb {
        let side = (self.cells as u32) << level;
        let at = |k: usize, n: u32| self.origin[k] + f64::from((n * side).min(self.last[k])) * self.spacing[k];
        let corner = |di: u32, y: f32| glam::DVec3::new(at(0, i + di), f64::from(y), at(1, j + di));
        Aabb { min: corner(0, range[0]), max: corner(1, range[1]) }
    }

    /// Calls `visit` for every block with land that may be seen.
    pub fn visit_visible(&self, frustum: &Frustum, visit: &mut impl FnMut(usize)) {
        self.descend(frustum, self.ranges.len() - 1, 0, 0, false, visit);
    }

    fn descend(&self, f: &Frustum, level: usize, i: u32, j: u32, inside: bool, visit: &mut impl FnMut(usize)) {
        let Level { count, ranges } = &self.ranges[level];
        if i >= count[0] || j >= count[1] {
            return;
        }
        let Some(range) = ranges[(j * count[0] + i) as usize] else { return };
        let inside = inside
            || match f.contains(&self.node_bounds(level, i, j, range)) {
                Containment::Outside => return,
                Containment::Crossing => false,
                Containment::Inside => true,
            };
        if level == 0 {
            return visit((j * count[0] + i) as usize);
        }
        for (di, dj) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            self.descend(f, level - 1, 2 * i + di, 2 * j + dj, inside, visit);
        }
    }
}

impl Level {
    fn parent(&self) -> Level {
        let count = self.count.map(|n| n.div_ceil(2));
        let node = |i: u32, j: u32| {
            let children = [(0, 0), (1, 0), (0, 1), (1, 1)].map(|(di, dj)| (2 * i + di, 2 * j + dj));
            children
                .into_iter()
                .filter(|&(i, j)| i < self.count[0] && j < self.count[1])
                .filter_map(|(i, j)| self.ranges[(j * self.count[0] + i) as usize])
                .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
        };
        let ranges = (0..count[1]).flat_map(|j| (0..count[0]).map(move |i| node(i, j))).collect();
        Level { count, ranges }
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
struct Block<'a> {
    field: &'a Field,
    cells: i32,
    at: [i32; 2],
}

impl Block<'_> {
    fn last(&self) -> [i32; 2] {
        self.field.size().map(|n| n as i32 - 1)
    }

    /// Range of all heights, those under holes included, or `None` if no triangle of the finest level has
    /// data at its three corners.
    fn range(&self) -> Option<[f32; 2]> {
        let first = self.at.map(|n| n * self.cells);
        let last = [0, 1].map(|k| (first[k] + self.cells).min(self.last()[k]));
        let (mut low, mut high) = (f32::INFINITY, f32::NEG_INFINITY);
        for j in first[1]..=last[1] {
            for i in first[0]..=last[0] {
                let y = self.field.height(i as u32, j as u32);
                (low, high) = (low.min(y), high.max(y));
            }
        }
        surface::has_land(self.field, first, last).then_some([low, high])
    }

    /// ε by level, saturated.
    fn errors(&self, patterns: &[Vec<[[i32; 2]; 3]>]) -> Vec<f32> {
        let mut saturated = 0.0f32;
        patterns
            .iter()
            .enumerate()
            .map(|(level, pattern)| {
                let level_error = pattern.iter().map(|t| self.deviation(level, t)).fold(0.0, f32::max);
                saturated = saturated.max(level_error);
                saturated
            })
            .collect()
    }

    fn deviation(&self, level: usize, triangle: &[[i32; 2]; 3]) -> f32 {
        let turn = coarsest_turn(self.at, self.cells >> level);
        let corners: Triangle = triangle.map(|[x, z]| {
            let [x, z] = if turn == 1 { [(self.cells >> level) - z, x] } else { [x, z] };
            let at = |k: usize, n: i32| (self.at[k] * self.cells + (n << level)).min(self.last()[k]);
            let (x, z) = (at(0, x), at(1, z));
            Corner { x, z, y: self.field.height(x as u32, z as u32) }
        });
        if surface::doubled_area(&corners) == 0 { 0.0 } else { surface::deviation(self.field, &corners) }
    }
}

/// A block of a single cell takes its diagonal from its own parity among the blocks.
pub fn coarsest_turn(at: [i32; 2], n: i32) -> u32 {
    u32::from(n == 1 && (at[0] + at[1]) & 1 == 1)
}
