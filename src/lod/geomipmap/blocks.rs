//! Precomputed height range of every block, and its error at each level, with a quadtree for culling.

use rayon::prelude::*;

use super::measure::{Block, Shape};
use crate::height::Field;
use crate::height::progress::Progress;
use crate::view::{Aabb, Containment, Frustum};

/// Blocks of a field, and the quadtree over them.
pub struct Blocks {
    /// Cells along a side of a block. The last blocks may extend beyond the field.
    pub cells: i32,
    /// Number of levels of a block, log2(cells) + 1.
    pub levels: u32,
    /// Number of blocks along (x, z).
    pub count: [u32; 2],
    /// Error ε by block, then level, metres, never falling with the level. It holds for every border mask and, if
    /// blocks morph, during the morph from the level before.
    errors: Vec<f32>,
    /// Height ranges from the blocks (level 0) up to one root; `None` where all samples are holes.
    ranges: Vec<BlockLevel>,
    spacing: [f64; 2],
    origin: [f64; 2],
    last: [u32; 2],
}

/// One level of the quadtree. A node covers 2 × 2 nodes of the level below, fewer at the field's far edges.
struct BlockLevel {
    count: [u32; 2],
    ranges: Vec<Option<[f32; 2]>>,
}

impl Blocks {
    /// Measures all blocks of a field, with the errors of morphs if `morph` is true.
    pub fn new(field: &Field, cells: i32, morph: bool, progress: &Progress) -> Self {
        let levels = cells.ilog2() + 1;
        let count = field.size().map(|n| (n - 1).div_ceil(cells as u32));
        let shapes: Vec<_> = (0..levels).map(|level| Shape::up_to(cells, level, morph)).collect();
        progress.expect(u64::from(count[0] * count[1]));
        let (ranges, errors): (Vec<_>, Vec<_>) = (0..count[0] * count[1])
            .into_par_iter()
            .map(|k| {
                let block = Block::new(field, cells, [k % count[0], k / count[0]].map(|n| n as i32));
                let measured = (block.range_of_terrain(), block.errors(&shapes));
                progress.advance(1);
                measured
            })
            .unzip();
        let mut tree = vec![BlockLevel { count, ranges }];
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

    /// Returns true if a block extends beyond the field.
    pub fn is_partial(&self, block: usize) -> bool {
        let at = [block as u32 % self.count[0], block as u32 / self.count[0]];
        (0..2).any(|k| (at[k] + 1) * self.cells as u32 > self.last[k])
    }

    /// Returns the error ε of a block by level, metres.
    pub fn errors(&self, block: usize) -> &[f32] {
        let levels = self.levels as usize;
        &self.errors[block * levels..(block + 1) * levels]
    }

    /// Returns the finest level that any block needs under any tolerance: the coarsest at which all of them are exact.
    pub fn finest(&self) -> u32 {
        let exact = |errors: &[f32]| errors.iter().skip(1).take_while(|&&error| error == 0.0).count() as u32;
        self.errors.chunks(self.levels as usize).map(exact).min().unwrap_or(0)
    }

    /// Returns the bounding box of a block, metres. One without data has height 0.
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

    /// Calls `visit` for every block with data whose box intersects the frustum.
    pub fn visit_visible(&self, frustum: &Frustum, visit: &mut impl FnMut(usize)) {
        self.descend(frustum, self.ranges.len() - 1, 0, 0, false, visit);
    }

    fn descend(&self, f: &Frustum, level: usize, i: u32, j: u32, inside: bool, visit: &mut impl FnMut(usize)) {
        let BlockLevel { count, ranges } = &self.ranges[level];
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

impl BlockLevel {
    fn parent(&self) -> BlockLevel {
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
        BlockLevel { count, ranges }
    }
}
