//! Coordinate reference systems by text: well-known text, codes, and lines of ARC/INFO.

use super::crs::Crs;
use super::ellipsoid::Ellipsoid;
use super::epsg::from_epsg;
use super::unit::Unit;
use super::units::{self, US_FOOT};
use super::wkt;

/// The system that a text describes: well-known text, codes as in `EPSG:2263+6360`, or lines of ARC/INFO.
pub fn from_text(text: &str) -> Option<Crs> {
    let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\0' || c == '\u{feff}');
    wkt::parse(text).or_else(|| from_codes(text)).or_else(|| from_arc_info(text))
}

/// `EPSG:2263`, `EPSG:2263+6360`, `ESRI:102100`, `urn:ogc:def:crs:EPSG::2263`.
fn from_codes(text: &str) -> Option<Crs> {
    let upper = text.to_ascii_uppercase();
    let codes = match upper.strip_prefix("URN:OGC:DEF:CRS:") {
        Some(urn) => urn.rsplit_once(':')?.1,
        None => upper.strip_prefix("EPSG:").or_else(|| upper.strip_prefix("ESRI:"))?,
    };
    let codes = codes.split('+').map(|code| code.trim_start_matches("EPSG:").parse().ok());
    codes.map(|code| from_epsg(code?)).collect::<Option<Vec<Crs>>>()?.into_iter().reduce(Crs::and)
}

/// Lines such as `Projection GEOGRAPHIC`, `Units DD` and `Zunits METERS`.
fn from_arc_info(text: &str) -> Option<Crs> {
    let upper = text.to_ascii_uppercase();
    let value = |key: &str| {
        upper.lines().find_map(|line| line.trim().strip_prefix(key)?.strip_prefix([' ', '\t'])).map(str::trim)
    };
    let length = |name: &str| if name == "FEET" { Some(US_FOOT) } else { units::named_length(name) };
    let (projection, unit) = (value("PROJECTION"), value("UNITS"));
    let angle = unit.and_then(units::named_angle);
    let unit = match (projection, unit) {
        (Some("GEOGRAPHIC"), _) | (None, Some("DD" | "DS" | "DM")) => {
            Unit::Angles { radians: angle.unwrap_or(1f64.to_radians()), ellipsoid: Ellipsoid::WGS84 }
        }
        (Some(_), unit) => Unit::Metres(unit.and_then(length).unwrap_or(1.0)),
        _ => return None,
    };
    // A number counts units a metre.
    let per_metre = |text: &str| text.parse::<f64>().ok().filter(|n| *n > 0.0 && n.is_finite()).map(f64::recip);
    let height_unit = value("ZUNITS").and_then(|name| length(name).or_else(|| per_metre(name)));
    Some(Crs { unit: Some(unit), height_unit, ..Crs::default() })
}
