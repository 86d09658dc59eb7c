//! How far the vertices of a lattice mesh have gone to coarser levels: sixteen bytes an instance.
//!
//! A mesh is four quadrants, number `q = (x half) + 2 (z half)` after the turn. Its vertices lie inside a quadrant,
//! on an outer side, or on a seam between quadrants; half a side and half a seam belong to one quadrant each. A byte
//! counts in [`ONE`]s: 0 is the vertex's own level, `ONE` the next coarser one, and on outer sides `2 ONE` the one
//! after it. On an outer side from `ONE` on, and on a seam whose bit 7 is set, an odd vertex falls onto the even one
//! before it, so that no T-junction is left where blocks of two levels meet. Integers, so that both meshes of a
//! side agree to the bit.
//!
//! | word | bytes 0 and 1 | bytes 2 and 3 |
//! |---|---|---|
//! | 0 | inside of quadrants 0 and 1 | inside of 2 and 3; bit 7 of each: the quadrant is one level finer |
//! | 1 | side x = 0, its z halves | side z = 0, its x halves |
//! | 2 | side x = cells, its z halves | side z = cells, its x halves |
//! | 3 | seam x = cells / 2, its z halves | seam z = cells / 2, its x halves |

use super::Instance;

/// The next coarser level. A power of two: the weight is exact as a float.
pub const ONE: u32 = 64;

/// Set in a quadrant's byte: the quadrant is one level finer than its instance's.
pub const FINER: u32 = 128;

/// Set in a seam's byte: one side of the seam is coarser than the other.
pub const STITCHED: u32 = 128;

/// Which byte of the weights: word, byte.
pub type Slot = (usize, u32);

/// The byte of the inside of a quadrant.
pub fn inside(quadrant: usize) -> Slot {
    (0, quadrant as u32)
}

/// What a vertex that carries its height says to have the weight of a slot: on the way to the next level (stage 0), or
/// from that to the one after it (1). From 1 to 32.
pub fn region((word, byte): Slot, stage: u32) -> u32 {
    1 + 16 * stage + 4 * word as u32 + byte
}

/// The weight of a region, in [`ONE`]s, at most one; 0 of none.
pub fn region_weight(instance: &Instance, region: u32) -> u32 {
    if region == 0 {
        return 0;
    }
    let (slot, stage) = ((region - 1) & 15, (region - 1) >> 4);
    get(instance, (slot as usize / 4, slot % 4)).saturating_sub(stage * ONE).min(ONE)
}

/// Weights that all quadrants share: of the inside, and of the sides x = 0, z = 0, x = cells and z = cells.
pub fn uniform(inside: u32, [x_first, z_first, x_last, z_last]: [u32; 4]) -> [u32; 4] {
    let sides = |x: u32, z: u32| x * 0x0101 + z * 0x0101_0000;
    let all = inside * 0x0101_0101;
    [all, sides(x_first, z_first), sides(x_last, z_last), all]
}

/// Writes one byte.
pub fn set(weights: &mut [u32; 4], (word, byte): Slot, weight: u32) {
    weights[word] |= weight << (8 * byte);
}

/// Reads one byte.
pub fn get(instance: &Instance, (word, byte): Slot) -> u32 {
    (instance.weights[word] >> (8 * byte)) & 255
}

/// Whether odd vertices there fall onto even ones.
pub fn is_stitched(instance: &Instance, slot: Slot) -> bool {
    match slot.0 {
        0 => false,
        3 => get(instance, slot) & STITCHED != 0,
        _ => get(instance, slot) >= ONE,
    }
}

/// The slot of a turned vertex. Where lines cross no level within reach lacks the vertex, and any will do.
pub fn slot(instance: &Instance, [x, z]: [i32; 2]) -> Slot {
    let cells = instance.cells as i32;
    let half = |n: i32| u32::from(2 * n >= cells);
    match (line(cells, x), line(cells, z)) {
        (side @ (1 | 2), _) => (side, half(z)),
        (_, side @ (1 | 2)) => (side, 2 + half(x)),
        (3, _) => (3, half(z)),
        (_, 3) => (3, 2 + half(x)),
        _ => (0, half(x) + 2 * half(z)),
    }
}

/// Whether a coordinate is that of the first side (1), the last side (2), the seam (3), or of none (0).
fn line(cells: i32, n: i32) -> usize {
    match n {
        0 => 1,
        _ if n == cells => 2,
        _ if 2 * n == cells => 3,
        _ => 0,
    }
}

/// Level of detail at a turned vertex: of the finest quadrant that it touches.
pub fn vertex_level(instance: &Instance, turned: [i32; 2]) -> i32 {
    let cells = instance.cells as i32;
    let touches = |n: i32, half: usize| if half == 0 { 2 * n <= cells } else { 2 * n >= cells };
    let finer = (0..4).any(|quadrant: usize| {
        touches(turned[0], quadrant & 1)
            && touches(turned[1], quadrant >> 1)
            && get(instance, inside(quadrant)) & FINER != 0
    });
    instance.level as i32 - i32::from(finer)
}
