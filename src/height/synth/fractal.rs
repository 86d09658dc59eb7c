//! Warped multifractal terrain: rough on the heights and smooth in the valleys, without rivers.
//!
//! Musgrave's "ridged multifractal" in Ebert et al., "Texturing & Modeling" (2003): the detail of each octave is
//! weighted by the octave before it; the place is warped first, after Quílez, "Domain warping" (2002).

use rayon::prelude::*;

use super::noise;
use crate::height::field::Field;
use crate::height::holes::Holes;
use crate::height::samples::Samples;

/// Distance of samples, metres.
const SPACING: f64 = 20.0;
/// Wavelength of the first octave, metres.
const WAVELENGTH: f64 = 9000.0;
/// Octaves, down to a wavelength of about two samples.
const OCTAVES: u64 = 9;
/// Height of the highest crests, metres.
const RELIEF: f64 = 2400.0;

/// Makes a fractal landscape.
pub fn fractal(size: [u32; 2], seed: u64) -> Field {
    let [w, h] = size.map(u64::from);
    let place = |k: u64| [(k % w) as f64, (k / w) as f64].map(|t| t * SPACING / WAVELENGTH);
    let heights = (0..w * h).into_par_iter().map(|k| (height(place(k), seed) * RELIEF) as f32);
    let samples = Samples::F32(heights.collect());
    let holes = Holes::none(samples.len());
    Field::new(samples, size, [SPACING; 2], holes)
}

/// Height, about [0, 1].
fn height(place: [f64; 2], seed: u64) -> f64 {
    let mut p = noise::warped(place, 0.25, seed ^ 0x5EED);
    let (mut value, mut weight, mut amplitude) = (0.0, 1.0, 0.5);
    for octave in 0..OCTAVES {
        let crest = 1.0 - noise::gradient(p[0], p[1], seed.wrapping_add(octave)).abs();
        let signal = crest * crest * weight;
        value += signal * amplitude;
        weight = (signal * 1.6).clamp(0.0, 1.0);
        amplitude *= 0.5;
        p = noise::next_octave(p);
    }
    value
}
