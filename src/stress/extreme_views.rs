//! Cases with extreme views.

use super::case::{Case, Kind};
use super::fields::hills;
use super::finding::Finding;
use super::forms::Form;
use super::invariants::{INVARIANTS, Subject, TOLERANCES_PX};
use super::terrain::StressTerrain;
use super::views::views;
use crate::height::Field;
use crate::lod::Technique;
use crate::view::{Lens, View};
use glam::DVec3;
use std::sync::Arc;

const fn case(name: &'static str, terrain: fn() -> StressTerrain) -> Case {
    Case { family: "view", name, kind: Kind::Terrain(terrain) }
}

/// The family `view`. Straight down, upside down, rolled, parallel, under the land and exactly on a vertex are views of
/// every land ([`views`]).
pub const CASES: &[Case] = &[
    case("every common view", || extreme(|view| view)),
    case("half a degree wide", || extreme(|view| wide(view, 0.5))),
    case("170 degrees wide", || extreme(|view| wide(view, 170.0))),
    case("near plane at 1 mm", || extreme(|view| View { near: 1e-3, ..view })),
    case("1 x 1 pixels", || extreme(|view| View { size: [1, 1], ..view })),
    case("16384 x 1 pixels", || extreme(|view| View { size: [16384, 1], ..view })),
    Case { family: "view", name: "exactly on a threshold", kind: Kind::Each(on_a_threshold) },
];

/// The land of this family.
fn terrain() -> Field {
    hills([129, 97], [10.0; 2], 400.0)
}

/// Its common views, changed.
fn extreme(change: fn(View) -> View) -> StressTerrain {
    let field = Arc::new(terrain());
    StressTerrain { views: views(&field).into_iter().map(|(name, view)| (name, change(view))).collect(), field }
}

/// As wide; parallel rays stay.
fn wide(view: View, degrees: f64) -> View {
    match view.lens {
        Lens::Perspective { .. } => View { lens: Lens::Perspective { fov_x: degrees.to_radians() }, ..view },
        Lens::Orthographic { .. } => view,
    }
}

/// The last eye from which one list is drawn and the first from which another is, next to each other as numbers are, on
/// the way from above a corner to far away: every law on both sides.
fn on_a_threshold(form: &Form) -> Vec<Finding> {
    let field = Arc::new(terrain());
    let mut technique = (form.entry.build)(Arc::clone(&field), &form.settings);
    let all = views(&field);
    let of = |name: &str| all.iter().find(|view| view.0 == name).expect("a view of the land").1;
    let (near, far) = (of("from above a corner"), of("far outside"));
    let Some(sides) = threshold(&field, &mut *technique, near, far.eye) else {
        return vec![Finding::reported("every list is the same", 1.0)];
    };
    let views = [("just before", sides[0]), ("just behind", sides[1])];
    let mut subject = Subject {
        field: &field,
        technique: &mut *technique,
        views: &views,
        tolerances_px: &TOLERANCES_PX,
        time_s: 0.0,
    };
    let invariants = INVARIANTS.iter().filter(|invariant| invariant.is_for(form.entry.name));
    invariants.map(|invariant| Finding::holds(invariant.name, (invariant.check)(&mut subject))).collect()
}

/// The view and its eye moved towards `end`, halved until nothing lies between two that draw differently many triangles;
/// `None` if both ends draw as many.
pub fn threshold(field: &Field, technique: &mut dyn Technique, view: View, end: DVec3) -> Option<[View; 2]> {
    let mut subject = Subject { field, technique, views: &[], tolerances_px: &TOLERANCES_PX, time_s: 0.0 };
    let way = end - view.eye;
    let at = |share: f64| View { eye: view.eye + way * share, ..view };
    let mut triangles = |share: f64| subject.select(&at(share)).map(|list| list.triangles()).ok();
    let (mut low, mut high) = (0.0, 1.0);
    let first = triangles(low)?;
    if triangles(high)? == first {
        return None;
    }
    while at(low).eye != at(high).eye {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            break;
        }
        *(if triangles(middle)? == first { &mut low } else { &mut high }) = middle;
    }
    Some([at(low), at(high)])
}
