//! Goals: a cost to hold along a path, and the deviation from it.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::sample::FrameSample;
use super::statistics::{Spread, middle};
use crate::lod::budget::Target;
use crate::measure::extended;

/// A frame whose cost is within this share of the target holds it.
const BAND: f64 = 0.05;

/// Cost that every frame is held at by moving the tolerance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Goal {
    /// Triangles.
    Triangles(f64),
    /// Milliseconds from the start of selection until the picture is done.
    FrameMs(f64),
}

impl Goal {
    /// For the controller.
    pub fn target(self) -> Target {
        match self {
            Goal::Triangles(count) => Target::Triangles(count),
            Goal::FrameMs(ms) => Target::FrameMs(ms),
        }
    }

    /// Returns the cost of a frame in the goal's unit.
    pub(super) fn cost(self, triangles: u64, frame_ms: f64) -> f64 {
        match self {
            Goal::Triangles(_) => triangles as f64,
            Goal::FrameMs(_) => frame_ms,
        }
    }
}

impl fmt::Display for Goal {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        match self {
            Goal::Triangles(count) => write!(f, "{count} triangles"),
            Goal::FrameMs(ms) => write!(f, "{ms} ms"),
        }
    }
}

/// Deviation from a goal along a path.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = extended::non_negative)]
pub struct BudgetStats {
    /// Share, 0 to 1, of the frames within 5 % of the goal.
    #[schemars(range(max = 1.0))]
    pub within: f64,
    /// Frames before the first one within it.
    pub settling_frames: f64,
    /// Share, 0 to 1, of the frames from that one on that are within it; 0 if there is none.
    #[schemars(range(max = 1.0))]
    pub settled: f64,
    /// Largest cost of a frame from that one on, divided by the goal.
    pub max: f64,
    /// Tolerances of the frames, pixels.
    pub tolerance_px: Spread,
}

impl BudgetStats {
    /// Of a path's frames.
    pub fn of(goal: Goal, frames: &[FrameSample]) -> Self {
        let costs: Vec<f64> =
            frames.iter().map(|frame| goal.cost(frame.triangles, frame.frame_ms) / goal.target().cost()).collect();
        let is_within = |cost: &&f64| (**cost - 1.0).abs() <= BAND;
        let share = |costs: &[f64]| costs.iter().filter(is_within).count() as f64 / costs.len().max(1) as f64;
        let first = costs.iter().position(|cost| is_within(&cost)).unwrap_or(costs.len());
        Self {
            within: share(&costs),
            settling_frames: first as f64,
            settled: share(&costs[first..]),
            max: costs[first..].iter().copied().fold(0.0, f64::max),
            tolerance_px: Spread::of(frames.iter().map(|frame| frame.tolerance_px)),
        }
    }

    /// The median of each value over the rounds; `None` if there is no round.
    pub fn median(rounds: &[BudgetStats]) -> Option<Self> {
        let over = |of: fn(&BudgetStats) -> f64| middle(rounds.iter().map(of));
        (!rounds.is_empty()).then(|| Self {
            within: over(|budget| budget.within),
            settling_frames: over(|budget| budget.settling_frames),
            settled: over(|budget| budget.settled),
            max: over(|budget| budget.max),
            tolerance_px: Spread {
                mean: over(|budget| budget.tolerance_px.mean),
                max: over(|budget| budget.tolerance_px.max),
            },
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_goal_is_held_from_the_first_frame_within_it() {
        let frame = |triangles: u64| FrameSample {
            triangles,
            tolerance_px: triangles as f64 / 100.0,
            ..FrameSample::default()
        };
        let frames = [300, 80, 96, 104, 110, 97].map(frame);
        let budget = BudgetStats::of(Goal::Triangles(100.0), &frames);
        assert_eq!((budget.within, budget.settling_frames, budget.settled, budget.max), (0.5, 2.0, 0.75, 1.1));
        assert_eq!(budget.tolerance_px.max, 3.0);
        let never = BudgetStats::of(Goal::Triangles(1000.0), &frames);
        assert_eq!((never.within, never.settling_frames, never.settled), (0.0, 6.0, 0.0));
    }
}
