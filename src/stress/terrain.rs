//! Checks a field from several views: invariants, screen error and validity of all numbers.

use std::sync::Arc;

use super::Finding;
use super::forms::TechniqueConfig;
use super::invariants::{INVARIANTS, SLACK, Subject, TOLERANCES_PX, Violation};
use crate::draw::expand;
use crate::draw::layout::Frame;
use crate::draw::weights::{FINER, ONE, Weights};
use crate::draw::{DrawList, Instance};
use crate::height::Field;
use crate::lod::Technique;
use crate::measure::geometric;
use crate::view::View;

/// A field with views.
pub struct StressTerrain {
    /// The field.
    pub field: Arc<Field>,
    /// Names and views.
    pub views: Vec<(&'static str, View)>,
}

/// Checks a technique on a terrain against every invariant.
pub fn examine(terrain: &StressTerrain, config: &TechniqueConfig) -> Vec<Finding> {
    let mut technique = match config.entry.prepare(&terrain.field, &config.settings) {
        Ok(technique) => technique,
        Err(why) => return vec![Finding::reported("refused with a reason", 1.0).with_reason(Some(why))],
    };
    let mut subject = Subject {
        field: &terrain.field,
        technique: &mut *technique,
        views: &terrain.views,
        tolerances_px: &TOLERANCES_PX,
        time_s: 0.0,
    };
    let invariants = INVARIANTS.iter().filter(|invariant| invariant.is_for(config.entry.name));
    let mut findings: Vec<_> =
        invariants.map(|invariant| Finding::holds(invariant.name, (invariant.check)(&mut subject))).collect();
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

/// Checks that every number that reaches a vertex is finite and not subnormal, and that instance weights are in [0,
/// 1].
pub fn all_numbers(field: &Field, technique: &dyn Technique, view: &View, list: &DrawList) -> Result<(), String> {
    if let Some(instance) = list.instances.iter().find(|instance| !has_weights(instance)) {
        return Err(format!("{:x?} of the instance at {:?}", instance.weights(), instance.origin));
    }
    let frame = Frame::placing(field, view).with_fractions(list.fraction_bits);
    let mut wrong = None;
    expand::visit_triangles(field, &frame, technique.resident(), list, |triangle| {
        for corner in triangle.corners {
            let relative = crate::draw::place::relative_position(&frame, [corner.x, corner.z], corner.y);
            if !relative.into_iter().chain([corner.y]).all(is_zero_or_normal) {
                wrong = Some(format!("corner ({}, {}) is drawn at {relative:?}", corner.x, corner.z));
            }
        }
    });
    wrong.map_or(Ok(()), Err)
}

fn is_zero_or_normal(number: f32) -> bool {
    number == 0.0 || number.is_normal()
}

/// Returns true if the weight bytes of an instance are in [0, 1], those of its sides in [0, 2], without flags.
fn has_weights(instance: &Instance) -> bool {
    let all = |word: u32, max: u32| word.to_le_bytes().into_iter().all(|byte| u32::from(byte) <= max);
    let unflagged = |word: u32| word & !(0x0101_0101 * FINER);
    match instance.weights() {
        Weights::Slots(w) => {
            all(w.first_sides, 2 * ONE)
                && all(w.last_sides, 2 * ONE)
                && all(unflagged(w.inside), ONE)
                && all(unflagged(w.seams), ONE)
        }
        Weights::Skirts(w) => all(unflagged(w.inside), ONE) && w.depth_m >= 0.0 && w.depth_m.is_finite(),
        Weights::Distance(_) => true,
    }
}
