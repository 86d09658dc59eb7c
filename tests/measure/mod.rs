//! Measurements on lists of real techniques.

mod angles;
mod between;
mod faults;
mod journeys;
mod peers;
mod plan;
mod pops;
mod rays;

use std::sync::Arc;

use cuesta::internal::draw::DrawList;
use cuesta::internal::draw::expand::{self, Drawn};
use cuesta::internal::draw::layout::Frame;
use cuesta::internal::height::Field;
use cuesta::internal::lod::{self, Settings, Technique};
use cuesta::internal::view::View;

/// A technique of the table with settings given as pairs.
fn technique(field: &Arc<Field>, name: &str, settings: &[(&str, &str)]) -> Box<dyn Technique> {
    let entry = lod::find(name).expect("a row of the table");
    let settings: Vec<_> = settings.iter().map(|(key, value)| (key.to_string(), value.to_string())).collect();
    (entry.build)(Arc::clone(field), &Settings::new(entry, None, &settings).expect("the table's own values"))
}

/// Returns the triangles that a technique draws in a view.
fn select(technique: &mut dyn Technique, view: &View) -> DrawList {
    let mut list = DrawList::default();
    technique.select(view, &mut list);
    list
}

/// The triangles of a list.
fn drawn(field: &Field, view: &View, technique: &dyn Technique, list: &DrawList) -> Vec<Drawn> {
    expand::triangles(field, &Frame::placing(field, view), technique.resident(), list)
}
