//! Properties of single techniques beyond the invariants of `conformance`.

mod budget;
mod budget_circle;
mod clusters;
mod endless;
mod largest;
mod morph;
mod needs;
mod omitted;
mod skirts;
mod smooth_tiles;
mod sphere_tree;
mod strips;
mod strips_cave;
mod strips_far;
mod strips_guard;
mod strips_order;

use cuesta::internal::draw::expand;
use cuesta::internal::draw::layout::Frame;
use cuesta::internal::draw::{DrawList, Geometry};
use cuesta::internal::height::{Field, surface};
use cuesta::internal::view::View;

use crate::prepared::technique;

/// Returns the drawn height at every sample, the higher one if one edge lies above another; NaN if nothing is drawn
/// there.
fn heights(field: &Field, view: &View, resident: &Geometry, list: &DrawList) -> Vec<f64> {
    let [w, h] = field.size();
    let mut heights = vec![f64::NAN; (w * h) as usize];
    expand::visit_triangles(field, &Frame::placing(field, view), resident, list, |drawn| {
        surface::visit_samples_between(&drawn.corners, list.fraction_bits, |x, z, y| {
            let height = &mut heights[(z * w + x) as usize];
            *height = height.max(y);
        });
    });
    heights
}
