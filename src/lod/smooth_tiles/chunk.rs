//! Builds the vertices of a tile at a level, each with its height and its morph targets.
//!
//! A vertex that the next level lacks morphs to the middle of that level's edge on which it lies (Larsen & Christensen,
//! table 3). Inside, it uses the tile's weight; on a side, the side's. A side's weight may exceed one level, because
//! the tile beyond may already be morphing to the level after the next. Even vertices of the side then move to the
//! middle of that level's edges. Targets of inside vertices whose edges end on the side move with them. One chunk
//! therefore fits all levels of neighbours; only its indices change.

use glam::Vec3;

use super::pattern;
use crate::draw::layout::{FIRST_SIDE, LAST_SIDE};
use crate::draw::weights::Slot;
use crate::draw::{ExplicitVertex, VertexNormals, normals};
use crate::height::Field;

/// Place of a tile among the samples.
#[derive(Clone, Copy, Debug)]
pub struct Place {
    /// First sample, (x, z).
    pub origin: [i32; 2],
    /// Cells along a side.
    pub cells: i32,
}

/// One level of a tile.
struct ChunkLevel<'a> {
    field: &'a Field,
    place: Place,
    level: u32,
    /// Cells along a side at this level.
    n: i32,
}

/// Returns the number of vertices of a chunk of a level.
pub fn vertices(cells: i32, level: u32) -> usize {
    ((cells >> level) as usize + 1).pow(2)
}

/// Returns the slot of a side's weight. Both halves of a side have the same weight; this is the first one's.
fn side_slot(side: usize) -> Slot {
    Slot { line: if side < 2 { FIRST_SIDE } else { LAST_SIDE }, byte: 2 * (side as u32 % 2) }
}

/// Builds the vertices of a tile at a level, row by row.
pub fn build(field: &Field, place: Place, level: u32) -> Vec<ExplicitVertex> {
    let tile = ChunkLevel { field, place, level, n: place.cells >> level };
    let vertex = |at: [i32; 2]| {
        let [height, target, second_target] = tile.values(at, &|at| tile.height(at));
        let (position, regions) = (at.map(|n| n << level), tile.regions(at));
        ExplicitVertex { position, height, target, second_target, regions, ..ExplicitVertex::default() }
    };
    tile.vertices().map(vertex).collect()
}

/// Builds the normals of the same vertices. They morph by the same weights as heights.
pub fn build_normals(field: &Field, place: Place, level: u32) -> Vec<VertexNormals> {
    let tile = ChunkLevel { field, place, level, n: place.cells >> level };
    let normals = |at: [i32; 2]| {
        let [normal, target, second_target] = tile.values(at, &|at| tile.normal(at)).map(normals::pack);
        VertexNormals { normal, target, second_target }
    };
    tile.vertices().map(normals).collect()
}

/// A vertex attribute that morphs.
trait Value: Copy {
    /// Returns the value at the middle of an edge between two vertices.
    fn middle(self, other: Self) -> Self;
}

impl Value for f32 {
    fn middle(self, other: f32) -> f32 {
        (self + other) * 0.5
    }
}

/// Unit normals.
impl Value for Vec3 {
    fn middle(self, other: Vec3) -> Vec3 {
        (self + other).try_normalize().unwrap_or(Vec3::Y)
    }
}

impl ChunkLevel<'_> {
    fn vertices(&self) -> impl Iterator<Item = [i32; 2]> {
        let n = self.n;
        (0..=n).flat_map(move |z| (0..=n).map(move |x| [x, z]))
    }

    /// Returns a vertex's value, its target, and the target of that target, given the value at each vertex.
    fn values<V: Value>(&self, at: [i32; 2], value: &impl Fn([i32; 2]) -> V) -> [V; 3] {
        let own = value(at);
        if let Some(side) = pattern::side(self.n, at) {
            let is_odd = at[1 - side % 2] & 1 == 1;
            let target = if is_odd { middle(at, along(side, 1), value) } else { self.side_target(at, value) };
            return [own, target, target];
        }
        if !self.moves_inside(at) {
            return [own; 3];
        }
        let apart = self.half_edge(at);
        let [before, after] = ends(at, apart).map(|end| self.side_target(end, value));
        [own, middle(at, apart, value), before.middle(after)]
    }

    /// Returns the weight slots by which a vertex and its target morph.
    fn regions(&self, at: [i32; 2]) -> u32 {
        if let Some(side) = pattern::side(self.n, at) {
            let is_odd = at[1 - side % 2] & 1 == 1;
            return side_slot(side).region(u32::from(!is_odd));
        }
        if !self.moves_inside(at) {
            return 0;
        }
        let side = ends(at, self.half_edge(at)).into_iter().find_map(|end| pattern::side(self.n, end));
        let second = side.map_or(0, |side| side_slot(side).region(1));
        Slot::inside(0).region(0) | second << 8
    }

    /// Returns true if a vertex lies inside and the next level lacks it.
    fn moves_inside(&self, at: [i32; 2]) -> bool {
        self.half_edge(at) != [0, 0] && at.iter().all(|&n| n > 0 && n < self.n)
    }

    /// Returns the value of a vertex of the next level after its side, if it lies on one, has morphed one level
    /// further.
    fn side_target<V: Value>(&self, at: [i32; 2], value: &impl Fn([i32; 2]) -> V) -> V {
        match pattern::side(self.n, at) {
            Some(side) if at[1 - side % 2] & 2 != 0 => middle(at, along(side, 2), value),
            _ => value(at),
        }
    }

    /// Returns the step from a vertex to one end of the next level's edge in whose middle it lies; zero if that level
    /// has the vertex.
    fn half_edge(&self, at: [i32; 2]) -> [i32; 2] {
        let mut apart = at.map(|n| n & 1);
        if apart == [1, 1] {
            // Diagonals of the coarser cells alternate with the parity of the cell's place in the whole field.
            let cell = [0, 1].map(|k| (self.place.origin[k] + (at[k] << self.level)) >> (self.level + 1));
            if (cell[0] + cell[1]) & 1 == 1 {
                apart[1] = -1;
            }
        }
        apart
    }

    /// Returns the sample of a vertex. Vertices beyond the field collapse onto its edge.
    fn sample(&self, at: [i32; 2]) -> [u32; 2] {
        let size = self.field.size();
        [0, 1].map(|k| ((self.place.origin[k] + (at[k] << self.level)) as u32).min(size[k] - 1))
    }

    fn height(&self, at: [i32; 2]) -> f32 {
        let [x, z] = self.sample(at);
        self.field.height(x, z)
    }

    fn normal(&self, at: [i32; 2]) -> Vec3 {
        let [x, z] = self.sample(at);
        self.field.normal(x, z)
    }
}

/// Returns the ends of an edge, given its middle and half of it.
fn ends(middle: [i32; 2], half: [i32; 2]) -> [[i32; 2]; 2] {
    [-1, 1].map(|sign| [0, 1].map(|k| middle[k] + sign * half[k]))
}

fn middle<V: Value>(at: [i32; 2], half: [i32; 2], value: &impl Fn([i32; 2]) -> V) -> V {
    let [before, after] = ends(at, half).map(value);
    before.middle(after)
}

/// Returns a step along a side.
fn along(side: usize, step: i32) -> [i32; 2] {
    if side.is_multiple_of(2) { [0, step] } else { [step, 0] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::Instance;
    use crate::draw::normals::explicit_normal;
    use crate::draw::place::explicit_height;
    use crate::draw::weights::{ONE, SlotWeights};
    use crate::height::{Holes, Samples};

    const CELLS: i32 = 16;

    fn rough() -> Field {
        let height = |k: u32| ((k.wrapping_mul(0x9e37_79b1) ^ (k << 7)).wrapping_mul(0x85eb_ca77) >> 8) as f32 / 1e5;
        Field::new(Samples::F32((0..49 * 49).map(height).collect()), [49; 2], [1.0; 2], Holes::none(49 * 49))
    }

    /// Heights of a tile at a level, morphed by the given weights.
    struct Shape {
        n: i32,
        heights: Vec<f32>,
    }

    impl Shape {
        fn new(field: &Field, origin: [i32; 2], level: u32, inside: u32, sides: [u32; 4]) -> Self {
            let chunk = build(field, Place { origin, cells: CELLS }, level);
            assert_eq!(chunk.len(), vertices(CELLS, level));
            let instance = Instance::default().with_weights(SlotWeights::uniform(inside, sides));
            Self { n: CELLS >> level, heights: chunk.iter().map(|vertex| explicit_height(&instance, vertex)).collect() }
        }

        fn at(&self, [x, z]: [i32; 2]) -> f32 {
            self.heights[(z * (self.n + 1) + x) as usize]
        }
    }

    /// Returns the ends of the coarser grid's edge in whose middle a vertex lies, in units of that grid. Uses only the
    /// rule of the RTIN pattern.
    fn ends(origin: [i32; 2], level: u32, [x, z]: [i32; 2]) -> [[i32; 2]; 2] {
        let (i, j) = (x.div_euclid(2), z.div_euclid(2));
        let place = origin.map(|n| n >> (level + 1));
        match (x & 1, z & 1) {
            (1, 1) if (place[0] + i + place[1] + j) & 1 == 0 => [[i, j], [i + 1, j + 1]],
            (1, 1) => [[i, j + 1], [i + 1, j]],
            (dx, dz) => [[i, j], [i + dx, j + dz]],
        }
    }

    #[test]
    fn morph_ends_equal_both_levels_exactly() {
        let field = rough();
        let mut moved = 0;
        for (origin, level) in [[0, 0], [16, 0], [16, 32]].into_iter().flat_map(|o| (0..4).map(move |l| (o, l))) {
            let start = Shape::new(&field, origin, level, 0, [0; 4]);
            let end = Shape::new(&field, origin, level, ONE, [ONE; 4]);
            let next = Shape::new(&field, origin, level + 1, 0, [0; 4]);
            for at in (0..=start.n).flat_map(|z| (0..=start.n).map(move |x| [x, z])) {
                let [x, z] = [0, 1].map(|k| (origin[k] + (at[k] << level)) as u32);
                assert_eq!(start.at(at).to_bits(), field.height(x, z).to_bits());
                let [a, b] = ends(origin, level, at).map(|end| next.at(end));
                assert_eq!(end.at(at).to_bits(), ((a + b) * 0.5).to_bits(), "level {level} of {origin:?} at {at:?}");
                moved += u32::from(end.at(at) != start.at(at));
            }
        }
        assert!(moved > 500, "{moved} vertices move");
    }

    #[test]
    fn normals_morph_from_samples_to_the_coarser_level() {
        let field = rough();
        let mut moved = 0;
        for (origin, level) in [[0, 0], [16, 32]].into_iter().flat_map(|o| (0..4).map(move |l| (o, l))) {
            let place = Place { origin, cells: CELLS };
            let (vertices, normals) = (build(&field, place, level), build_normals(&field, place, level));
            assert_eq!(vertices.len(), normals.len());
            let n = CELLS >> level;
            let normal = |[x, z]: [i32; 2], step: i32| {
                field.normal((origin[0] + x * step) as u32, (origin[1] + z * step) as u32)
            };
            let drawn = |at: [i32; 2], weight: u32| {
                let instance = Instance::default().with_weights(SlotWeights::uniform(weight, [weight; 4]));
                let k = (at[1] * (n + 1) + at[0]) as usize;
                explicit_normal(&instance, &vertices[k], &normals[k])
            };
            for at in (0..=n).flat_map(|z| (0..=n).map(move |x| [x, z])) {
                assert!(drawn(at, 0).distance(normal(at, 1 << level)) < 2e-3, "the samples' own");
                let [a, b] = ends(origin, level, at).map(|end| normal(end, 2 << level));
                let end = drawn(at, ONE);
                assert!(end.distance((a + b).try_normalize().unwrap()) < 4e-3, "level {level} of {origin:?} at {at:?}");
                moved += u32::from(end.distance(drawn(at, 0)) > 0.01);
            }
        }
        assert!(moved > 200, "{moved} normals turn");
    }

    #[test]
    fn sides_beyond_the_next_level_move_inside_targets() {
        let (field, sides) = (rough(), [0, 17, 40, ONE]);
        for (origin, level) in [[0, 0], [16, 32]].into_iter().flat_map(|o| (0..3).map(move |l| (o, l))) {
            let end = Shape::new(&field, origin, level, ONE, sides.map(|e| ONE + e));
            let next = Shape::new(&field, origin, level + 1, 0, sides);
            for at in (0..=end.n).flat_map(|z| (0..=end.n).map(move |x| [x, z])) {
                // Odd vertices of sides are not drawn.
                if at[0] & 1 == 1 && at[1] % end.n == 0 || at[1] & 1 == 1 && at[0] % end.n == 0 {
                    continue;
                }
                let [a, b] = ends(origin, level, at).map(|end| next.at(end));
                let expected = (a + b) * 0.5;
                let is_common = at[0] & 1 == 0 && at[1] & 1 == 0;
                let apart = (end.at(at) - expected).abs();
                assert!(if is_common { apart == 0.0 } else { apart <= 4e-5 }, "level {level} at {at:?}: {apart} m");
            }
        }
    }

    #[test]
    fn two_tiles_agree_on_their_shared_side_at_any_weight() {
        let field = rough();
        for (level, finer, weight) in
            (1..4).flat_map(|l| [l, l - 1].into_iter().flat_map(move |f| [0, 1, 33, ONE].map(|w| (l, f, w))))
        {
            // The western tile has the level, the eastern one the same or one finer.
            let west = Shape::new(&field, [0, 16], level, 21, [5, 9, weight, 3]);
            let east = Shape::new(&field, [16, 16], finer, 50, [weight + (level - finer) * ONE, 7, 60, 0]);
            let step = 1 << (level - finer);
            for z in 0..=west.n {
                let [a, b] = [west.at([west.n, z]), east.at([0, z * step])];
                assert_eq!(a.to_bits(), b.to_bits(), "levels {level} and {finer}, weight {weight}, at {z}");
            }
        }
    }
}
