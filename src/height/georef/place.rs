//! The place of a raster, north up, and the metres that it means.

use std::f64::consts::TAU;

use super::mercator::mercator_latitude;
use super::unit::Unit;

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
