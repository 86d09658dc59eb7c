//! Numbers from triangles and pictures: how far the drawn surface is from the samples, and proof that it is
//! one surface. Pure computation on what [`draw::expand`](crate::draw::expand) says is drawn.

pub mod geometric;
pub mod picture;
pub mod watertight;

use glam::DVec3;

use crate::view::{Lens, View};

/// Whether a world point falls into the picture, between the near and the far plane.
pub fn in_view(view: &View, point: DVec3) -> bool {
    let far = match view.lens {
        Lens::Perspective { .. } => f64::INFINITY,
        Lens::Orthographic { far, .. } => far,
    };
    view.project(point).is_some_and(|at| view.in_picture(&at) && at.depth <= far)
}
