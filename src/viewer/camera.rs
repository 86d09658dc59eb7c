//! The camera: flies, circles a point, or walks. Whatever comes in, its position stays finite and near the land.

use glam::{DMat3, DVec2, DVec3};

use crate::height::Field;
use crate::view::View;

/// Height of a walker's eyes, metres.
const EYE_HEIGHT: f64 = 1.7;
/// The closest that a flight comes to the ground, metres.
const CLEARANCE: f64 = 1.0;
/// The longest step, seconds: after a pause the camera does not leap.
const LONGEST_STEP: f64 = 0.1;
/// A flight covers this many times its height above ground in a second.
const FLIGHT_PER_HEIGHT: f64 = 0.7;
/// A walk, metres a second: brisk.
const WALK: f64 = 6.0;
/// What `fast` multiplies.
const FAST: f64 = 6.0;

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

/// Where the eye is and how it moves.
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
}

impl Camera {
    /// The camera of a view.
    pub fn of(view: &View) -> Self {
        let forward = view.forward();
        let yaw = forward.z.atan2(forward.x).to_degrees();
        let pitch = forward.y.clamp(-1.0, 1.0).asin().to_degrees();
        let rolled = View::turned(yaw, pitch, 0.0).transpose() * view.world_from_eye;
        let roll = (-rolled.x_axis.y).atan2(rolled.x_axis.x).to_degrees();
        Self { eye: view.eye, mode: Mode::Fly, yaw, pitch, roll, factor: 1.0 }
    }

    /// The rotation of a view.
    pub fn world_from_eye(&self) -> DMat3 {
        View::turned(self.yaw, self.pitch, self.roll)
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
    pub fn above_ground(&self, field: &Field) -> f64 {
        self.eye.y - ground(field, self.eye)
    }

    /// Metres a second.
    pub fn speed(&self, field: &Field) -> f64 {
        self.factor
            * match self.mode {
                Mode::Fly => self.above_ground(field).abs().max(5.0) * FLIGHT_PER_HEIGHT,
                Mode::Orbit { focus } => self.eye.distance(focus),
                Mode::Walk => WALK,
            }
    }

    /// Goes over to the next way to move.
    pub fn next_mode(&mut self, field: &Field) {
        self.factor = 1.0;
        self.mode = match self.mode {
            Mode::Fly => Mode::Orbit { focus: looked_at(field, self.eye, self.forward()) },
            Mode::Orbit { .. } => Mode::Walk,
            Mode::Walk => Mode::Fly,
        };
        if self.mode == Mode::Walk {
            (self.pitch, self.roll) = (self.pitch.clamp(-10.0, 10.0), 0.0);
        }
        self.settle(field);
    }

    /// Moves for `dt` seconds.
    pub fn advance(&mut self, field: &Field, motion: &Motion, dt: f64) {
        let before = *self;
        let dt = if dt.is_finite() { dt.clamp(0.0, LONGEST_STEP) } else { 0.0 };
        let notch = if matches!(self.mode, Mode::Orbit { .. }) { 1.0 } else { 1.2f64.powf(motion.wheel) };
        self.factor = (self.factor * notch).clamp(1e-3, 1e3);
        let step = dt * self.speed(field) * if motion.fast { FAST } else { 1.0 };
        self.turn(motion.turn);
        match self.mode {
            Mode::Fly => self.eye += self.world_from_eye() * (motion.drive * DVec3::new(1.0, 1.0, -1.0)) * step,
            Mode::Orbit { focus } => self.circle(field, focus, motion, dt),
            Mode::Walk => {
                let level = View::turned(self.yaw, 0.0, 0.0);
                self.eye += level * (motion.drive * DVec3::new(1.0, 0.0, -1.0)) * step;
            }
        }
        if self.mode == Mode::Walk || self.eye != before.eye {
            self.settle(field);
        }
        if !(self.eye.is_finite() && self.yaw.is_finite() && self.pitch.is_finite() && self.factor.is_finite()) {
            *self = before;
        }
    }

    fn turn(&mut self, degrees: DVec2) {
        if degrees != DVec2::ZERO {
            self.yaw = (self.yaw + degrees.x).rem_euclid(360.0);
            self.pitch = (self.pitch - degrees.y).clamp(-89.9, 89.9);
        }
    }

    fn circle(&mut self, field: &Field, focus: DVec3, motion: &Motion, dt: f64) {
        const DEGREES_A_SECOND: f64 = 45.0;
        let drive = motion.drive * if motion.fast { FAST } else { 1.0 };
        self.turn(DVec2::new(-drive.x, drive.y) * DEGREES_A_SECOND * dt);
        let closer = (-drive.z * dt).exp() * 0.85f64.powf(motion.wheel);
        let distance = (self.eye.distance(focus) * closer).clamp(2.0, reach(field));
        self.roll = 0.0;
        self.eye = focus - self.forward() * distance;
    }

    fn forward(&self) -> DVec3 {
        -self.world_from_eye().z_axis
    }

    /// Keeps the eye near the land and above it.
    fn settle(&mut self, field: &Field) {
        let (low, high) = plan(field);
        let margin = if self.mode == Mode::Walk { 0.0 } else { reach(field) };
        self.eye.x = self.eye.x.clamp(low.x - margin, high.x + margin);
        self.eye.z = self.eye.z.clamp(low.y - margin, high.y + margin);
        let ground = ground(field, self.eye);
        self.eye.y = match self.mode {
            Mode::Walk => ground + EYE_HEIGHT,
            _ => self.eye.y.clamp(ground + CLEARANCE, ground + 2.0 * reach(field)),
        };
    }
}

/// North-west and south-east corner of the field (x, z), metres.
fn plan(field: &Field) -> (DVec2, DVec2) {
    let [w, h] = field.size().map(|n| f64::from(n - 1));
    let at = |i, j| field.world_at(i, j, 0.0);
    (DVec2::new(at(0.0, 0.0).x, at(0.0, 0.0).z), DVec2::new(at(w, h).x, at(w, h).z))
}

/// How far one may go from the land, metres: twice its diagonal.
fn reach(field: &Field) -> f64 {
    let (low, high) = plan(field);
    2.0 * low.distance(high)
}

/// Height of the ground below, of the nearest edge outside the field, of what fills them over holes.
fn ground(field: &Field, at: DVec3) -> f64 {
    let (low, high) = plan(field);
    let (x, z) = (at.x.clamp(low.x, high.x), at.z.clamp(low.y, high.y));
    field.height_at(x, z).unwrap_or_else(|| {
        let nearest = |at: f64, low: f64, spacing: f64, count: u32| {
            ((at - low) / spacing).round().clamp(0.0, f64::from(count - 1)) as u32
        };
        let i = nearest(x, low.x, field.spacing[0], field.size()[0]);
        let j = nearest(z, low.y, field.spacing[1], field.size()[1]);
        f64::from(field.height(i, j))
    })
}

/// The land that a ray meets, else the middle of the field.
fn looked_at(field: &Field, eye: DVec3, forward: DVec3) -> DVec3 {
    let mut at = eye;
    for _ in 0..512 {
        let above = field.height_at(at.x, at.z).map_or(f64::INFINITY, |height| at.y - height);
        if above <= 0.0 {
            return at;
        }
        // Slopes of the land and of the ray are seldom steeper than this step allows for.
        at += forward * (above.min(at.distance(eye).max(1.0)) * 0.25).max(0.25);
        if at.distance(eye) > 2.0 * reach(field) {
            break;
        }
    }
    let (low, high) = plan(field);
    let centre = (low + high) / 2.0;
    let middle = DVec3::new(centre.x, 0.0, centre.y);
    DVec3 { y: ground(field, middle), ..middle }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::{Holes, Samples};
    use crate::view::{Lens, Metric, Tolerance};

    fn field() -> Field {
        let heights = (0..33 * 17).map(|k| ((k * 37) % 101) as f32).collect();
        Field::new(Samples::F32(heights), [33, 17], [30.0, 20.0], Holes::none(33 * 17))
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
    fn it_stays_finite_and_above_the_land() {
        let field = field();
        let strange = [0.0, 1.0, -1.0, 1e-300, 1e9, f64::MAX, f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
        for mode in 0..3 {
            let mut camera = camera(30.0, -40.0, 0.0);
            (0..mode).for_each(|_| camera.next_mode(&field));
            for k in 0..20_000usize {
                let pick = |n: usize| strange[((k * 2654435761) >> n) % strange.len()];
                let motion = Motion {
                    drive: DVec3::new(pick(1), pick(3), pick(5)),
                    fast: k % 7 == 0,
                    turn: DVec2::new(pick(7), pick(9)),
                    wheel: pick(11),
                };
                camera.advance(&field, &motion, pick(13));
                assert!(camera.eye.is_finite() && camera.speed(&field).is_finite(), "{camera:?} after {motion:?}");
                assert!(camera.world_from_eye().is_finite(), "{camera:?}");
                assert!(camera.above_ground(&field) >= 0.999, "{camera:?}");
                if k % 100 == 0 {
                    let far = |n| if pick(n).is_finite() { pick(n).clamp(-1e12, 1e12) } else { 0.0 };
                    camera.eye = DVec3::new(far(2), far(4).abs() + 1e3, far(6));
                }
            }
        }
    }

    #[test]
    fn a_pause_is_no_leap_and_no_time_is_no_move() {
        let field = field();
        let ahead = Motion { drive: DVec3::Z, ..Motion::default() };
        let mut still = camera(0.0, 0.0, 0.0);
        still.advance(&field, &ahead, 0.0);
        assert_eq!(still.eye, camera(0.0, 0.0, 0.0).eye);
        let (mut pause, mut step) = (still, still);
        pause.advance(&field, &ahead, 3600.0);
        step.advance(&field, &ahead, LONGEST_STEP);
        assert_eq!(pause.eye, step.eye);
        assert!(step.eye.x > still.eye.x);
    }

    #[test]
    fn a_walker_stays_on_the_ground_and_on_the_field() {
        let field = field();
        let mut camera = camera(45.0, 0.0, 0.0);
        camera.next_mode(&field);
        camera.next_mode(&field);
        for _ in 0..5000 {
            camera.advance(&field, &Motion { drive: DVec3::Z, fast: true, ..Motion::default() }, 0.05);
            assert!((camera.above_ground(&field) - EYE_HEIGHT).abs() < 1e-9);
        }
        assert_eq!((camera.eye.x, camera.eye.z), (960.0, 320.0));
    }

    #[test]
    fn an_orbit_keeps_its_distance_and_its_focus_in_the_middle() {
        let field = field();
        let mut camera = camera(-90.0, -30.0, 0.0);
        camera.next_mode(&field);
        let Mode::Orbit { focus } = camera.mode else { panic!("orbit comes after fly") };
        let distance = camera.eye.distance(focus);
        for _ in 0..100 {
            camera.advance(&field, &Motion { drive: DVec3::X, ..Motion::default() }, 0.05);
            assert!((camera.eye.distance(focus) - distance).abs() < 1e-6);
            assert!((camera.forward() - (focus - camera.eye) / distance).length() < 1e-9);
        }
    }
}
