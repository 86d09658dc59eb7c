//! The camera paths `fly` and `high`, on which other terrain renderers were measured.
//!
//! Both follow one straight line of 1500 samples, `fly` near the ground and `high` above the highest ground. Lengths
//! are in units of the spacing along x. On fields with fewer than 2049 samples a side the line is shortened in
//! proportion.

use glam::DVec3;

use super::ground::Ground;
use super::pose::{Opening, Pose};

/// Start and end of the line (x, z), samples.
const FROM: [f64; 2] = [300.0, 300.0];
const TO: [f64; 2] = [1500.0, 1200.0];
/// Samples along a side of the field of the original protocol.
const SIDE: f64 = 2049.0;
/// Samples before and after a point over which the ground is smoothed.
const REACH: usize = 48;
/// Length by which the height profile extends beyond either end of the line, samples.
const BEYOND: f64 = 120.0;
/// Height of `fly` above the smoothed ground, samples.
const CLEARANCE: f64 = 6.0;
/// Height of `high` over the field of the original protocol, samples.
const HIGH: f64 = 420.0;
/// Greatest height of that field, samples.
const RELIEF: f64 = 400.0;
/// Field of view.
const OPENING: Opening = Opening::Vertical(45.0);

/// The line over one field.
struct Line<'a> {
    ground: &'a Ground<'a>,
    /// Start (x, z), samples.
    from: [f64; 2],
    /// Direction of flight (x, z), of length 1.
    direction: [f64; 2],
    /// Length, samples.
    length: f64,
}

impl<'a> Line<'a> {
    fn over(ground: &'a Ground) -> Self {
        let size = ground.field.size();
        let scale = [0, 1].map(|k| (f64::from(size[k] - 1) / (SIDE - 1.0)).min(1.0));
        let way = [0, 1].map(|k| (TO[k] - FROM[k]) * scale[k]);
        let length = way[0].hypot(way[1]);
        let from = [0, 1].map(|k| FROM[k] * scale[k]);
        Self { ground, from, direction: way.map(|w| w / length), length }
    }

    /// Returns the position (x, z), samples, at a distance of `t` samples from the start.
    fn at(&self, t: f64) -> [f64; 2] {
        [0, 1].map(|k| self.from[k] + self.direction[k] * t)
    }

    /// Returns the length of this line divided by that of the original protocol, at most 1.
    fn scale(&self) -> f64 {
        self.length / (TO[0] - FROM[0]).hypot(TO[1] - FROM[1])
    }

    /// Returns the unit of lengths: metres between samples along x.
    fn unit(&self) -> f64 {
        self.ground.field.spacing[0]
    }

    /// Returns the height of `fly`, metres, at every sample of the line, extended by [`BEYOND`] at both ends. It is a
    /// moving maximum of the ground, smoothed by a moving mean, plus [`CLEARANCE`].
    fn profile(&self) -> Vec<f64> {
        let count = (self.length + 2.0 * BEYOND).ceil() as usize;
        let ground: Vec<f64> = (0..count).map(|k| self.ground.height_of_sample(self.at(k as f64 - BEYOND))).collect();
        let window = |k: usize| k.saturating_sub(REACH)..(k + REACH + 1).min(count);
        let largest = |k: usize| ground[window(k)].iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let largest: Vec<f64> = (0..count).map(largest).collect();
        let mean = |k: usize| largest[window(k)].iter().sum::<f64>() / window(k).len() as f64;
        (0..count).map(|k| mean(k) + CLEARANCE * self.unit()).collect()
    }

    /// Returns poses at equal distances that look along the line. `height` maps a distance from the start, samples, to
    /// the height of the eye, metres; it is raised where it would come too close to the ground.
    fn poses(&self, frames: usize, pitch: f64, height: impl Fn(f64) -> f64) -> Vec<Pose> {
        let yaw = self.direction[1].atan2(self.direction[0]).to_degrees();
        let pose = |k: usize| {
            let t = self.length * k as f64 / (frames - 1).max(1) as f64;
            let [u, v] = self.at(t);
            let at = self.ground.field.world_at(u, v, 0.0);
            let floor = self.ground.height_of_sample([u, v]) + self.ground.near() * 2.0;
            Pose { eye: DVec3::new(at.x, height(t).max(floor), at.z), yaw, pitch, opening: OPENING }
        };
        (0..frames).map(pose).collect()
    }
}

/// Returns the height of a profile `t` samples from the start of the line, by linear interpolation.
fn interpolate(profile: &[f64], t: f64) -> f64 {
    let at = (t + BEYOND).clamp(0.0, (profile.len() - 1) as f64);
    let low = (at as usize).min(profile.len() - 2);
    profile[low] + (profile[low + 1] - profile[low]) * (at - low as f64)
}

/// Returns the poses of the path `fly`: above the smoothed ground, looking 8° down.
pub fn fly(ground: &Ground, frames: usize) -> Vec<Pose> {
    let line = Line::over(ground);
    let profile = line.profile();
    line.poses(frames, -8.0, |t| interpolate(&profile, t))
}

/// Returns the poses of the path `high`, looking 35° down. The height is 420 samples over a field like that of the
/// original protocol. Over other fields it is 20 samples above the highest one, or less on a shortened line.
pub fn high(ground: &Ground, frames: usize) -> Vec<Pose> {
    let line = Line::over(ground);
    let [low, top] = ground.range;
    let is_peers = line.scale() == 1.0 && low >= 0.0 && top <= RELIEF * line.unit();
    let above = (HIGH - RELIEF) * line.unit() * line.scale();
    let height = if is_peers { HIGH * line.unit() } else { top + above };
    line.poses(frames, -35.0, |_| height)
}
