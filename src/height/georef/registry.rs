//! The registry of `proj-core`: vertical systems, and horizontal ones that it alone holds.

use proj_core::CrsDef;

use super::crs::Crs;
use super::ellipsoid::Ellipsoid;
use super::unit::Unit;

/// The vertical system of an EPSG code, or the vertical axis of a three-dimensional one.
pub fn vertical(code: u32) -> Option<Crs> {
    let by_own_code = proj_core::lookup_vertical_epsg(code);
    let by_axis = || proj_core::lookup_epsg(code)?.vertical_crs().cloned();
    let system = by_own_code.or_else(by_axis)?;
    // Names of systems that count down contain the word.
    let is_depth = system.name().to_lowercase().contains("depth");
    Some(Crs { height_unit: Some(system.linear_unit_to_meter()), is_depth, ..Crs::default() })
}

/// The system of a definition, if it is projected or geographic.
pub fn registered(definition: &CrsDef) -> Option<Crs> {
    let unit = if let Some(projected) = definition.as_projected() {
        Unit::Metres(projected.linear_unit_to_meter())
    } else if definition.as_geographic().is_some() {
        let ellipsoid = definition.datum().ellipsoid();
        let ellipsoid = Ellipsoid::new(ellipsoid.semi_major_axis(), ellipsoid.flattening())?;
        Unit::Angles { radians: 1f64.to_radians(), ellipsoid }
    } else {
        return None;
    };
    let vertical = definition.vertical_crs();
    let height_unit = vertical.map(|system| system.linear_unit_to_meter());
    let is_depth = vertical.is_some_and(|system| system.name().to_lowercase().contains("depth"));
    Some(Crs { unit: Some(unit), height_unit, is_depth, name: None })
}
