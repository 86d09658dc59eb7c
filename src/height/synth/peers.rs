//! The field on which other terrain renderers were measured, bit for bit: heterogeneous fractal noise, ten octaves
//! of wavelengths 1024 to 2 samples, the middle ones ridged; an infinite landscape of which any size is a crop.

use rayon::prelude::*;

use super::noise;
use crate::height::field::Field;
use crate::height::holes::Holes;
use crate::height::samples::Samples;

/// Wavelength of the first octave, samples.
const WAVELENGTH: f64 = 1024.0;
const OCTAVES: u64 = 10;
/// Height of the largest code, metres, at 1 m between samples.
const RELIEF: f32 = 400.0;

/// Makes a crop of the landscape.
pub fn peers(size: [u32; 2], seed: u64) -> Field {
    let place = |k: u64| [(k % u64::from(size[0])) as f64, (k / u64::from(size[0])) as f64];
    let code = |k| (height(place(k), seed) * 65535.0 + 0.5).floor() as u16;
    let codes: Vec<u16> = (0..u64::from(size[0]) * u64::from(size[1])).into_par_iter().map(code).collect();
    let holes = Holes::none(codes.len());
    Field::new(Samples::Coded { codes, zero: 0.0, scale: RELIEF / 65535.0 }, size, [1.0; 2], holes)
}

/// Height in [0, 1].
fn height(place: [f64; 2], seed: u64) -> f64 {
    let mut p = place.map(|t| t / WAVELENGTH);
    let (mut value, mut rough, mut norm, mut amplitude) = (0.0, 1.0, 0.0, 1.0);
    for octave in 0..OCTAVES {
        let mut n = noise::gradient(p[0], p[1], seed.wrapping_add(octave));
        if (1..=3).contains(&octave) {
            n = 1.0 - 2.0 * n.abs();
        }
        value += n * amplitude * rough;
        norm += amplitude;
        if octave >= 1 {
            // Valleys smooth, heights rough.
            rough = (0.45 + value / norm).clamp(0.1, 1.0);
        }
        p = noise::next_octave(p);
        amplitude *= 0.5;
    }
    (0.42 + 0.5 * value / norm).clamp(0.0, 1.0)
}
