//! Common views of a field, in which invariants are checked, and extreme ones.

use std::sync::Arc;

use glam::{DMat3, DVec3};

use super::fields::hills;
use super::forms::TechniqueConfig;
use super::invariants::{INVARIANTS, Subject, TOLERANCES_PX};
use super::{Case, Finding, Kind, StressTerrain};
use crate::height::Field;
use crate::lod::Technique;
use crate::view::{Aabb, Containment, Lens, Metric, Tolerance, View};

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
    let all = views(&field);
    let of = |name: &str| all.iter().find(|view| view.0 == name).expect("a common view").1;
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
    let invariants = INVARIANTS.iter().filter(|invariant| invariant.is_for(config.entry.name));
    invariants.map(|invariant| Finding::holds(invariant.name, (invariant.check)(&mut subject))).collect()
}

/// Bisects the path of the eye towards `end` until two adjacent positions (in f64) draw different numbers of
/// triangles. Returns `None` if both ends draw the same number.
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

/// Returns the view with another tolerance, pixels, under the certified metric.
pub fn with_tolerance(view: &View, px: f64) -> View {
    View { tolerance: Tolerance { px, metric: Metric::Certified }, ..*view }
}

/// Returns named views near the field and far from it; each step from one to the next is a teleport.
pub fn views(field: &Field) -> Vec<(&'static str, View)> {
    let [w, h] = field.size().map(f64::from);
    let (low, high) = (field.world_at(0.0, 0.0, 0.0), field.world_at(w - 1.0, h - 1.0, 0.0));
    let (size, range) = (high - low, field.statistics());
    let at = |u: f64, v: f64, above: f64| {
        let ground = field.height(((w - 1.0) * u.min(1.0)) as u32, ((h - 1.0) * v.min(1.0)) as u32);
        low + size * DVec3::new(u, 0.0, v) + DVec3::Y * (f64::from(ground) + above)
    };
    let (middle, extent) = (at(0.5, 0.5, 0.0), size.length());
    let pinhole = |eye, rotation, degrees: f64| perspective(eye, rotation, degrees, extent);
    let towards = |eye: DVec3| View::looking_along(middle - eye);
    let (corner, far) = (at(-0.1, 1.1, 0.0) + DVec3::Y * extent / 3.0, middle + DVec3::new(7.0, 4.0, -9.0) * extent);
    let above = middle + DVec3::Y * extent;
    let under = DVec3::new(middle.x, f64::from(range.min) - extent / 5.0, middle.z);
    let over = DVec3::new(middle.x, f64::from(range.max) + extent, middle.z);
    vec![
        ("inside", pinhole(at(0.45, 0.55, extent / 40.0), View::turned(30.0, -10.0, 0.0), 90.0)),
        ("on a vertex", pinhole(at(0.5, 0.5, 0.0), View::turned(200.0, 0.0, 0.0), 60.0)),
        ("from above a corner", pinhole(corner, towards(corner), 60.0)),
        ("far outside", pinhole(far, towards(far), 30.0)),
        ("straight down", pinhole(above, View::turned(90.0, -90.0, 0.0), 75.0)),
        ("from under the terrain", pinhole(under, View::turned(0.0, 60.0, 20.0), 100.0)),
        ("5°", pinhole(corner, towards(corner), 5.0)),
        ("120°, upside down", pinhole(at(0.2, 0.3, extent / 15.0), View::turned(45.0, -30.0, 180.0), 120.0)),
        ("orthographic", orthographic(corner, towards(corner), extent / 2.0)),
        ("orthographic, all", orthographic(over, View::turned(-90.0, -90.0, 0.0), 3.0 * extent)),
        ("away from it", pinhole(far, View::looking_along(far - middle), 60.0)),
    ]
}

fn perspective(eye: DVec3, world_from_eye: DMat3, degrees: f64, extent: f64) -> View {
    let lens = Lens::Perspective { fov_x: degrees.to_radians() };
    let tolerance = Tolerance { px: 1.0, metric: Metric::Certified };
    View { eye, world_from_eye, lens, size: [320, 180], near: extent / 1e4, tolerance, time_s: 0.0 }
}

fn orthographic(eye: DVec3, world_from_eye: DMat3, width: f64) -> View {
    let view = perspective(eye, world_from_eye, 90.0, width);
    View { lens: Lens::Orthographic { width, far: 1e9 }, ..view }
}

/// Returns true if all samples are certainly in the frustum.
pub fn sees_everything(field: &Field, view: &View) -> bool {
    let [w, h] = field.size().map(|n| f64::from(n - 1));
    let range = field.statistics();
    let bounds = Aabb { min: field.world_at(0.0, 0.0, range.min.into()), max: field.world_at(w, h, range.max.into()) };
    view.frustum().contains(&bounds) == Containment::Inside
}
