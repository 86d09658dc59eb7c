//! Checks a field from several views: invariants, screen error and validity of all numbers.

use super::case::StressTerrain;
use super::finding::Finding;
use super::forms::TechniqueConfig;
use super::invariants::{SLACK, Subject, Violation};
use super::numbers::all_numbers;
use crate::measure::geometric;

/// Checks a technique on a terrain against every invariant.
pub fn examine(terrain: &StressTerrain, config: &TechniqueConfig) -> Vec<Finding> {
    let mut technique = match config.entry.prepare(&terrain.field, &config.settings) {
        Ok(technique) => technique,
        Err(why) => return vec![Finding::reported("refused with a reason", 1.0).with_reason(Some(why))],
    };
    let mut subject = Subject::new(&terrain.field, &mut *technique, &terrain.views);
    let mut findings = Finding::of_invariants(&mut subject, config.entry.name);
    findings.extend(error_and_numbers(&mut subject));
    findings
}

/// Returns the largest screen error relative to the tolerance, and the check of all numbers.
fn error_and_numbers(subject: &mut Subject) -> Vec<Finding> {
    let (mut error, mut at, mut numbers) = (0.0, None, Ok(()));
    for &named in subject.views {
        let (_, view) = named;
        let Ok(list) = subject.select(&view) else { continue };
        if subject.technique.keeps_tolerance() {
            let errors = geometric::errors(subject.field, &view, subject.technique.resident(), &list);
            let share = errors.screen_px.max / view.tolerance.px;
            if share.is_nan() || share > error {
                let why = format!("{} px of {} at {:?}", errors.screen_px.max, view.tolerance.px, errors.screen_at);
                (error, at) = (share, Some(Violation::new(named, why)));
            }
        }
        let fine = all_numbers(subject.field, subject.technique, &view, &list);
        numbers = numbers.and(fine.map_err(|why| Violation::new(named, why)));
    }
    let error = Finding::within("screen error, tolerances", error, 1.0 + SLACK);
    let at = if error.passes() { None } else { at };
    vec![Finding { violation: at, ..error }, Finding::holds("no NaN, no subnormal, weights in [0, 1]", numbers)]
}
