//! The paths on which other renderers were measured: a straight line of 1500 samples, once near the ground and once
//! above all land. Lengths are in samples of the x axis; a field below 2049 samples gets a shorter line.

use glam::DVec3;

use super::ground::Ground;
use super::pose::{Opening, Pose};

/// Ends of the line, samples.
const FROM: [f64; 2] = [300.0, 300.0];
const TO: [f64; 2] = [1500.0, 1200.0];
/// Samples along a side of the field that the line was made for.
const SIDE: f64 = 2049.0;
/// Reach of the window that smooths the ground, and how far it looks beyond the ends, samples.
const REACH: usize = 48;
const BEYOND: f64 = 120.0;
/// Above the smoothed ground, and above all land, samples.
const CLEARANCE: f64 = 6.0;
const HIGH: f64 = 420.0;
/// Largest height of the field that the line was made for, samples.
const RELIEF: f64 = 400.0;
const OPENING: Opening = Opening::Vertical(45.0);

/// The line over one field.
struct Line<'a> {
    ground: &'a Ground<'a>,
    from: [f64; 2],
    direction: [f64; 2],
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

    /// Position, in samples, `t` samples from the start.
    fn at(&self, t: f64) -> [f64; 2] {
        [0, 1].map(|k| self.from[k] + self.direction[k] * t)
    }

    /// Its length over that of the line it was made after.
    fn scale(&self) -> f64 {
        self.length / (TO[0] - FROM[0]).hypot(TO[1] - FROM[1])
    }

    /// Metres per sample of the x axis.
    fn unit(&self) -> f64 {
        self.ground.field.spacing[0]
    }

    /// A height at every sample from `BEYOND` before the start to as far behind the end: the mean over the window of
    /// the largest ground over the window, and the clearance.
    fn profile(&self) -> Vec<f64> {
        let count = (self.length + 2.0 * BEYOND).ceil() as usize;
        let ground: Vec<f64> = (0..count).map(|k| self.ground.height_of_sample(self.at(k as f64 - BEYOND))).collect();
        let window = |k: usize| k.saturating_sub(REACH)..(k + REACH + 1).min(count);
        let largest = |k: usize| ground[window(k)].iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let largest: Vec<f64> = (0..count).map(largest).collect();
        let mean = |k: usize| largest[window(k)].iter().sum::<f64>() / window(k).len() as f64;
        (0..count).map(|k| mean(k) + CLEARANCE * self.unit()).collect()
    }

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

/// Linear between the whole steps of a profile.
fn interpolate(profile: &[f64], t: f64) -> f64 {
    let at = (t + BEYOND).clamp(0.0, (profile.len() - 1) as f64);
    let low = (at as usize).min(profile.len() - 2);
    profile[low] + (profile[low + 1] - profile[low]) * (at - low as f64)
}

pub fn fly(ground: &Ground, frames: usize) -> Vec<Pose> {
    let line = Line::over(ground);
    let profile = line.profile();
    line.poses(frames, -8.0, |t| interpolate(&profile, t))
}

/// Above all land: at 420 samples over the field that the line was made for, and as far above the highest sample of any
/// other, or less far over a smaller one.
pub fn high(ground: &Ground, frames: usize) -> Vec<Pose> {
    let line = Line::over(ground);
    let [low, top] = ground.range;
    let is_peers = line.scale() == 1.0 && low >= 0.0 && top <= RELIEF * line.unit();
    let above = (HIGH - RELIEF) * line.unit() * line.scale();
    let height = if is_peers { HIGH * line.unit() } else { top + above };
    line.poses(frames, -35.0, |_| height)
}
