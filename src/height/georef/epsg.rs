//! Coordinate reference systems by EPSG code.
//!
//! The registries are those of `crs-definitions` and, for newer, compound and vertical systems, of `proj-core`.

use super::crs::Crs;
use super::mercator::WEB_MERCATOR;
use super::registry::{registered, vertical};
use super::unit::Unit;
use super::units::US_FOOT;
use super::wkt;

/// Metres a unit of systems in other units than metres that neither registry holds; EPSG registry v11.022.
const ABSENT: [(u32, f64); 4] = [(3139, 0.201168), (6200, US_FOOT), (10_622, US_FOOT), (22_300, 1000.0)];

/// The system of an EPSG code: projected, geographic, compound or vertical.
pub fn from_epsg(code: u32) -> Option<Crs> {
    let name = Some(format!("EPSG:{code}"));
    if WEB_MERCATOR.contains(&code) {
        return Some(Crs { unit: Some(Unit::Mercator), name, ..Crs::default() });
    }
    if let Some(&(_, metres)) = ABSENT.iter().find(|&&(absent, _)| absent == code) {
        return Some(Crs { unit: Some(Unit::Metres(metres)), name, ..Crs::default() });
    }
    let text = u16::try_from(code).ok().and_then(crs_definitions::from_code);
    let by_text = text.and_then(|definition| wkt::parse(definition.wkt)).filter(|crs| crs.unit.is_some());
    let registered = || proj_core::lookup_epsg(code).and_then(|definition| registered(&definition));
    let horizontal = by_text.or_else(registered).map(|crs| Crs { name, ..crs });
    horizontal.or_else(|| vertical(code))
}
