//! Arithmetic: lists that are repeatable to the bit, and tolerances that only ever refine.

use std::sync::Arc;

use super::case::{Case, Kind};
use super::fields::hills;
use super::finding::Finding;
use super::forms::Form;
use super::invariants::{Subject, TOLERANCES_PX, Violation};
use super::views;
use crate::draw::DrawList;

/// The family `arithmetic`. That lists of one view are the same, that numbers are numbers and that weights are in [0, 1]
/// is a law or a check of every land.
pub const CASES: &[Case] = &[
    Case { family: "arithmetic", name: "two of a kind", kind: Kind::Each(two_of_a_kind) },
    Case { family: "arithmetic", name: "tolerances in steps of 1 %", kind: Kind::Each(fine_steps) },
];

/// Two techniques made alike draw alike, byte for byte, frame by frame: nothing depends on threads, addresses or what was
/// made before.
fn two_of_a_kind(form: &Form) -> Vec<Finding> {
    let field = Arc::new(hills([129, 97], [10.0; 2], 400.0));
    let mut both = [0, 1].map(|_| (form.entry.build)(Arc::clone(&field), &form.settings));
    let differs = views::views(&field).into_iter().find(|(_, view)| {
        let lists = both.each_mut().map(|technique| {
            let mut list = DrawList::default();
            technique.select(view, &mut list);
            bytes(&list)
        });
        lists[0] != lists[1]
    });
    let violation = differs.map(|view| Violation::new(view, "two techniques made alike draw two lists"));
    vec![Finding::holds("same frame twice, same bytes", violation.map_or(Ok(()), Err))]
}

/// All of a list that reaches the device.
fn bytes(list: &DrawList) -> Vec<u8> {
    let draws = list.draws.iter().flat_map(|draw| {
        let words = [draw.indices.start, draw.indices.end, draw.instances.start, draw.instances.end, draw.first_vertex];
        words.into_iter().flat_map(u32::to_le_bytes)
    });
    let mut bytes: Vec<u8> = draws.collect();
    bytes.extend_from_slice(bytemuck::cast_slice(&list.instances));
    bytes.extend_from_slice(bytemuck::cast_slice(&list.streamed.vertices));
    bytes.extend_from_slice(bytemuck::cast_slice(&list.streamed.indices));
    bytes
}

/// From 1/8 px to 16 px in steps of 1 %: a wider tolerance never draws more.
fn fine_steps(form: &Form) -> Vec<Finding> {
    const STEPS: i32 = 490;
    let field = hills([129, 97], [10.0; 2], 400.0);
    let mut technique = (form.entry.build)(Arc::new(field.clone()), &form.settings);
    let named = views::views(&field).swap_remove(2);
    let mut subject =
        Subject { field: &field, technique: &mut *technique, views: &[], tolerances_px: &TOLERANCES_PX, time_s: 0.0 };
    let mut before = u64::MAX;
    let mut worst: (f64, Option<Violation>) = (0.0, None);
    for px in (0..STEPS).map(|k| 0.125 * 1.01f64.powi(k)) {
        let view = views::with_tolerance(&named.1, px);
        let Ok(list) = subject.select(&view) else { continue };
        let more = list.triangles().saturating_sub(before) as f64;
        if more > worst.0 {
            let why = format!("{} triangles at {px} px, {before} at 1 % less", list.triangles());
            worst = (more, Some(Violation::new((named.0, view), why)));
        }
        before = list.triangles();
    }
    vec![Finding { violation: worst.1, ..Finding::within("triangles more at a wider tolerance", worst.0, 0.0) }]
}
