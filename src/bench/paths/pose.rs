//! Position, direction and field of view of the camera at one frame of a path.

use glam::DVec3;

use crate::view::{Lens, Tolerance, View};

/// The camera at one frame of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// Position of the eye, world metres.
    pub eye: DVec3,
    /// Heading, degrees: 0 = east, 90 = south.
    pub yaw: f64,
    /// Pitch, degrees above the horizon.
    pub pitch: f64,
    /// Field of view.
    pub opening: Opening,
}

/// Field of view, degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Opening {
    /// Angle between the left and the right border of the picture.
    Horizontal(f64),
    /// Angle between the upper and the lower border of the picture.
    Vertical(f64),
}

impl Pose {
    /// Returns the view for a picture of `size` (x, y) pixels, with the near plane at `near` metres.
    pub fn view(&self, size: [u32; 2], near: f64, tolerance: Tolerance) -> View {
        let fov_x = match self.opening {
            Opening::Horizontal(degrees) => degrees.to_radians(),
            Opening::Vertical(degrees) => {
                let slope = (degrees.to_radians() / 2.0).tan() * f64::from(size[0]) / f64::from(size[1]);
                2.0 * slope.atan()
            }
        };
        View {
            eye: self.eye,
            world_from_eye: View::turned(self.yaw, self.pitch, 0.0),
            lens: Lens::Perspective { fov_x },
            size,
            near,
            tolerance,
            time_s: 0.0,
        }
    }
}
