//! Winding passages between rock: a floor and a ceiling that match if they have the same seed.
//!
//! Passages follow the zero lines of a noise, as crests of ridged noise do; where the noise is large, the ceiling is below
//! the floor, which [`Cave`](crate::height::cave::Cave) takes for rock.

use rayon::prelude::*;

use super::noise;
use crate::height::field::Field;
use crate::height::holes::Holes;
use crate::height::samples::Samples;

/// Distance of samples, metres.
const SPACING: f64 = 1.0;
/// Wavelength of the noise along whose zero lines passages run, metres.
const WAVELENGTH: f64 = 90.0;
/// The noise at which a passage ends.
const WALL: f64 = 0.22;
/// Half the height of a passage at its middle, metres.
const HALF_HEIGHT: f64 = 9.0;
/// Amplitude of the rise and fall of passages, metres.
const RELIEF: f64 = 30.0;
/// Half the height of rocks on the floor, metres; those on the ceiling are twice as long.
const ROUGHNESS: f64 = 0.8;

/// Makes the floor.
pub fn floor(size: [u32; 2], seed: u64) -> Field {
    field(size, |p| {
        let (middle, half) = passage(p, seed);
        middle - half * 0.6 + ROUGHNESS * noise::fractal(p.map(|t| t / 7.0), 4, seed ^ 0xF100)
    })
}

/// Makes the ceiling.
pub fn ceiling(size: [u32; 2], seed: u64) -> Field {
    field(size, |p| {
        let (middle, half) = passage(p, seed);
        middle + half - 2.0 * ROUGHNESS * noise::ridged(p.map(|t| t / 9.0), 4, seed ^ 0xCE11)
    })
}

fn field(size: [u32; 2], height: impl Fn([f64; 2]) -> f64 + Sync) -> Field {
    let [w, h] = size.map(u64::from);
    let place = |k: u64| [k % w, k / w].map(|n| n as f64 * SPACING);
    let samples = Samples::F32((0..w * h).into_par_iter().map(|k| height(place(k)) as f32).collect());
    let holes = Holes::none(samples.len());
    Field::new(samples, size, [SPACING; 2], holes)
}

/// Height of a passage's middle, and half its height, below 0 in the rock, metres.
fn passage(p: [f64; 2], seed: u64) -> (f64, f64) {
    let [x, z] = noise::warped(p.map(|t| t / WAVELENGTH), 0.3, seed ^ 0x5EED);
    let beside = noise::gradient(x, z, seed).abs() / WALL;
    let middle = RELIEF * noise::fractal(p.map(|t| t / (3.0 * WAVELENGTH)), 2, seed ^ 0x31DD);
    (middle, HALF_HEIGHT * (1.0 - beside * beside).max(-1.0))
}
