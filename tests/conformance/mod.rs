//! The invariants that every technique keeps in every form, on every field, from every view. Needs no device.
//!
//! [`mutants`] checks that each invariant fails on techniques that violate it.

pub(crate) mod cases;
mod mutants;
mod sweep;

use std::sync::Arc;

use cuesta::internal::lod::TECHNIQUES;
use cuesta::internal::stress::invariants::{self, INVARIANTS, Subject};
use cuesta::internal::stress::views;
use rayon::prelude::*;

/// Checks all invariants at once, so that each technique is prepared once. A failure names the invariant, the technique
/// with its settings, the field and the view.
#[test]
fn every_technique_keeps_every_invariant() {
    let fields = cases::fields();
    let forms: Vec<_> = TECHNIQUES.iter().flat_map(cases::forms).collect();
    let pairs: Vec<_> = fields.iter().flat_map(|field| forms.iter().map(move |form| (field, form))).collect();
    let violation: Vec<String> = pairs
        .par_iter()
        .flat_map_iter(|&((field_name, field), form)| {
            let views = views::views(field);
            let mut technique = (form.entry.build)(Arc::clone(field), &form.settings);
            let mut subject = Subject::new(field, &mut *technique, &views);
            let failed = invariants::of_technique(form.entry.name)
                .filter_map(move |invariant| Some((invariant.name, (invariant.check)(&mut subject).err()?)));
            failed
                .map(|(invariant, why)| format!("{invariant}: {} on {field_name}: {why}", form.name))
                .collect::<Vec<_>>()
        })
        .collect();
    assert!(
        violation.is_empty(),
        "{} failures, the first:\n{}",
        violation.len(),
        violation[..violation.len().min(12)].join("\n")
    );
    println!("{} forms × {} fields × {} invariants", forms.len(), fields.len(), INVARIANTS.len());
}
