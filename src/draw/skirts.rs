//! Meshes with skirts: four quadrants that share no vertex, and walls that hang from their sides.
//!
//! Each quadrant is a grid of lines with one more line beyond each of its sides. Two such grids lie along an axis:
//! quadrants of s units make 2 (s + 3) lines, numbered from 0 to `cells` = 2 s + 5. A quarter turn maps the lines onto
//! each other as it does in other meshes. The position alone tells the quadrant of a vertex, and whether the vertex is a
//! skirt's: a vertex on a line beyond a side hangs under the nearest vertex of that side.
//!
//! Each quadrant morphs as a whole, sides included, and no vertex snaps to another: see [`SkirtWeights`].

pub use super::layout::SKIRT;
use super::layout::{Instance, SKIRT_WEIGHTS, SkirtWeights};

/// A vertex of a mesh with skirts, after the turn.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SkirtVertex {
    /// Mesh units as in other meshes, where quadrants meet on a line. For a skirt's vertex, the vertex it hangs from.
    pub at: [i32; 2],
    /// The quadrant, `(x half) + 2 (z half)`.
    pub quadrant: usize,
    /// The side that a skirt's vertex is beyond: x first, z first, x last, z last.
    pub side: Option<usize>,
}

/// `cells` of a mesh whose quadrants are this many units long.
pub fn cells(quadrant_units: u32) -> u32 {
    2 * quadrant_units + 5
}

/// The line of a position in a quadrant's half (0 or 1). Positions run from -1, beyond the first side, to one beyond
/// the last side.
pub fn line(quadrant_units: i32, half: i32, place: i32) -> i32 {
    half * (quadrant_units + 3) + place + 1
}

/// True if an instance's mesh has skirts.
pub fn is_skirted(instance: &Instance) -> bool {
    instance.weights_kind == SKIRT_WEIGHTS
}

/// Decodes a vertex after the rotation.
pub fn skirt_vertex(instance: &Instance, turned: [i32; 2]) -> SkirtVertex {
    let lines = (instance.cells as i32 + 1) / 2;
    let half = turned.map(|n| n / lines);
    let place = [0, 1].map(|k| turned[k] % lines - 1);
    let last = lines - 3;
    let at = [0, 1].map(|k| half[k] * last + place[k].clamp(0, last));
    let side = (0..2).find_map(|k| match place[k] {
        -1 => Some(k),
        n if n > last => Some(k + 2),
        _ => None,
    });
    SkirtVertex { at, quadrant: (half[0] + 2 * half[1]) as usize, side }
}

/// Level of detail of a quadrant.
pub fn quadrant_level(instance: &Instance, quadrant: usize) -> i32 {
    instance.level as i32 - i32::from(instance.is_finer(quadrant))
}

/// Length by which a vertex hangs down, metres: 0 where its side has no skirt.
pub fn depth(weights: &SkirtWeights, skirt_vertex: &SkirtVertex) -> f32 {
    match skirt_vertex.side {
        Some(side) if weights.sides >> (4 * skirt_vertex.quadrant + side) & 1 == 1 => weights.depth_m,
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_line_is_a_place_of_one_quadrant() {
        let instance = Instance { cells: cells(8), ..Instance::default() };
        for (half, place) in (0..2).flat_map(|half| (-1..=9).map(move |place| (half, place))) {
            let found = skirt_vertex(&instance, [line(8, half, place), line(8, 1, 3)]);
            let side = [(-1, 0), (9, 2)].into_iter().find(|&(beyond, _)| beyond == place).map(|(_, side)| side);
            let at = [8 * half + place.clamp(0, 8), 11];
            assert_eq!(found, SkirtVertex { at, quadrant: half as usize + 2, side }, "{half} {place}");
        }
        assert_eq!(line(8, 1, 9), instance.cells as i32, "the last line");
    }

    #[test]
    fn skirts_hang_where_they_are_set() {
        let instance = Instance { cells: cells(8), ..Instance::default() };
        let weights = SkirtWeights { inside: 0, sides: 1 << (4 * 2 + 1), depth_m: 7.5 };
        let hangs = |x, z| depth(&weights, &skirt_vertex(&instance, [x, z]));
        assert_eq!(hangs(line(8, 0, 5), line(8, 1, -1)), 7.5);
        assert_eq!(hangs(line(8, 0, 5), line(8, 1, 0)), 0.0, "the side itself");
        assert_eq!(hangs(line(8, 0, 5), line(8, 1, 9)), 0.0, "the other side");
        assert_eq!(hangs(line(8, 1, 5), line(8, 1, -1)), 0.0, "another quadrant");
    }
}
