//! Which samples lie in the silhouette band, where the land turns away from the eye.

use glam::DVec3;

use crate::height::Field;
use crate::view::{Lens, View};

/// Tells the band from the rest of a field in a view.
pub struct Silhouette<'a> {
    field: &'a Field,
    last: [u32; 2],
    lens: Lens,
    eye: DVec3,
    backward: DVec3,
}

impl<'a> Silhouette<'a> {
    /// For a field in a view.
    pub fn new(field: &'a Field, view: &View) -> Self {
        let last = field.size().map(|n| n - 1);
        Self { field, last, lens: view.lens, eye: view.eye, backward: -view.forward() }
    }

    /// Whether the land's facing changes at the sample: a plane through it with slopes (a, b) along x and z
    /// faces the eye, which lies at (u, y, v) from the sample, if y − a·u − b·v > 0. Each slope is one of two,
    /// towards either neighbour; at the field's border, and beside a hole as filled, the one there is.
    pub fn passes(&self, [x, z]: [u32; 2]) -> bool {
        let to_eye = match self.lens {
            Lens::Perspective { .. } => self.eye - self.field.world(x, z),
            Lens::Orthographic { .. } => self.backward,
        };
        let height = |x, z| f64::from(self.field.height(x, z));
        let [dx, dz] = self.field.spacing;
        // Where the slopes begin: they end one sample further.
        let (west, east) = (x.max(1) - 1, x.min(self.last[0] - 1));
        let (north, south) = (z.max(1) - 1, z.min(self.last[1] - 1));
        let along_x = [west, east].map(|x| (height(x + 1, z) - height(x, z)) / dx * to_eye.x);
        let along_z = [north, south].map(|z| (height(x, z + 1) - height(x, z)) / dz * to_eye.z);
        let nearest = to_eye.y - along_x[0].min(along_x[1]) - along_z[0].min(along_z[1]);
        let farthest = to_eye.y - along_x[0].max(along_x[1]) - along_z[0].max(along_z[1]);
        nearest > 0.0 && farthest <= 0.0
    }
}
