//! Measurements of drawn frames: errors, proofs of watertightness, visible changes between frames, costs of triangles,
//! and comparison with near-optimal meshes.
//!
//! All functions are pure. Their input are the triangles of a draw list ([`draw::expand`](crate::draw::expand)), and
//! pictures and depth buffers as pixels.

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

// Fixed sizes of parallel work make the order of sums, and so their rounding, the same on every machine.

/// Largest number of triangles in a part of a draw list.
const PART: usize = 1 << 15;
/// Number of parts that are processed in parallel before their results are merged.
const BATCH: usize = 64;

/// Returns true if a world point lies in the picture and between the near and the far plane.
pub fn in_view(view: &View, point: DVec3) -> bool {
    let far = match view.lens {
        Lens::Perspective { .. } => f64::INFINITY,
        Lens::Orthographic { far, .. } => far,
    };
    view.project(point).is_some_and(|at| view.in_picture(&at) && at.depth <= far)
}

/// Calls `work` for all parts of a draw list in parallel, and `merge` for their results in the order of the list.
fn each_part<T: Send>(list: &DrawList, work: impl Fn(&Draw) -> T + Sync, merge: impl FnMut(T)) {
    let parts: Vec<Draw> = list.draws.iter().flat_map(|draw| draw.parts(PART)).collect();
    let batches = parts.chunks(BATCH).flat_map(|batch| batch.par_iter().map(&work).collect::<Vec<_>>());
    batches.for_each(merge);
}

/// Returns a triangle with its corners in the order that faces up.
fn facing_up(triangle: &Triangle) -> Triangle {
    let [a, b, c] = *triangle;
    if doubled_area(triangle) < 0 { [a, c, b] } else { [a, b, c] }
}
