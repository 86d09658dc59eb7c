//! Colours for heights: water, meadow, forest, scree, rock and snow, by height, slope, hollows and drainage. No light is
//! baked in.

use cuesta::internal::height::Field;
use cuesta::internal::height::synth::flow::{Flow, Grid};
use cuesta::internal::height::synth::noise;
use image::{Rgb, RgbImage};

type Colour = [f64; 3];

const LAKE: Colour = [58.0, 92.0, 104.0];
const RIVER: Colour = [104.0, 124.0, 124.0];
const GRAVEL: Colour = [152.0, 148.0, 134.0];
const MEADOW: Colour = [116.0, 128.0, 74.0];
const FIELDS: Colour = [146.0, 144.0, 94.0];
const FOREST: Colour = [64.0, 79.0, 50.0];
const PASTURE: Colour = [124.0, 122.0, 78.0];
const SCREE: Colour = [156.0, 149.0, 136.0];
const ROCK: Colour = [128.0, 120.0, 110.0];
const SNOW: Colour = [236.0, 240.0, 244.0];

/// Seed of the patches; the picture depends on the field alone.
const SEED: u64 = 0xC0105;

/// A picture of two pixels a cell, from the first sample to the last one along each axis.
pub fn overlay(field: &Field) -> RgbImage {
    let ground = Ground::new(field);
    let [w, h] = ground.grid.size;
    RgbImage::from_fn(2 * (w as u32 - 1), 2 * (h as u32 - 1), |x, z| {
        let place = [x, z].map(|t| (f64::from(t) + 0.5) / 2.0);
        Rgb(ground.colour(place).map(|c| (c + 0.5).floor().clamp(0.0, 255.0) as u8))
    })
}

/// Quantities that decide the colours, one of each per sample.
struct Ground {
    grid: Grid,
    /// 0 at the lowest sample, 1 at the highest.
    rise: Vec<f64>,
    slope: Vec<f64>,
    /// North component of a sample's direction, −1 to 1.
    north: Vec<f64>,
    /// Depth below the mean of some 150 m around, metres.
    hollow: Vec<f64>,
    /// √(area drained), metres.
    river: Vec<f64>,
    /// 1 on lakes.
    lake: Vec<f64>,
}

impl Ground {
    fn new(field: &Field) -> Self {
        let [w, h] = field.stored().map(|n| n as usize);
        let grid = Grid { size: [w, h], spacing: field.spacing[0] };
        let height = grid.map(|k| f64::from(field.samples().height(k)));
        let gradient: Vec<[f64; 2]> = (0..grid.cells()).map(|k| gradient(field, &height, k)).collect();
        let slope: Vec<f64> = gradient.iter().map(|[x, z]| (x * x + z * z).sqrt()).collect();
        let statistics = field.statistics();
        let (low, range) = (f64::from(statistics.min), f64::from(statistics.max - statistics.min).max(1.0));
        let around = (0..8).fold(height.clone(), |blurred, _| blur(grid, &blurred));
        Self {
            rise: height.iter().map(|h| (h - low) / range).collect(),
            north: gradient.iter().zip(&slope).map(|([_, z], slope)| z / slope.max(0.05)).collect(),
            hollow: around.iter().zip(&height).map(|(around, h)| around - h).collect(),
            river: Flow::new(grid, &height, 0.0).area(grid).iter().map(|area| area.sqrt()).collect(),
            lake: blur(grid, &lakes(grid, &height)).iter().map(|wet| step(0.2, 0.5, *wet)).collect(),
            slope,
            grid,
        }
    }

    /// A quantity between samples, bilinearly.
    fn at(&self, values: &[f64], [x, z]: [f64; 2]) -> f64 {
        let [w, h] = self.grid.size;
        let (i, j) = ((x as usize).min(w - 2), (z as usize).min(h - 2));
        let (u, v) = (x - i as f64, z - j as f64);
        let row = |j: usize| values[j * w + i] * (1.0 - u) + values[j * w + i + 1] * u;
        row(j) * (1.0 - v) + row(j + 1) * v
    }

    /// Layer by layer, each over the one before.
    fn colour(&self, place: [f64; 2]) -> Colour {
        let patch = |cells: f64, salt: u64| noise::fractal(place.map(|t| t / cells), 4, SEED + salt);
        let (broad, fine) = (patch(60.0, 0), patch(9.0, 10));
        let rise = self.at(&self.rise, place);
        let slope = self.at(&self.slope, place) + 0.12 * fine;
        let hollow = self.at(&self.hollow, place);
        let height = rise + 0.06 * broad + 0.03 * fine;

        let mut colour = mix(MEADOW, FIELDS, step(0.0, 0.4, patch(25.0, 20)));
        colour = mix(colour, FOREST, step(0.12, 0.3, slope + 0.15 * broad));
        colour = mix(colour, PASTURE, step(0.36, 0.44, height - 0.002 * hollow));
        colour = mix(colour, SCREE, step(0.50, 0.62, height + 0.1 * (slope - 0.6)));
        colour = mix(colour, ROCK, step(0.90, 1.30, slope + 0.5 * (height - 0.5)) * step(0.2, 0.4, height));
        let snow = height + 0.05 * self.at(&self.north, place) + 0.0025 * hollow;
        colour = mix(colour, SNOW, step(0.54, 0.60, snow) * (1.0 - step(1.05, 1.35, slope - 0.8 * (height - 0.7))));
        colour = colour.map(|c| c * (1.0 + 0.07 * fine - (0.004 * hollow).clamp(-0.06, 0.10)));

        let river = self.at(&self.river, place);
        colour = mix(colour, GRAVEL, 0.7 * step(2500.0, 5000.0, river * (1.0 + 0.3 * fine)));
        colour = mix(colour, RIVER, step(4000.0, 7000.0, river));
        mix(colour, LAKE, self.at(&self.lake, place))
    }
}

fn gradient(field: &Field, height: &[f64], k: usize) -> [f64; 2] {
    let [w, h] = field.stored().map(|n| n as usize);
    let (i, j) = (k % w, k / w);
    let along = |low: usize, high: usize, step: f64| (height[high] - height[low]) / step;
    let (left, right) = (i.saturating_sub(1), (i + 1).min(w - 1));
    let (up, down) = (j.saturating_sub(1), (j + 1).min(h - 1));
    [
        along(j * w + left, j * w + right, (right - left) as f64 * field.spacing[0]),
        along(up * w + i, down * w + i, (down - up) as f64 * field.spacing[1]),
    ]
}

/// Mean of each cell and its neighbours.
fn blur(grid: Grid, values: &[f64]) -> Vec<f64> {
    let mean = |k: usize| {
        let (sum, count) = grid.neighbours(k).fold((values[k], 1.0), |(sum, n), (at, _)| (sum + values[at], n + 1.0));
        sum / count
    };
    grid.map(mean)
}

/// 1 on level ground of more than half a square kilometre or so, which only water is.
fn lakes(grid: Grid, height: &[f64]) -> Vec<f64> {
    const SMALLEST: usize = 500;
    let level = |k: usize| grid.neighbours(k).all(|(n, _)| height[n] == height[k]);
    let mut lake: Vec<f64> = vec![0.0; grid.cells()];
    let mut seen = vec![false; grid.cells()];
    for start in 0..grid.cells() {
        let mut found = Vec::new();
        let mut next = vec![start];
        while let Some(k) = next.pop() {
            if !seen[k] && level(k) {
                seen[k] = true;
                found.push(k);
                next.extend(grid.neighbours(k).map(|(n, _)| n));
            }
        }
        if found.len() >= SMALLEST {
            found.iter().for_each(|&k| lake[k] = 1.0);
        }
    }
    lake
}

/// 0 below `low`, 1 above `high`, smooth between.
fn step(low: f64, high: f64, value: f64) -> f64 {
    let t = ((value - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

fn mix(below: Colour, above: Colour, cover: f64) -> Colour {
    [0, 1, 2].map(|c| below[c] + (above[c] - below[c]) * cover)
}
