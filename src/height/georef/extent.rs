//! Extent of a raster in degrees of longitude and latitude.

use std::f64::consts::TAU;

use proj_core::{Bounds, Transform};
use serde::Serialize;

use super::mercator::{MERCATOR_RADIUS, mercator_latitude};
use super::place::Place;
use super::unit::Unit;

/// Points between the corners of each side that are transformed too, as straight sides may become curves.
const POINTS_PER_SIDE: usize = 20;

/// Rectangle of longitudes and latitudes around a raster, degrees. A projected raster across the antimeridian or a pole
/// spans all longitudes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Extent {
    /// Westernmost longitude.
    pub west: f64,
    /// Southernmost latitude.
    pub south: f64,
    /// Easternmost longitude.
    pub east: f64,
    /// Northernmost latitude.
    pub north: f64,
}

impl Place {
    /// Returns the extent of a raster's samples; `size` is their number along (x, z).
    ///
    /// Geographic coordinates stay in their own datum, projected ones are transformed to WGS 84. Returns `None` if the
    /// coordinate system is projected and has no EPSG code, or no transformation is known for it.
    pub fn extent(&self, size: [u32; 2]) -> Option<Extent> {
        let [west, north] = self.origin;
        let [east, south] =
            [west + self.step[0] * f64::from(size[0] - 1), north - self.step[1] * f64::from(size[1] - 1)];
        let extent = match self.unit {
            Unit::Angles { radians, .. } => {
                let [west, south, east, north] = [west, south, east, north].map(|angle| (angle * radians).to_degrees());
                Extent { west, south, east, north }
            }
            Unit::Mercator => {
                let [west, east] = [west, east].map(|x| x * 360.0 / (TAU * MERCATOR_RADIUS));
                Extent { west, south: mercator_latitude(south), east, north: mercator_latitude(north) }
            }
            Unit::Metres(_) => unprojected(self.crs.as_deref()?, Bounds::new(west, south, east, north))?,
        };
        [extent.south, extent.north].iter().all(|latitude| latitude.abs() <= 90.0 + 1e-9).then_some(extent)
    }
}

/// Transforms bounds in the units of a projected system, `EPSG:code` or `EPSG:code+vertical code`, to WGS 84.
fn unprojected(crs: &str, bounds: Bounds) -> Option<Extent> {
    let horizontal = crs.split('+').next().filter(|code| code.starts_with("EPSG:"))?;
    let transform = Transform::new_horizontal(horizontal, "EPSG:4326").ok()?;
    let found = transform.transform_bounds(bounds, POINTS_PER_SIDE).ok()?;
    Some(Extent { west: found.min_x, south: found.min_y, east: found.max_x, north: found.max_y })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::georef::units::US_FOOT;

    fn place(unit: Unit, crs: Option<&str>, origin: [f64; 2], step: f64) -> Place {
        Place { origin, step: [step; 2], unit, crs: crs.map(str::to_string) }
    }

    fn assert_near(found: Option<Extent>, [west, south, east, north]: [f64; 4]) {
        let found = found.expect("a known system");
        let pairs = [(found.west, west), (found.south, south), (found.east, east), (found.north, north)];
        assert!(pairs.iter().all(|(found, expected)| (found - expected).abs() < 1e-6), "{found:?}");
    }

    #[test]
    fn degrees_and_web_mercator_need_no_registry() {
        let degrees = place(Unit::DEGREES, None, [1.0, 43.0], 1.0 / 1200.0);
        assert_near(degrees.extent([1201, 1201]), [1.0, 42.0, 2.0, 43.0]);
        let half = MERCATOR_RADIUS * TAU / 2.0;
        let world = place(Unit::Mercator, Some("EPSG:3857"), [-half, half], half);
        assert_near(world.extent([3, 3]), [-180.0, -85.0511287798066, 180.0, 85.0511287798066]);
    }

    /// On the central meridian of UTM zone 31, 500 km east is 3° east, and the equator is 0 m north. The tile is 2 km wide.
    #[test]
    fn projected_coordinates_are_transformed() {
        let utm = place(Unit::Metres(1.0), Some("EPSG:32631"), [499_000.0, 1000.0], 1000.0);
        let (across, up) = (1000.0 / 0.9996 / 111_319.490_793, 1000.0 / 0.9996 / 110_574.275_8);
        let found = utm.extent([3, 3]).expect("a known system");
        assert!((found.west - (3.0 - across)).abs() < 1e-6 && (found.east - (3.0 + across)).abs() < 1e-6, "{found:?}");
        assert!((found.south + up).abs() < 1e-6 && (found.north - up).abs() < 1e-6, "{found:?}");
        let compound = Place { crs: Some("EPSG:32631+5773".to_string()), ..utm.clone() };
        assert_eq!(compound.extent([3, 3]), Some(found));
    }

    #[test]
    fn feet_stay_feet() {
        // False origin of EPSG:2263: 40°10' N, 74° W at 984 250 US feet east.
        let long_island = place(Unit::Metres(US_FOOT), Some("EPSG:2263"), [984_250.0, 10.0], 10.0);
        let found = long_island.extent([2, 2]).expect("a known system");
        assert!((found.west + 74.0).abs() < 1e-4 && (found.south - (40.0 + 1.0 / 6.0)).abs() < 1e-4, "{found:?}");
    }

    #[test]
    fn other_systems_have_no_extent() {
        for crs in [None, Some("Local grid"), Some("EPSG:1")] {
            assert_eq!(place(Unit::Metres(1.0), crs, [0.0; 2], 1.0).extent([2, 2]), None, "{crs:?}");
        }
        assert_eq!(place(Unit::DEGREES, None, [0.0, 200.0], 1.0).extent([2, 2]), None);
    }
}
