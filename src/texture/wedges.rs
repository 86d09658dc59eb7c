//! The wedges of a draw list, as a map over the field's root square knows them, and the working set they need.

use glam::DVec2;

use super::hidden::Depths;
use super::pieces::{Corner, Cutter};
use super::working_set::WorkingSet;
use crate::draw::expand;
use crate::draw::layout::Frame;
use crate::draw::{DrawList, Geometry};
use crate::height::Field;
use crate::height::surface::{self, Triangle, doubled_area};
use crate::view::{Lens, View};

/// Pixels between the samples at which what is hidden is looked for.
const STEP_PX: f64 = 4.0;

/// A triangle of a binary triangle tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wedge {
    /// Its level, 0 for the two halves of the root square.
    pub level: u32,
    /// The right angle first, counter-clockwise seen from above.
    pub corners: [Corner; 3],
}

/// Side of the root square of a field, samples: a power of two, 2 at least.
pub fn root_side(field: &Field) -> u32 {
    field.size().into_iter().map(|n| n - 1).max().unwrap_or(2).next_power_of_two().max(2)
}

/// The triangles of a draw list that face the eye, as wedges. Those that end at the field's edge, where a wedge sticks
/// out, have the level of a wedge of about their area.
pub fn of_list(field: &Field, view: &View, resident: &Geometry, list: &DrawList) -> Vec<Wedge> {
    let mut wedges = Vec::new();
    expand::visit_triangles(field, &Frame::placing(field, view), resident, list, |drawn| {
        wedges.extend(of_triangle(field, view, &drawn.corners, list.fraction_bits));
    });
    wedges
}

fn of_triangle(field: &Field, view: &View, triangle: &Triangle, fraction_bits: u32) -> Option<Wedge> {
    let side = f64::from(root_side(field)) * f64::from(1u32 << fraction_bits);
    let level = (side * side / doubled_area(triangle) as f64).log2().round().max(0.0) as u32;
    let right_angle = (0..3).max_by_key(|&k| squared_length(triangle, k)).unwrap_or(0);
    let corners = [0, 1, 2].map(|k| {
        let corner = triangle[(k + right_angle) % 3];
        let [x, z] = [corner.x, corner.z].map(f64::from);
        Corner { map: DVec2::new(x, z) / side, world: surface::world(field, &corner, fraction_bits) }
    });
    let [a, b, c] = corners.map(|corner| corner.world);
    let to_eye = if matches!(view.lens, Lens::Perspective { .. }) { view.eye - a } else { -view.forward() };
    ((b - a).cross(c - a).dot(to_eye) > 0.0).then_some(Wedge { level, corners })
}

/// Square of the side across from a corner, in plan.
fn squared_length(triangle: &Triangle, k: usize) -> i128 {
    let [a, b] = [1, 2].map(|step| triangle[(k + step) % 3]);
    i128::from(a.x - b.x).pow(2) + i128::from(a.z - b.z).pow(2)
}

/// What a set needs for a frame's wedges: of what is seen of them, and no other wedge hides.
pub fn show(set: &mut WorkingSet, view: &View, cutter: Cutter, wedges: &[Wedge]) {
    let mut depths = Depths::new(view.size, STEP_PX);
    wedges.iter().for_each(|wedge| cutter.cover(&wedge.corners, &mut depths));
    let cutter = cutter.behind(&depths);
    set.begin();
    for wedge in wedges {
        cutter.cut(wedge.level, wedge.corners, &mut |piece| {
            set.show(piece.wedge.key(), &piece.wedge, piece.texels, false);
        });
    }
    set.end();
}
