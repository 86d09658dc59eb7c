//! The bounds of one square of a quadtree over a field.

/// One square.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Square {
    /// Largest vertical distance of its surface from the samples, metres, holes excepted.
    ///
    /// At least that of the squares in it. In [`Bounds`](super::Bounds) it holds with any side one level coarser too, and
    /// is at least `growth` times that of the squares in it. At level 0 it is 0: only a coarser side is off the samples,
    /// and the square beyond that side accounts for it.
    pub error: f32,
    /// Lowest and highest sample, metres; the lowest is above the highest if there is no terrain.
    pub range: [f32; 2],
}

impl Square {
    /// A square without terrain.
    pub(crate) const NOTHING: Square = Square { error: 0.0, range: [f32::INFINITY, f32::NEG_INFINITY] };

    /// Returns true if there is any terrain. In [`Bounds`](super::Bounds): if any triangle of the finest surface has
    /// data.
    #[inline]
    pub fn has_terrain(&self) -> bool {
        self.range[0] <= self.range[1]
    }

    /// Returns the bounds of two squares together.
    pub(crate) fn union(self, other: Square) -> Square {
        let range = [self.range[0].min(other.range[0]), self.range[1].max(other.range[1])];
        Square { error: self.error.max(other.error), range }
    }
}
