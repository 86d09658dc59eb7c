//! Georeferencing: a file's coordinates turned into metres.

pub(super) mod affine;
pub(super) mod crs;
pub(super) mod extent;
pub(super) mod units;
pub(super) mod wkt;

use std::f64::consts::TAU;

/// Radius of the sphere of web Mercator, metres.
pub const MERCATOR_RADIUS: f64 = 6_378_137.0;
/// International foot, metres.
pub const FOOT: f64 = 0.3048;
/// US survey foot, metres.
pub const US_FOOT: f64 = 1200.0 / 3937.0;

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

/// Latitude, degrees, of a web Mercator northing, metres.
pub fn mercator_latitude(y: f64) -> f64 {
    (y / MERCATOR_RADIUS).sinh().atan().to_degrees()
}

/// Half the side of the web Mercator square, metres.
pub const MERCATOR_HALF: f64 = MERCATOR_RADIUS * TAU / 2.0;

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

/// Coordinates of the north-west sample (east, north), and steps (east, south).
pub type Grid = ([f64; 2], [f64; 2]);

/// Position of a raster, north up.
#[derive(Clone, Debug, PartialEq)]
pub struct Place {
    /// East and north coordinate of the north-west sample.
    pub origin: [f64; 2],
    /// Distance of neighbouring samples east and south, both positive.
    pub step: [f64; 2],
    /// Unit of both.
    pub unit: Unit,
    /// Coordinate reference system, as the file names it.
    pub crs: Option<String>,
}

impl Place {
    /// Distance of neighbouring samples (x, z) on the ground and world position (x, z) of the north-west
    /// sample, metres, for `rows` rows.
    ///
    /// Angles become metres by `Ellipsoid::metres_per_radian` at the middle row. Web Mercator distances shrink by
    /// cos φ of the middle row; its origin stays in Mercator metres.
    pub fn spacing_and_origin(&self, rows: u32) -> ([f64; 2], [f64; 2]) {
        let [east, north] = self.origin;
        let middle = north - self.step[1] * f64::from(rows - 1) / 2.0;
        let (ground, world) = match self.unit {
            Unit::Angles { radians, .. } if (middle * radians).abs() > TAU / 4.0 + 1e-9 => {
                ([f64::NAN; 2], [f64::NAN; 2])
            }
            Unit::Angles { radians, ellipsoid } => {
                let metres = ellipsoid.metres_per_radian(middle * radians).map(|metres| metres * radians);
                (metres, metres)
            }
            Unit::Metres(factor) => ([factor; 2], [factor; 2]),
            Unit::Mercator => ([mercator_latitude(middle).to_radians().cos(); 2], [1.0; 2]),
        };
        ([self.step[0] * ground[0], self.step[1] * ground[1]], [east * world[0], -north * world[1]])
    }

    /// The place of the part that begins at sample (x, z).
    pub fn moved(mut self, [x, z]: [u32; 2]) -> Self {
        self.origin[0] += f64::from(x) * self.step[0];
        self.origin[1] -= f64::from(z) * self.step[1];
        self
    }

    /// Returns the place of a raster whose file names no coordinate system: degrees if all of it could be longitude and
    /// latitude, else metres. The warning states the assumption.
    pub fn guessed((origin, step): Grid, [w, h]: [u32; 2]) -> (Self, String) {
        let [east, south] = [origin[0] + step[0] * f64::from(w), origin[1] - step[1] * f64::from(h)];
        // A grid of someone's own often begins near (0, 0) with steps of metres; a degree is the longest
        // step of published global grids.
        let on_globe = origin[0] >= -181.0 && east <= 361.0 && south >= -91.0 && origin[1] <= 91.0;
        let local = origin[0].abs() <= step[0] && south.abs() <= 2.0 * step[1] && step[0] >= 0.1;
        let degrees = on_globe && !local && step[0] <= 1.0 && step[1] <= 1.0;
        let (unit, found) = match degrees {
            true => (Unit::DEGREES, "degrees of longitude and latitude"),
            false => (Unit::Metres(1.0), "metres"),
        };
        let warning = format!("no coordinate system is named; the coordinates look like {found} (--spacing overrides)");
        (Self { origin, step, unit, crs: None }, warning)
    }
}
