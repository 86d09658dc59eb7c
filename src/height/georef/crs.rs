//! Coordinate reference systems by EPSG code and by text: units of coordinates and heights, and the ellipsoid.
//!
//! The registries are those of `crs-definitions` and, for newer, compound and vertical systems, of `proj-core`.

use proj_core::CrsDef;

use super::{Ellipsoid, US_FOOT, Unit, units, wkt};

/// Codes of web Mercator, those of ESRI included.
const WEB_MERCATOR: [u32; 5] = [3857, 3785, 900_913, 102_100, 102_113];

/// Metres a unit of systems in other units than metres that neither registry holds; EPSG registry v11.022.
const ABSENT: [(u32, f64); 4] = [(3139, 0.201168), (6200, US_FOOT), (10_622, US_FOOT), (22_300, 1000.0)];

/// The part of a coordinate reference system that placing a raster needs.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Crs {
    /// Unit of horizontal coordinates; `None` for a vertical system.
    pub unit: Option<Unit>,
    /// Metres a unit of height; `None` where no vertical unit is named.
    pub height_unit: Option<f64>,
    /// The vertical axis points down.
    pub is_depth: bool,
    /// Name or authority code of the horizontal system.
    pub name: Option<String>,
}

impl Crs {
    /// Joins a horizontal and a vertical system; the first that names a thing decides it.
    pub fn and(self, other: Self) -> Self {
        Self {
            unit: self.unit.or(other.unit),
            height_unit: self.height_unit.or(other.height_unit),
            is_depth: self.is_depth || other.is_depth,
            name: self.name.or(other.name),
        }
    }
}

/// The system of an EPSG code: projected, geographic, compound or vertical.
pub(in crate::internal::height) fn from_epsg(code: u32) -> Option<Crs> {
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

/// The vertical system of an EPSG code, or the vertical axis of a three-dimensional one.
pub(in crate::internal::height) fn vertical(code: u32) -> Option<Crs> {
    let by_own_code = proj_core::lookup_vertical_epsg(code);
    let by_axis = || proj_core::lookup_epsg(code)?.vertical_crs().cloned();
    let system = by_own_code.or_else(by_axis)?;
    // Names of systems that count down contain the word.
    let is_depth = system.name().to_lowercase().contains("depth");
    Some(Crs { height_unit: Some(system.linear_unit_to_meter()), is_depth, ..Crs::default() })
}

fn registered(definition: &CrsDef) -> Option<Crs> {
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

/// The system that a text describes: well-known text, codes as in `EPSG:2263+6360`, or lines of ARC/INFO.
pub(in crate::internal::height) fn from_text(text: &str) -> Option<Crs> {
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

/// Returns true for the name or the code of web Mercator.
pub(in crate::internal::height) fn is_web_mercator(text: &str) -> bool {
    let squeezed: String = text.chars().filter(|c| c.is_alphanumeric()).collect::<String>().to_uppercase();
    let names = ["PSEUDOMERCATOR", "WEBMERCATOR", "MERCATORAUXILIARYSPHERE"];
    let codes = WEB_MERCATOR.map(|code| code.to_string());
    names.iter().any(|name| squeezed.contains(name))
        || ["EPSG", "ESRI"].iter().any(|authority| {
            squeezed.strip_prefix(authority).is_some_and(|code| codes.iter().any(|known| known == code))
        })
}
