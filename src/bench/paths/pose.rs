//! A pose of the camera on a path.

use glam::DVec3;

use crate::view::{Lens, Tolerance, View};

/// One pose of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pose {
    /// World metres.
    pub eye: DVec3,
    /// Heading, degrees: 0 = east, 90 = south.
    pub yaw: f64,
    /// Degrees above the horizon.
    pub pitch: f64,
    /// Field of view.
    pub opening: Opening,
}

/// Field of view, degrees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Opening {
    /// From the left to the right border.
    Horizontal(f64),
    /// From the upper to the lower border.
    Vertical(f64),
}

impl Pose {
    /// The view from here.
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
