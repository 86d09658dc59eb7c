//! Checks the numbers of a draw list.

use crate::draw::expand;
use crate::draw::layout::Frame;
use crate::draw::place::relative_position;
use crate::draw::weights::{FINER, ONE, Weights};
use crate::draw::{DrawList, Instance};
use crate::height::Field;
use crate::lod::Technique;
use crate::view::View;

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
            let relative = relative_position(&frame, [corner.x, corner.z], corner.y);
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
