//! The camera paths `circle`, `skim`, `corner`, `spin`, `zoom`, `dive`, `hover` and `teleport`. Their lengths scale
//! with the field, so that they work on fields of any size. [`PATHS`](super::PATHS) describes each.

use std::f64::consts::TAU;

use glam::DVec3;

use super::ground::Ground;
use super::pose::{Opening, Pose};

/// Default field of view.
const OPENING: Opening = Opening::Horizontal(60.0);
/// Wide horizontal field of view, degrees.
const WIDE: f64 = 90.0;
/// Narrow horizontal field of view, degrees.
const NARROW: f64 = 3.0;

/// Returns the parameter of each frame on an open path: 0 at the first frame, 1 at the last.
pub(super) fn along(frames: usize) -> impl Iterator<Item = f64> {
    (0..frames).map(move |k| if frames > 1 { k as f64 / (frames - 1) as f64 } else { 0.0 })
}

/// Returns the parameter of each frame on a closed path: 0 at the first frame, 1 one step after the last.
fn around(frames: usize) -> impl Iterator<Item = f64> {
    (0..frames).map(move |k| k as f64 / frames as f64)
}

/// Returns the point `clearance` metres above the ground at a world position (x, z).
fn above(ground: &Ground, at: [f64; 2], clearance: f64) -> DVec3 {
    DVec3::new(at[0], ground.height(at) + clearance, at[1])
}

/// Returns heading (0 = east, 90 = south) and pitch of a direction, degrees.
pub(super) fn angles(direction: DVec3) -> (f64, f64) {
    let level = direction.x.hypot(direction.z);
    (direction.z.atan2(direction.x).to_degrees(), direction.y.atan2(level).to_degrees())
}

pub fn circle(ground: &Ground, frames: usize) -> Vec<Pose> {
    let radius = 0.3;
    let pose = |turn: f64| {
        let (sin, cos) = (TAU * turn).sin_cos();
        let at = ground.place(0.5 + radius * cos, 0.5 + radius * sin);
        let tangent = angles(DVec3::new(-sin, 0.0, cos)).0;
        Pose { eye: above(ground, at, ground.altitude()), yaw: tangent + 25.0, pitch: -12.0, opening: OPENING }
    };
    around(frames).map(pose).collect()
}

pub fn skim(ground: &Ground, frames: usize) -> Vec<Pose> {
    let pose = |t: f64| {
        let at = ground.place(0.1 + 0.8 * t, 0.5);
        Pose { eye: above(ground, at, ground.eye_height()), yaw: 0.0, pitch: -2.0, opening: OPENING }
    };
    along(frames).map(pose).collect()
}

pub fn corner(ground: &Ground, frames: usize) -> Vec<Pose> {
    let at = |t: f64| ground.place(0.02 + 0.94 * t, 0.02 + 0.94 * t);
    let top = (0..=256).map(|k| ground.height(at(f64::from(k) / 256.0))).fold(f64::NEG_INFINITY, f64::max);
    let way = (at(1.0)[0] - at(0.0)[0], at(1.0)[1] - at(0.0)[1]);
    let yaw = angles(DVec3::new(way.0, 0.0, way.1)).0;
    let pose = |t: f64| {
        let [x, z] = at(t);
        // The ground may be higher between the examined points.
        let y = (top + ground.altitude()).max(ground.height([x, z]) + ground.eye_height());
        Pose { eye: DVec3::new(x, y, z), yaw, pitch: -20.0 - 40.0 * t, opening: OPENING }
    };
    along(frames).map(pose).collect()
}

pub fn spin(ground: &Ground, frames: usize) -> Vec<Pose> {
    let eye = above(ground, ground.place(0.5, 0.5), ground.altitude());
    let opening = Opening::Horizontal(WIDE);
    around(frames).map(|turn| Pose { eye, yaw: 360.0 * turn, pitch: -10.0, opening }).collect()
}

/// Zooms in on the summit from the corner farthest from it.
pub fn zoom(ground: &Ground, frames: usize) -> Vec<Pose> {
    let summit = ground.summit();
    let distance = |at: &[f64; 2]| (at[0] - summit[0]).hypot(at[1] - summit[1]);
    let corners = [[0.05, 0.05], [0.95, 0.05], [0.05, 0.95], [0.95, 0.95]].map(|[u, v]| ground.place(u, v));
    let from = corners.into_iter().max_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(summit);
    let eye = above(ground, from, ground.altitude());
    let (yaw, pitch) = angles(above(ground, summit, 0.0) - eye);
    let pose = |t: f64| {
        let opening = Opening::Horizontal(WIDE * (NARROW / WIDE).powf(t));
        Pose { eye, yaw, pitch, opening }
    };
    along(frames).map(pose).collect()
}

pub fn dive(ground: &Ground, frames: usize) -> Vec<Pose> {
    let at = ground.place(0.5, 0.6);
    let (high, low) = (ground.extent(), ground.eye_height());
    let pose = |t: f64| {
        let eye = above(ground, at, high * (low / high).powf(t));
        Pose { eye, yaw: -90.0, pitch: -75.0 + 70.0 * t, opening: OPENING }
    };
    along(frames).map(pose).collect()
}

/// Moves back and forth along the view five times, by a tenth of the altitude. A level of detail that switches within
/// this distance switches ten times.
pub fn hover(ground: &Ground, frames: usize) -> Vec<Pose> {
    let start = above(ground, ground.place(0.4, 0.5), ground.altitude());
    let pose = |t: f64| {
        let sway = 0.1 * ground.altitude() * (5.0 * TAU * t).sin();
        let eye = start + DVec3::new(sway, 0.0, 0.0);
        Pose { eye, yaw: 0.0, pitch: -25.0, opening: OPENING }
    };
    around(frames).map(|t| lifted(ground, pose(t))).collect()
}

/// Raises a pose to eye height if it is lower.
fn lifted(ground: &Ground, mut pose: Pose) -> Pose {
    let floor = ground.height([pose.eye.x, pose.eye.z]) + ground.eye_height();
    pose.eye.y = pose.eye.y.max(floor);
    pose
}

/// Chooses a random position in every frame, at a log-uniform height above ground. The eye looks at a random point in
/// the inner half of the field.
pub fn teleport(ground: &Ground, frames: usize) -> Vec<Pose> {
    let mut random = Random(1);
    let pose = |_: usize| {
        let at = ground.place(0.02 + 0.96 * random.next(), 0.02 + 0.96 * random.next());
        let (low, high) = (ground.eye_height(), ground.extent() / 2.0);
        let eye = above(ground, at, low * (high / low).powf(random.next()));
        let target = ground.place(0.25 + 0.5 * random.next(), 0.25 + 0.5 * random.next());
        let (yaw, pitch) = angles(above(ground, target, 0.0) - eye);
        Pose { eye, yaw, pitch, opening: OPENING }
    };
    (0..frames).map(pose).collect()
}

/// SplitMix64 random numbers (Steele, Lea and Flood, "Fast splittable pseudorandom number generators", 2014). They are
/// implemented here so that paths never change.
struct Random(u64);

impl Random {
    /// Returns a number in [0, 1).
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
    }
}
