//! Where blocks of each level go over into the next one, with `morph=distance`: by the distance of every vertex.
//!
//! The errors are those of whole levels, so that the way into a level begins at one distance, wherever a block lies. It
//! begins where the tolerance allows what may be off then: the error of the blocks that go, and as far as a vertex
//! goes; a cell's diagonal later, as points between vertices are nearer than these. And it begins only where the way
//! into the level before has ended for all of a split node: so no vertex is on two ways, neighbours are within one
//! level of each other, and where two levels meet the finer one has gone all its way and the coarser one has not begun.

use super::tree::Tree;
use crate::draw::distance::{END, weights};
use crate::view::{Lens, Metric, View};

/// More than single precision may change a distance by.
const GUARD: f64 = 1.001;

/// More levels than any field has.
pub const MORPH_RANGES: usize = 32;

/// Where a way has ended for all of a node, the square of the distance over that of its beginning: no rounding matters.
pub const NODE_END: f32 = END * 1.0001;

/// Distances end here, metres.
const FARTHEST_M: f64 = 1e12;

/// The ways into all levels in a view.
#[derive(Clone, Copy, Debug, Default)]
pub struct MorphRanges {
    /// By level, 1 over the square of the distance at which the way into it begins, 1/m².
    pub ranges: [f32; MORPH_RANGES],
    /// Square of the eye's distance from all land in height, m².
    pub above_squared: f32,
}

impl MorphRanges {
    /// The ways in a view of a quadtree whose errors are those of whole levels.
    pub fn new(tree: &Tree, view: &View) -> Self {
        if view.tolerance.px == f64::INFINITY {
            // No tolerance is kept: the way into every level has ended, wherever the eye is.
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
            ended_m = GUARD * f64::from(END).sqrt() * begin_m + diagonal * f64::from(tree.bounds.side(level));
        }
        Self { ranges, above_squared: (above * above) as f32 }
    }

    /// The weights of an instance of a level.
    pub fn weights(&self, level: u32, staying: u32, finer: u32) -> [u32; 4] {
        // A root goes nowhere.
        let into = |level: u32| self.ranges.get(level as usize).copied().unwrap_or(0.0);
        weights(staying, finer, [into(level + 1), into(level)], self.above_squared)
    }
}

/// From which distance on an error is allowed wherever in the picture it is, metres.
fn allowed_from_m(view: &View, error_m: f64) -> f64 {
    let scale = view.focal_px() / view.tolerance.px.max(f64::MIN_POSITIVE);
    let lean = view.forward().y.abs();
    match (view.lens, view.tolerance.metric) {
        (Lens::Perspective { .. }, Metric::Paper) => error_m * scale,
        // At a distance d depths are at least d / c, for a picture corner's ray c long at unit depth, and nothing is
        // farther aside than c times its depth.
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

/// An error that is the same at every distance, so many times what is allowed.
fn everywhere_m(times: f64) -> f64 {
    if times < 1.0 { 0.0 } else { FARTHEST_M }
}
