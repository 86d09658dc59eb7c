//! Fields with known heights: planes, and extreme ones that break careless renderers.

use super::noise;
use crate::height::field::Field;
use crate::height::holes::Holes;
use crate::height::samples::Samples;

/// Distance of samples, metres.
const SPACING: f64 = 10.0;

fn field(size: [u32; 2], height: impl Fn(u32, u32) -> f32) -> Field {
    let heights = (0..size[1]).flat_map(|j| (0..size[0]).map(move |i| (i, j))).map(|(i, j)| height(i, j));
    let samples = Samples::F32(heights.collect());
    let holes = Holes::none(samples.len());
    Field::new(samples, size, [SPACING; 2], holes)
}

/// Makes a horizontal plane; not at 0, so that a lost height shows.
pub fn flat(size: [u32; 2], _: u64) -> Field {
    field(size, |_, _| 100.0)
}

/// Makes a ramp. Its steps of 1 and 1/2 m are exact, and so is any interpolation of it.
pub fn ramp(size: [u32; 2], _: u64) -> Field {
    field(size, |i, j| i as f32 + j as f32 * 0.5)
}

/// Makes a checkerboard with the largest steps that 16 bits hold between all neighbours.
pub fn checker([w, h]: [u32; 2], _: u64) -> Field {
    let heights = (0..h).flat_map(|j| (0..w).map(move |i| if (i + j) % 2 == 0 { i16::MIN } else { i16::MAX }));
    let samples = Samples::from_i16(heights);
    let holes = Holes::none(samples.len());
    Field::new(samples, [w, h], [SPACING; 2], holes)
}

/// Makes a cliff that moves by one column every three rows, so that it crosses the edges of blocks.
pub fn cliff(size: [u32; 2], _: u64) -> Field {
    let foot = |j: u32| i64::from(size[0] / 2) + (i64::from(j) - i64::from(size[1] / 2)) / 3;
    field(size, |i, j| if i64::from(i) < foot(j) { 0.0 } else { 1000.0 })
}

/// Makes a spike of one sample, away from the border where the size allows.
pub fn spike(size: [u32; 2], seed: u64) -> Field {
    let [x, z] = [0, 1].map(|axis| match size[axis] {
        2 => noise::hash(axis as i64, 0, seed) % 2,
        n => 1 + noise::hash(axis as i64, 0, seed) % (n - 2),
    });
    field(size, |i, j| if (i, j) == (x, z) { 1e5 } else { 0.0 })
}

/// Makes a ridge of one sample per row that moves by one column every two rows.
pub fn ridge(size: [u32; 2], _: u64) -> Field {
    field(size, |i, j| if i == (size[0] / 4 + j / 2) % size[0] { 300.0 } else { 0.0 })
}
