//! Common views of a field, in which invariants are checked.

use glam::{DMat3, DVec3};

use crate::height::Field;
use crate::view::{Aabb, Containment, Lens, Metric, Tolerance, View};

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
