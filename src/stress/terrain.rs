//! A field looked at from views: the laws, the error in numbers, and the numbers themselves.

use std::sync::Arc;

use super::Finding;
use super::forms::Form;
use super::invariants::{INVARIANTS, SLACK, Subject, TOLERANCES_PX, Violation};
use crate::draw::expand;
use crate::draw::layout::Frame;
use crate::draw::weights::{FINER, ONE, Weights};
use crate::draw::{DrawList, Instance};
use crate::height::Field;
use crate::lod::Technique;
use crate::measure::geometric;
use crate::view::View;

/// A field and where it is looked at from.
pub struct StressTerrain {
    /// The field.
    pub field: Arc<Field>,
    /// Views and their names.
    pub views: Vec<(&'static str, View)>,
}

/// Holds a technique on a land against every law.
pub fn examine(terrain: &StressTerrain, form: &Form) -> Vec<Finding> {
    let mut technique = match form.entry.prepare(&terrain.field, &form.settings) {
        Ok(technique) => technique,
        Err(why) => return vec![Finding::reported("refused, saying why", 1.0).because(Some(why))],
    };
    let mut subject = Subject {
        field: &terrain.field,
        technique: &mut *technique,
        views: &terrain.views,
        tolerances_px: &TOLERANCES_PX,
        time_s: 0.0,
    };
    let invariants = INVARIANTS.iter().filter(|invariant| invariant.is_for(form.entry.name));
    let mut findings: Vec<_> =
        invariants.map(|invariant| Finding::holds(invariant.name, (invariant.check)(&mut subject))).collect();
    findings.extend(in_numbers(&mut subject));
    findings
}

/// The largest error of all views over the tolerance, and how many numbers are none.
fn in_numbers(subject: &mut Subject) -> Vec<Finding> {
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

/// Whether every number that reaches a vertex is one: finite, not subnormal, weights of instances in [0, 1].
pub fn all_numbers(field: &Field, technique: &dyn Technique, view: &View, list: &DrawList) -> Result<(), String> {
    if let Some(instance) = list.instances.iter().find(|instance| !has_weights(instance)) {
        return Err(format!("{:x?} of the instance at {:?}", instance.weights(), instance.origin));
    }
    let frame = Frame::placing(field, view).with_fractions(list.fraction_bits);
    let mut wrong = None;
    expand::visit_triangles(field, &frame, technique.resident(), list, |triangle| {
        for corner in triangle.corners {
            let relative = crate::draw::place::relative_position(&frame, [corner.x, corner.z], corner.y);
            if !relative.into_iter().chain([corner.y]).all(is_plain) {
                wrong = Some(format!("corner ({}, {}) is drawn at {relative:?}", corner.x, corner.z));
            }
        }
    });
    wrong.map_or(Ok(()), Err)
}

fn is_plain(number: f32) -> bool {
    number == 0.0 || number.is_normal()
}

/// True if an instance's weights are in [0, 1], on sides in [0, 2], flags left out.
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
