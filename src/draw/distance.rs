//! Weights that every vertex has by itself, from its distance to the eye: two meshes of one level agree on those that
//! they share, whatever each is otherwise.
//!
//! The distance is that in plan together with the eye's height above all land, or its depth below it: no height of a
//! vertex is in it, so that it changes no faster than the way in plan is long. The way to the next coarser level
//! begins at a distance that the level has, and has ended at √1.5 times that. An instance says for two levels 1 over
//! the square of where it begins; of its [`weights`](super::weights) are:
//!
//! | word | |
//! |---|---|
//! | 0 | bytes of the quadrants: [`BY_DISTANCE`], and bit 7 if the quadrant is one level finer; bits 0 to 3: sides that stay |
//! | 1 | for the instance's level, 1/m², a float |
//! | 2 | for quadrants one level finer |
//! | 3 | square of the eye's distance from all land in height, m², a float |
//!
//! Beyond a side, and beyond a seam of a finer quadrant, may be the next level: there an odd vertex whose way has ended
//! falls onto the even one before it. Sides that stay, x first, z first, x last, z last, meet their own level.

use super::Instance;
use super::layout::Frame;
use super::place::relative_plan;
use super::weights::{ONE, slot, vertex_level};

/// Set in the bytes of all quadrants: no weight has both bits.
pub const BY_DISTANCE: u32 = 96;

/// Where a way has ended: the square of the distance over that of its beginning.
pub const END: f32 = 1.5;

/// [`ONE`] over the length of a way.
const STEEPNESS: f32 = 2.0 * ONE as f32;

/// Whether an instance's vertices have weights by their distance.
pub fn is_by_distance(instance: &Instance) -> bool {
    instance.weights[0] & BY_DISTANCE == BY_DISTANCE
}

/// The weights of an instance: the sides that stay and the quadrants that are one level finer, a bit each, and words 1
/// to 3.
pub fn weights(staying: u32, finer: u32, ways: [f32; 2], above_squared: f32) -> [u32; 4] {
    let quadrants: u32 = (0..4).map(|quadrant| (BY_DISTANCE | (finer >> quadrant & 1) << 7) << (8 * quadrant)).sum();
    [quadrants | staying, ways[0].to_bits(), ways[1].to_bits(), above_squared.to_bits()]
}

/// Whether a turned vertex lies where the next level may be beyond.
pub fn is_beside_another(instance: &Instance, turned: [i32; 2]) -> bool {
    match slot(instance, turned) {
        (0, _) => false,
        (3, _) => vertex_level(instance, turned) < instance.level as i32,
        (word, byte) => instance.weights[0] >> (2 * (word as u32 - 1) + byte / 2) & 1 == 0,
    }
}

/// Square of the distance of a place that lies so far from the eye in plan, m².
pub fn squared([x, z]: [f32; 2], above_squared: f32) -> f32 {
    (x * x + z * z) + above_squared
}

/// The weight of a lattice position of a level of an instance, in [`ONE`]s, at most one.
pub fn weight(frame: &Frame, instance: &Instance, at: [i32; 2], level: i32) -> u32 {
    let [_, own, finer, above_squared] = instance.weights.map(f32::from_bits);
    let way = if level == instance.level as i32 { own } else { finer };
    let ratio = squared(relative_plan(frame, at), above_squared) * way;
    if ratio >= END { ONE } else { ((ratio - 1.0) * STEEPNESS).clamp(0.0, (ONE - 1) as f32) as u32 }
}
