//! Named camera paths. A path depends only on the field and the number of frames, so that every machine draws the same
//! views. The number of frames divides the whole path into steps. Each frame stands for 1/60 s of scene time.

mod cave;
mod ground;
mod peers;
mod pose;
mod shapes;

use crate::height::Field;
use crate::view::{Tolerance, View};
use ground::Ground;

pub use pose::{Opening, Pose};

/// Scene time between two frames, seconds.
pub const TIME_STEP_S: f64 = 1.0 / 60.0;

/// A named camera path, one row of [`PATHS`].
pub struct Path {
    /// Name on the command line.
    pub name: &'static str,
    /// Description in a few words, for help texts.
    pub about: &'static str,
    /// Returns this many poses along the whole path.
    poses: fn(&Ground, usize) -> Vec<Pose>,
}

/// All paths.
#[rustfmt::skip]
pub const PATHS: &[Path] = &[
    Path { name: "circle", about: "a circle 300 m above ground, looking along it and inwards", poses: shapes::circle },
    Path { name: "skim", about: "straight across at eye height", poses: shapes::skim },
    Path { name: "corner", about: "from corner to corner, 300 m above the highest ground on the way", poses: shapes::corner },
    Path { name: "spin", about: "one full turn on the spot, 90 degrees wide", poses: shapes::spin },
    Path { name: "zoom", about: "zoom towards the summit, from 90 to 3 degrees wide", poses: shapes::zoom },
    Path { name: "dive", about: "from far above down to eye height", poses: shapes::dive },
    Path { name: "hover", about: "back and forth, so that levels of detail switch many times", poses: shapes::hover },
    Path { name: "teleport", about: "a pseudo-random position in every frame", poses: shapes::teleport },
    Path { name: "cave", about: "through a cave from end to end, along its widest passage", poses: cave::cave },
    Path { name: "fly", about: "straight and near the ground, as other renderers were measured", poses: peers::fly },
    Path { name: "high", about: "the same line above the highest ground", poses: peers::high },
];

/// Returns the path with this name.
pub fn find(name: &str) -> Option<&'static Path> {
    PATHS.iter().find(|path| path.name == name)
}

/// Returns the distance of the near plane for all paths over a field, metres.
pub fn near(field: &Field) -> f64 {
    Ground::of(field).near()
}

impl Path {
    /// Returns `frames` poses along the whole path.
    pub fn poses(&self, field: &Field, frames: usize) -> Vec<Pose> {
        (self.poses)(&Ground::of(field), frames)
    }

    /// Returns `frames` views along the whole path, for pictures of `size` (x, y) pixels.
    pub fn views(&self, field: &Field, frames: usize, size: [u32; 2], tolerance: Tolerance) -> Vec<View> {
        views(&self.poses(field, frames), near(field), size, tolerance)
    }
}

/// Returns one view per pose. Scene time advances by [`TIME_STEP_S`] from frame to frame. `near` is in metres, `size`
/// in pixels.
pub fn views(poses: &[Pose], near: f64, size: [u32; 2], tolerance: Tolerance) -> Vec<View> {
    let view =
        |(k, pose): (u32, &Pose)| View { time_s: f64::from(k) * TIME_STEP_S, ..pose.view(size, near, tolerance) };
    (0..).zip(poses).map(view).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::synth::{Kind, synth};
    use crate::view::Metric;

    /// Fields of extreme sizes: 2 × 2 samples, a 64 × 64 field repeated 128 × 128 times, a narrow one far from the
    /// origin, and one with a single spike.
    fn fields() -> Vec<Field> {
        let huge = synth(Kind::Fractal, [64, 64], 1).tiled([128, 128]);
        let mut flat = synth(Kind::Eroded, [300, 40], 5);
        (flat.spacing, flat.origin) = ([0.01, 0.5], [1e6, -3e5]);
        vec![synth(Kind::Ramp, [2, 2], 1), huge, flat, synth(Kind::Spike, [65, 33], 2)]
    }

    #[test]
    fn every_path_stays_over_every_field_and_above_its_ground() {
        for field in fields() {
            let ground = Ground::of(&field);
            let [low, high] = [[0.0; 2], [1.0; 2]].map(|[u, v]| ground.place(u, v));
            for path in PATHS {
                let poses = path.poses(&field, 48);
                assert_eq!(poses.len(), 48, "{}", path.name);
                for pose in poses {
                    let at = [pose.eye.x, pose.eye.z];
                    let over = (0..2).all(|k| (low[k]..=high[k]).contains(&at[k]));
                    assert!(over && pose.eye.y > ground.height(at), "{}: {pose:?} {:?}", path.name, field.size());
                }
            }
        }
    }

    #[test]
    fn every_path_moves_is_the_same_again_and_is_flown_whole_in_any_number_of_frames() {
        let field = synth(Kind::Fractal, [129, 129], 1);
        for path in PATHS {
            let poses = path.poses(&field, 60);
            assert_eq!(poses, path.poses(&field, 60), "{}", path.name);
            assert!(poses.iter().any(|pose| *pose != poses[0]), "{}", path.name);
            assert_eq!(path.poses(&field, 1).len(), 1, "{}", path.name);
            if !["teleport", "hover", "circle", "spin"].contains(&path.name) {
                let fewer = path.poses(&field, 20);
                assert_eq!((fewer[0], fewer[19]), (poses[0], poses[59]), "{}", path.name);
            }
        }
    }

    #[test]
    fn every_path_sees_terrain_in_every_frame() {
        let field = synth(Kind::Fractal, [129, 129], 1);
        let tolerance = Tolerance { px: 1.0, metric: Metric::Certified };
        for path in PATHS {
            for view in path.views(&field, 30, [160, 90], tolerance) {
                let seen = (0..129 * 129).any(|k| {
                    let at = view.project(field.world(k % 129, k / 129));
                    at.is_some_and(|at| view.in_picture(&at))
                });
                assert!(seen, "{}: {view:?}", path.name);
            }
        }
    }

    #[test]
    fn names_are_told_apart() {
        for path in PATHS {
            let found = PATHS.iter().filter(|other| other.name == path.name).count();
            assert_eq!((found, find(path.name).unwrap().about), (1, path.about));
        }
        assert!(find("cirle").is_none());
    }
}
