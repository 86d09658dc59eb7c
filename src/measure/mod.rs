//! Numbers from triangles and pictures: how far the drawn surface is from the samples, proof that it is one
//! surface, what it costs and what could be had for less. Pure computation on what
//! [`draw::expand`](crate::draw::expand) says is drawn, and on pictures handed in as pixels.

pub mod beyond;
pub mod economy;
pub mod extended;
pub mod geometric;
pub mod hidden;
pub mod histogram;
#[cfg(feature = "bench")]
pub mod image;
pub mod peers;
pub mod picture;
pub mod pop;
mod projection;
#[cfg(feature = "bench")]
pub mod reference;
pub mod summary;
pub mod watertight;

use glam::DVec3;
use rayon::prelude::*;

use crate::draw::{Draw, DrawList};
use crate::height::surface::{Triangle, doubled_area};
use crate::view::{Lens, View};

/// Triangles in a piece of work, and pieces in work at once. Fixed numbers, so that sums are formed in the
/// same order on every machine.
const PART: usize = 1 << 15;
const BATCH: usize = 64;

/// Returns true if a world point falls into the picture, between the near and the far plane.
pub fn in_view(view: &View, point: DVec3) -> bool {
    let far = match view.lens {
        Lens::Perspective { .. } => f64::INFINITY,
        Lens::Orthographic { far, .. } => far,
    };
    view.project(point).is_some_and(|at| view.in_picture(&at) && at.depth <= far)
}

/// Works on the parts of a list in parallel and merges what comes of them in the order of the list.
fn each_part<T: Send>(list: &DrawList, work: impl Fn(&Draw) -> T + Sync, merge: impl FnMut(T)) {
    let parts: Vec<Draw> = list.draws.iter().flat_map(|draw| draw.parts(PART)).collect();
    let batches = parts.chunks(BATCH).flat_map(|batch| batch.par_iter().map(&work).collect::<Vec<_>>());
    batches.for_each(merge);
}

/// The triangle with the corners in the order that faces up.
fn facing_up(triangle: &Triangle) -> Triangle {
    let [a, b, c] = *triangle;
    if doubled_area(triangle) < 0 { [a, c, b] } else { [a, b, c] }
}
