//! Target cost of every frame on a path, and how well the frames met it.

use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::sample::FrameSample;
use super::statistics::{Spread, middle};
use crate::lod::budget::Target;
use crate::measure::extended;

/// Largest relative deviation of a frame's cost from its target that still meets the target.
const BAND: f64 = 0.05;

/// Target cost of every frame. The budget controller adjusts the tolerance to reach it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum Goal {
    /// Triangles per frame.
    Triangles(f64),
    /// Milliseconds per frame, from the start of selection until the device has finished.
    FrameMs(f64),
}

impl Goal {
    /// Returns the target of the budget controller.
    pub fn target(self) -> Target {
        match self {
            Goal::Triangles(count) => Target::Triangles(count),
            Goal::FrameMs(ms) => Target::FrameMs(ms),
        }
    }

    /// Returns the cost of a frame in the goal's unit: its triangles or its milliseconds.
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

/// Deviation of the frames of a path from their goal. A frame meets the goal if its cost is within 5 % of it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = extended::non_negative)]
pub struct BudgetStats {
    /// Share of all frames that meet the goal, 0 to 1.
    #[schemars(range(max = 1.0))]
    pub within: f64,
    /// Number of frames before the first one that meets the goal.
    pub settling_frames: f64,
    /// Share of the frames from the first one that meets the goal on, 0 to 1; 0 if no frame meets it.
    #[schemars(range(max = 1.0))]
    pub settled: f64,
    /// Largest cost among those frames, divided by the goal.
    pub max: f64,
    /// Tolerances of all frames, pixels.
    pub tolerance_px: Spread,
}

impl BudgetStats {
    /// Evaluates the frames of a path.
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

    /// Returns the median of each value over the rounds; `None` without rounds.
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
