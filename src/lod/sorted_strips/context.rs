//! Inputs shared by the walks of all rows of a frame, and the vertices computed from them.

use super::blend::Blend;
use super::pages::{Pages, TraversalDirection};
use super::shapes::Shapes;
use super::splits::Levels;
use crate::draw::ExplicitVertex;
use crate::draw::place::morphed_height;
use crate::height::Field;

/// Inputs shared by the walks of all rows of a frame.
pub struct WalkContext<'a, L> {
    /// Heights.
    pub field: &'a Field,
    /// Pages to draw.
    pub pages: &'a Pages,
    /// Level function.
    pub levels: &'a L,
    /// All kinds of quads.
    pub shapes: &'a Shapes,
    /// Position of the eye and direction of the view.
    pub traversal: TraversalDirection,
    /// Morph of vertices to the next level.
    pub blend: Blend,
}

impl<L: Levels> WalkContext<'_, L> {
    /// Returns the vertex whose unmorphed position is given; the same for every call in a frame.
    pub(super) fn vertex(&self, position: [i32; 2]) -> ExplicitVertex {
        let [x, z] = position;
        let height = self.height(position);
        let bits = self.blend.fraction_bits();
        let still =
            ExplicitVertex { position: [x << bits, z << bits], height, target: height, ..ExplicitVertex::default() };
        let level = (x | z).trailing_zeros();
        if self.blend == Blend::Off || level >= self.pages.grid.level {
            return still;
        }
        let morph = self.levels.weight(level, position);
        let apart = half_edge(position, level);
        let ends = [-1, 1].map(|sign| [x + sign * apart[0], z + sign * apart[1]]);
        let last = self.pages.grid.last;
        // Next-level edges that extend beyond the field do not exist.
        let is_inside =
            (0..2).all(|k| ((position[k] >> (level + 1)) + i32::from(apart[k] != 0)) << (level + 1) <= last[k]);
        if morph == 0.0 || !is_inside {
            return still;
        }
        if matches!(self.blend, Blend::End(_)) {
            let parts = 1 << bits;
            let steps = ((morph * parts as f32).round() as i32).min(parts - 1);
            return ExplicitVertex {
                position: [0, 1].map(|k| still.position[k] - apart[k] * steps),
                target: self.height(ends[0]),
                morph: steps as f32 / parts as f32,
                ..still
            };
        }
        let [a, b] = ends.map(|end| self.vertex(end)).map(|v| morphed_height(v.height, v.target, v.morph));
        ExplicitVertex { target: (a + b) * 0.5, morph, ..still }
    }

    fn height(&self, [x, z]: [i32; 2]) -> f32 {
        self.field.height(x as u32, z as u32)
    }
}

/// Returns the step from a vertex to one end of the next level's edge in whose middle it lies. `level` is the coarsest
/// level that has the vertex.
fn half_edge(position: [i32; 2], level: u32) -> [i32; 2] {
    let step = 1 << level;
    let mut apart = position.map(|n| n & step);
    if apart == [step; 2] && ((position[0] >> (level + 1)) + (position[1] >> (level + 1))) & 1 == 1 {
        apart[1] = -apart[1];
    }
    apart
}
