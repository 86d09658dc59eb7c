//! Texels of a ground over a whole field, as fine as anyone asks for: made from heights, slopes and noise, a node of the
//! map's quadtree at a time.
//!
//! After J. Blow, "Terrain Rendering at High Levels of Detail" (2000), §1 and §2: a map of 2^36 texels is never there, and
//! nodes of it are generated on demand. A texel holds nothing narrower than two of its own width, so that a coarse node is
//! what a fine one looks like from afar. Corners of texels' squares are what is coloured: neighbours of one level have the
//! same texels on their common edge.

use std::sync::Arc;

use super::noise::{open_nearest, open_values};
use super::tile_cache::Texel;
use super::wedges::root_side;
use super::working_set::Node;
use crate::height::{Field, bezier};

/// A colour as texels hold it (sRGB), 0 to 1.
type Colour = [f32; 3];

/// Lowland, slopes, rock and snow by the share of the field's heights at which they are reached; and what is too steep for
/// any of them.
const LOWLAND: [Colour; 2] = [[0.36, 0.46, 0.28], [0.54, 0.56, 0.36]];
const SLOPES: Colour = [0.63, 0.56, 0.45];
const ROCK: Colour = [0.60, 0.59, 0.58];
const SNOW: Colour = [0.93, 0.95, 0.97];
const STEEP: Colour = [0.52, 0.49, 0.46];
/// Of a stone.
const STONE: Colour = [0.66, 0.63, 0.58];

/// The widest waves of brightness, metres, and how high each one is: those half as wide are as high.
const WIDEST_M: f64 = 2048.0;
const WAVE: f32 = 0.055;
/// Distances between stones of each size, metres.
const STONES_M: [f64; 6] = [16.0, 4.0, 1.0, 0.25, 0.0625, 0.015_625];
/// The narrowest wave.
const NARROWEST_M: f64 = 0.004;

/// The ground of a field.
pub struct Ground {
    field: Arc<Field>,
    /// Lowest and highest, metres.
    range: [f64; 2],
}

/// A place of the ground.
struct Place {
    height_m: f64,
    /// Cosine of the angle between the vertical and the normal.
    upright: f32,
}

impl Ground {
    /// Of a field.
    pub fn new(field: &Arc<Field>) -> Self {
        Self { field: Arc::clone(field), range: field.range().map(f64::from) }
    }

    /// The texels of a node of the quadtree over the field's root square, row by row: `cells` + 1 along a side. What lies
    /// beyond the field's end looks as its end does.
    pub fn tile(&self, node: Node, cells: u32) -> Vec<Texel> {
        let side = f64::from(root_side(&self.field)) * 0.5f64.powi(node.level as i32);
        let step = side / f64::from(cells);
        let along = |k: usize, n: u32| f64::from(node.at[k]) * side + f64::from(n) * step;
        let corners = (0..=cells).flat_map(|z| (0..=cells).map(move |x| [x, z]));
        corners.map(|[x, z]| self.texel([along(0, x), along(1, z)], step)).collect()
    }

    /// The texel at a place, samples, with others so many samples away.
    fn texel(&self, at: [f64; 2], step: f64) -> Texel {
        let last = self.field.size().map(|n| f64::from(n - 1));
        let at = [0, 1].map(|k| at[k].min(last[k]));
        let spacing = self.field.spacing;
        let width_m = step * spacing[0].max(spacing[1]);
        let place = self.place(at, step);
        let [x, z] = [0, 1].map(|k| at[k] * spacing[k]);
        let colour = with_stones(self.tint(&place, [x, z], width_m), &place, [x, z], width_m);
        let [r, g, b] = colour.map(|part| (part.clamp(0.0, 1.0) * 255.0).round() as u8);
        [r, g, b, 255]
    }

    fn place(&self, at: [f64; 2], step: f64) -> Place {
        let (height_m, slopes) = match self.field.procedural() {
            Some(terrain) => {
                let at = at.map(|n| n * bezier::SPACING_M);
                (terrain.height(at), terrain.slopes(at, 2.0 * step * bezier::SPACING_M))
            }
            None => (self.height(at), self.slopes(at, step.max(1.0))),
        };
        let upright = 1.0 / (1.0 + slopes[0] * slopes[0] + slopes[1] * slopes[1]).sqrt();
        Place { height_m, upright: upright as f32 }
    }

    /// Height between samples, metres.
    fn height(&self, at: [f64; 2]) -> f64 {
        let last = self.field.size().map(|n| n - 1);
        let first = [0, 1].map(|k| (at[k] as u32).min(last[k] - 1));
        let [u, v] = [0, 1].map(|k| at[k] - f64::from(first[k]));
        let sample = |dx: u32, dz: u32| f64::from(self.field.height(first[0] + dx, first[1] + dz));
        let row = |dz: u32| sample(0, dz) * (1.0 - u) + sample(1, dz) * u;
        row(0) * (1.0 - v) + row(1) * v
    }

    /// Slopes (x, z) from heights `reach` samples away on both sides.
    fn slopes(&self, at: [f64; 2], reach: f64) -> [f64; 2] {
        let last = self.field.size().map(|n| f64::from(n - 1));
        [0, 1].map(|k| {
            let beside = |n: f64| (at[k] + n).clamp(0.0, last[k]);
            let height = |n: f64| self.height(if k == 0 { [n, at[1]] } else { [at[0], n] });
            let [low, high] = [beside(-reach), beside(reach)];
            (height(high) - height(low)) / ((high - low) * self.field.spacing[k])
        })
    }

    /// The ground without stones.
    fn tint(&self, place: &Place, at_m: [f64; 2], width_m: f64) -> Colour {
        let share = (place.height_m - self.range[0]) / (self.range[1] - self.range[0]).max(1e-6);
        let mut brightness = 1.0;
        let mut border = 0.0;
        let mut wave_m = WIDEST_M;
        let mut seed = 1;
        while wave_m >= NARROWEST_M && seen(wave_m, width_m) > 0.0 {
            let value = 2.0 * open_values(at_m.map(|n| n / wave_m), seed) - 1.0;
            brightness += WAVE * seen(wave_m, width_m) * value;
            // Borders between kinds of ground follow the wide waves.
            border += if wave_m >= 16.0 { 0.012 * seen(wave_m, width_m) * value } else { 0.0 };
            (wave_m, seed) = (wave_m / 2.0, seed + 1);
        }
        let t = (share as f32 + border).clamp(0.0, 1.0);
        let mut colour = mixed(LOWLAND[0], LOWLAND[1], step_between(0.0, 0.28, t));
        colour = mixed(colour, SLOPES, step_between(0.25, 0.55, t));
        colour = mixed(colour, ROCK, step_between(0.5, 0.75, t));
        colour = mixed(colour, SNOW, step_between(0.78, 0.92, t));
        colour = mixed(STEEP, colour, step_between(0.45, 0.75, place.upright + 2.0 * border));
        colour.map(|part| part * brightness)
    }
}

/// A ground with stones on it: more where it is steep.
fn with_stones(ground: Colour, place: &Place, at_m: [f64; 2], width_m: f64) -> Colour {
    let share = 0.08 + 0.5 * (1.0 - place.upright);
    let mut colour = ground;
    for (seed, apart_m) in (100..).zip(STONES_M) {
        // A stone is about a quarter of the way to the next one wide.
        let seen = seen(apart_m / 4.0, width_m);
        if seen == 0.0 {
            break;
        }
        let nearest = open_nearest(at_m.map(|n| n / apart_m), 7 * seed);
        let radius = 0.06 + 0.10 * nearest.own;
        let is_there = (nearest.own * 97.0).fract() < share;
        if is_there && nearest.first < radius {
            let out = nearest.first / radius;
            let light = 1.08 - 0.45 * out * out * out + 0.25 * (nearest.own - 0.5);
            colour = mixed(colour, STONE.map(|part| part * light), seen);
        }
    }
    colour
}

/// How much of a wave is seen in texels of a width: nothing from twice that width down, all of it from four times up.
fn seen(wave_m: f64, width_m: f64) -> f32 {
    ((wave_m / width_m - 2.0) / 2.0).clamp(0.0, 1.0) as f32
}

fn mixed(from: Colour, to: Colour, share: f32) -> Colour {
    std::array::from_fn(|k| from[k] + (to[k] - from[k]) * share)
}

/// From 0 up to the first end to 1 from the second one on, both level.
fn step_between(first: f32, second: f32, t: f32) -> f32 {
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
    fn neighbours_have_the_same_texels_on_their_edge() {
        for ground in grounds() {
            for level in [1, 4, 9, 14] {
                let at = [1 << (level - 1), (1 << (level - 1)) - 1];
                let tile = |dx: u32, dz: u32| ground.tile(Node { level, at: [at[0] - dx, at[1] + dz] }, CELLS);
                let (here, west, south) = (tile(0, 0), tile(1, 0), tile(0, 1));
                for n in 0..=CELLS {
                    assert_eq!(texel(&here, 0, n), texel(&west, CELLS, n));
                    assert_eq!(texel(&here, n, CELLS), texel(&south, n, 0));
                }
            }
        }
    }

    /// Four children over four by four of their cells are, about, what their parent is.
    #[test]
    fn a_node_is_what_its_children_look_like_from_afar() {
        for ground in grounds() {
            for level in [2, 6, 10, 16] {
                let node = Node { level, at: [1 << (level - 1); 2] };
                let parent = ground.tile(node, CELLS);
                let child = ground.tile(Node { level: level + 1, at: node.at.map(|n| 2 * n) }, CELLS);
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

    /// Down to the least node there is something to see, and no texel stands out of its surroundings by all there is.
    #[test]
    fn there_is_always_something_to_see() {
        for ground in grounds() {
            for level in [0, 3, 7, 12] {
                let tile = ground.tile(Node { level, at: [(1 << level) / 3; 2] }, CELLS);
                let greens: Vec<u8> = tile.iter().map(|texel| texel[1]).collect();
                let (low, high) = (greens.iter().min().unwrap(), greens.iter().max().unwrap());
                assert!(high - low >= 3, "level {level}: {low} to {high}");
            }
        }
    }
}
