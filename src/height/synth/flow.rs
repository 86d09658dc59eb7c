//! Drainage of a grid: an order in which every cell comes after those it drains to, and the area drained.
//!
//! Barnes, Lehman and Mulla, "Priority-Flood" (2014), gives the order, the level of lakes and a way out of each;
//! Freeman, "Calculating catchment area with divergent flow based on a regular grid" (1991), spreads the flow over
//! all lower neighbours, so that slopes do not break into eight directions.

use std::cmp::{Ordering, Reverse};
use std::collections::BinaryHeap;

use rayon::prelude::*;

/// A rectangle of square cells.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    /// Cells along (x, z).
    pub size: [usize; 2],
    /// Side of a cell, metres.
    pub spacing: f64,
}

/// Offsets of the eight neighbours and their distance in cells.
const NEIGHBOURS: [(i32, i32, f64); 8] = {
    const DIAGONAL: f64 = std::f64::consts::SQRT_2;
    [
        (-1, -1, DIAGONAL),
        (0, -1, 1.0),
        (1, -1, DIAGONAL),
        (-1, 0, 1.0),
        (1, 0, 1.0),
        (-1, 1, DIAGONAL),
        (0, 1, 1.0),
        (1, 1, DIAGONAL),
    ]
};

impl Grid {
    /// Number of cells.
    pub fn cells(&self) -> usize {
        self.size[0] * self.size[1]
    }

    /// Returns true if cell `k` lies on the border, where water leaves.
    pub fn is_border(&self, k: usize) -> bool {
        let (i, j) = (k % self.size[0], k / self.size[0]);
        i == 0 || j == 0 || i + 1 == self.size[0] || j + 1 == self.size[1]
    }

    /// Computes a value for each cell, in parallel.
    pub fn map(&self, value: impl Fn(usize) -> f64 + Sync + Send) -> Vec<f64> {
        (0..self.cells()).into_par_iter().map(value).collect()
    }

    /// Distance of two cells, metres.
    pub fn distance(&self, a: usize, b: usize) -> f64 {
        let w = self.size[0];
        let (x, z) = ((a % w) as f64 - (b % w) as f64, (a / w) as f64 - (b / w) as f64);
        (x * x + z * z).sqrt() * self.spacing
    }

    /// The neighbours of cell `k` and their distance, metres.
    #[inline]
    pub fn neighbours(self, k: usize) -> impl Iterator<Item = (usize, f64)> {
        let [w, h] = self.size.map(|n| n as u32);
        let (i, j) = (k as u32 % w, k as u32 / w);
        NEIGHBOURS.iter().filter_map(move |&(di, dj, distance)| {
            // Left of 0 wraps to beyond the width.
            let (i, j) = (i.wrapping_add_signed(di), j.wrapping_add_signed(dj));
            (i < w && j < h).then(|| (j as usize * w as usize + i as usize, distance * self.spacing))
        })
    }
}

/// Drainage over a grid of heights.
pub struct Flow {
    /// All cells, each after every cell it drains to.
    pub order: Vec<u32>,
    /// Height of the water: the ground's, or that of the lake over it.
    pub level: Vec<f64>,
    /// The cell from which the flood reached each cell: its outlet from a lake.
    parent: Vec<u32>,
}

#[derive(PartialEq)]
struct Shore {
    level: f64,
    cell: u32,
}

impl Eq for Shore {}

impl Ord for Shore {
    fn cmp(&self, other: &Self) -> Ordering {
        self.level.total_cmp(&other.level).then(self.cell.cmp(&other.cell))
    }
}

impl PartialOrd for Shore {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Flow {
    /// Floods `height` from the border inwards; upstream the level rises by `slope` at least: 0 for lakes, more for
    /// plains of rubble.
    pub fn new(grid: Grid, height: &[f64], slope: f64) -> Self {
        const UNSEEN: u32 = u32::MAX;
        let mut flow = Self {
            order: Vec::with_capacity(grid.cells()),
            level: height.to_vec(),
            parent: vec![UNSEEN; grid.cells()],
        };
        let mut shore = BinaryHeap::new();
        for k in (0..grid.cells()).filter(|&k| grid.is_border(k)) {
            flow.parent[k] = k as u32;
            shore.push(Reverse(Shore { level: height[k], cell: k as u32 }));
        }
        while let Some(Reverse(Shore { level, cell })) = shore.pop() {
            flow.order.push(cell);
            for (n, distance) in grid.neighbours(cell as usize) {
                if flow.parent[n] == UNSEEN {
                    flow.parent[n] = cell;
                    flow.level[n] = height[n].max(level + slope * distance);
                    shore.push(Reverse(Shore { level: flow.level[n], cell: n as u32 }));
                }
            }
        }
        flow
    }

    /// The cells that `k` drains to, with their share (the shares sum to 1) and distance; none on the border.
    #[inline]
    pub fn receivers(&self, grid: Grid, k: usize) -> Receivers {
        let mut out = Receivers { cells: [(0, 0.0, 0.0); 8], count: 0 };
        if self.parent[k] as usize == k {
            return out;
        }
        let mut sum = 0.0;
        for (n, distance) in grid.neighbours(k) {
            let fall = (self.level[k] - self.level[n]) / distance;
            if fall > 0.0 {
                // The square gathers the flow into channels; Freeman's 1.1 lets it spread over whole slopes.
                out.push(n, fall * fall, distance);
                sum += fall * fall;
            }
        }
        if sum > 0.0 {
            out.cells[..out.count].iter_mut().for_each(|(_, share, _)| *share /= sum);
        } else {
            let way_out = self.parent[k] as usize;
            let distance = grid.neighbours(k).find(|&(n, _)| n == way_out).map_or(grid.spacing, |(_, d)| d);
            out.count = 0;
            out.push(way_out, 1.0, distance);
        }
        out
    }

    /// Area drained through each cell, its own included, m².
    pub fn area(&self, grid: Grid) -> Vec<f64> {
        let mut area = vec![grid.spacing * grid.spacing; grid.cells()];
        for &k in self.order.iter().rev() {
            for &(n, share, _) in self.receivers(grid, k as usize).iter() {
                area[n] += area[k as usize] * share;
            }
        }
        area
    }
}

/// Up to eight (cell, share, distance).
pub struct Receivers {
    cells: [(usize, f64, f64); 8],
    count: usize,
}

impl Receivers {
    fn push(&mut self, cell: usize, share: f64, distance: f64) {
        self.cells[self.count] = (cell, share, distance);
        self.count += 1;
    }

    /// The receivers, (cell, share, distance in metres).
    pub fn iter(&self) -> std::slice::Iter<'_, (usize, f64, f64)> {
        self.cells[..self.count].iter()
    }
}
