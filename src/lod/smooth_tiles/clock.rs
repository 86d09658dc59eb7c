//! Advances morphs from frame to frame: by time, by frames, or by the viewer's movement (Larsen & Christensen, §2.3).

use crate::view::{Lens, View};

use super::levels;

/// Seconds in which a tile morphs by one level; the same as Hoppe's geomorphs (1998).
const LEVEL_S: f64 = 1.0;

/// Frames in which a tile morphs by one level: half a second at 60 frames a second.
const LEVEL_FRAMES: f64 = 30.0;

/// Distance that the viewer moves while a tile morphs by one level, as a part of the distance to the tile. A rotation
/// by the view's whole angle counts as one level. So does doubling the magnification or halving the tolerance.
const LEVEL_DISTANCE: f64 = 0.25;

/// Minimum step, in levels or in tile sides. Smaller steps accumulate until they reach it.
const MIN: f64 = 1.0 / 1024.0;

/// Source that advances morphs.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Drive {
    /// None: levels change at once.
    AtOnce,
    /// The scene's time, seconds.
    Time,
    /// The number of frames.
    Frames,
    /// The viewer's movement. Levels are constant while the view is.
    Speed,
}

/// Morph clock of one terrain.
pub struct Clock {
    drive: Drive,
    /// Side of a tile, metres.
    side_m: f64,
    last: Option<View>,
    /// Accumulated step below the minimum.
    rest: Step,
}

/// Amount by which morphs advance in a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Step {
    /// Levels, for all tiles.
    pub levels: f64,
    /// Distance the viewer moved, metres. Nearer tiles advance more by it.
    pub moved_m: f64,
}

impl Step {
    const NONE: Step = Step { levels: 0.0, moved_m: 0.0 };
    /// Unlimited: morphs end at once.
    pub const AT_ONCE: Step = Step { levels: f64::INFINITY, moved_m: 0.0 };

    /// Returns the step of a tile at this distance from the eye, in units of [`levels::ONE`].
    pub fn at(&self, distance_m: f64) -> u32 {
        levels::fixed(self.levels + self.moved_m / (LEVEL_DISTANCE * distance_m))
    }
}

impl Clock {
    /// Creates a clock without a last view. `side_m` is the length of a tile's side, metres.
    pub fn new(drive: Drive, side_m: f64) -> Self {
        Self { drive, side_m, last: None, rest: Step::NONE }
    }

    /// Returns the source that advances morphs.
    pub fn drive(&self) -> Drive {
        self.drive
    }

    /// Returns the step from the last view to this one. The first step is unlimited.
    pub fn step(&mut self, view: &View) -> Step {
        let Some(last) = self.last.replace(*view) else { return Step::AT_ONCE };
        let Step { levels, moved_m } = match self.drive {
            Drive::AtOnce => Step::AT_ONCE,
            Drive::Time => Step { levels: (view.time_s - last.time_s) / LEVEL_S, moved_m: 0.0 },
            Drive::Frames => Step { levels: 1.0 / LEVEL_FRAMES, moved_m: 0.0 },
            Drive::Speed => movement(&last, view),
        };
        // Negative and NaN time steps count as zero.
        self.rest = Step { levels: self.rest.levels + levels.max(0.0), moved_m: self.rest.moved_m + moved_m };
        let released = |rest: &mut f64, min: f64| if *rest < min { 0.0 } else { std::mem::take(rest) };
        let Step { levels, moved_m } = &mut self.rest;
        Step { levels: released(levels, MIN), moved_m: released(moved_m, MIN * self.side_m) }
    }
}

/// Returns the step for the viewer's movement between two views.
fn movement(from: &View, to: &View) -> Step {
    // The chord: precise for small angles, which arc cosines are not.
    let turned = [0, 1, 2].map(|k| from.world_from_eye.col(k).distance(to.world_from_eye.col(k)));
    let turned = turned.into_iter().fold(0.0, f64::max) / breadth(to);
    let scale = |view: &View| view.focal_px() / view.tolerance.px.max(f64::MIN_POSITIVE);
    let scaled = (scale(to) / scale(from)).log2().abs();
    let is_other = from.tolerance.metric != to.tolerance.metric
        || std::mem::discriminant(&from.lens) != std::mem::discriminant(&to.lens);
    let levels = if is_other { f64::INFINITY } else { turned + scaled };
    Step { levels, moved_m: from.eye.distance(to.eye) }
}

/// Returns the view's horizontal angle, radians; 1 for an orthographic view.
fn breadth(view: &View) -> f64 {
    match view.lens {
        Lens::Perspective { fov_x } => fov_x.max(1e-3),
        Lens::Orthographic { .. } => 1.0,
    }
}

#[cfg(test)]
mod tests {
    use super::levels::ONE;
    use super::*;
    use crate::view::{Metric, Tolerance};
    use glam::DVec3;

    fn view(eye: DVec3, yaw: f64, time_s: f64) -> View {
        View {
            eye,
            world_from_eye: View::turned(yaw, -10.0, 0.0),
            lens: Lens::Perspective { fov_x: 1.0 },
            size: [320, 200],
            near: 0.1,
            tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
            time_s,
        }
    }

    fn clock(drive: Drive) -> Clock {
        let mut clock = Clock::new(drive, 100.0);
        assert_eq!(clock.step(&view(DVec3::ZERO, 0.0, 5.0)).at(1e9), u32::MAX, "at first, at once");
        clock
    }

    /// Steps the clock for a tile 200 m away.
    fn step(clock: &mut Clock, view: &View) -> u32 {
        clock.step(view).at(200.0)
    }

    #[test]
    fn time_clock_handles_zero_large_and_negative_steps() {
        let mut clock = clock(Drive::Time);
        let mut at = |time_s| step(&mut clock, &view(DVec3::X * 1e9, 90.0, time_s));
        assert_eq!(at(5.0), 0);
        assert_eq!(at(5.0 + 0.25 * LEVEL_S), ONE / 4);
        assert_eq!(at(3.0), 0, "back");
        assert_eq!(at(1e300), u32::MAX, "a leap");
        assert_eq!(at(f64::NAN), 0);
        assert_eq!(at(7.0), 0);
    }

    #[test]
    fn small_steps_add_up() {
        let mut time = clock(Drive::Time);
        let after = |k: u32| f64::from(k) / 3e6;
        let sum: u32 = (1..=3_000_000).map(|k| step(&mut time, &view(DVec3::ZERO, 0.0, 5.0 + after(k)))).sum();
        assert!(sum.abs_diff(ONE) < ONE / 50, "{sum} of {ONE}");
        let mut speed = clock(Drive::Speed);
        let sum: u32 = (1..=3_000_000).map(|k| step(&mut speed, &view(DVec3::Z * 50.0 * after(k), 0.0, 5.0))).sum();
        assert!(sum.abs_diff(ONE) < ONE / 50, "{sum} of {ONE}");
    }

    #[test]
    fn speed_clock_stops_while_the_view_is_constant() {
        let mut clock = clock(Drive::Speed);
        let mut at = |view: &View| step(&mut clock, view);
        assert_eq!(at(&view(DVec3::ZERO, 0.0, 1e9)), 0);
        assert_eq!(at(&view(DVec3::Z * 25.0, 0.0, 1e9)), ONE / 2);
        let turned = at(&view(DVec3::Z * 25.0, 9.0, 1e9));
        assert!(turned > ONE / 10 && turned < ONE / 4, "{turned}");
        let nearer = View { lens: Lens::Perspective { fov_x: 0.2 }, ..view(DVec3::Z * 25.0, 9.0, 1e9) };
        assert!(at(&nearer) > 2 * ONE);
        let finer = View { tolerance: Tolerance { px: 0.5, metric: Metric::Certified }, ..nearer };
        assert_eq!(at(&finer), ONE);
        assert_eq!(at(&View { eye: DVec3::X * 1e12, ..finer }), u32::MAX, "a teleport");
        assert_eq!(at(&View { lens: Lens::Orthographic { width: 9.0, far: 9.0 }, ..finer }), u32::MAX, "another lens");
    }

    #[test]
    fn frame_clock_is_independent_of_the_view() {
        let mut clock = clock(Drive::Frames);
        let sum: u32 = (0..30).map(|_| step(&mut clock, &view(DVec3::ZERO, 0.0, 5.0))).sum();
        assert!(sum.abs_diff(ONE) <= 30, "{sum}");
    }
}
