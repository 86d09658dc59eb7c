//! Chooses the tolerance of each frame on a benchmark path.

use super::goal::Goal;
use super::rows::Case;
use crate::lod::budget::{Controller, RANGE_PX};
use crate::view::{Tolerance, View};

/// Chooses the tolerance of each frame on a path. It is constant, or adjusted to reach the case's goal if it has one.
pub struct ToleranceController {
    tolerance: Tolerance,
    budget: Option<(Goal, Controller)>,
}

impl ToleranceController {
    /// Creates the controller for a path of this case. The first frame has the case's tolerance.
    pub fn new(case: &Case) -> Self {
        let controller = |goal: Goal| (goal, Controller::new(goal.target(), case.tolerance_px, RANGE_PX));
        Self { tolerance: case.tolerance(), budget: case.goal.map(controller) }
    }

    /// Returns the view with the tolerance for the next frame.
    pub fn view(&self, view: &View) -> View {
        let px = self.budget.as_ref().map_or(self.tolerance.px, |(_, controller)| controller.tolerance_px());
        View { tolerance: Tolerance { px, ..self.tolerance }, ..*view }
    }

    /// Adjusts the tolerance to the cost of a frame. `view` is the view, with its tolerance, that was drawn.
    pub fn learn(&mut self, view: &View, triangles: u64, frame_ms: f64) {
        if let Some((goal, controller)) = &mut self.budget {
            controller.learn(view.tolerance.px, goal.cost(triangles, frame_ms));
        }
    }
}
