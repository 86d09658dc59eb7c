//! Arithmetic: lists that are reproducible to the bit, and tolerances that refine monotonically.

use std::sync::Arc;

use super::case::{Case, Kind};
use super::fields::hills;
use super::finding::Finding;
use super::forms::TechniqueConfig;
use super::invariants::{Subject, Violation};
use super::views;
use crate::draw::DrawList;

/// The family `arithmetic`. Determinism, finite numbers and weights in [0, 1] are checked on every terrain as well.
pub const CASES: &[Case] = &[
    Case { family: "arithmetic", name: "two instances of a technique", kind: Kind::PerTechnique(two_instances) },
    Case { family: "arithmetic", name: "tolerances in steps of 1 %", kind: Kind::PerTechnique(fine_steps) },
];

/// Two instances of a technique must draw equal lists, byte for byte, in every frame: nothing may depend on threads,
/// addresses or allocation history.
fn two_instances(config: &TechniqueConfig) -> Vec<Finding> {
    let field = Arc::new(hills([129, 97], [10.0; 2], 400.0));
    let mut both = [0, 1].map(|_| (config.entry.build)(Arc::clone(&field), &config.settings));
    let differs = views::views(&field).into_iter().find(|(_, view)| {
        let lists = both.each_mut().map(|technique| {
            let mut list = DrawList::default();
            technique.select(view, &mut list);
            bytes(&list)
        });
        lists[0] != lists[1]
    });
    let violation = differs.map(|view| Violation::new(view, "two instances with equal settings draw different lists"));
    vec![Finding::holds("same frame twice, same bytes", violation.map_or(Ok(()), Err))]
}

/// Returns all bytes of a list that reach the device.
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

/// Raises the tolerance from 1/8 px to 16 px in steps of 1 %: a wider tolerance must never draw more triangles.
fn fine_steps(config: &TechniqueConfig) -> Vec<Finding> {
    const STEPS: i32 = 490;
    let field = hills([129, 97], [10.0; 2], 400.0);
    let mut technique = (config.entry.build)(Arc::new(field.clone()), &config.settings);
    let named = views::views(&field).swap_remove(2);
    let mut subject = Subject::new(&field, &mut *technique, &[]);
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
