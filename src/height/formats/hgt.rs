//! SRTM `.hgt`: a degree of big-endian 16-bit metres, edges shared with neighbours.
//!
//! The file has no header: the length gives the size, the name the position of the south-west corner.

use super::decoded::Decoded;
use super::input::Input;
use super::options::Options;
use super::raw::Rows;
use super::sample::{Order, SampleType};
use crate::height::error::Error;
use crate::height::georef::ellipsoid::metres_per_degree;
use crate::height::georef::place::Place;
use crate::height::georef::unit::Unit;

/// The value of a void.
const VOID: f64 = -32768.0;
/// Samples along (x, z) of known tiles: 3, 1 and ½ arc-seconds; 2 by 1 arc-seconds beyond 50° or 60° of latitude.
const SIZES: [[u32; 2]; 4] = [[1201, 1201], [3601, 3601], [7201, 7201], [1801, 3601]];

/// Samples along (x, z) of a file of this length, if there is such a file.
pub(super) fn size(len: u64) -> Option<[u32; 2]> {
    SIZES.into_iter().find(|&[w, h]| u64::from(w) * u64::from(h) * 2 == len)
}

/// Returns the error text for a file that is named as a tile and has the length of none; `None` for other names.
pub(super) fn wrong_length(name: &str, len: u64) -> Option<String> {
    let lengths = SIZES.map(|[w, h]| (2 * u64::from(w) * u64::from(h)).to_string()).join(", ");
    let is_tile = name.to_ascii_lowercase().ends_with(".hgt");
    is_tile.then(|| format!("expected an SRTM tile of {lengths} bytes, found {len}: it is incomplete or damaged"))
}

/// Reads a tile.
pub(super) fn read(input: &mut Input, options: &Options) -> Result<Decoded, Error> {
    let expected = "expected 1201², 3601², 7201² or 1801 x 3601 samples of 2 bytes";
    let size = size(input.len).ok_or_else(|| input.error("length", expected))?;
    let corner = input.name.rsplit(['/', '\\']).find_map(Corner::of);
    if let Some(Corner { part: Some(part), position }) = &corner {
        return Err(input.error("name", part_of_a_degree(part, *position, size)));
    }
    let count = input.samples(size.map(u64::from), options)?;
    let rows = Rows { sample: SampleType::I16, order: Order::Big, start: 0, stride: u64::from(size[0]) * 2 };
    let samples = rows.read(input, size, count)?;
    let mut raster = Decoded::new("i16", size, samples);
    raster.nodata = Some(VOID);
    if corner.is_none() {
        raster.warnings.push("the name has no position as N42E001 has: taken to lie at 0°N 0°E".to_owned());
    }
    let [lon, lat] = corner.map_or([0.0, 0.0], |corner| corner.position);
    raster.place = Some(Place {
        origin: [lon, lat + 1.0],
        step: size.map(|n| 1.0 / f64::from(n - 1)),
        unit: Unit::DEGREES,
        crs: Some("EPSG:4326".to_owned()),
    });
    Ok(raster)
}

/// The error of a tile such as `N45W074T86`: 1 of 9 x 9 parts of a degree, at 1/3 arc-second. The order of their
/// numbers is not published.
fn part_of_a_degree(part: &str, [_, lat]: [f64; 2], [w, h]: [u32; 2]) -> String {
    let [dx, dz] = metres_per_degree(lat + 0.5).map(|metres| metres / 9.0);
    let (dx, dz) = (dx / f64::from(w - 1), dz / f64::from(h - 1));
    format!(
        "expected a whole degree, found {part}, one of 9 x 9 parts whose place is not known: \
         --raw {w}x{h}:i16be --spacing {dx:.3},{dz:.3} --nodata -32768 reads it alone"
    )
}

/// The position in a tile's name.
#[derive(Debug, PartialEq)]
struct Corner {
    /// Longitude and latitude of the south-west corner, degrees.
    position: [f64; 2],
    /// The part of the degree, as `T86`.
    part: Option<String>,
}

impl Corner {
    /// The position in a name such as `N42E001.hgt`, `n42_e001_1arc.hgt` or `NASADEM_HGT_n42e001.hgt`.
    fn of(name: &str) -> Option<Self> {
        let is_begin = |at: &usize| *at == 0 || !name.as_bytes()[at - 1].is_ascii_alphanumeric();
        (0..name.len()).filter(is_begin).find_map(|at| Self::at_start(name.get(at..)?))
    }

    fn at_start(name: &str) -> Option<Self> {
        let (lat, rest) = degrees(name, 2, ['N', 'S'])?;
        let (lon, rest) = degrees(rest.strip_prefix('_').unwrap_or(rest), 3, ['E', 'W'])?;
        if lat.abs() > 90.0 || lon.abs() > 180.0 {
            return None;
        }
        let mut letters = rest.chars();
        let is_part = letters.next().is_some_and(|c| c.eq_ignore_ascii_case(&'T'));
        let digits: String = letters.take_while(char::is_ascii_digit).collect();
        let part = (is_part && !digits.is_empty()).then(|| format!("T{digits}"));
        Some(Self { position: [lon, lat], part })
    }
}

/// Degrees after a letter for their sign, and what follows.
fn degrees(text: &str, digits: usize, [positive, negative]: [char; 2]) -> Option<(f64, &str)> {
    let number = text.get(1..=digits).filter(|number| number.bytes().all(|b| b.is_ascii_digit()))?;
    let number: f64 = number.parse().ok()?;
    match text.chars().next()?.to_ascii_uppercase() {
        letter if letter == positive => Some((number, &text[digits + 1..])),
        letter if letter == negative => Some((-number, &text[digits + 1..])),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_say_positions() {
        for (name, position) in [
            ("N42E001.hgt", [1.0, 42.0]),
            ("n45w074.hgt", [-74.0, 45.0]),
            ("N45W074.SRTMGL1.hgt", [-74.0, 45.0]),
            ("NASADEM_HGT_s01e010.hgt", [10.0, -1.0]),
            ("n45_w074_1arc_v3.hgt", [-74.0, 45.0]),
            ("S01W180", [-180.0, -1.0]),
        ] {
            assert_eq!(Corner::of(name), Some(Corner { position, part: None }), "{name}");
        }
        assert_eq!(Corner::of("N45W074T86.hgt").and_then(|corner| corner.part).as_deref(), Some("T86"));
        for name in
            ["45N074W.hgt", "N4E001.hgt", "N99E001.hgt", "N42E181.hgt", "land.hgt", "xN42E001.hgt", "N42E0é1", "é"]
        {
            assert_eq!(Corner::of(name), None, "{name}");
        }
    }
}
