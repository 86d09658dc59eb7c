//! The laws that every technique keeps in every form, on every field, from every view. No device is needed.
//!
//! [`broken`] holds each law against techniques that break it.

mod broken;
pub(crate) mod cases;
mod sweep;

use std::sync::Arc;

use cuesta::lod::TECHNIQUES;
use cuesta::stress::laws::{LAWS, Subject, TOLERANCES_PX};
use cuesta::stress::views;
use rayon::prelude::*;

/// All laws at once, so that each technique is prepared once: a failure names the law, the technique with its
/// settings, the field and the view.
#[test]
fn every_technique_keeps_every_law() {
    let fields = cases::fields();
    let forms: Vec<_> = TECHNIQUES.iter().flat_map(cases::forms).collect();
    let pairs: Vec<_> = fields.iter().flat_map(|field| forms.iter().map(move |form| (field, form))).collect();
    let broken: Vec<String> = pairs
        .par_iter()
        .flat_map_iter(|&((field_name, field), form)| {
            let views = views::views(field);
            let mut technique = (form.entry.build)(Arc::clone(field), &form.settings);
            let mut subject = Subject {
                field,
                technique: &mut *technique,
                views: &views,
                tolerances_px: &TOLERANCES_PX,
                time_s: 0.0,
            };
            let laws = LAWS.iter().filter(|law| law.is_for(form.entry.name));
            let failed = laws.filter_map(move |law| Some((law.name, (law.check)(&mut subject).err()?)));
            failed.map(|(law, why)| format!("{law}: {} on {field_name}: {why}", form.name)).collect::<Vec<_>>()
        })
        .collect();
    assert!(broken.is_empty(), "{} failures, the first:\n{}", broken.len(), broken[..broken.len().min(12)].join("\n"));
    println!("{} forms × {} fields × {} laws", forms.len(), fields.len(), LAWS.len());
}
