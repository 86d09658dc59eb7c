//! Effects of ice, soil and rubble on terrain cut by rivers: troughs with flat floors, rounded lowlands, plains and lakes.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::flow::{Flow, Grid};
use super::noise;
use super::rock::Rock;

/// Half width of a trough over √(area drained).
const WIDTH: f64 = 0.055;
/// Distance at which a trough's walls end, half widths.
const WALLS: f64 = 1.6;
/// Slope of a plain of rubble.
const PLAIN: f64 = 0.004;

/// Widens the valleys and rounds the slopes. Then the terrain sags twice: the first basins fill with rubble, the last
/// ones with water.
pub fn settle(rock: &Rock, grid: Grid, height: &mut Vec<f64>) {
    widen(rock, grid, height);
    (0..6).for_each(|_| creep(grid, height));
    sag(rock, grid, height, 400.0, rock.seed ^ 0x60);
    *height = Flow::new(grid, height, PLAIN).level;
    (0..2).for_each(|_| creep(grid, height));
    roughen(rock, grid, height);
    sag(rock, grid, height, 200.0, rock.seed ^ 0x70);
    *height = Flow::new(grid, height, 0.0).level;
}

/// Lowers the terrain beside large rivers towards them, as glaciers did: the larger the river, the wider the trough. The
/// river nearest in half widths decides for a cell; the search spreads from the rivers like Dijkstra's.
fn widen(rock: &Rock, grid: Grid, height: &mut [f64]) {
    let area = Flow::new(grid, height, 0.0).area(grid);
    let half_width = |k: usize| {
        let [x, z] = rock.place(grid, k, 1100.0);
        WIDTH * area[k].sqrt() * (1.0 + 0.6 * noise::gradient(x, z, rock.seed ^ 0x50))
    };
    let mut nearest = vec![(f64::INFINITY, 0); grid.cells()];
    let mut front = BinaryHeap::new();
    for k in (0..grid.cells()).filter(|&k| half_width(k) > 2.0 * grid.spacing) {
        nearest[k] = (0.0, k);
        front.push((Reverse(0), k));
    }
    while let Some((Reverse(bits), k)) = front.pop() {
        let (away, river) = nearest[k];
        if away.to_bits() != bits {
            continue;
        }
        let half_width = half_width(river);
        for (n, _) in grid.neighbours(k) {
            let away = grid.distance(n, river) / half_width;
            if away < nearest[n].0.min(WALLS) {
                nearest[n] = (away, river);
                // The bits of non-negative floats sort like the floats.
                front.push((Reverse(away.to_bits()), n));
            }
        }
    }
    let old = height.to_vec();
    for (k, &(away, river)) in nearest.iter().enumerate().filter(|(_, (away, _))| *away < WALLS) {
        let t = ((away - 0.5) / (WALLS - 0.5)).clamp(0.0, 1.0);
        let keep = 0.02 + 0.98 * t * t * (3.0 - 2.0 * t);
        height[k] = old[k].min(old[river] + (old[k] - old[river]) * keep);
    }
}

/// Soil creep, dh/dt ∝ ∇²h, by a nine-point stencil; little of it where rock is bare.
fn creep(grid: Grid, height: &mut [f64]) {
    const BARE: f64 = 1300.0;
    let old = height.to_vec();
    let w = grid.size[0];
    for k in (0..grid.cells()).filter(|&k| !grid.is_border(k)) {
        let straight = old[k - 1] + old[k + 1] + old[k - w] + old[k + w];
        let diagonal = old[k - w - 1] + old[k - w + 1] + old[k + w - 1] + old[k + w + 1];
        let soil = 1.0 - (old[k] / BARE).clamp(0.0, 0.8);
        height[k] += 0.6 * soil * ((4.0 * straight + diagonal) / 20.0 - old[k]);
    }
}

/// Gives walls their ribs, and plains the ground swell that makes a river wander.
fn roughen(rock: &Rock, grid: Grid, height: &mut [f64]) {
    const STEEP: [f64; 2] = [0.5, 1.0];
    let old = height.to_vec();
    let w = grid.size[0];
    for k in (0..grid.cells()).filter(|&k| !grid.is_border(k)) {
        let (x, z) = ((old[k + 1] - old[k - 1]) / 2.0, (old[k + w] - old[k - w]) / 2.0);
        let slope = (x * x + z * z).sqrt() / grid.spacing;
        let bare = ((slope - STEEP[0]) / (STEEP[1] - STEEP[0])).clamp(0.0, 1.0);
        let ribs = noise::ridged(rock.place(grid, k, 170.0), 2, rock.seed ^ 0x80);
        let swell = noise::fractal(rock.place(grid, k, 700.0), 3, rock.seed ^ 0x90);
        height[k] += 9.0 * bare * ribs + 2.5 * swell;
    }
}

/// Lowers the terrain in wide basins of up to `depth` metres.
fn sag(rock: &Rock, grid: Grid, height: &mut [f64], depth: f64, seed: u64) {
    for (k, h) in height.iter_mut().enumerate() {
        *h -= depth * noise::fractal(rock.place(grid, k, 9_000.0), 2, seed).max(0.0);
    }
}
