//! An alpine landscape: mountains rise, rivers cut them, slopes give way, and valley floors fill ([`super::settle`]).
//!
//! Cordonnier et al., "Large Scale Terrain Generation from Tectonic Uplift and Fluvial Erosion" (2016): uplift
//! against the stream-power law dh/dt = U − K √A S, solved implicitly downstream first as in Braun and Willett,
//! "A very efficient O(n), implicit and parallel method to solve the stream power equation" (2013), here with
//! several receivers a cell, and slopes held to the angle of repose. It starts coarse and doubles the grid, so that
//! large valleys are grown before gullies.

use super::flow::{Flow, Grid};
use super::noise;
use super::rock::Rock;
use super::settle::settle;
use crate::height::field::Field;
use crate::height::holes::Holes;
use crate::height::samples::Samples;

/// Distance of samples, metres.
const SPACING: f64 = 25.0;
/// Height of one code, metres: finer than any step that shading shows, coarse enough to compress.
const CODE: f32 = 0.1;
/// Cells of the longer side at most on the coarsest grid.
const COARSEST: usize = 160;
/// Steps on the coarsest grid, and on each finer one.
const STEPS: [usize; 2] = [80, 8];
/// K · dt of a step on the coarsest grid, and on each finer one; with U / K in metres, time needs no unit of its own.
const PACE: [f64; 2] = [0.4, 0.1];
/// Lowest height, metres.
const BASE: f64 = 400.0;

/// Makes an eroded landscape.
pub fn eroded(size: [u32; 2], seed: u64) -> Field {
    // Rivers leave over the border of the grid: a margin keeps its fixed heights out of the picture.
    let margin = size.map(|n| (n as usize / 8).max(8));
    let grid = Grid { size: [0, 1].map(|axis| size[axis] as usize + 2 * margin[axis]), spacing: SPACING };
    let rock = Rock::new(seed, margin.map(|m| -(m as f64) * SPACING));
    let mut height = rock.grow(grid);
    settle(&rock, grid, &mut height);
    let [w, h] = size.map(|n| n as usize);
    let mut crop = Vec::with_capacity(w * h);
    for row in height.chunks(grid.size[0]).skip(margin[1]).take(h) {
        crop.extend_from_slice(&row[margin[0]..margin[0] + w]);
    }
    let lowest = crop.iter().copied().fold(f64::INFINITY, f64::min);
    let code = |metres: f64| ((metres - lowest + BASE) / f64::from(CODE) + 0.5).floor().clamp(0.0, 65535.0) as u16;
    let samples = Samples::Coded { codes: crop.into_iter().map(code).collect(), zero: 0.0, scale: CODE };
    Field::new(samples, size, [SPACING; 2], Holes::none(w * h))
}

impl Rock {
    /// Returns the heights of terrain cut by rivers, coarse grids first.
    fn grow(&self, grid: Grid) -> Vec<f64> {
        let finer = usize::from(grid.size[0].max(grid.size[1]) > COARSEST);
        let mut height = match finer {
            0 => grid.map(|k| 900.0 * (1.0 + self.massif(grid, k, 6))),
            _ => {
                let coarse = Grid { size: grid.size.map(|n| n.div_ceil(2).max(2)), spacing: grid.spacing * 2.0 };
                self.refine(grid, coarse, &self.grow(coarse))
            }
        };
        let uplift = grid.map(|k| self.uplift(grid, k));
        let firmness = grid.map(|k| self.firmness(grid, k));
        for _ in 0..STEPS[finer] {
            self.cut(grid, &mut height, &uplift, &firmness, PACE[finer]);
        }
        height
    }

    /// Heights on a grid twice as fine: bilinear, pulled about by about a coarse cell so that no valley keeps to the
    /// lines of the coarse grid, with a little noise for new gullies to start from.
    fn refine(&self, grid: Grid, coarse: Grid, height: &[f64]) -> Vec<f64> {
        let [w, h] = coarse.size;
        let salt = self.seed ^ (grid.cells() as u64) << 8;
        let fine = |k: usize| {
            let [i, j] = [k % grid.size[0], k / grid.size[0]];
            let [x, z] = noise::warped([i as f64 / 9.0, j as f64 / 9.0], 0.28, salt).map(|t| t * 4.5);
            let (x, z) = (x.clamp(0.0, (w - 1) as f64), z.clamp(0.0, (h - 1) as f64));
            let (i0, j0) = ((x as usize).min(w - 2), (z as usize).min(h - 2));
            let (u, v) = (x - i0 as f64, z - j0 as f64);
            let row = |j: usize| height[j * w + i0] * (1.0 - u) + height[j * w + i0 + 1] * u;
            let smooth = row(j0) * (1.0 - v) + row(j0 + 1) * v;
            smooth + noise::white(i as i64, j as i64, salt) * 0.1 * grid.spacing
        };
        grid.map(fine)
    }

    /// One implicit step of uplift and stream power, every cell after those it drains to; then slopes beyond repose
    /// slide. Both take the receivers' mean, so that slopes do not break into eight directions.
    fn cut(&self, grid: Grid, height: &mut [f64], uplift: &[f64], firmness: &[f64], pace: f64) {
        let flow = Flow::new(grid, height, 0.0);
        let area = flow.area(grid);
        for &k in &flow.order {
            let k = k as usize;
            if grid.is_border(k) {
                continue;
            }
            let grain = 1.0 + 0.5 * noise::white(k as i64, 0, self.seed ^ 0x45);
            let power = pace * area[k].sqrt() * grain;
            let repose = self.repose(grid, k, height[k], firmness[k]);
            let (mut sum, mut weight, mut ceiling) = (height[k] + pace * uplift[k], 1.0, 0.0);
            for &(n, share, distance) in flow.receivers(grid, k).iter() {
                sum += power * share / distance * height[n];
                weight += power * share / distance;
                ceiling += share * (height[n] + repose * distance);
            }
            height[k] = (sum / weight).min(ceiling);
        }
    }
}
