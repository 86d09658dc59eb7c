//! Distances at which vertices morph into each level, with `morph=distance`.
//!
//! Errors are those of whole levels, so the morph into a level begins at the same distance for all blocks. It begins
//! where the tolerance allows the error during the morph: the error of the blocks that morph, plus the displacement of
//! a vertex. One cell diagonal is added, because points between vertices may be nearer than these. It also begins only
//! where the morph into the previous level has ended for all of a split node. No vertex is therefore in two morphs, and
//! neighbours are within one level. Where two levels meet, the finer one has fully morphed and the coarser one has not
//! begun.

use super::tree::Tree;
use crate::draw::distance::{MORPH_END, weights};
use crate::draw::weights::DistanceWeights;
use crate::view::{Lens, Metric, View};

/// Factor above the rounding error of distances in single precision.
const GUARD: f64 = 1.001;

/// Length of the table, above the number of levels of any field.
pub const MORPH_RANGES: usize = 32;

/// Squared distance at which a morph has ended for all of a node, relative to that of its beginning; rounding cannot
/// matter.
pub const NODE_END: f32 = MORPH_END * 1.0001;

/// Maximum distance, metres.
const FARTHEST_M: f64 = 1e12;

/// Distances of the morphs into all levels in a view.
#[derive(Clone, Copy, Debug, Default)]
pub struct MorphRanges {
    /// Inverse square of the distance at which the morph into each level begins, 1/m².
    pub ranges: [f32; MORPH_RANGES],
    /// Square of the eye's vertical distance from the terrain's height range, m².
    pub above_squared: f32,
}

impl MorphRanges {
    /// Computes the distances for a view of a quadtree whose errors are those of whole levels.
    pub fn new(tree: &Tree, view: &View) -> Self {
        if view.tolerance.px == f64::INFINITY {
            // An infinite tolerance ends the morph into every level at any distance.
            return Self { ranges: [FARTHEST_M as f32; MORPH_RANGES], above_squared: FARTHEST_M as f32 };
        }
        let [low, high] = tree.bounds.square(tree.root().level, [0, 0]).range.map(f64::from);
        let above = (view.eye.y - high).max(low - view.eye.y).clamp(0.0, FARTHEST_M);
        let diagonal = tree.spacing[0].hypot(tree.spacing[1]);
        let mut ranges = [0.0; MORPH_RANGES];
        let mut ended_m = 0.0f64;
        for level in 1..=tree.root().level {
            let cell_m = diagonal * f64::from(1u32 << level);
            let allowed_m = allowed_from_m(view, tree.error(level, 0.0).into());
            let begin_m = GUARD * (allowed_m + cell_m).max(ended_m).min(FARTHEST_M);
            ranges[level as usize] = (1.0 / (begin_m * begin_m)) as f32;
            ended_m = GUARD * f64::from(MORPH_END).sqrt() * begin_m + diagonal * f64::from(tree.bounds.side(level));
        }
        Self { ranges, above_squared: (above * above) as f32 }
    }

    /// Returns the weights of an instance of a level.
    pub fn weights(&self, level: u32, staying: u32, finer: u32) -> DistanceWeights {
        // The root has no level to morph into.
        let into = |level: u32| self.ranges.get(level as usize).copied().unwrap_or(0.0);
        weights(staying, finer, [into(level + 1), into(level)], self.above_squared)
    }
}

/// Returns the distance from which on an error is allowed anywhere in the picture, metres.
fn allowed_from_m(view: &View, error_m: f64) -> f64 {
    let scale = view.focal_px() / view.tolerance.px.max(f64::MIN_POSITIVE);
    let lean = view.forward().y.abs();
    match (view.lens, view.tolerance.metric) {
        (Lens::Perspective { .. }, Metric::Paper) => error_m * scale,
        // At a distance d depths are at least d / c, with c the length of the picture's corner ray at unit depth. No
        // point is further off the axis than c times its depth.
        (Lens::Perspective { .. }, Metric::Certified) => {
            let corner = view.corner_ray();
            error_m * corner * (corner * scale + lean)
        }
        (Lens::Orthographic { .. }, Metric::Paper) => everywhere_m(error_m * scale),
        (Lens::Orthographic { .. }, Metric::Certified) => {
            everywhere_m(error_m * scale * (1.0 - lean * lean).max(0.0).sqrt())
        }
    }
}

/// Returns the distance, metres, for an error that is `times` the allowed one at every distance: 0 or the maximum.
fn everywhere_m(times: f64) -> f64 {
    if times < 1.0 { 0.0 } else { FARTHEST_M }
}
