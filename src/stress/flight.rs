//! A flight over a field: every frame must be one surface within its tolerance, however time passes.

use std::sync::Arc;

use super::case::Flight;
use super::finding::Finding;
use super::forms::TechniqueConfig;
use super::invariants::{SLACK, Violation};
use super::numbers::all_numbers;
use crate::draw::DrawList;
use crate::height::Field;
use crate::lod::Technique;
use crate::measure::{geometric, watertight};
use crate::view::View;

/// Flies with a technique and checks every frame.
pub fn examine(flight: &Flight, config: &TechniqueConfig) -> Vec<Finding> {
    let mut technique = (config.entry.build)(Arc::clone(&flight.field), &config.settings);
    let mut check = FrameChecks { surface: Ok(()), numbers: Ok(()), error: 0.0, worst: None, pending: 0 };
    for view in &flight.views {
        let mut list = DrawList::default();
        technique.select(view, &mut list);
        check.frame(&flight.field, &*technique, view, &list);
    }
    check.findings()
}

/// Results of the frames so far.
struct FrameChecks {
    surface: Result<(), Violation>,
    numbers: Result<(), Violation>,
    /// Largest screen error relative to the tolerance.
    error: f64,
    /// The frame with the largest error.
    worst: Option<Violation>,
    /// Frames that draw coarser data than required because finer data is pending.
    pending: usize,
}

impl FrameChecks {
    fn frame(&mut self, field: &Field, technique: &dyn Technique, view: &View, list: &DrawList) {
        let violation = |why: String| Violation::new(("a frame", *view), why);
        let (seams, resident) = (technique.pipeline_requirements().seams, technique.resident());
        let proof = watertight::prove_list(field, view, seams, resident, list);
        let proof = proof.map(|_| ()).map_err(|why| violation(why.to_string()));
        self.surface = std::mem::replace(&mut self.surface, Ok(())).and(proof);
        let numbers = all_numbers(field, technique, view, list).map_err(violation);
        self.numbers = std::mem::replace(&mut self.numbers, Ok(())).and(numbers);
        self.pending += usize::from(list.pending > 0);
        if technique.keeps_tolerance() && list.pending == 0 {
            let errors = geometric::errors(field, view, resident, list);
            let share = errors.screen_px.max / view.tolerance.px;
            if share.is_nan() || share > self.error {
                let why = format!("{} px of {} at {:?}", errors.screen_px.max, view.tolerance.px, errors.screen_at);
                (self.error, self.worst) = (share, Some(violation(why)));
            }
        }
    }

    fn findings(self) -> Vec<Finding> {
        let error = Finding::within("screen error, tolerances", self.error, 1.0 + SLACK);
        let violation = if error.passes() { None } else { self.worst };
        vec![
            Finding::holds("one surface in every frame", self.surface),
            Finding { violation, ..error },
            Finding::holds("no NaN, no subnormal, weights in [0, 1]", self.numbers),
            Finding::reported("frames with pending data", self.pending as f64),
        ]
    }
}
