//! The header of ENVI files: `key = value`, with values in braces over several lines.

use std::collections::BTreeMap;

use super::{
    Error,
    bil::{Header, Values},
    georef::{self, FOOT, Unit},
    sample::{Order, SampleType},
};

/// Whether a file is such a header.
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
    let map = Map::parse(&values)?;
    let system = values.text("coordinate system string").and_then(georef::from_wkt);
    Ok(Header {
        format: "ENVI",
        size: [values.required("samples")?, values.required("lines")?],
        sample,
        order,
        start: values.number("header offset")?.unwrap_or(0),
        stride: None,
        nodata: values.text("data ignore value").map(str::to_owned),
        grid: map.as_ref().map(|map| (map.origin, map.step)),
        system: system.or(map.map(|map| (map.unit, map.crs))),
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

/// `map info`: projection, reference pixel (1, 1 is the corner of the first sample), its coordinates, steps,
/// zone, hemisphere and datum, units.
struct Map {
    origin: [f64; 2],
    step: [f64; 2],
    unit: Unit,
    crs: Option<String>,
}

impl Map {
    fn parse(values: &Values) -> Result<Option<Self>, Error> {
        let Some(text) = values.text("map info") else { return Ok(None) };
        let fields: Vec<&str> = text.split(',').map(str::trim).collect();
        let wrong = || values.error("map info", format!("expected a name and six numbers, found {text:?}"));
        let numbers: Vec<f64> = fields.iter().skip(1).map_while(|field| field.parse().ok()).take(6).collect();
        let &[column, row, east, north, dx, dy] = numbers.as_slice() else { return Err(wrong()) };
        let lower = text.to_lowercase();
        let unit = match () {
            _ if lower.starts_with("geographic") || lower.contains("units=degrees") => Unit::Degrees,
            _ if georef::is_web_mercator(&text.to_uppercase()) => Unit::Mercator,
            _ if lower.contains("units=feet") => Unit::Metres(FOOT),
            _ => Unit::Metres(1.0),
        };
        Ok(Some(Self {
            origin: [east + (1.5 - column) * dx, north - (1.5 - row) * dy],
            step: [dx, dy],
            unit,
            crs: crs(&fields),
        }))
    }
}

fn crs(fields: &[&str]) -> Option<String> {
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
