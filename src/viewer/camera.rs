//! The camera: flies, orbits a point, or walks. Its position stays finite and near the terrain for any input.

use glam::{DMat3, DVec2, DVec3};

use super::site::Site;
use crate::view::{Lens, View, default_near};

/// Eye height of a walker, metres.
const EYE_HEIGHT: f64 = 1.7;
/// Minimum height of a flight above the ground, metres.
const CLEARANCE: f64 = 1.0;
/// Minimum distance of an orbit from its focus, metres.
const CLOSEST: f64 = 2.0;
/// Height below which the flight speed no longer falls, metres.
const LOWEST: f64 = 5.0;
/// Maximum time step, seconds, so that the camera does not jump after a pause.
const LONGEST_STEP: f64 = 0.1;
/// Flight speed per second, as a multiple of the height above ground or of the width of an orthographic image.
const FLIGHT_PER_HEIGHT: f64 = 0.7;
/// Walking speed, metres per second.
const WALK: f64 = 6.0;
/// Speed factor of `fast`.
const FAST: f64 = 6.0;
/// Factor on a distance or width per notch of the wheel.
const NOTCH: f64 = 0.85;
/// Minimum width of an orthographic image, metres.
const NARROWEST: f64 = 1e-3;

/// Camera mode.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    /// Moves along the camera's axes.
    Fly,
    /// Circles a point.
    Orbit {
        /// The point, world metres.
        focus: DVec3,
    },
    /// Walks on the ground.
    Walk,
}

/// User input of one frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Motion {
    /// Right, up, forward; −1 to 1 each.
    pub drive: DVec3,
    /// True to move at `FAST` times the speed.
    pub fast: bool,
    /// Turn to the right and down, degrees.
    pub turn: DVec2,
    /// Notches of the wheel, positive away from the user.
    pub wheel: f64,
}

/// Position and mode of the camera. Lengths in human scale are multiplied by [`Site::scale`].
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Position, world metres.
    pub eye: DVec3,
    /// Camera mode.
    pub mode: Mode,
    yaw: f64,
    pitch: f64,
    roll: f64,
    /// Speed factor set with the wheel.
    factor: f64,
    /// Width of an orthographic image, metres; `None` in perspective.
    width: Option<f64>,
}

impl Camera {
    /// Creates a camera at a view.
    pub fn of(view: &View) -> Self {
        let forward = view.forward();
        let yaw = forward.z.atan2(forward.x).to_degrees();
        let pitch = forward.y.clamp(-1.0, 1.0).asin().to_degrees();
        let rolled = View::turned(yaw, pitch, 0.0).transpose() * view.world_from_eye;
        let roll = (-rolled.x_axis.y).atan2(rolled.x_axis.x).to_degrees();
        let width = match view.lens {
            Lens::Perspective { .. } => None,
            Lens::Orthographic { width, .. } => Some(width),
        };
        Self { eye: view.eye, mode: Mode::Fly, yaw, pitch, roll, factor: 1.0, width }
    }

    /// Returns the rotation of the view.
    pub fn world_from_eye(&self) -> DMat3 {
        View::turned(self.yaw, self.pitch, self.roll)
    }

    /// Returns the view of the camera; size and tolerance come from `start`. The near plane is at `near` metres, or
    /// follows the height above ground. An orthographic far plane lies beyond all terrain.
    pub fn view(&self, site: &Site, start: &View, near: Option<f64>) -> View {
        let near = near.unwrap_or_else(|| default_near(self.above_ground(site), site.diagonal()));
        let lens = match self.width {
            Some(width) => Lens::Orthographic { width, far: near + 2.0 * site.farthest(self.eye) },
            None => start.lens,
        };
        View { eye: self.eye, world_from_eye: self.world_from_eye(), lens, near, ..*start }
    }

    /// Returns the width of an orthographic image, metres.
    pub fn width(&self) -> Option<f64> {
        self.width
    }

    /// Returns the name of the mode.
    pub fn mode_name(&self) -> &'static str {
        match self.mode {
            Mode::Fly => "fly",
            Mode::Orbit { .. } => "orbit",
            Mode::Walk => "walk",
        }
    }

    /// Returns the height above the ground, or above the nearest edge of the field, metres.
    pub fn above_ground(&self, site: &Site) -> f64 {
        self.eye.y - site.ground(self.eye)
    }

    /// Returns the speed, metres per second.
    pub fn speed(&self, site: &Site) -> f64 {
        let flight = || match self.width {
            Some(width) => width,
            None => self.above_ground(site).abs().max(LOWEST * site.scale()),
        };
        self.factor
            * match self.mode {
                Mode::Fly => flight() * FLIGHT_PER_HEIGHT,
                Mode::Orbit { focus } => self.eye.distance(focus),
                Mode::Walk => WALK * site.scale(),
            }
    }

    /// Switches to the next mode.
    pub fn next_mode(&mut self, site: &Site) {
        self.factor = 1.0;
        self.mode = match self.mode {
            Mode::Fly => Mode::Orbit { focus: site.ray_hit(self.eye, self.forward()) },
            Mode::Orbit { .. } => Mode::Walk,
            Mode::Walk => Mode::Fly,
        };
        if self.mode == Mode::Walk {
            (self.pitch, self.roll) = (self.pitch.clamp(-10.0, 10.0), 0.0);
        }
        self.clamp_to_terrain(site);
    }

    /// Moves the camera for `dt` seconds.
    pub fn advance(&mut self, site: &Site, motion: &Motion, dt: f64) {
        let before = *self;
        let dt = if dt.is_finite() { dt.clamp(0.0, LONGEST_STEP) } else { 0.0 };
        let fast = if motion.fast { FAST } else { 1.0 };
        match (self.width, self.mode) {
            (Some(_), mode) => self.zoom(site, motion, if mode == Mode::Walk { 0.0 } else { fast * dt }),
            (None, Mode::Orbit { .. }) => {}
            (None, _) => self.factor = (self.factor * 1.2f64.powf(motion.wheel)).clamp(1e-3, 1e3),
        }
        let step = dt * self.speed(site) * fast;
        self.turn(motion.turn);
        match self.mode {
            Mode::Fly => {
                // Moving along parallel rays changes nothing; the width changes instead.
                let ahead = if self.width.is_some() { 0.0 } else { -1.0 };
                self.eye += self.world_from_eye() * (motion.drive * DVec3::new(1.0, 1.0, ahead)) * step;
            }
            Mode::Orbit { focus } => self.orbit(site, focus, motion, fast * dt),
            Mode::Walk => {
                let level = View::turned(self.yaw, 0.0, 0.0);
                self.eye += level * (motion.drive * DVec3::new(1.0, 0.0, -1.0)) * step;
            }
        }
        if self.mode == Mode::Walk || self.eye != before.eye {
            self.clamp_to_terrain(site);
        }
        let is_finite = self.eye.is_finite() && self.width.is_none_or(f64::is_finite);
        if !(is_finite && self.yaw.is_finite() && self.pitch.is_finite() && self.factor.is_finite()) {
            *self = before;
        }
    }

    fn turn(&mut self, degrees: DVec2) {
        if degrees != DVec2::ZERO {
            self.yaw = (self.yaw + degrees.x).rem_euclid(360.0);
            self.pitch = (self.pitch - degrees.y).clamp(-89.9, 89.9);
        }
    }

    /// Changes the width of an orthographic image, within the range that shows terrain. A larger width given at the
    /// start is kept until it is changed.
    fn zoom(&mut self, site: &Site, motion: &Motion, dt: f64) {
        let Some(width) = self.width else { return };
        let (narrowest, widest) = (NARROWEST * site.scale(), 2.0 * site.reach());
        let wider = (-motion.drive.z * dt).exp() * NOTCH.powf(motion.wheel);
        self.width = Some((width * wider).clamp(narrowest.min(width), widest.max(width)));
    }

    fn orbit(&mut self, site: &Site, focus: DVec3, motion: &Motion, dt: f64) {
        const DEGREES_A_SECOND: f64 = 45.0;
        self.turn(DVec2::new(-motion.drive.x, motion.drive.y) * DEGREES_A_SECOND * dt);
        let closer = match self.width {
            Some(_) => 1.0,
            None => (-motion.drive.z * dt).exp() * NOTCH.powf(motion.wheel),
        };
        let distance = (self.eye.distance(focus) * closer).clamp(CLOSEST * site.scale(), site.reach());
        self.roll = 0.0;
        self.eye = focus - self.forward() * distance;
    }

    fn forward(&self) -> DVec3 {
        -self.world_from_eye().z_axis
    }

    /// Keeps the eye near the terrain and above it.
    fn clamp_to_terrain(&mut self, site: &Site) {
        let margin = if self.mode == Mode::Walk { 0.0 } else { site.reach() };
        self.eye = site.within(self.eye, margin);
        let ground = site.ground(self.eye);
        self.eye.y = match self.mode {
            Mode::Walk => ground + EYE_HEIGHT * site.scale(),
            _ => self.eye.y.clamp(ground + CLEARANCE * site.scale(), ground + 2.0 * site.reach()),
        };
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::height::{Field, Holes, Samples};
    use crate::view::{Metric, Tolerance};

    fn site() -> Site {
        scaled([33, 17], 1.0)
    }

    /// Returns rough terrain with samples 30 m × 20 m apart, up to 100 m high, multiplied by a scale.
    fn scaled(size: [u32; 2], scale: f64) -> Site {
        let heights: Vec<_> = (0..size[0] * size[1]).map(|k| ((k * 37) % 101) as f32 * scale as f32).collect();
        let holes = Holes::none(heights.len());
        Site::new(&Arc::new(Field::new(Samples::F32(heights), size, [30.0 * scale, 20.0 * scale], holes)))
    }

    fn camera(yaw: f64, pitch: f64, roll: f64) -> Camera {
        Camera::of(&View {
            eye: DVec3::new(300.0, 400.0, 500.0),
            world_from_eye: View::turned(yaw, pitch, roll),
            lens: Lens::Perspective { fov_x: 1.0 },
            size: [320, 200],
            near: 0.1,
            tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
            time_s: 0.0,
        })
    }

    #[test]
    fn a_camera_keeps_the_rotation_of_its_view() {
        for [yaw, pitch, roll] in [[10.0, -20.0, 30.0], [-170.0, 89.0, -80.0], [0.0, -90.0, 0.0]] {
            let difference = camera(yaw, pitch, roll).world_from_eye() - View::turned(yaw, pitch, roll);
            assert!(difference.to_cols_array().iter().all(|v| v.abs() < 1e-9), "{yaw} {pitch} {roll}");
        }
    }

    /// Extreme and non-finite inputs, as from a broken clock, key or mouse.
    #[test]
    fn any_input_keeps_the_eye_finite_and_above_the_terrain() {
        let site = site();
        let strange = [0.0, 1.0, -1.0, 1e-300, 1e9, f64::MAX, f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
        for mode in 0..3 {
            let mut camera = camera(30.0, -40.0, 0.0);
            (0..mode).for_each(|_| camera.next_mode(&site));
            for k in 0..20_000usize {
                let pick = |n: usize| strange[((k * 2654435761) >> n) % strange.len()];
                let motion = Motion {
                    drive: DVec3::new(pick(1), pick(3), pick(5)),
                    fast: k % 7 == 0,
                    turn: DVec2::new(pick(7), pick(9)),
                    wheel: pick(11),
                };
                camera.advance(&site, &motion, pick(13));
                assert!(camera.eye.is_finite() && camera.speed(&site).is_finite(), "{camera:?} after {motion:?}");
                assert!(camera.world_from_eye().is_finite(), "{camera:?}");
                assert!(camera.above_ground(&site) >= 0.999, "{camera:?}");
                if k % 100 == 0 {
                    let far = |n| if pick(n).is_finite() { pick(n).clamp(-1e12, 1e12) } else { 0.0 };
                    camera.eye = DVec3::new(far(2), far(4).abs() + 1e3, far(6));
                }
            }
        }
    }

    #[test]
    fn long_pauses_are_clamped_and_zero_time_does_not_move() {
        let site = site();
        let ahead = Motion { drive: DVec3::Z, ..Motion::default() };
        let mut still = camera(0.0, 0.0, 0.0);
        still.advance(&site, &ahead, 0.0);
        assert_eq!(still.eye, camera(0.0, 0.0, 0.0).eye);
        let (mut pause, mut step) = (still, still);
        pause.advance(&site, &ahead, 3600.0);
        step.advance(&site, &ahead, LONGEST_STEP);
        assert_eq!(pause.eye, step.eye);
        assert!(step.eye.x > still.eye.x);
    }

    #[test]
    fn walking_stays_on_the_ground_and_inside_the_field() {
        let site = site();
        let mut camera = camera(45.0, 0.0, 0.0);
        camera.next_mode(&site);
        camera.next_mode(&site);
        for _ in 0..5000 {
            camera.advance(&site, &Motion { drive: DVec3::Z, fast: true, ..Motion::default() }, 0.05);
            assert!((camera.above_ground(&site) - EYE_HEIGHT).abs() < 1e-9);
        }
        assert_eq!((camera.eye.x, camera.eye.z), (960.0, 320.0));
    }

    #[test]
    fn an_orbit_keeps_its_distance_and_faces_its_focus() {
        let site = site();
        let mut camera = camera(-90.0, -30.0, 0.0);
        camera.next_mode(&site);
        let Mode::Orbit { focus } = camera.mode else { panic!("orbit comes after fly") };
        let distance = camera.eye.distance(focus);
        for _ in 0..100 {
            camera.advance(&site, &Motion { drive: DVec3::X, ..Motion::default() }, 0.05);
            assert!((camera.eye.distance(focus) - distance).abs() < 1e-6);
            assert!((camera.forward() - (focus - camera.eye) / distance).length() < 1e-9);
        }
    }

    /// The default view of the command line: all of the terrain from the south and above.
    fn whole(site: &Site, lens: Lens) -> View {
        let back = DVec3::new(0.35, 0.6, 1.0).normalize_or(DVec3::Y);
        let eye = site.middle() + back * (1.5 * site.diagonal());
        let near = default_near(eye.y, site.diagonal());
        View { eye, world_from_eye: View::looking_along(-back), lens, near, size: [320, 200], ..start() }
    }

    fn start() -> View {
        let lens = Lens::Perspective { fov_x: 1.0 };
        let tolerance = Tolerance { px: 1.0, metric: Metric::Certified };
        let (eye, world_from_eye) = (DVec3::ZERO, DMat3::IDENTITY);
        View { eye, world_from_eye, lens, size: [320, 200], near: 0.1, tolerance, time_s: 0.0 }
    }

    const SCALES: [f64; 9] = [1e-7, 1e-5, 1e-4, 1e-3, 0.03, 1.0, 30.0, 1e4, 1e6];

    /// From millimetres to thousands of kilometres between samples, and the smallest field: every mode moves the eye
    /// and keeps it above the ground.
    #[test]
    fn every_mode_works_on_terrain_of_any_scale() {
        for (size, scale) in SCALES.iter().flat_map(|&scale| [([33, 17], scale), ([2, 2], scale)]) {
            let site = scaled(size, scale);
            for mode in 0..3 {
                let start = whole(&site, Lens::Perspective { fov_x: 1.0 });
                let mut camera = Camera::of(&start);
                (0..mode).for_each(|_| camera.next_mode(&site));
                let before = camera;
                for drive in [DVec3::Z, DVec3::X, DVec3::Y, DVec3::NEG_Z] {
                    (0..30).for_each(|_| camera.advance(&site, &Motion { drive, ..Motion::default() }, 0.02));
                    let view = camera.view(&site, &start, None);
                    let above = camera.above_ground(&site);
                    assert!(above > 0.0 && view.near < above, "{scale} {size:?} {mode}: {above} m, near {}", view.near);
                }
                let moved = camera.eye.distance(before.eye) / site.diagonal();
                // Walking covers a tiny share of a continent.
                let min = if mode == 2 { 1e-9 } else { 1e-3 };
                assert!(moved > min && moved < 10.0, "{scale} {size:?} {mode}: {moved} diagonals");
            }
        }
    }

    /// Motion and near plane scale with the model.
    #[test]
    fn motion_scales_with_small_models() {
        let flown = |scale: f64| {
            let site = scaled([33, 17], scale);
            let start = whole(&site, Lens::Perspective { fov_x: 1.0 });
            let mut camera = Camera::of(&start);
            let mut seen = Vec::new();
            for mode in 0..3 {
                for drive in [DVec3::new(0.3, 0.1, 1.0), DVec3::NEG_X] {
                    (0..40).for_each(|_| camera.advance(&site, &Motion { drive, ..Motion::default() }, 0.05));
                    seen.push((camera.eye / scale, camera.view(&site, &start, None).near / scale, mode));
                }
                camera.next_mode(&site);
            }
            seen
        };
        let models = [1e-2, 1e-4, 1e-6].map(flown);
        for (k, (eye, near, mode)) in models[0].iter().enumerate() {
            for other in &models[1..] {
                let apart = other[k].0.distance(*eye);
                assert!(apart < 1.0 && (other[k].1 / near - 1.0).abs() < 1e-2, "mode {mode}: {apart} m apart");
            }
        }
    }

    /// Holding a key for any time keeps terrain in the image and between near and far plane.
    #[test]
    fn an_orthographic_view_keeps_the_terrain_in_view() {
        for scale in SCALES {
            let site = scaled([33, 17], scale);
            let start = whole(&site, Lens::Orthographic { width: site.diagonal(), far: 1.0 });
            let middle = site.middle();
            for mode in 0..2 {
                for drive in [DVec3::Z, DVec3::NEG_Z] {
                    let mut camera = Camera::of(&start);
                    (0..mode).for_each(|_| camera.next_mode(&site));
                    for _ in 0..600 {
                        camera.advance(&site, &Motion { drive, fast: true, ..Motion::default() }, 0.05);
                        let view = camera.view(&site, &start, None);
                        let at = view.project(middle).expect("beyond the near plane");
                        let Lens::Orthographic { width, far } = view.lens else { panic!("it stays orthographic") };
                        assert!(view.in_picture(&at) && at.depth < far, "{scale} {mode} {drive}: {at:?} of {far} m");
                        assert!(width <= 5.0 * site.diagonal(), "{width} m wide");
                    }
                    let Some(width) = camera.width() else { panic!("it stays orthographic") };
                    assert!(if drive.z > 0.0 { width < 0.1 * site.diagonal() } else { width > site.diagonal() });
                }
            }
        }
    }

    #[test]
    fn wheel_and_keys_change_an_orthographic_width() {
        let site = site();
        let start = whole(&site, Lens::Orthographic { width: 1500.0, far: 1.0 });
        for mode in 0..3 {
            let mut camera = Camera::of(&start);
            (0..mode).for_each(|_| camera.next_mode(&site));
            let (eye, speed) = (camera.eye, camera.speed(&site));
            camera.advance(&site, &Motion { wheel: 2.0, ..Motion::default() }, 0.05);
            let width = camera.width().unwrap();
            assert!((width - 1500.0 * NOTCH * NOTCH).abs() < 1e-9, "mode {mode}");
            assert!(camera.eye.distance(eye) < 1e-9, "the eye stays");
            assert_eq!(mode == 0, camera.speed(&site) < speed, "flight slows down with the width");
            camera.advance(&site, &Motion { drive: DVec3::Z, ..Motion::default() }, 0.05);
            assert_eq!(camera.width().unwrap() < width, mode < 2, "walking does not zoom");
        }
        // Sideways speed depends on the width, not on the height.
        let mut camera = Camera::of(&start);
        let eye = camera.eye;
        camera.advance(&site, &Motion { drive: DVec3::X, ..Motion::default() }, 0.05);
        assert!((camera.eye.distance(eye) - 1500.0 * FLIGHT_PER_HEIGHT * 0.05).abs() < 1e-6);
        // A width beyond the terrain is kept until it is changed.
        let wide = whole(&site, Lens::Orthographic { width: 1e9, far: 1.0 });
        let mut camera = Camera::of(&wide);
        camera.advance(&site, &Motion { drive: DVec3::X, ..Motion::default() }, 0.05);
        assert_eq!(camera.width(), Some(1e9));
        camera.advance(&site, &Motion { wheel: 1.0, ..Motion::default() }, 0.05);
        assert_eq!(camera.width(), Some(NOTCH * 1e9));
    }

    #[test]
    fn an_explicit_near_plane_is_kept() {
        let site = scaled([33, 17], 1e-4);
        let camera = Camera::of(&start());
        assert_eq!(camera.view(&site, &start(), Some(0.5)).near, 0.5);
        assert!(camera.view(&site, &start(), None).near < 1e-3);
    }
}
