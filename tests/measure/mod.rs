//! Measurements on lists of real techniques.

mod angles;
mod between;
mod faults;
mod journeys;
mod peers;
mod plan;
mod pops;
mod rays;

use cuesta::internal::draw::DrawList;
use cuesta::internal::draw::expand::{self, Drawn};
use cuesta::internal::draw::layout::Frame;
use cuesta::internal::height::Field;
use cuesta::internal::lod::Technique;
use cuesta::internal::view::View;

use crate::prepared::technique;

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
