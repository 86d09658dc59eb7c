//! Generates ground colour texels for any tile of a virtual texture over a whole field, from heights, slopes and
//! noise.
//!
//! After J. Blow, "Terrain Rendering at High Levels of Detail" (2000), §1 and §2: a texture of 2^36 texels is never
//! stored; its tiles are generated on demand. Noise narrower than two texels is left out, so that a coarse tile
//! equals a downsampled fine one. Colours are evaluated at texel corners: neighbouring tiles of one level share the
//! texels on their common edge.

use std::sync::Arc;

use super::noise::{plane_nearest, plane_values};
use super::tile_cache::Texel;
use super::wedges::root_side;
use super::working_set::TileId;
use crate::height::{Field, bezier};

/// An sRGB-encoded colour, components 0 to 1.
type Colour = [f32; 3];

/// Colours of lowland, slopes, rock and snow, from the lowest to the highest; and of ground too steep for any of
/// them.
const LOWLAND: [Colour; 2] = [[0.36, 0.46, 0.28], [0.54, 0.56, 0.36]];
const SLOPES: Colour = [0.63, 0.56, 0.45];
const ROCK: Colour = [0.60, 0.59, 0.58];
const SNOW: Colour = [0.93, 0.95, 0.97];
const STEEP: Colour = [0.52, 0.49, 0.46];
/// Colour of stones.
const STONE: Colour = [0.66, 0.63, 0.58];

/// Longest brightness wave, metres, and the amplitude of each octave: all octaves have the same amplitude.
const WIDEST_M: f64 = 2048.0;
const WAVE: f32 = 0.055;
/// Distances between stones of each size, metres.
const STONES_M: [f64; 6] = [16.0, 4.0, 1.0, 0.25, 0.0625, 0.015_625];
/// Shortest wave, metres.
const NARROWEST_M: f64 = 0.004;

/// A generator of ground colour texels for one field.
pub struct Ground {
    field: Arc<Field>,
    /// Lowest and highest height, metres.
    range: [f64; 2],
}

/// The terrain surface at one point.
struct SurfacePoint {
    height_m: f64,
    /// Cosine of the angle between the vertical and the normal.
    upright: f32,
}

impl Ground {
    /// Creates a generator for a field.
    pub fn new(field: &Arc<Field>) -> Self {
        Self { field: Arc::clone(field), range: field.range().map(f64::from) }
    }

    /// Returns the texels of a tile of the quadtree over the field's root square: (`cells` + 1)² sRGB texels, row by
    /// row. Beyond the field's edge the edge colour continues.
    pub fn tile(&self, id: TileId, cells: u32) -> Vec<Texel> {
        let side = f64::from(root_side(&self.field)) * 0.5f64.powi(id.level as i32);
        let step = side / f64::from(cells);
        let along = |k: usize, n: u32| f64::from(id.at[k]) * side + f64::from(n) * step;
        let corners = (0..=cells).flat_map(|z| (0..=cells).map(move |x| [x, z]));
        corners.map(|[x, z]| self.texel([along(0, x), along(1, z)], step)).collect()
    }

    /// Returns the texel at a position, samples, for a texel spacing of `step` samples.
    fn texel(&self, at: [f64; 2], step: f64) -> Texel {
        let last = self.field.size().map(|n| f64::from(n - 1));
        let at = [0, 1].map(|k| at[k].min(last[k]));
        let spacing = self.field.spacing;
        let width_m = step * spacing[0].max(spacing[1]);
        let surface_point = self.surface_point(at, step);
        let [x, z] = [0, 1].map(|k| at[k] * spacing[k]);
        let colour = with_stones(self.tint(&surface_point, [x, z], width_m), &surface_point, [x, z], width_m);
        let [r, g, b] = colour.map(|part| (part.clamp(0.0, 1.0) * 255.0).round() as u8);
        [r, g, b, 255]
    }

    fn surface_point(&self, at: [f64; 2], step: f64) -> SurfacePoint {
        let (height_m, slopes) = match self.field.procedural() {
            Some(terrain) => {
                let at = at.map(|n| n * bezier::SPACING_M);
                (terrain.height(at), terrain.slopes(at, 2.0 * step * bezier::SPACING_M))
            }
            None => (self.height(at), self.slopes(at, step.max(1.0))),
        };
        let upright = 1.0 / (1.0 + slopes[0] * slopes[0] + slopes[1] * slopes[1]).sqrt();
        SurfacePoint { height_m, upright: upright as f32 }
    }

    /// Returns the bilinearly interpolated height at a position in samples, metres.
    fn height(&self, at: [f64; 2]) -> f64 {
        let last = self.field.size().map(|n| n - 1);
        let first = [0, 1].map(|k| (at[k] as u32).min(last[k] - 1));
        let [u, v] = [0, 1].map(|k| at[k] - f64::from(first[k]));
        let sample = |dx: u32, dz: u32| f64::from(self.field.height(first[0] + dx, first[1] + dz));
        let row = |dz: u32| sample(0, dz) * (1.0 - u) + sample(1, dz) * u;
        row(0) * (1.0 - v) + row(1) * v
    }

    /// Returns the slopes along (x, z) as differences of heights `reach` samples away on both sides.
    fn slopes(&self, at: [f64; 2], reach: f64) -> [f64; 2] {
        let last = self.field.size().map(|n| f64::from(n - 1));
        [0, 1].map(|k| {
            let beside = |n: f64| (at[k] + n).clamp(0.0, last[k]);
            let height = |n: f64| self.height(if k == 0 { [n, at[1]] } else { [at[0], n] });
            let [low, high] = [beside(-reach), beside(reach)];
            (height(high) - height(low)) / ((high - low) * self.field.spacing[k])
        })
    }

    /// Returns the ground colour without stones at a position in metres, for texels `width_m` wide.
    fn tint(&self, surface_point: &SurfacePoint, at_m: [f64; 2], width_m: f64) -> Colour {
        let share = (surface_point.height_m - self.range[0]) / (self.range[1] - self.range[0]).max(1e-6);
        let mut brightness = 1.0;
        let mut border = 0.0;
        let mut wave_m = WIDEST_M;
        let mut seed = 1;
        while wave_m >= NARROWEST_M && visibility(wave_m, width_m) > 0.0 {
            let value = 2.0 * plane_values(at_m.map(|n| n / wave_m), seed) - 1.0;
            brightness += WAVE * visibility(wave_m, width_m) * value;
            // Long waves displace the borders between ground colours.
            border += if wave_m >= 16.0 { 0.012 * visibility(wave_m, width_m) * value } else { 0.0 };
            (wave_m, seed) = (wave_m / 2.0, seed + 1);
        }
        let t = (share as f32 + border).clamp(0.0, 1.0);
        let mut colour = mixed(LOWLAND[0], LOWLAND[1], smoothstep(0.0, 0.28, t));
        colour = mixed(colour, SLOPES, smoothstep(0.25, 0.55, t));
        colour = mixed(colour, ROCK, smoothstep(0.5, 0.75, t));
        colour = mixed(colour, SNOW, smoothstep(0.78, 0.92, t));
        colour = mixed(STEEP, colour, smoothstep(0.45, 0.75, surface_point.upright + 2.0 * border));
        colour.map(|part| part * brightness)
    }
}

/// Blends stones over a ground colour; their density grows with steepness.
fn with_stones(ground: Colour, surface_point: &SurfacePoint, at_m: [f64; 2], width_m: f64) -> Colour {
    let share = 0.08 + 0.5 * (1.0 - surface_point.upright);
    let mut colour = ground;
    for (seed, apart_m) in (100..).zip(STONES_M) {
        // A stone is about a quarter as wide as the distance to the next one.
        let visibility = visibility(apart_m / 4.0, width_m);
        if visibility == 0.0 {
            break;
        }
        let nearest = plane_nearest(at_m.map(|n| n / apart_m), 7 * seed);
        let radius = 0.06 + 0.10 * nearest.own;
        let is_there = (nearest.own * 97.0).fract() < share;
        if is_there && nearest.first < radius {
            let out = nearest.first / radius;
            let light = 1.08 - 0.45 * out * out * out + 0.25 * (nearest.own - 0.5);
            colour = mixed(colour, STONE.map(|part| part * light), visibility);
        }
    }
    colour
}

/// Returns the weight of a wave for a texel width: 0 up to two texel widths, 1 from four texel widths.
fn visibility(wave_m: f64, width_m: f64) -> f32 {
    ((wave_m / width_m - 2.0) / 2.0).clamp(0.0, 1.0) as f32
}

fn mixed(from: Colour, to: Colour, share: f32) -> Colour {
    std::array::from_fn(|k| from[k] + (to[k] - from[k]) * share)
}

/// Returns the smoothstep of `t`: 0 up to `first`, 1 from `second`, with zero slope at both.
fn smoothstep(first: f32, second: f32, t: f32) -> f32 {
    let part = ((t - first) / (second - first)).clamp(0.0, 1.0);
    part * part * (3.0 - 2.0 * part)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::synth::{Kind, synth};

    const CELLS: u32 = 16;

    fn grounds() -> [Ground; 2] {
        let samples = Arc::new(synth(Kind::Fractal, [129, 100], 4));
        let endless = Arc::new(Field::endless(Arc::new(bezier::Bezier::new(3, bezier::LAYERS))));
        [Ground::new(&samples), Ground::new(&endless)]
    }

    fn texel(tile: &[Texel], x: u32, z: u32) -> Texel {
        tile[(z * (CELLS + 1) + x) as usize]
    }

    #[test]
    fn neighbouring_tiles_share_edge_texels() {
        for ground in grounds() {
            for level in [1, 4, 9, 14] {
                let at = [1 << (level - 1), (1 << (level - 1)) - 1];
                let tile = |dx: u32, dz: u32| ground.tile(TileId { level, at: [at[0] - dx, at[1] + dz] }, CELLS);
                let (here, west, south) = (tile(0, 0), tile(1, 0), tile(0, 1));
                for n in 0..=CELLS {
                    assert_eq!(texel(&here, 0, n), texel(&west, CELLS, n));
                    assert_eq!(texel(&here, n, CELLS), texel(&south, n, 0));
                }
            }
        }
    }

    /// The first quadrant of a tile and the child over it have about the same mean.
    #[test]
    fn a_tile_has_about_the_mean_of_its_child() {
        for ground in grounds() {
            for level in [2, 6, 10, 16] {
                let tile = TileId { level, at: [1 << (level - 1); 2] };
                let parent = ground.tile(tile, CELLS);
                let child = ground.tile(TileId { level: level + 1, at: tile.at.map(|n| 2 * n) }, CELLS);
                let mean = |tile: &[Texel], cells: u32| {
                    let inside = (0..cells).flat_map(|z| (0..cells).map(move |x| [x, z]));
                    let sum: f64 = inside.map(|[x, z]| f64::from(texel(tile, x, z)[1])).sum();
                    sum / f64::from(cells * cells)
                };
                let apart = mean(&parent, CELLS / 2) - mean(&child, CELLS);
                assert!(apart.abs() < 12.0, "level {level}: {apart}");
            }
        }
    }

    /// Tiles of all levels have some contrast.
    #[test]
    fn every_level_has_contrast() {
        for ground in grounds() {
            for level in [0, 3, 7, 12] {
                let tile = ground.tile(TileId { level, at: [(1 << level) / 3; 2] }, CELLS);
                let greens: Vec<u8> = tile.iter().map(|texel| texel[1]).collect();
                let (low, high) = (greens.iter().min().unwrap(), greens.iter().max().unwrap());
                assert!(high - low >= 3, "level {level}: {low} to {high}");
            }
        }
    }
}
