//! The view of a sweep case, relative to the terrain, so that it keeps its meaning on terrain of another size.

use glam::DVec3;
use serde::{Deserialize, Serialize};

use crate::height::Field;
use crate::view::{Lens, Tolerance, View};

/// Projection of a case.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum CaseLens {
    /// Perspective with a horizontal field of view, degrees.
    Degrees(f64),
    /// Orthographic with an image width in diagonals of the terrain.
    Parallel(f64),
}

/// View direction of a case.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Direction {
    /// Yaw and pitch, degrees.
    Turned([f64; 2]),
    /// Towards a point of the terrain, as fractions of its sides.
    Towards([f64; 2]),
}

/// Position and direction of the eye.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Viewpoint {
    /// Position of the eye along (x, z) as fractions of the terrain's sides; 0 to 1 is inside.
    pub at: [f64; 2],
    /// Height of the eye above the nearest sample, in diagonals of the terrain.
    pub above: f64,
    /// Direction.
    pub direction: Direction,
    /// Roll, degrees.
    #[serde(default)]
    pub roll: f64,
    /// Projection.
    pub lens: CaseLens,
    /// Image size, pixels.
    pub size: [u32; 2],
    /// Distance of the near plane, in diagonals of the terrain.
    pub near: f64,
}

impl Viewpoint {
    /// Returns the view of a field.
    pub fn view(&self, field: &Field, tolerance: Tolerance) -> View {
        let [w, h] = field.size().map(|n| f64::from(n - 1));
        let diagonal = (w * field.spacing[0]).hypot(h * field.spacing[1]);
        let over = |[u, v]: [f64; 2], above: f64| {
            let [i, j] = [u.clamp(0.0, 1.0) * w, v.clamp(0.0, 1.0) * h].map(|n| n.round() as u32);
            field.world_at(u * w, v * h, f64::from(field.height(i, j)) + above)
        };
        let eye = over(self.at, self.above * diagonal);
        let world_from_eye = match self.direction {
            Direction::Turned([yaw, pitch]) => View::turned(yaw, pitch, self.roll),
            Direction::Towards(position) => {
                let forward = over(position, 0.0) - eye;
                let forward = if forward.length() > 0.0 { forward } else { DVec3::NEG_Y };
                View::looking_along(forward) * View::rolled(self.roll)
            }
        };
        let lens = match self.lens {
            CaseLens::Degrees(degrees) => Lens::Perspective { fov_x: degrees.to_radians() },
            CaseLens::Parallel(width) => Lens::Orthographic { width: width * diagonal, far: 1e9 },
        };
        View { eye, world_from_eye, lens, size: self.size, near: self.near * diagonal, tolerance, time_s: 0.0 }
    }
}
