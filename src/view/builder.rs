//! Builds a view from defaults and named values.

use glam::{DMat3, DVec3};

use super::{Lens, Metric, Tolerance, View};

/// Builds a [`View`].
///
/// Defaults: at the origin, northward, level, perspective with 60° across, 1280 × 720 pixels, near plane at 0.1 m,
/// tolerance of 1 pixel under [`Metric::Certified`], time 0.
///
/// ```
/// use cuesta::View;
/// use glam::DVec3;
///
/// let view = View::builder().eye(DVec3::new(0.0, 500.0, 0.0)).look_at(DVec3::ZERO).tolerance_px(2.0).build()?;
/// assert_eq!(view.forward(), DVec3::NEG_Y);
/// assert!(View::builder().fov_deg(180.0).build().is_err());
/// assert!(View::builder().look_at(DVec3::ZERO).build().is_err());
/// # Ok::<(), String>(())
/// ```
#[derive(Clone, Copy, Debug)]
#[must_use]
pub struct ViewBuilder {
    view: View,
    target: Option<DVec3>,
}

impl Default for ViewBuilder {
    fn default() -> Self {
        let view = View {
            eye: DVec3::ZERO,
            world_from_eye: View::looking_along(DVec3::NEG_Z),
            lens: Lens::Perspective { fov_x: 60f64.to_radians() },
            size: [1280, 720],
            near: 0.1,
            tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
            time_s: 0.0,
        };
        Self { view, target: None }
    }
}

impl View {
    /// Returns a builder with default values.
    pub fn builder() -> ViewBuilder {
        ViewBuilder::default()
    }

    /// Checks the numbers of a view.
    ///
    /// # Errors
    /// If a position is not finite, a side of the picture is 0, the near plane or the tolerance is not positive, the field
    /// of view is not between 0 and 180°, or an orthographic far plane is not beyond the near plane.
    pub fn check(&self) -> Result<(), String> {
        let Self { eye, world_from_eye, lens, size, near, tolerance, time_s } = *self;
        let is_positive = |value: f64| value.is_finite() && value > 0.0;
        let is_lens = match lens {
            Lens::Perspective { fov_x } => fov_x > 0.0 && fov_x < std::f64::consts::PI,
            Lens::Orthographic { width, far } => is_positive(width) && far.is_finite() && far > near,
        };
        let checks = [
            (eye.is_finite() && world_from_eye.is_finite(), "expected a finite eye and rotation"),
            (size.iter().all(|&side| side > 0), "expected at least one pixel a side"),
            (is_positive(near), "expected a near plane in front of the eye"),
            (
                is_lens,
                "expected a field of view between 0 and 180°, or a positive width and a far plane beyond the near one",
            ),
            (tolerance.px > 0.0, "expected a positive tolerance"),
            (time_s.is_finite(), "expected a finite time"),
        ];
        checks.iter().find(|(holds, _)| !holds).map_or(Ok(()), |(_, why)| Err(format!("view: {why}")))
    }
}

impl ViewBuilder {
    /// Sets the position of the eye, world metres.
    pub fn eye(mut self, eye: DVec3) -> Self {
        self.view.eye = eye;
        self
    }

    /// Turns the eye to a point, world metres, with the horizon level. Replaces any other rotation.
    pub fn look_at(mut self, target: DVec3) -> Self {
        self.target = Some(target);
        self
    }

    /// Turns the eye by yaw (0 = east, 90 = south), pitch (up positive) and roll (clockwise), degrees.
    pub fn turned(self, yaw: f64, pitch: f64, roll: f64) -> Self {
        self.rotation(View::turned(yaw, pitch, roll))
    }

    /// Sets the rotation of the eye. Columns: right, up and backward in world axes, an orthonormal basis.
    pub fn rotation(mut self, world_from_eye: DMat3) -> Self {
        self.view.world_from_eye = world_from_eye;
        self.target = None;
        self
    }

    /// Sets a perspective projection with this horizontal field of view, degrees.
    pub fn fov_deg(self, fov: f64) -> Self {
        self.lens(Lens::Perspective { fov_x: fov.to_radians() })
    }

    /// Sets the projection.
    pub fn lens(mut self, lens: Lens) -> Self {
        self.view.lens = lens;
        self
    }

    /// Sets the size of the picture, pixels.
    pub fn size(mut self, width: u32, height: u32) -> Self {
        self.view.size = [width, height];
        self
    }

    /// Sets the near plane, metres in front of the eye. [`default_near`](super::default_near) returns one that suits a terrain.
    pub fn near(mut self, near: f64) -> Self {
        self.view.near = near;
        self
    }

    /// Sets the largest error allowed, pixels.
    pub fn tolerance_px(mut self, px: f64) -> Self {
        self.view.tolerance.px = px;
        self
    }

    /// Sets the formula that converts metres of error to pixels.
    pub fn metric(mut self, metric: Metric) -> Self {
        self.view.tolerance.metric = metric;
        self
    }

    /// Sets the time of the scene, seconds.
    pub fn time_s(mut self, time_s: f64) -> Self {
        self.view.time_s = time_s;
        self
    }

    /// Returns the view.
    ///
    /// # Errors
    /// As [`View::check`]; or the point to look at is not finite, or is the eye.
    pub fn build(self) -> Result<View, String> {
        let mut view = self.view;
        if let Some(target) = self.target {
            if !target.is_finite() || target == view.eye {
                return Err(format!("view: expected a point to look at that is not the eye, found {target}"));
            }
            view.world_from_eye = View::looking_along(target - view.eye);
        }
        view.check().map(|()| view)
    }
}
