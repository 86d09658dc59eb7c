//! Level function with an error bound: splits a square where its error exceeds what the view allows.
//!
//! The paper prefers triangles of equal size on the screen to an error bound, and allows any selection of vertices in
//! place of its level function (§4.1). This one descends from pages to finer squares, so its work grows with what is
//! drawn. Invisible squares are split only in a band around the picture ([`guarded`]). Without the band, terrain that a
//! rotation brings into view jumps from its coarsest level to its own.

use super::measure::Errors;
use super::pages::Pages;
use super::splits::Splits;
use crate::height::Field;
use crate::view::{Aabb, Allowance, Containment, Frustum, Lens, View};

/// Level function of a view of a measured field.
pub struct Certified<'a> {
    field: &'a Field,
    errors: &'a Errors,
    pages: &'a Pages,
    frustum: Frustum,
    allowance: Allowance,
    max: usize,
}

impl<'a> Certified<'a> {
    /// Creates the level function under the tolerance of `view`, for squares visible in `seen`: the same view or a
    /// wider one. Stops after `max` split squares.
    pub fn new(field: &'a Field, errors: &'a Errors, pages: &'a Pages, [view, seen]: [&View; 2], max: usize) -> Self {
        Self { field, errors, pages, frustum: seen.frustum(), allowance: view.allowance(), max }
    }

    /// Fills an empty set; returns false if more than `max` squares are split.
    pub fn split(&self, splits: &mut Splits) -> bool {
        let level = self.pages.grid.level;
        for &page in self.pages.list() {
            let range = self.errors.square(level, page).range;
            self.descend(level, page, range, Containment::Crossing, splits);
        }
        splits.close(self.pages);
        splits.count() <= self.max
    }

    /// Splits a square as far as needed. `around` is the height range of its parent: a pair that matches a coarser quad
    /// extends into the square beside it.
    fn descend(&self, level: u32, at: [i32; 2], around: [f32; 2], containment: Containment, splits: &mut Splits) {
        if splits.count() > self.max {
            return;
        }
        let square = self.errors.square(level, at);
        if !square.has_terrain() || square.error == 0.0 {
            return;
        }
        let bounds = bounds(self.field, level, at, around);
        // Squares within a visible square need no test.
        let containment =
            if containment == Containment::Crossing { self.frustum.contains(&bounds) } else { containment };
        if containment == Containment::Outside || f64::from(square.error) <= self.allowance.error(&bounds) {
            return;
        }
        splits.insert(self.pages, level, at);
        if level > 1 {
            let last = self.pages.grid.last;
            for child in [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[i, j]| [2 * at[0] + i, 2 * at[1] + j]) {
                if (0..2).all(|k| child[k] << (level - 1) < last[k]) {
                    self.descend(level - 1, child, square.range, containment, splits);
                }
            }
        }
    }
}

/// Returns the view with a picture enlarged on each side by a band, in parts of its width and height.
pub fn guarded(view: &View, band: f64) -> View {
    let wider = 1.0 + 2.0 * band;
    let lens = match view.lens {
        Lens::Perspective { fov_x } => Lens::Perspective { fov_x: 2.0 * (wider * (fov_x / 2.0).tan()).atan() },
        Lens::Orthographic { width, far } => Lens::Orthographic { width: wider * width, far },
    };
    View { lens, ..*view }
}

/// Returns the box around a square, clipped to the field, metres.
pub fn bounds(field: &Field, level: u32, at: [i32; 2], range: [f32; 2]) -> Aabb {
    let last = field.size().map(|n| n as i32 - 1);
    let corner = |offset: i32, y: f32| {
        let [x, z] = [0, 1].map(|k| f64::from(((at[k] + offset) << level).min(last[k])));
        field.world_at(x, z, f64::from(y))
    };
    Aabb { min: corner(0, range[0]), max: corner(1, range[1]) }
}
