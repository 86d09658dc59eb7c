//! States of a cluster: 80, of which 23 differ under quarter turns.
//!
//! Judnich & Ling 2012, section IV: single-level clusters have 2⁴ − 1 = 15 states and 5 seeds. With quadrants that may
//! also be 2 × 2 blocks there are 3⁴ − 1 = 80 states. By Burnside's lemma these have (81 + 3 + 9 + 3) / 4 − 1 = 23
//! seeds.

/// Contents of the quadrants, with index `q = (x half) + 2 (z half)`: empty (0), a block (1), 2 × 2 blocks of the next
/// finer level (2).
pub type State = [u8; 4];

/// Maximum number of seeds.
pub const MAX_SEEDS: usize = 23;

/// Quadrant to which a quarter turn, (x, z) to (cells − z, x), moves each quadrant.
const ROTATED: [usize; 4] = [1, 3, 0, 2];

/// Returns a state after `rotation` quarter turns.
pub fn rotated(state: State, rotation: u32) -> State {
    (0..rotation).fold(state, |state, _| {
        let mut next = State::default();
        (0..4).for_each(|quadrant| next[ROTATED[quadrant]] = state[quadrant]);
        next
    })
}

/// Stored states, and the seed and rotation of every state.
pub struct Seeds {
    /// Seeds: of the four rotations of a state, the one with the lowest number.
    pub states: Vec<State>,
    /// Seed and number of quarter turns, by the number of a state.
    table: [(u8, u8); 81],
}

/// Returns a state as a number in base 3.
fn number(state: State) -> usize {
    state.iter().rev().fold(0, |number, &quadrant| 3 * number + usize::from(quadrant))
}

fn state(number: usize) -> State {
    [1, 3, 9, 27].map(|place| (number / place % 3) as u8)
}

impl Seeds {
    /// Creates all 23 seeds, or with `single` only that of a single block.
    pub fn new(single: bool) -> Self {
        let mut seeds = Self { states: Vec::new(), table: [(0, 0); 81] };
        for seed in 1..if single { 2 } else { 81 } {
            let rotation = [0, 1, 2, 3].map(|rotation| rotated(state(seed), rotation));
            if rotation.iter().any(|&turn| number(turn) < seed) {
                continue;
            }
            // A rotationally symmetric state uses its smallest rotation.
            for turn in [3, 2, 1, 0] {
                seeds.table[number(rotation[turn])] = (seeds.states.len() as u8, turn as u8);
            }
            seeds.states.push(state(seed));
        }
        seeds
    }

    /// Returns seed and quarter turns of every state, by its number in base 3 with the first quadrant as the lowest
    /// digit.
    pub fn all(&self) -> [(u8, u8); 81] {
        self.table
    }

    /// Returns the seed of a state, and the number of quarter turns from the seed to the state.
    pub fn of(&self, state: State) -> (usize, u32) {
        let (seed, rotation) = self.table[number(state)];
        (usize::from(seed), u32::from(rotation))
    }
}

#[cfg(test)]
mod tests {
    use super::super::mesh::Mesh;
    use super::*;
    use crate::draw::Seams;
    use std::collections::BTreeSet;

    #[test]
    fn every_state_is_a_rotated_seed() {
        let seeds = Seeds::new(false);
        assert_eq!([seeds.states.len(), MAX_SEEDS], [23; 2]);
        for number in 1..81 {
            let (seed, rotation) = seeds.of(state(number));
            assert_eq!(rotated(seeds.states[seed], rotation), state(number));
        }
        let single: BTreeSet<_> =
            (1..81).map(state).filter(|s| s.iter().all(|&q| q < 2)).map(|s| seeds.of(s).0).collect();
        assert_eq!(single.len(), 5);
        // No seed is a rotation of another.
        let rotation: BTreeSet<_> = seeds.states.iter().flat_map(|&s| (0..4).map(move |t| rotated(s, t))).collect();
        assert_eq!(rotation.len(), 80);
    }

    /// Compares the rotated triangles of each seed with those of a mesh of the state itself.
    #[test]
    fn rotated_seeds_match_their_states() {
        let n = 8;
        let seeds = Seeds::new(false);
        let mesh = Mesh::new(n, &seeds.states, Seams::Shared);
        let set = |mesh: &Mesh, seed: usize, rotation: u32| -> BTreeSet<[[i32; 2]; 3]> {
            let range = &mesh.ranges[seed];
            let indices = &mesh.geometry.indices[range.start as usize..range.end as usize];
            let turn =
                |[x, z]: [i32; 2]| [[x, z], [4 * n - z, x], [4 * n - x, 4 * n - z], [z, 4 * n - x]][rotation as usize];
            let corner = |&k: &u32| turn(mesh.geometry.lattice[k as usize].position);
            // Corners in cyclic order from the smallest, which keeps the winding.
            let canonical = |t: &[u32]| {
                let [a, b, c] = [corner(&t[0]), corner(&t[1]), corner(&t[2])];
                [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap()
            };
            indices.chunks_exact(3).map(canonical).collect()
        };
        for number in 1..81 {
            let (seed, rotation) = seeds.of(state(number));
            let own = Mesh::new(n, &[state(number)], Seams::Shared);
            let drawn = set(&mesh, seed, rotation);
            assert_eq!(drawn, set(&own, 0, 0), "{:?}", state(number));
            for (quadrant, &what) in state(number).iter().enumerate() {
                let of = |t: &&[[i32; 2]; 3]| {
                    let middle = [0, 1].map(|k| t.iter().map(|corner| corner[k]).sum::<i32>());
                    [quadrant & 1, quadrant >> 1] == middle.map(|n3| usize::from(n3 >= 3 * 2 * n))
                };
                let area = |[a, b, c]: &[[i32; 2]; 3]| (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1]);
                let inside: Vec<_> = drawn.iter().filter(of).collect();
                assert_eq!(inside.len() as i32, [0, 2, 8][usize::from(what)] * n * n);
                assert!(inside.iter().all(|t| area(t) == [0, 4, 1][usize::from(what)]));
            }
        }
    }
}
