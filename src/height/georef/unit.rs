//! Units of coordinates.

use std::f64::consts::TAU;

use super::ellipsoid::Ellipsoid;

/// Unit of coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Unit {
    /// Longitude and latitude.
    Angles {
        /// Radians a unit.
        radians: f64,
        /// The body that they lie on.
        ellipsoid: Ellipsoid,
    },
    /// Projected lengths; metres per unit.
    Metres(f64),
    /// Web Mercator metres, which are 1 / cos φ times too long on the ground.
    Mercator,
}

impl Unit {
    /// Degrees of longitude and latitude on WGS 84.
    pub const DEGREES: Self = Self::Angles { radians: TAU / 360.0, ellipsoid: Ellipsoid::WGS84 };
}
