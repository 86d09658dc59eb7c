//! The level function that keeps the bound: a square is split where its error is more than the view allows.
//!
//! The paper prefers triangles of one size on the screen to a bound, and says that any selection of vertices may take
//! the place of its level function (§4.1). This one looks at squares from the page down, so that its work grows with
//! what is drawn. Squares out of sight are split only in a band around the picture ([`guarded`]): without it, what a
//! turn of the head brings into sight goes from its coarsest level to its own at once.

use super::measure::Errors;
use super::pages::Pages;
use super::splits::Splits;
use crate::height::Field;
use crate::view::{Aabb, Allowance, Containment, Frustum, Lens, View};

/// A view of a measured field.
pub struct Certified<'a> {
    field: &'a Field,
    errors: &'a Errors,
    pages: &'a Pages,
    frustum: Frustum,
    allowance: Allowance,
    max: usize,
}

impl<'a> Certified<'a> {
    /// Under the view's tolerance, in the sight of `seen`: the view, or one that sees more. It stops at `max` split
    /// squares.
    pub fn new(field: &'a Field, errors: &'a Errors, pages: &'a Pages, [view, seen]: [&View; 2], max: usize) -> Self {
        Self { field, errors, pages, frustum: seen.frustum(), allowance: view.allowance(), max }
    }

    /// Fills an empty set; `false` if there would be too many.
    pub fn split(&self, splits: &mut Splits) -> bool {
        let level = self.pages.grid.level;
        for &page in self.pages.list() {
            let range = self.errors.square(level, page).range;
            self.descend(level, page, range, Containment::Crossing, splits);
        }
        splits.close(self.pages);
        splits.count() <= self.max
    }

    /// Splits a square as far as needed. Its triangles lie in the range of `around`, the square that it lies in: a pair
    /// that matches a coarser quad reaches into the square beside it.
    fn descend(&self, level: u32, at: [i32; 2], around: [f32; 2], seen: Containment, splits: &mut Splits) {
        if splits.count() > self.max {
            return;
        }
        let square = self.errors.square(level, at);
        if !square.has_terrain() || square.error == 0.0 {
            return;
        }
        let bounds = bounds(self.field, level, at, around);
        // What is in a square in sight is in sight.
        let seen = if seen == Containment::Crossing { self.frustum.contains(&bounds) } else { seen };
        if seen == Containment::Outside || f64::from(square.error) <= self.allowance.error(&bounds) {
            return;
        }
        splits.insert(self.pages, level, at);
        if level > 1 {
            let last = self.pages.grid.last;
            for child in [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[i, j]| [2 * at[0] + i, 2 * at[1] + j]) {
                if (0..2).all(|k| child[k] << (level - 1) < last[k]) {
                    self.descend(level - 1, child, square.range, seen, splits);
                }
            }
        }
    }
}

/// The view with a picture that is wider and higher by a band on each side, in parts of its width and its height.
pub fn guarded(view: &View, band: f64) -> View {
    let wider = 1.0 + 2.0 * band;
    let lens = match view.lens {
        Lens::Perspective { fov_x } => Lens::Perspective { fov_x: 2.0 * (wider * (fov_x / 2.0).tan()).atan() },
        Lens::Orthographic { width, far } => Lens::Orthographic { width: wider * width, far },
    };
    View { lens, ..*view }
}

/// The box around a square, its part outside the field left out, metres.
pub fn bounds(field: &Field, level: u32, at: [i32; 2], range: [f32; 2]) -> Aabb {
    let last = field.size().map(|n| n as i32 - 1);
    let corner = |second_target: i32, y: f32| {
        let [x, z] = [0, 1].map(|k| f64::from(((at[k] + second_target) << level).min(last[k])));
        field.world_at(x, z, f64::from(y))
    };
    Aabb { min: corner(0, range[0]), max: corner(1, range[1]) }
}
