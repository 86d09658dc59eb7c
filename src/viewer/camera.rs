//! The camera: flies, circles a point, or walks. Its position stays finite and near the terrain for every input.

use glam::{DMat3, DVec2, DVec3};

use super::site::Site;
use crate::view::{Lens, View, default_near};

/// Height of a walker's eyes, metres.
const EYE_HEIGHT: f64 = 1.7;
/// The closest that a flight comes to the ground, metres.
const CLEARANCE: f64 = 1.0;
/// The closest that an orbit comes to its focus, metres.
const CLOSEST: f64 = 2.0;
/// A flight is at least as fast as at this height, metres.
const LOWEST: f64 = 5.0;
/// The longest step, seconds: after a pause the camera does not leap.
const LONGEST_STEP: f64 = 0.1;
/// A flight covers this many times its height above ground in a second, or the width of an orthographic picture.
const FLIGHT_PER_HEIGHT: f64 = 0.7;
/// A walk, metres a second: brisk.
const WALK: f64 = 6.0;
/// What `fast` multiplies.
const FAST: f64 = 6.0;
/// The factor on a distance or a width that one notch of the wheel makes.
const NOTCH: f64 = 0.85;
/// The smallest width of an orthographic picture, metres.
const NARROWEST: f64 = 1e-3;

/// How the camera moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Mode {
    /// Along its own axes.
    Fly,
    /// Around a point.
    Orbit {
        /// The point.
        focus: DVec3,
    },
    /// On the ground.
    Walk,
}

/// What the user wants in one frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Motion {
    /// Right, up, forward; −1 to 1 each.
    pub drive: DVec3,
    /// Much faster.
    pub fast: bool,
    /// Turn right and down, degrees.
    pub turn: DVec2,
    /// Notches of the wheel, away from the user positive.
    pub wheel: f64,
}

/// Where the eye is and how it moves. Lengths of a person are times [`Site::scale`].
#[derive(Clone, Copy, Debug)]
pub struct Camera {
    /// Position, world metres.
    pub eye: DVec3,
    /// How it moves.
    pub mode: Mode,
    yaw: f64,
    pitch: f64,
    roll: f64,
    /// The wheel's share in the speed.
    factor: f64,
    /// Width of an orthographic picture, metres.
    width: Option<f64>,
}

impl Camera {
    /// The camera of a view.
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

    /// The rotation of a view.
    pub fn world_from_eye(&self) -> DMat3 {
        View::turned(self.yaw, self.pitch, self.roll)
    }

    /// A view with this eye, its near plane where `near` or the height above ground says. An orthographic one is as
    /// wide as the camera says, and its far plane lies beyond all terrain.
    pub fn seen(&self, site: &Site, start: &View, near: Option<f64>) -> View {
        let near = near.unwrap_or_else(|| default_near(self.above_ground(site), site.diagonal()));
        let lens = match self.width {
            Some(width) => Lens::Orthographic { width, far: near + 2.0 * site.farthest(self.eye) },
            None => start.lens,
        };
        View { eye: self.eye, world_from_eye: self.world_from_eye(), lens, near, ..*start }
    }

    /// Width of the picture, metres, if it is orthographic.
    pub fn width(&self) -> Option<f64> {
        self.width
    }

    /// The name of the way it moves.
    pub fn mode_name(&self) -> &'static str {
        match self.mode {
            Mode::Fly => "fly",
            Mode::Orbit { .. } => "orbit",
            Mode::Walk => "walk",
        }
    }

    /// Height above the ground, or above the field's edge nearest to it, metres.
    pub fn above_ground(&self, site: &Site) -> f64 {
        self.eye.y - site.ground(self.eye)
    }

    /// Metres a second.
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

    /// Goes over to the next way to move.
    pub fn next_mode(&mut self, site: &Site) {
        self.factor = 1.0;
        self.mode = match self.mode {
            Mode::Fly => Mode::Orbit { focus: site.looked_at(self.eye, self.forward()) },
            Mode::Orbit { .. } => Mode::Walk,
            Mode::Walk => Mode::Fly,
        };
        if self.mode == Mode::Walk {
            (self.pitch, self.roll) = (self.pitch.clamp(-10.0, 10.0), 0.0);
        }
        self.settle(site);
    }

    /// Moves for `dt` seconds.
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
                // Along parallel rays nothing comes closer: there the width changes instead.
                let ahead = if self.width.is_some() { 0.0 } else { -1.0 };
                self.eye += self.world_from_eye() * (motion.drive * DVec3::new(1.0, 1.0, ahead)) * step;
            }
            Mode::Orbit { focus } => self.circle(site, focus, motion, fast * dt),
            Mode::Walk => {
                let level = View::turned(self.yaw, 0.0, 0.0);
                self.eye += level * (motion.drive * DVec3::new(1.0, 0.0, -1.0)) * step;
            }
        }
        if self.mode == Mode::Walk || self.eye != before.eye {
            self.settle(site);
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

    /// Makes an orthographic picture narrower or wider, within what shows some terrain. A width beyond that, given at
    /// the start, stays until it is changed.
    fn zoom(&mut self, site: &Site, motion: &Motion, dt: f64) {
        let Some(width) = self.width else { return };
        let (narrowest, widest) = (NARROWEST * site.scale(), 2.0 * site.reach());
        let wider = (-motion.drive.z * dt).exp() * NOTCH.powf(motion.wheel);
        self.width = Some((width * wider).clamp(narrowest.min(width), widest.max(width)));
    }

    fn circle(&mut self, site: &Site, focus: DVec3, motion: &Motion, dt: f64) {
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
    fn settle(&mut self, site: &Site) {
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

    /// Hills 30 m and 20 m apart and up to 100 m high, all of it times a scale.
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
    fn it_looks_where_the_view_looked() {
        for [yaw, pitch, roll] in [[10.0, -20.0, 30.0], [-170.0, 89.0, -80.0], [0.0, -90.0, 0.0]] {
            let difference = camera(yaw, pitch, roll).world_from_eye() - View::turned(yaw, pitch, roll);
            assert!(difference.to_cols_array().iter().all(|v| v.abs() < 1e-9), "{yaw} {pitch} {roll}");
        }
    }

    /// Anything a broken clock, a stuck key or a mad mouse may send.
    #[test]
    fn it_stays_finite_and_above_the_terrain() {
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
    fn a_pause_is_no_leap_and_no_time_is_no_move() {
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
    fn a_walker_stays_on_the_ground_and_on_the_field() {
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
    fn an_orbit_keeps_its_distance_and_its_focus_in_the_middle() {
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

    /// A view of all of a terrain from the south and above, as the command line makes it where nothing is given.
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

    /// Millimetres or thousands of kilometres between samples, and the smallest field: every way to move shows terrain,
    /// moves, and keeps the eye above the ground.
    #[test]
    fn it_moves_on_terrain_of_any_size() {
        for (size, scale) in SCALES.iter().flat_map(|&scale| [([33, 17], scale), ([2, 2], scale)]) {
            let site = scaled(size, scale);
            for mode in 0..3 {
                let start = whole(&site, Lens::Perspective { fov_x: 1.0 });
                let mut camera = Camera::of(&start);
                (0..mode).for_each(|_| camera.next_mode(&site));
                let before = camera;
                for drive in [DVec3::Z, DVec3::X, DVec3::Y, DVec3::NEG_Z] {
                    (0..30).for_each(|_| camera.advance(&site, &Motion { drive, ..Motion::default() }, 0.02));
                    let view = camera.seen(&site, &start, None);
                    let above = camera.above_ground(&site);
                    assert!(above > 0.0 && view.near < above, "{scale} {size:?} {mode}: {above} m, near {}", view.near);
                }
                let moved = camera.eye.distance(before.eye) / site.diagonal();
                // A person on a continent does not come far.
                let min = if mode == 2 { 1e-9 } else { 1e-3 };
                assert!(moved > min && moved < 10.0, "{scale} {size:?} {mode}: {moved} diagonals");
            }
        }
    }

    /// Models that are smaller alike look alike, to the near plane.
    #[test]
    fn small_models_are_flown_over_alike() {
        let flown = |scale: f64| {
            let site = scaled([33, 17], scale);
            let start = whole(&site, Lens::Perspective { fov_x: 1.0 });
            let mut camera = Camera::of(&start);
            let mut seen = Vec::new();
            for mode in 0..3 {
                for drive in [DVec3::new(0.3, 0.1, 1.0), DVec3::NEG_X] {
                    (0..40).for_each(|_| camera.advance(&site, &Motion { drive, ..Motion::default() }, 0.05));
                    seen.push((camera.eye / scale, camera.seen(&site, &start, None).near / scale, mode));
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

    /// Whichever key is held and however long, an orthographic view keeps terrain in its picture and between its planes.
    #[test]
    fn an_orthographic_view_keeps_the_terrain_in_sight() {
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
                        let view = camera.seen(&site, &start, None);
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
    fn the_wheel_and_the_keys_change_an_orthographic_width() {
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
            assert_eq!(mode == 0, camera.speed(&site) < speed, "what is seen closer is flown over slower");
            camera.advance(&site, &Motion { drive: DVec3::Z, ..Motion::default() }, 0.05);
            assert_eq!(camera.width().unwrap() < width, mode < 2, "a walker walks");
        }
        // Aside it moves by its width, however high it is.
        let mut camera = Camera::of(&start);
        let eye = camera.eye;
        camera.advance(&site, &Motion { drive: DVec3::X, ..Motion::default() }, 0.05);
        assert!((camera.eye.distance(eye) - 1500.0 * FLIGHT_PER_HEIGHT * 0.05).abs() < 1e-6);
        // Given wider than the terrain, it stays as wide until it is changed.
        let wide = whole(&site, Lens::Orthographic { width: 1e9, far: 1.0 });
        let mut camera = Camera::of(&wide);
        camera.advance(&site, &Motion { drive: DVec3::X, ..Motion::default() }, 0.05);
        assert_eq!(camera.width(), Some(1e9));
        camera.advance(&site, &Motion { wheel: 1.0, ..Motion::default() }, 0.05);
        assert_eq!(camera.width(), Some(NOTCH * 1e9));
    }

    #[test]
    fn a_near_plane_that_is_given_stays() {
        let site = scaled([33, 17], 1e-4);
        let camera = Camera::of(&start());
        assert_eq!(camera.seen(&site, &start(), Some(0.5)).near, 0.5);
        assert!(camera.seen(&site, &start(), None).near < 1e-3);
    }
}
