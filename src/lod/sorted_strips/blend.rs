//! Vertices, and how they go over into the next level: towards the middle of the edge of that level on which they lie, as
//! that edge is drawn (Finch & Bishop, §4.9).
//!
//! Heights only: the paper's variant in three dimensions, in which a vertex slides out of an end of that edge, has vertices
//! between samples, which the neck has not: its lattice is what all proofs of a surface stand on.

use super::splits::Levels;
use super::walk::Ground;
use crate::draw::ExplicitVertex;
use crate::draw::place::morphed_height;

impl<L: Levels> Ground<'_, L> {
    /// The vertex at a position: the same wherever it is asked for.
    pub(super) fn vertex(&self, position: [i32; 2]) -> ExplicitVertex {
        let [x, z] = position;
        let height = self.field.height(x as u32, z as u32);
        let still = ExplicitVertex { position, height, target: height, ..ExplicitVertex::default() };
        let level = (x | z).trailing_zeros();
        if !self.blends || level >= self.pages.grid.level {
            return still;
        }
        let morph = self.levels.weight(level, position);
        let apart = half_edge(position, level);
        let ends = [-1, 1].map(|sign| [x + sign * apart[0], z + sign * apart[1]]);
        let last = self.pages.grid.last;
        // The field's edge is no vertex of the next level, unless it is whole there.
        let is_inside =
            (0..2).all(|k| ((position[k] >> (level + 1)) + i32::from(apart[k] != 0)) << (level + 1) <= last[k]);
        if morph == 0.0 || !is_inside {
            return still;
        }
        let [a, b] = ends.map(|end| self.vertex(end)).map(|v| morphed_height(v.height, v.target, v.morph));
        ExplicitVertex { target: (a + b) * 0.5, morph, ..still }
    }
}

/// From a vertex that a level is the coarsest to have to one end of the edge of the next level in whose middle it is.
fn half_edge(position: [i32; 2], level: u32) -> [i32; 2] {
    let step = 1 << level;
    let mut apart = position.map(|n| n & step);
    if apart == [step; 2] && ((position[0] >> (level + 1)) + (position[1] >> (level + 1))) & 1 == 1 {
        apart[1] = -apart[1];
    }
    apart
}
