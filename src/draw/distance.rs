//! Morph weights by distance: each vertex has its own, whatever mesh it belongs to, so that neighbouring meshes of one
//! level agree on their common vertices.
//!
//! The distance combines the distance in plan with the vertical distance from the eye to the range of all heights. No
//! height of a vertex is part of it, so that it changes no faster than the distance in plan. The morph to the next
//! coarser level begins at a distance of that level and has ended at √1.5 times it ([`MORPH_END`]).
//!
//! The next level may lie beyond a side, and beyond a seam of a finer quadrant. An odd vertex there whose morph has
//! ended snaps to the even one before it. Sides marked as staying meet their own level.

use super::layout::{DistanceWeights, Frame, Instance, NO_LINE, ONE, SEAM};
use super::relative::relative_plan;
use super::weights::{Slot, vertex_level};

pub use super::layout::MORPH_END;

/// Weight per unit of the squared distance over that of the morph's beginning.
const STEEPNESS: f32 = 2.0 * ONE as f32;

/// Weights of an instance from the sides that stay and the quadrants that are one level finer, a bit each, the ranges of
/// its level and of the finer one, and the squared vertical distance.
pub fn weights(staying: u32, finer: u32, ranges: [f32; 2], above_squared: f32) -> DistanceWeights {
    let quadrants: u32 = (0..4).map(|quadrant| (finer >> quadrant & 1) << (8 * quadrant + 7)).sum();
    DistanceWeights { flags: quadrants | staying, range: ranges[0], finer_range: ranges[1], above_squared }
}

/// True if the next level may lie beyond a vertex (after the rotation).
pub fn is_beside_another(instance: &Instance, weights: &DistanceWeights, turned: [i32; 2]) -> bool {
    let Slot { line, byte } = Slot::of_vertex(instance, turned);
    match line {
        NO_LINE => false,
        SEAM => vertex_level(instance, turned) < instance.level as i32,
        // Sides in the order x first, z first, x last, z last.
        _ => weights.flags >> (2 * (line as u32 - 1) + byte / 2) & 1 == 0,
    }
}

/// Square of the distance of a point from the eye, m², from its offset in plan (metres) and the squared vertical
/// distance.
pub fn squared([x, z]: [f32; 2], above_squared: f32) -> f32 {
    (x * x + z * z) + above_squared
}

/// The weight of a lattice position at a level of an instance, 0 to [`ONE`].
pub fn weight(frame: &Frame, instance: &Instance, weights: &DistanceWeights, at: [i32; 2], level: i32) -> u32 {
    let range = if level == instance.level as i32 { weights.range } else { weights.finer_range };
    let ratio = squared(relative_plan(frame, at), weights.above_squared) * range;
    if ratio >= MORPH_END { ONE } else { ((ratio - 1.0) * STEEPNESS).clamp(0.0, (ONE - 1) as f32) as u32 }
}
