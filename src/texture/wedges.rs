//! Converts the triangles of a draw list to wedges of a binary triangle tree, and updates a working set for them.

use glam::DVec2;

use super::hidden::Depths;
use super::pieces::{Clipper, Corner};
use super::working_set::WorkingSet;
use crate::draw::expand;
use crate::draw::layout::Frame;
use crate::draw::{DrawList, Geometry};
use crate::height::Field;
use crate::height::surface::{self, Triangle, doubled_area};
use crate::view::{Lens, View};

/// Pixels between samples of the occlusion test.
const STEP_PX: f64 = 4.0;

/// A triangle of a binary triangle tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct WedgeTriangle {
    /// Level, 0 for the two halves of the root square.
    pub level: u32,
    /// Corners: right angle first, counter-clockwise seen from above.
    pub corners: [Corner; 3],
}

/// Returns the side of a field's root square, samples: a power of two, at least 2.
pub fn root_side(field: &Field) -> u32 {
    field.size().into_iter().map(|n| n - 1).max().unwrap_or(2).next_power_of_two().max(2)
}

/// Returns the front-facing triangles of a draw list as wedges. A triangle clipped at the field's edge gets the level
/// whose wedges have about its area.
pub fn from_draw_list(field: &Field, view: &View, resident: &Geometry, list: &DrawList) -> Vec<WedgeTriangle> {
    let mut wedges = Vec::new();
    expand::visit_triangles(field, &Frame::placing(field, view), resident, list, |drawn| {
        wedges.extend(from_triangle(field, view, &drawn.corners, list.fraction_bits));
    });
    wedges
}

/// Returns a triangle as a wedge; `None` if it faces away from the eye.
fn from_triangle(field: &Field, view: &View, triangle: &Triangle, fraction_bits: u32) -> Option<WedgeTriangle> {
    let side = f64::from(root_side(field)) * f64::from(1u32 << fraction_bits);
    let level = (side * side / doubled_area(triangle) as f64).log2().round().max(0.0) as u32;
    let right_angle = (0..3).max_by_key(|&k| squared_length(triangle, k)).unwrap_or(0);
    let corners = [0, 1, 2].map(|k| {
        let corner = triangle[(k + right_angle) % 3];
        let [x, z] = [corner.x, corner.z].map(f64::from);
        Corner { uv: DVec2::new(x, z) / side, world: surface::world(field, &corner, fraction_bits) }
    });
    let [a, b, c] = corners.map(|corner| corner.world);
    let to_eye = if matches!(view.lens, Lens::Perspective { .. }) { view.eye - a } else { -view.forward() };
    ((b - a).cross(c - a).dot(to_eye) > 0.0).then_some(WedgeTriangle { level, corners })
}

/// Returns the squared length in plan of the side opposite corner `k`.
fn squared_length(triangle: &Triangle, k: usize) -> i128 {
    let [a, b] = [1, 2].map(|step| triangle[(k + step) % 3]);
    i128::from(a.x - b.x).pow(2) + i128::from(a.z - b.z).pow(2)
}

/// Updates a working set with the visible parts of a frame's wedges that no other wedge hides.
pub fn update(set: &mut WorkingSet, view: &View, clipper: Clipper, wedges: &[WedgeTriangle]) {
    let mut depths = Depths::new(view.size, STEP_PX);
    wedges.iter().for_each(|wedge| clipper.add_occluder(&wedge.corners, &mut depths));
    let clipper = clipper.with_occlusion(&depths);
    set.begin();
    for wedge in wedges {
        clipper.split(wedge.level, wedge.corners, &mut |piece| {
            set.require(piece.wedge.key(), &piece.wedge, piece.texels, false);
        });
    }
    set.end();
}
