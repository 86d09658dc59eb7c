//! The named paths: pure functions of a field, a name and a number of frames. A frame stands for 1/60 s, so two runs
//! see the same views whatever the machine; a path is flown whole, however many frames it is cut into.

mod cave;
mod ground;
mod peers;
mod pose;
mod shapes;

use crate::height::Field;
use crate::view::{Tolerance, View};
use ground::Ground;

pub use pose::{Opening, Pose};

/// Time that a frame stands for, seconds.
pub const TIME_STEP_S: f64 = 1.0 / 60.0;

/// One line of [`PATHS`].
pub struct Path {
    /// Its name on the command line.
    pub name: &'static str,
    /// Description in one sentence.
    pub about: &'static str,
    poses: fn(&Ground, usize) -> Vec<Pose>,
}

/// Every path.
#[rustfmt::skip]
pub const PATHS: &[Path] = &[
    Path { name: "circle", about: "a circle 300 m above ground, looking along it and inwards", poses: shapes::circle },
    Path { name: "skim", about: "straight across at eye height", poses: shapes::skim },
    Path { name: "corner", about: "from corner to corner, 300 m above the highest ground of the way", poses: shapes::corner },
    Path { name: "spin", about: "one turn on the spot, 90 degrees wide", poses: shapes::spin },
    Path { name: "zoom", about: "from 90 degrees wide to 3, towards the summit", poses: shapes::zoom },
    Path { name: "dive", about: "from far above down to eye height", poses: shapes::dive },
    Path { name: "hover", about: "back and forth, so that every distance around crosses a switching threshold many times", poses: shapes::hover },
    Path { name: "teleport", about: "somewhere else in every frame, pseudo-random", poses: shapes::teleport },
    Path { name: "cave", about: "through a cave from end to end, along the widest way", poses: cave::cave },
    Path { name: "fly", about: "the peers' path near the ground", poses: peers::fly },
    Path { name: "high", about: "the peers' path above all land", poses: peers::high },
];

/// The path with this name.
pub fn find(name: &str) -> Option<&'static Path> {
    PATHS.iter().find(|path| path.name == name)
}

/// The near plane of every path over a field, metres.
pub fn near(field: &Field) -> f64 {
    Ground::of(field).near()
}

impl Path {
    /// The poses of the whole path in `frames` steps.
    pub fn poses(&self, field: &Field, frames: usize) -> Vec<Pose> {
        (self.poses)(&Ground::of(field), frames)
    }

    /// The views of the whole path in `frames` steps.
    pub fn views(&self, field: &Field, frames: usize, size: [u32; 2], tolerance: Tolerance) -> Vec<View> {
        views(&self.poses(field, frames), near(field), size, tolerance)
    }
}

/// A view a pose, the scene's time going on from frame to frame.
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

    /// From the smallest field to one as large as any, the latter a small one repeated.
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
