//! Ellipsoids of revolution.

/// An ellipsoid of revolution.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ellipsoid {
    /// Semi-major axis, metres.
    pub a: f64,
    /// Flattening.
    pub f: f64,
}

impl Ellipsoid {
    /// The ellipsoid of GPS.
    pub const WGS84: Self = Self { a: 6_378_137.0, f: 1.0 / 298.257_223_563 };

    /// Returns the ellipsoid, or `None` if the numbers describe none.
    pub fn new(a: f64, f: f64) -> Option<Self> {
        (a.is_finite() && a > 0.0 && (0.0..0.5).contains(&f)).then_some(Self { a, f })
    }

    /// Returns true for the size of the Earth, within a percent.
    pub fn is_earth(self) -> bool {
        (self.a / Self::WGS84.a - 1.0).abs() < 0.01
    }

    /// Metres per radian of longitude and of latitude at latitude φ, radians.
    ///
    /// The radius of the parallel N cos φ and the radius of curvature of the meridian M, with
    /// N = a / √(1 − e² sin² φ) and M = a (1 − e²) / (1 − e² sin² φ)^(3/2).
    pub fn metres_per_radian(self, latitude: f64) -> [f64; 2] {
        let e2 = self.f * (2.0 - self.f);
        let w2 = 1.0 - e2 * latitude.sin().powi(2);
        [self.a / w2.sqrt() * latitude.cos(), self.a * (1.0 - e2) / (w2 * w2.sqrt())]
    }
}

/// Metres per degree of longitude and of latitude on the WGS 84 ellipsoid, at a latitude in degrees.
pub fn metres_per_degree(latitude: f64) -> [f64; 2] {
    Ellipsoid::WGS84.metres_per_radian(latitude.to_radians()).map(f64::to_radians)
}
