//! A view: eye, projection, frustum and tolerance.
//!
//! World axes: right-handed, x east, y up, z south, metres in f64. Screen: pixels, x right, y down.

pub mod builder;

use glam::{DMat3, DMat4, DVec2, DVec3};

/// An axis-aligned box in world metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Aabb {
    /// Smallest corner.
    pub min: DVec3,
    /// Largest corner.
    pub max: DVec3,
}

impl Aabb {
    /// Returns the distance from `point` to the closest point of the box, metres; 0 inside.
    pub fn distance(&self, point: DVec3) -> f64 {
        (self.min - point).max(point - self.max).max(DVec3::ZERO).length()
    }

    /// Returns the largest horizontal distance from `point` to a point of the box, metres.
    pub fn farthest_horizontal(&self, point: DVec3) -> f64 {
        let far = (self.min - point).abs().max((self.max - point).abs());
        far.x.hypot(far.z)
    }

    /// Returns the smallest and the largest horizontal distance of the box from a place in plan (x, z), metres.
    fn distances_in_plan(&self, [x, z]: [f64; 2]) -> (f64, f64) {
        let (min, max) = ([self.min.x - x, self.min.z - z], [self.max.x - x, self.max.z - z]);
        let min = [0, 1].map(|k| min[k].max(-max[k]).max(0.0));
        let max = [0, 1].map(|k| max[k].max(-min[k]));
        (min[0].hypot(min[1]), max[0].hypot(max[1]))
    }

    /// Returns the largest value of `normal · p` over the box.
    pub fn support(&self, normal: DVec3) -> f64 {
        (normal * self.min).max(normal * self.max).element_sum()
    }

    /// Returns the smallest box around both.
    pub fn union(&self, other: &Aabb) -> Aabb {
        Aabb { min: self.min.min(other.min), max: self.max.max(other.max) }
    }
}

/// The projection from eye space to the picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Lens {
    /// A pinhole camera without a far plane.
    Perspective {
        /// Horizontal field of view, radians.
        fov_x: f64,
    },
    /// Parallel rays.
    Orthographic {
        /// Width of the picture, metres.
        width: f64,
        /// Far plane, metres in front of the eye.
        far: f64,
    },
}

/// The formula that converts a vertical error in metres to pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Metric {
    /// An upper bound for every pixel of the picture, off the view axis too.
    #[default]
    Certified,
    /// Judnich & Ling 2012, eq. 1: ρ = ε/d · w / (2 tan(φ/2)); no bound off the view axis.
    Paper,
}

/// The largest error allowed on the screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tolerance {
    /// Pixels.
    pub px: f64,
    /// Converts metres to these pixels.
    pub metric: Metric,
}

/// Returns a near plane, metres: a thousandth of the height above ground, and at least 0.1 m. On a terrain with a
/// diagonal below 20 m the least is a two-hundredth of the diagonal.
pub fn default_near(above_ground_m: f64, diagonal_m: f64) -> f64 {
    (above_ground_m.abs() / 1000.0).max((diagonal_m / 200.0).min(0.1))
}

/// One view of the world: all that a technique selects by.
///
/// [`View::builder`] makes one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Position of the eye, world metres.
    pub eye: DVec3,
    /// Columns: right, up and backward in world axes.
    pub world_from_eye: DMat3,
    /// Projection.
    pub lens: Lens,
    /// Size of the picture (x, y), pixels.
    pub size: [u32; 2],
    /// Near plane, metres in front of the eye.
    pub near: f64,
    /// Largest error allowed.
    pub tolerance: Tolerance,
    /// Time of the scene, seconds, for gradual transitions. It may stand still, leap or go back.
    pub time_s: f64,
}

/// The position of a box relative to the frustum.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Containment {
    /// No point of the box is in view.
    Outside,
    /// Some points may be in view.
    Crossing,
    /// All of the box is in the frustum.
    Inside,
}

/// Planes around the visible part of the world: `normal · p ≥ offset` inside.
#[derive(Clone, Copy, Debug)]
pub struct Frustum {
    planes: [(DVec3, f64); 5],
    /// A place in plan (x, z), and the draw distance around it, metres.
    reach: Option<([f64; 2], f64)>,
}

impl Frustum {
    /// Tests a box against the planes. Conservative: a box just outside may be `Crossing`, a visible one is never
    /// `Outside`.
    pub fn contains(&self, bounds: &Aabb) -> Containment {
        let mut containment = Containment::Inside;
        if let Some((eye, reach_m)) = self.reach {
            let (min, max) = bounds.distances_in_plan(eye);
            if min > reach_m {
                return Containment::Outside;
            }
            if max > reach_m {
                containment = Containment::Crossing;
            }
        }
        for &(normal, offset) in &self.planes {
            if bounds.support(normal) < offset {
                return Containment::Outside;
            }
            if -bounds.support(-normal) < offset {
                containment = Containment::Crossing;
            }
        }
        containment
    }

    /// Returns the part of the frustum within a horizontal distance of the eye, metres.
    pub fn within(self, eye: DVec3, reach_m: f64) -> Self {
        Self { reach: reach_m.is_finite().then_some(([eye.x, eye.z], reach_m)), ..self }
    }
}

/// The projection of a world point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Projected {
    /// Pixels from the top left corner.
    pub pixel: DVec2,
    /// Metres in front of the eye.
    pub depth: f64,
}

impl View {
    /// Returns the rotation of an eye that looks along `forward` with the horizon level.
    pub fn looking_along(forward: DVec3) -> DMat3 {
        let back = -forward.try_normalize().unwrap_or(DVec3::NEG_Z);
        // Straight up or down: north is up on the screen (or down, looking up).
        let right = DVec3::Y.cross(back).try_normalize().unwrap_or(DVec3::X);
        DMat3::from_cols(right, back.cross(right), back)
    }

    /// Returns the rotation for yaw (0 = east, 90 = south), pitch (up positive) and roll (clockwise), degrees.
    pub fn turned(yaw: f64, pitch: f64, roll: f64) -> DMat3 {
        let (sin_yaw, cos_yaw) = yaw.to_radians().sin_cos();
        let (sin_pitch, cos_pitch) = pitch.to_radians().sin_cos();
        let right = DVec3::new(-sin_yaw, 0.0, cos_yaw);
        let back = -DVec3::new(cos_yaw * cos_pitch, sin_pitch, sin_yaw * cos_pitch);
        DMat3::from_cols(right, back.cross(right), back) * Self::rolled(roll)
    }

    /// Returns the rotation for a clockwise roll about the view axis, degrees.
    pub fn rolled(roll: f64) -> DMat3 {
        DMat3::from_rotation_z(-roll.to_radians())
    }

    /// Returns the unit vector along the view axis.
    pub fn forward(&self) -> DVec3 {
        -self.world_from_eye.z_axis
    }

    /// Returns the focal length in pixels: pixels per unit of slope (perspective) or per metre (orthographic).
    pub fn focal_px(&self) -> f64 {
        let width = f64::from(self.size[0]);
        match self.lens {
            Lens::Perspective { fov_x } => width / (2.0 * (fov_x / 2.0).tan()),
            Lens::Orthographic { width: metres, .. } => width / metres,
        }
    }

    /// Returns the matrix from eye-relative world metres to clip space: y down, depth reversed (1 at the near plane,
    /// 0 at the far plane or at infinity).
    pub fn clip_from_relative(&self) -> DMat4 {
        let x = 2.0 * self.focal_px() / f64::from(self.size[0]);
        let y = -2.0 * self.focal_px() / f64::from(self.size[1]);
        let eye = DMat4::from_mat3(self.world_from_eye.transpose());
        let lens = match self.lens {
            Lens::Perspective { .. } => DMat4::from_cols_array(&[
                x, 0.0, 0.0, 0.0, 0.0, y, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, self.near, 0.0,
            ]),
            Lens::Orthographic { far, .. } => {
                let scale = 1.0 / (far - self.near);
                DMat4::from_cols_array(&[
                    x,
                    0.0,
                    0.0,
                    0.0,
                    0.0,
                    y,
                    0.0,
                    0.0,
                    0.0,
                    0.0,
                    scale,
                    0.0,
                    0.0,
                    0.0,
                    far * scale,
                    1.0,
                ])
            }
        };
        lens * eye
    }

    /// Projects a world point; `None` in front of the near plane or behind the eye.
    pub fn project(&self, point: DVec3) -> Option<Projected> {
        let p = self.world_from_eye.transpose() * (point - self.eye);
        let depth = -p.z;
        if depth < self.near {
            return None;
        }
        let scale = match self.lens {
            Lens::Perspective { .. } => self.focal_px() / depth,
            Lens::Orthographic { .. } => self.focal_px(),
        };
        let centre = DVec2::new(f64::from(self.size[0]), f64::from(self.size[1])) / 2.0;
        Some(Projected { pixel: centre + DVec2::new(p.x, -p.y) * scale, depth })
    }

    /// Returns the same view with the tolerance multiplied by `scale`.
    pub fn under_wider_tolerance(&self, scale: f64) -> Self {
        let px = self.tolerance.px.max(f64::MIN_POSITIVE) * scale;
        Self { tolerance: Tolerance { px, ..self.tolerance }, ..*self }
    }

    /// Returns the same view with a margin of `px` pixels added on every side.
    pub fn with_margin(&self, px: u32) -> Self {
        let size = self.size.map(|side| side + 2 * px);
        let wider = f64::from(size[0]) / f64::from(self.size[0]);
        let lens = match self.lens {
            Lens::Perspective { fov_x } => Lens::Perspective { fov_x: 2.0 * ((fov_x / 2.0).tan() * wider).atan() },
            Lens::Orthographic { width, far } => Lens::Orthographic { width: width * wider, far },
        };
        Self { lens, size, ..*self }
    }

    /// Returns true if a projected point lies in the picture.
    pub fn in_picture(&self, at: &Projected) -> bool {
        let size = DVec2::new(f64::from(self.size[0]), f64::from(self.size[1]));
        at.pixel.cmpge(DVec2::ZERO).all() && at.pixel.cmple(size).all()
    }

    /// Returns half the picture's width and height, as slopes (perspective) or metres (orthographic).
    fn half_extent(&self) -> DVec2 {
        DVec2::new(f64::from(self.size[0]), f64::from(self.size[1])) / (2.0 * self.focal_px())
    }

    /// Returns the near plane and the four side planes: `normal · (p − eye) + distance ≥ 0` inside.
    pub fn planes(&self) -> [(DVec3, f64); 5] {
        let half = self.half_extent();
        let rotate = self.world_from_eye;
        let side = |x: f64, y: f64| {
            let reach = x.abs() * half.x + y.abs() * half.y;
            match self.lens {
                // Inside: the slope towards (x, y) is at most `half`.
                Lens::Perspective { .. } => (rotate * DVec3::new(-x, -y, -reach), 0.0),
                Lens::Orthographic { .. } => (rotate * DVec3::new(-x, -y, 0.0), reach),
            }
        };
        [(self.forward(), -self.near), side(1.0, 0.0), side(-1.0, 0.0), side(0.0, 1.0), side(0.0, -1.0)]
    }

    /// Returns the view's frustum in world space, without a far plane.
    pub fn frustum(&self) -> Frustum {
        let planes = self.planes().map(|(normal, distance)| (normal, normal.dot(self.eye) - distance));
        Frustum { planes, reach: None }
    }

    /// Returns the length of the ray through a picture corner at unit depth.
    pub fn corner_ray(&self) -> f64 {
        self.half_extent().length().hypot(1.0)
    }

    /// Returns the largest vertical displacement, metres, that keeps the view's tolerance for a surface inside `bounds`:
    /// see [`Allowance::error`].
    pub fn allowed_error(&self, bounds: &Aabb) -> f64 {
        self.allowance().error(bounds)
    }

    /// Prepares [`View::allowed_error`] for many boxes.
    pub fn allowance(&self) -> Allowance {
        Allowance { view: *self, forward: self.forward(), focal_px: self.focal_px(), corner: self.corner_ray() }
    }

    /// Returns the distance on the screen between a drawn point and its true position, pixels; infinite if either
    /// lies in front of the near plane or behind the eye.
    pub fn displacement_px(&self, drawn: DVec3, truth: DVec3) -> f64 {
        match (self.project(drawn), self.project(truth)) {
            (Some(a), Some(b)) => a.pixel.distance(b.pixel),
            _ => f64::INFINITY,
        }
    }
}

/// A view's tolerance, prepared for many boxes.
#[derive(Clone, Copy, Debug)]
pub struct Allowance {
    view: View,
    forward: DVec3,
    focal_px: f64,
    /// Length of the ray through a picture corner at unit depth.
    corner: f64,
}

impl Allowance {
    /// Returns the largest vertical displacement, metres, that keeps the tolerance for a surface inside `bounds`.
    ///
    /// Certified metric: a point at view depth `z` and horizontal distance `r` from the eye is displaced vertically by δ.
    /// It moves on the screen by exactly `f·δ·|…|/(z·z′)` with `|…| ≤ r` and `z′ ≥ z − δ·|u|`. `u` is the component of
    /// the world's up vector along the view axis. Visible points of the box have `z ≥ max(near, nearest depth, d/k)` and
    /// `r ≤ min(k·z, farthest horizontal distance)`. `k` is the length of the ray through a picture corner at unit depth.
    ///
    /// Judnich & Ling's eq. 1 is up to k² too small off the axis; this bound is safe there and tighter on the axis.
    /// Under a finite tolerance the displaced surface stays in front of the eye. An infinite one allows everything.
    pub fn error(&self, bounds: &Aabb) -> f64 {
        let View { eye, lens, near, tolerance, .. } = self.view;
        let (focal, px, forward) = (self.focal_px, tolerance.px, self.forward);
        if px == f64::INFINITY {
            return px;
        }
        match (lens, tolerance.metric) {
            (Lens::Orthographic { .. }, Metric::Paper) => px / focal,
            (Lens::Orthographic { .. }, Metric::Certified) => {
                px / (focal * (1.0 - forward.y * forward.y).max(0.0).sqrt()).max(f64::MIN_POSITIVE)
            }
            (Lens::Perspective { .. }, Metric::Paper) => px * bounds.distance(eye).max(near) / focal,
            (Lens::Perspective { .. }, Metric::Certified) => {
                let distance = bounds.distance(eye).max(near);
                let nearest = -bounds.support(-forward) - forward.dot(eye);
                let depth = near.max(nearest).max(distance / self.corner);
                let aside = (bounds.farthest_horizontal(eye) / depth).min(self.corner);
                px * depth / (focal * aside + px * forward.y.abs()).max(f64::MIN_POSITIVE)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn view(px: f64) -> View {
        View {
            eye: DVec3::new(10.0, 20.0, 30.0),
            world_from_eye: View::turned(35.0, -20.0, 7.0),
            lens: Lens::Perspective { fov_x: 1.5 },
            size: [320, 200],
            near: 0.1,
            tolerance: Tolerance { px, metric: Metric::Certified },
            time_s: 0.0,
        }
    }

    #[test]
    fn clip_space_and_pixels_agree() {
        let view = view(1.0);
        let point = view.eye + view.forward() * 50.0 + DVec3::new(3.0, 4.0, -5.0);
        let clip = view.clip_from_relative() * (point - view.eye).extend(1.0);
        let pixel = (clip.truncate().truncate() / clip.w + 1.0) / 2.0 * DVec2::new(320.0, 200.0);
        let projected = view.project(point).unwrap();
        assert!(pixel.distance(projected.pixel) < 1e-9);
        assert!((clip.w - projected.depth).abs() < 1e-9);
        assert!((clip.z / clip.w - 0.1 / projected.depth).abs() < 1e-12);
    }

    #[test]
    fn a_margin_shifts_pixels_and_changes_nothing_else() {
        let parallel = View { lens: Lens::Orthographic { width: 70.0, far: 900.0 }, ..view(1.0) };
        for view in [view(1.0), parallel] {
            let wide = view.with_margin(16);
            assert_eq!(wide.size, [352, 232]);
            let point = view.eye + view.forward() * 50.0 + DVec3::new(3.0, 4.0, -5.0);
            let [inner, outer] = [view, wide].map(|view| view.project(point).unwrap());
            assert!((outer.pixel - inner.pixel).distance(DVec2::splat(16.0)) < 1e-9);
            assert!((wide.focal_px() - view.focal_px()).abs() < 1e-9);
        }
    }

    /// Random boxes: displacing any of their visible points by the allowed error keeps the tolerance, and
    /// somewhere comes within a factor of it (the bound is no trivial one).
    #[test]
    fn certified_error_is_a_bound_everywhere_in_the_picture() {
        let mut seed = 1u64;
        let mut random = move || {
            seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (seed >> 11) as f64 / (1u64 << 53) as f64
        };
        let (mut worst, mut paper_worst) = (0.0f64, 0.0f64);
        for _ in 0..20_000 {
            let mut view = view(4.0);
            view.world_from_eye = View::turned(360.0 * random(), 180.0 * random() - 90.0, 360.0 * random());
            let centre = view.eye + (DVec3::new(random(), random(), random()) - 0.5) * 200.0;
            let half = DVec3::new(random(), random(), random()) * 10.0;
            let bounds = Aabb { min: centre - half, max: centre + half };
            let allowed = view.allowed_error(&bounds);
            view.tolerance.metric = Metric::Paper;
            let paper = view.allowed_error(&bounds);
            let point = bounds.min + DVec3::new(random(), random(), random()) * (half * 2.0);
            if view.project(point).is_some_and(|p| view.in_picture(&p)) {
                assert_ne!(view.frustum().contains(&bounds), Containment::Outside);
                for sign in [-1.0, 1.0] {
                    worst = worst.max(view.displacement_px(point, point + DVec3::Y * allowed * sign));
                    paper_worst = paper_worst.max(view.displacement_px(point, point + DVec3::Y * paper * sign));
                }
            }
        }
        assert!((3.0..=4.0).contains(&worst), "certified: {worst} px of 4");
        assert!(paper_worst > 4.0, "the paper's metric is no bound: {paper_worst} px of 4");
    }
}
