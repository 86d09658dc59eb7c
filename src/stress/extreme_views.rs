//! Extreme views of one field.

use std::sync::Arc;

use super::case::{Case, Kind, StressTerrain};
use super::fields::hills;
use super::finding::Finding;
use super::forms::TechniqueConfig;
use super::invariants::Subject;
use super::threshold::Threshold;
use super::views::views;
use crate::height::Field;
use crate::view::{Lens, View};

const fn case(name: &'static str, terrain: fn() -> StressTerrain) -> Case {
    Case { family: "view", name, kind: Kind::Terrain(terrain) }
}

/// The family `view`. Views straight down, upside down, rolled, orthographic, under the terrain and exactly on a
/// vertex are common views of every terrain ([`views`]).
pub const CASES: &[Case] = &[
    case("every common view", || extreme(|view| view)),
    case("half a degree wide", || extreme(|view| wide(view, 0.5))),
    case("170 degrees wide", || extreme(|view| wide(view, 170.0))),
    case("near plane at 1 mm", || extreme(|view| View { near: 1e-3, ..view })),
    case("1 x 1 pixels", || extreme(|view| View { size: [1, 1], ..view })),
    case("16384 x 1 pixels", || extreme(|view| View { size: [16384, 1], ..view })),
    Case { family: "view", name: "exactly on a threshold", kind: Kind::PerTechnique(on_a_threshold) },
];

/// The terrain of this family.
fn terrain() -> Field {
    hills([129, 97], [10.0; 2], 400.0)
}

/// Returns the terrain with modified common views.
fn extreme(change: fn(View) -> View) -> StressTerrain {
    let field = Arc::new(terrain());
    StressTerrain { views: views(&field).into_iter().map(|(name, view)| (name, change(view))).collect(), field }
}

/// Returns a view with another field of view; orthographic views are unchanged.
fn wide(view: View, degrees: f64) -> View {
    match view.lens {
        Lens::Perspective { .. } => View { lens: Lens::Perspective { fov_x: degrees.to_radians() }, ..view },
        Lens::Orthographic { .. } => view,
    }
}

/// Checks every invariant at the two adjacent eye positions between which the list changes, on the way from above a
/// corner to far away.
fn on_a_threshold(config: &TechniqueConfig) -> Vec<Finding> {
    let field = Arc::new(terrain());
    let mut technique = (config.entry.build)(Arc::clone(&field), &config.settings);
    let Some(Threshold { sides: [before, behind], .. }) = Threshold::find(&field, &mut *technique) else {
        return vec![Finding::reported("every list is the same", 1.0)];
    };
    let views = [("just before", before), ("just behind", behind)];
    Finding::of_invariants(&mut Subject::new(&field, &mut *technique, &views), config.entry.name)
}
