//! Finds samples on silhouettes, where the terrain turns away from the eye.

use glam::DVec3;

use crate::height::Field;
use crate::measure::summary::Place;
use crate::view::{Lens, View};

/// Test for silhouettes of a field in a view.
pub struct Silhouette<'a> {
    field: &'a Field,
    /// Last column and row.
    last: [u32; 2],
    /// Samples per metre along x and z.
    per_metre: [f64; 2],
    is_perspective: bool,
    eye: DVec3,
    /// Direction towards the eye in an orthographic view.
    backward: DVec3,
}

impl<'a> Silhouette<'a> {
    /// Prepares the test for a field in a view.
    pub fn new(field: &'a Field, view: &View) -> Self {
        let last = field.size().map(|n| n - 1);
        let is_perspective = matches!(view.lens, Lens::Perspective { .. });
        let per_metre = field.spacing.map(f64::recip);
        Self { field, last, per_metre, is_perspective, eye: view.eye, backward: -view.forward() }
    }

    /// Returns true if a sample is on a silhouette: if some of the planes through it face the eye and others do not.
    ///
    /// A plane with slopes (a, b) along x and z faces an eye at (u, y, v) relative to the sample if y − a·u − b·v > 0.
    /// Each slope is that towards one of the two neighbours on its axis, or the only one at the field's border. In
    /// holes the filling counts.
    pub fn passes(&self, place: &Place) -> bool {
        let to_eye = if self.is_perspective { self.eye - place.truth } else { self.backward };
        let [x, z] = place.sample;
        let here = place.truth.y;
        let rise = |x, z| f64::from(self.field.height(x, z)) - here;
        // Slopes multiplied by the distance to the eye along their axis: a·u towards west and east, b·v towards north
        // and south.
        let west = (x > 0).then(|| -rise(x - 1, z) * self.per_metre[0] * to_eye.x);
        let east = (x < self.last[0]).then(|| rise(x + 1, z) * self.per_metre[0] * to_eye.x);
        let north = (z > 0).then(|| -rise(x, z - 1) * self.per_metre[1] * to_eye.z);
        let south = (z < self.last[1]).then(|| rise(x, z + 1) * self.per_metre[1] * to_eye.z);
        let along = |a: Option<f64>, b: Option<f64>| match (a, b) {
            (Some(a), Some(b)) => (a.min(b), a.max(b)),
            (a, b) => a.or(b).map_or((0.0, 0.0), |only| (only, only)),
        };
        let ((low_x, high_x), (low_z, high_z)) = (along(west, east), along(north, south));
        to_eye.y - low_x - low_z > 0.0 && to_eye.y - high_x - high_z <= 0.0
    }
}
