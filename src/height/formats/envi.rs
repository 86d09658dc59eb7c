//! The header of ENVI files: `key = value`, with values in braces over several lines.

use std::collections::BTreeMap;

use super::bare_header::{Header, Values};
use super::georeference::Georeference;
use super::sample::{Order, SampleType};
use crate::height::error::Error;
use crate::height::georef::affine::Affine;
use crate::height::georef::crs::Crs;
use crate::height::georef::ellipsoid::Ellipsoid;
use crate::height::georef::mercator::is_web_mercator;
use crate::height::georef::unit::Unit;
use crate::height::georef::{crs_text, units};

/// Returns true if a file begins as such a header.
pub(super) fn is_header(head: &[u8]) -> bool {
    head.strip_prefix(b"ENVI").is_some_and(|rest| rest.trim_ascii_start().len() < rest.len())
}

/// Reads a header.
pub(super) fn parse(name: &str, text: &str) -> Result<Header, Error> {
    let values = Values { name, values: pairs(text) };
    let bands = values.number("bands")?.unwrap_or(1u32);
    if bands != 1 {
        return Err(values.error("bands", format!("expected 1 band, found {bands}")));
    }
    let sample = match values.required("data type")? {
        1u32 => SampleType::U8,
        2 => SampleType::I16,
        3 => SampleType::I32,
        4 => SampleType::F32,
        5 => SampleType::F64,
        12 => SampleType::U16,
        13 => SampleType::U32,
        14 => SampleType::I64,
        15 => SampleType::U64,
        other => return Err(values.error("data type", format!("expected 1 to 5 or 12 to 15, found {other}"))),
    };
    let order = match values.number("byte order")?.unwrap_or(0u32) {
        0 => Order::Little,
        1 => Order::Big,
        other => return Err(values.error("byte order", format!("expected 0 or 1, found {other}"))),
    };
    Ok(Header {
        variant: Some("ENVI"),
        size: [values.required("samples")?, values.required("lines")?],
        sample,
        order,
        start: values.number("header offset")?.unwrap_or(0),
        stride: None,
        nodata: values.text("data ignore value").map(str::to_owned),
        georeference: georeference(&values)?,
    })
}

fn pairs(text: &str) -> BTreeMap<String, String> {
    let mut values = BTreeMap::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        let Some((key, value)) = line.split_once('=') else { continue };
        let mut value = value.trim().to_owned();
        while value.starts_with('{') && !value.ends_with('}') {
            let Some(more) = lines.next() else { break };
            value.push_str(more.trim());
        }
        let value = value.trim_matches(['{', '}']).trim().to_owned();
        values.insert(key.trim().to_lowercase(), value);
    }
    values
}

/// Position, system and scale.
fn georeference(values: &Values) -> Result<Georeference, Error> {
    let mut georeference = Georeference::default();
    let fields: Option<Vec<&str>> = values.text("map info").map(|text| text.split(',').map(str::trim).collect());
    if let Some(fields) = &fields {
        georeference.affine = Some(affine(values, fields)?);
    }
    let stated = values.text("coordinate system string").and_then(crs_text::from_text);
    georeference.crs = stated.or_else(|| fields.map(|fields| system(&fields)));
    georeference.band.scale = first(values, "data gain values")?;
    georeference.band.offset = first(values, "data offset values")?;
    Ok(georeference)
}

/// The first number of a list.
fn first(values: &Values, key: &str) -> Result<Option<f64>, Error> {
    let Some(text) = values.text(key) else { return Ok(None) };
    let number = text.split(',').next().and_then(|word| word.trim().parse::<f64>().ok()).filter(|n| n.is_finite());
    number.map(Some).ok_or_else(|| values.error(key, format!("expected a number, found {text:?}")))
}

/// The value of a `key=value` field of `map info`.
fn named<'a>(fields: &[&'a str], key: &str) -> Option<&'a str> {
    fields.iter().find_map(|field| {
        let (name, value) = field.split_once('=')?;
        name.trim().eq_ignore_ascii_case(key).then(|| value.trim())
    })
}

/// `map info`: projection, reference pixel (1, 1 is the corner of the first sample), its coordinates, steps,
/// zone, hemisphere and datum, units, rotation about the reference pixel in degrees.
fn affine(values: &Values, fields: &[&str]) -> Result<Affine, Error> {
    let wrong = || values.error("map info", format!("expected a name and six numbers, found {:?}", fields.join(", ")));
    let numbers: Vec<f64> = fields.iter().skip(1).map_while(|field| field.parse().ok()).take(6).collect();
    let &[column, row, east, north, dx, dy] = numbers.as_slice() else { return Err(wrong()) };
    let rotation: f64 = match named(fields, "rotation") {
        Some(text) => text.parse().map_err(|_| values.error("map info rotation", "expected degrees"))?,
        None => 0.0,
    };
    let (sin, cos) = rotation.to_radians().sin_cos();
    // Quarter turns become exact.
    let [sin, cos] = [sin, cos].map(|part| if part.abs() < 1e-12 { 0.0 } else { part });
    let at_reference = Affine { origin: [east, north], column: [dx * cos, dy * sin], row: [dx * sin, -dy * cos] };
    Ok(at_reference.shifted([1.5 - column, 1.5 - row]))
}

/// The system that `map info` describes.
fn system(fields: &[&str]) -> Crs {
    let projection = fields.first().copied().unwrap_or_default();
    let unit = named(fields, "units").unwrap_or_default();
    let is_geographic = projection.to_lowercase().starts_with("geographic") || unit.eq_ignore_ascii_case("degrees");
    let unit = match () {
        _ if is_geographic => {
            let radians = units::named_angle(unit).unwrap_or(1f64.to_radians());
            Unit::Angles { radians, ellipsoid: Ellipsoid::WGS84 }
        }
        _ if is_web_mercator(projection) => Unit::Mercator,
        _ => Unit::Metres(units::named_length(unit).unwrap_or(1.0)),
    };
    Crs { unit: Some(unit), name: name(fields), ..Crs::default() }
}

fn name(fields: &[&str]) -> Option<String> {
    let name = fields.first()?.to_lowercase();
    let wgs84 = fields.iter().any(|field| field.eq_ignore_ascii_case("WGS-84"));
    let zone = fields.get(7).and_then(|zone| zone.parse::<u32>().ok()).filter(|zone| (1..=60).contains(zone));
    match zone {
        Some(zone) if name == "utm" && wgs84 => {
            let south = fields.iter().any(|field| field.eq_ignore_ascii_case("South"));
            Some(format!("EPSG:{}", if south { 32700 } else { 32600 } + zone))
        }
        None if name.starts_with("geographic") && wgs84 => Some("EPSG:4326".to_owned()),
        _ => Some(fields.iter().take(1).chain(fields.iter().skip(7)).copied().collect::<Vec<_>>().join(" ")),
    }
}
