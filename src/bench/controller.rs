//! The tolerance of each frame of a benchmark path.

use super::goal::Goal;
use super::rows::Case;
use crate::lod::budget::{Controller, RANGE_PX};
use crate::view::{Tolerance, View};

/// Sets the tolerance of each frame of a flight: the case's own, or what holds its goal.
pub struct ToleranceController {
    tolerance: Tolerance,
    budget: Option<(Goal, Controller)>,
}

impl ToleranceController {
    /// Before the first frame.
    pub fn new(case: &Case) -> Self {
        let controller = |goal: Goal| (goal, Controller::new(goal.target(), case.tolerance_px, RANGE_PX));
        Self { tolerance: case.tolerance(), budget: case.goal.map(controller) }
    }

    /// The next frame's view.
    pub fn view(&self, view: &View) -> View {
        let px = self.budget.as_ref().map_or(self.tolerance.px, |(_, controller)| controller.tolerance_px());
        View { tolerance: Tolerance { px, ..self.tolerance }, ..*view }
    }

    /// Takes what a frame cost that was drawn for a view.
    pub fn learn(&mut self, view: &View, triangles: u64, frame_ms: f64) {
        if let Some((goal, controller)) = &mut self.budget {
            controller.learn(view.tolerance.px, goal.cost(triangles, frame_ms));
        }
    }
}
