//! Projection of many points with one view.

use glam::{DMat3, DVec2, DVec3};

use crate::view::{Lens, Projected, View};

/// Precomputed constants of [`View::project`].
pub struct Projection {
    eye: DVec3,
    eye_from_world: DMat3,
    focal_px: f64,
    size: DVec2,
    near: f64,
    far: f64,
    is_perspective: bool,
}

impl Projection {
    /// Precomputes the constants of a view.
    pub fn new(view: &View) -> Self {
        let (is_perspective, far) = match view.lens {
            Lens::Perspective { .. } => (true, f64::INFINITY),
            Lens::Orthographic { far, .. } => (false, far),
        };
        Self {
            eye: view.eye,
            eye_from_world: view.world_from_eye.transpose(),
            focal_px: view.focal_px(),
            size: DVec2::new(view.size[0].into(), view.size[1].into()),
            near: view.near,
            far,
            is_perspective,
        }
    }

    /// Projects a world point, even one before the near plane. Returns `None` at or behind the eye of a perspective
    /// view.
    #[inline]
    pub fn project(&self, point: DVec3) -> Option<Projected> {
        let at = self.eye_from_world * (point - self.eye);
        let depth = -at.z;
        let scale = if self.is_perspective { self.focal_px / depth } else { self.focal_px };
        let pixel = self.size / 2.0 + DVec2::new(at.x, -at.y) * scale;
        (!self.is_perspective || depth > 0.0).then_some(Projected { pixel, depth })
    }

    /// Projects a world point if it lies in the picture and between the near and the far plane.
    #[inline]
    pub fn project_seen(&self, point: DVec3) -> Option<Projected> {
        let seen = |at: &Projected| {
            (self.near..=self.far).contains(&at.depth)
                && at.pixel.cmpge(DVec2::ZERO).all()
                && at.pixel.cmple(self.size).all()
        };
        self.project(point).filter(seen)
    }

    /// Returns the distance on the screen between a projected point and a world point, pixels; infinite if the latter
    /// has no projection.
    #[inline]
    pub fn distance_px(&self, from: &Projected, to: DVec3) -> f64 {
        self.project(to).map_or(f64::INFINITY, |to| from.pixel.distance(to.pixel))
    }

    /// Returns the squared cosine of a point's angle off the view axis; 1 in an orthographic view. `at` is the point's
    /// projection.
    #[inline]
    pub fn squared_cosine(&self, point: DVec3, at: &Projected) -> f64 {
        if self.is_perspective { at.depth * at.depth / point.distance_squared(self.eye) } else { 1.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::measure::in_view;
    use crate::view::{Metric, Tolerance};

    #[test]
    fn it_is_the_views_own() {
        let lenses = [Lens::Perspective { fov_x: 1.8 }, Lens::Orthographic { width: 40.0, far: 60.0 }];
        let mut seen = [0, 0];
        for (lens, count) in lenses.into_iter().zip(&mut seen) {
            let view = View {
                eye: DVec3::new(3.0, 40.0, -7.0),
                world_from_eye: View::turned(30.0, -40.0, 20.0),
                lens,
                size: [300, 200],
                near: 5.0,
                tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
                time_s: 0.0,
            };
            let projection = Projection::new(&view);
            for k in 0..8000 {
                let point = DVec3::new((k % 20) as f64, (k / 20 % 20) as f64, (k / 400) as f64) * 4.0 - 30.0;
                let at = projection.project_seen(point);
                assert_eq!(at.is_some(), in_view(&view, point), "{point}");
                let Some(at) = at else { continue };
                let expected = view.project(point).expect("in view");
                assert!(at.pixel.distance(expected.pixel) < 1e-9 && (at.depth - expected.depth).abs() < 1e-9);
                let angle = view.forward().angle_between(point - view.eye);
                let cosine = if projection.is_perspective { angle.cos() } else { 1.0 };
                assert!((projection.squared_cosine(point, &at) - cosine * cosine).abs() < 1e-9);
                *count += 1;
            }
        }
        assert!(seen.iter().all(|&n| n > 100), "{seen:?}");
    }
}
