//! Precomputed errors and height ranges of all tiles, and a quadtree over them.

use rayon::prelude::*;

use super::chunk::Place;
use super::measure::Tile;
use crate::height::Field;
use crate::view::{Aabb, Containment, Frustum};

/// Tiles of a field.
pub struct Tiles {
    /// Cells along a side. The last tiles may extend beyond the field.
    pub cells: i32,
    /// Number of levels of a tile, log2(cells) + 1.
    pub levels: u32,
    /// Number of tiles along (x, z).
    pub count: [usize; 2],
    /// Error ε by tile, then level, metres.
    errors: Vec<f32>,
    /// Height ranges by level, from the tiles up to one root; `None` where all samples are holes.
    tree: Vec<Nodes>,
    spacing: [f64; 2],
    origin: [f64; 2],
    last: [usize; 2],
}

/// One level of the quadtree. A node covers 2 × 2 nodes of the level below, fewer at the field's far edges.
struct Nodes {
    count: [usize; 2],
    ranges: Vec<Option<[f32; 2]>>,
}

impl Tiles {
    /// Measures all tiles of a field, with the errors of morphs if `morphs` is true.
    pub fn new(field: &Field, cells: i32, morphs: bool) -> Self {
        let last = field.size().map(|n| n as usize - 1);
        let count = last.map(|n| n.div_ceil(cells as usize));
        let (ranges, errors): (Vec<_>, Vec<_>) = (0..count[0] * count[1])
            .into_par_iter()
            .map(|k| {
                let tile = Tile::new(field, place(cells, count, k));
                (tile.range_of_terrain(), tile.errors(morphs))
            })
            .unzip();
        let mut tree = vec![Nodes { count, ranges }];
        while tree.last().is_some_and(|nodes| nodes.ranges.len() > 1) {
            tree.push(tree[tree.len() - 1].parents());
        }
        let (spacing, origin) = (field.spacing, field.origin);
        Self { cells, levels: cells.ilog2() + 1, count, errors: errors.concat(), tree, spacing, origin, last }
    }

    /// Returns the number of tiles.
    pub fn total(&self) -> usize {
        self.count[0] * self.count[1]
    }

    /// Returns the error ε of a tile by level, metres.
    pub fn errors(&self, tile: usize) -> &[f32] {
        let levels = self.levels as usize;
        &self.errors[tile * levels..(tile + 1) * levels]
    }

    /// Returns the finest level that any tile needs under any tolerance: the coarsest at which all of them are exact.
    pub fn finest(&self) -> u32 {
        let exact = |tile| self.errors(tile).iter().skip(1).take_while(|&&error| error == 0.0).count() as u32;
        (0..self.total()).map(exact).min().unwrap_or(0)
    }

    /// Returns the place of a tile among the samples.
    pub fn place(&self, tile: usize) -> Place {
        place(self.cells, self.count, tile)
    }

    /// Returns true if a tile extends beyond the field.
    pub fn is_partial(&self, tile: usize) -> bool {
        let Place { origin, cells } = self.place(tile);
        (0..2).any(|k| (origin[k] + cells) as usize > self.last[k])
    }

    /// Returns true if the sum of a tile's two grid coordinates is odd.
    pub fn is_odd(&self, tile: usize) -> bool {
        (tile % self.count[0] + tile / self.count[0]) % 2 == 1
    }

    /// Returns the neighbours beyond the sides x = 0, z = 0, x = last and z = last; `None` at the field's border.
    pub fn neighbours(&self, tile: usize) -> [Option<usize>; 4] {
        let [w, h] = self.count;
        let (i, j) = (tile % w, tile / w);
        [
            (i > 0).then(|| tile - 1),
            (j > 0).then(|| tile - w),
            (i + 1 < w).then_some(tile + 1),
            (j + 1 < h).then_some(tile + w),
        ]
    }

    /// Returns the bounding box of a tile, metres. One without data has height 0.
    pub fn bounds(&self, tile: usize) -> Aabb {
        let range = self.tree[0].ranges[tile].unwrap_or_default();
        self.node_bounds(0, [tile % self.count[0], tile / self.count[0]], range)
    }

    fn node_bounds(&self, level: usize, at: [usize; 2], range: [f32; 2]) -> Aabb {
        let side = (self.cells as usize) << level;
        let corner = |step: usize, y: f32| {
            let [x, z] =
                [0, 1].map(|k| self.origin[k] + ((at[k] + step) * side).min(self.last[k]) as f64 * self.spacing[k]);
            glam::DVec3::new(x, f64::from(y), z)
        };
        Aabb { min: corner(0, range[0]), max: corner(1, range[1]) }
    }

    /// Calls `visit` for every tile with data whose box intersects the frustum.
    pub fn visit_visible(&self, frustum: &Frustum, visit: &mut impl FnMut(usize)) {
        self.descend(frustum, self.tree.len() - 1, [0, 0], false, visit);
    }

    fn descend(&self, frustum: &Frustum, level: usize, at: [usize; 2], inside: bool, visit: &mut impl FnMut(usize)) {
        let Nodes { count, ranges } = &self.tree[level];
        if at[0] >= count[0] || at[1] >= count[1] {
            return;
        }
        let node = at[1] * count[0] + at[0];
        let Some(range) = ranges[node] else { return };
        let inside = inside
            || match frustum.contains(&self.node_bounds(level, at, range)) {
                Containment::Outside => return,
                Containment::Crossing => false,
                Containment::Inside => true,
            };
        if level == 0 {
            return visit(node);
        }
        for [i, j] in [[0, 0], [1, 0], [0, 1], [1, 1]] {
            self.descend(frustum, level - 1, [2 * at[0] + i, 2 * at[1] + j], inside, visit);
        }
    }
}

fn place(cells: i32, count: [usize; 2], tile: usize) -> Place {
    Place { origin: [tile % count[0], tile / count[0]].map(|n| n as i32 * cells), cells }
}

impl Nodes {
    fn parents(&self) -> Nodes {
        let count = self.count.map(|n| n.div_ceil(2));
        let parent = |i: usize, j: usize| {
            let children = [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[di, dj]| [2 * i + di, 2 * j + dj]);
            children
                .into_iter()
                .filter(|&[i, j]| i < self.count[0] && j < self.count[1])
                .filter_map(|[i, j]| self.ranges[j * self.count[0] + i])
                .reduce(|a, b| [a[0].min(b[0]), a[1].max(b[1])])
        };
        let ranges = (0..count[1]).flat_map(|j| (0..count[0]).map(move |i| parent(i, j))).collect();
        Nodes { count, ranges }
    }
}
