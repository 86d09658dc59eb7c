//! USGS DEM: text in records of 1024 bytes; profiles that run north, from west to east, of different lengths.
//!
//! Record A describes the grid, a record B with its continuations is a profile. Fields are as in "Standards for
//! Digital Elevation Models", part 2 (1998); files from before 1988 end record A after the profile count.

use std::io::SeekFrom;

use super::decoded::Decoded;
use super::input::Input;
use super::options::Options;
use crate::height::error::Error;
use crate::height::georef::crs::Crs;
use crate::height::georef::epsg::from_epsg;
use crate::height::georef::place::Place;
use crate::height::georef::unit::Unit;
use crate::height::georef::units::FOOT;
use crate::height::holes::Holes;
use crate::height::samples::Samples;

/// Bytes of a record.
const RECORD: usize = 1024;
/// Byte position of the elevations in a profile's first record.
const ELEVATIONS: usize = 144;
/// Elevations, of 6 bytes each, in a profile's first record and in its continuations.
const IN_FIRST: usize = 146;
const IN_NEXT: usize = 170;
/// The elevation of a void.
const VOID: i32 = -32767;

/// Returns true if a file begins with a record A.
pub(super) fn is_header(head: &[u8]) -> bool {
    Header::parse(head).is_some()
}

/// The numbers of record A.
struct Header {
    /// 0 geographic, 1 UTM, otherwise other systems.
    system: i32,
    zone: i32,
    /// 0 radians, 1 feet, 2 metres, 3 arc-seconds.
    ground_unit: i32,
    /// 1 feet, 2 metres.
    height_unit: i32,
    /// Steps (x, y) in ground units, and of the elevation.
    step: [f64; 3],
    profiles: i32,
    /// South and north end of the quadrangle, in ground units.
    north: Option<[f64; 2]>,
    /// 1 NAD 27, 2 WGS 72, 3 WGS 84, 4 NAD 83.
    datum: i32,
}

impl Header {
    fn parse(record: &[u8]) -> Option<Self> {
        let [level, pattern] = [144, 150].map(|at| number::<i32>(record, at, 6));
        let header = Self {
            system: number(record, 156, 6)?,
            zone: number(record, 162, 6).unwrap_or(0),
            ground_unit: number(record, 528, 6)?,
            height_unit: number(record, 534, 6)?,
            step: [number(record, 816, 12)?, number(record, 828, 12)?, number(record, 840, 12)?],
            profiles: number(record, 858, 6)?,
            north: north(record),
            datum: number(record, 890, 2).unwrap_or(1),
        };
        let plausible = (1..=4).contains(&level?)
            && (1..=2).contains(&pattern?)
            && (0..=3).contains(&header.ground_unit)
            && (1..=2).contains(&header.height_unit);
        plausible.then_some(header)
    }

    /// EPSG codes of the datum's geographic system and of its UTM zone 0.
    fn codes(&self) -> (u32, i32) {
        match self.datum {
            2 => (4322, 32200),
            3 => (4326, 32600),
            4 => (4269, 26900),
            _ => (4267, 26700),
        }
    }

    /// Degrees on the ellipsoid of the datum.
    fn angles(&self) -> Unit {
        from_epsg(self.codes().0).and_then(|crs| crs.unit).unwrap_or(Unit::DEGREES)
    }

    fn crs(&self) -> Option<String> {
        let (geographic, utm) = self.codes();
        match self.system {
            0 => Some(format!("EPSG:{geographic}")),
            1 if (1..=60).contains(&self.zone) => Some(format!("EPSG:{}", utm + self.zone)),
            _ => None,
        }
    }
}

/// The lowest and highest northing of the quadrangle's four corners.
fn north(record: &[u8]) -> Option<[f64; 2]> {
    (0..4).try_fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], corner| {
        let y = number::<f64>(record, 546 + corner * 48 + 24, 24)?;
        Some([low.min(y), high.max(y)])
    })
}

/// The number in a field, written the Fortran way.
fn number<T: std::str::FromStr>(record: &[u8], at: usize, len: usize) -> Option<T> {
    let text = str::from_utf8(record.get(at..at + len)?).ok()?;
    text.trim().replace(['D', 'd'], "E").parse().ok()
}

/// Elevations from south to north.
struct Profile {
    /// Coordinates of the first elevation.
    first: [f64; 2],
    /// Added to each elevation.
    base: f64,
    elevations: Vec<i32>,
}

/// Reads a grid; cells outside the profiles are holes.
pub(super) fn read(input: &mut Input, options: &Options) -> Result<Decoded, Error> {
    let mut record = [0; RECORD];
    input.need("record A", 2 * RECORD as u64)?;
    input.reader.read_exact(&mut record).map_err(|e| input.error("record A", e))?;
    let header = Header::parse(&record).ok_or_else(|| input.error("record A", "expected the header of a USGS DEM"))?;
    if header.step.iter().any(|step| !(1e-9..=1e9).contains(step)) {
        return Err(
            input.error("record A, spatial resolution", format!("expected positive steps, found {:?}", header.step))
        );
    }
    let profiles = read_profiles(input, &header)?;

    // The rectangle around all profiles, in steps.
    let steps = |axis: usize, at: f64| (at / header.step[axis]).round();
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for profile in &profiles {
        let first = [steps(0, profile.first[0]), steps(1, profile.first[1])];
        let last = [first[0], first[1] + profile.elevations.len() as f64 - 1.0];
        for axis in 0..2 {
            low[axis] = low[axis].min(first[axis]);
            high[axis] = high[axis].max(last[axis]);
        }
    }
    // The profiles lie within a quadrangle whose sides are not quite north; the grid has all its rows.
    if let Some([south, north]) = header.north {
        low[1] = low[1].min((south / header.step[1]).floor());
        high[1] = high[1].max((north / header.step[1]).ceil());
    }
    // Larger steps are no longer exact; no grid on Earth has them.
    if low.iter().chain(&high).any(|at| !(-1e12..=1e12).contains(at)) {
        return Err(input.error("profiles", format!("expected coordinates of a grid, found {low:?} to {high:?} steps")));
    }
    let size = [0, 1].map(|axis| (high[axis] - low[axis] + 1.0) as u64);
    let count = input.samples(size, options)?;

    let (mut heights, mut known) = (vec![0.0; count], Holes::none(count));
    for profile in &profiles {
        let i = (steps(0, profile.first[0]) - low[0]) as usize;
        let south = (high[1] - steps(1, profile.first[1])) as usize;
        for (n, &elevation) in profile.elevations.iter().enumerate().filter(|(_, e)| **e != VOID) {
            let k = (south - n) * size[0] as usize + i;
            heights[k] = (f64::from(elevation) + profile.base / header.step[2]) as f32;
            known.insert(k);
        }
    }
    let mut holes = Holes::none(count);
    (0..count).filter(|&k| !known.contains(k)).for_each(|k| holes.insert(k));

    let mut raster = Decoded::new("text", size.map(|n| n as u32), Samples::F32(heights));
    raster.holes = holes;
    raster.step = header.step[2];
    let height_unit = Some(if header.height_unit == 1 { FOOT } else { 1.0 });
    raster.georeference.crs = Some(Crs { height_unit, ..Crs::default() });
    raster.place = Some(place(&header, [low[0], high[1]]));
    Ok(raster)
}

/// The place of a grid whose north-west sample is at a position in steps.
fn place(header: &Header, corner: [f64; 2]) -> Place {
    let (unit, factor) = match header.ground_unit {
        0 => (header.angles(), 1f64.to_degrees()),
        1 => (Unit::Metres(FOOT), 1.0),
        2 => (Unit::Metres(1.0), 1.0),
        _ => (header.angles(), 1.0 / 3600.0),
    };
    let step = [header.step[0] * factor, header.step[1] * factor];
    Place { origin: [corner[0] * step[0], corner[1] * step[1]], step, unit, crs: header.crs() }
}

fn read_profiles(input: &mut Input, header: &Header) -> Result<Vec<Profile>, Error> {
    let records = input.len / RECORD as u64;
    if header.profiles < 2 || header.profiles as u64 >= records {
        let what = format!("expected 2 to {}, for a record takes 1024 bytes, found {}", records - 1, header.profiles);
        return Err(input.error("record A, number of profiles", what));
    }
    let mut at = RECORD as u64;
    (0..header.profiles).map(|_| read_profile(input, &mut at)).collect()
}

fn read_profile(input: &mut Input, at: &mut u64) -> Result<Profile, Error> {
    let mut record = [0; RECORD];
    next(input, at, &mut record)?;
    let error = |place: &str, input: &Input, at: u64| {
        input.error(format!("record at byte {}, {place}", at - RECORD as u64), "expected a number in range, found none")
    };
    let field = |place: usize| number::<f64>(&record, place, 24).filter(|value| value.abs() < 1e12);
    let first = [field(24), field(48)];
    let [Some(x), Some(y)] = first else { return Err(error("first coordinates", input, *at)) };
    let base = field(72).ok_or_else(|| error("local datum", input, *at))?;
    let count: usize = number(&record, 12, 6).ok_or_else(|| error("number of elevations", input, *at))?;
    let mut elevations = Vec::new();
    let (mut begin, mut room) = (ELEVATIONS, IN_FIRST);
    while elevations.len() < count {
        for n in 0..room.min(count - elevations.len()) {
            let elevation = number(&record, begin + n * 6, 6);
            elevations.push(elevation.ok_or_else(|| error(&format!("elevation {n}"), input, *at))?);
        }
        if elevations.len() < count {
            next(input, at, &mut record)?;
            (begin, room) = (0, IN_NEXT);
        }
    }
    Ok(Profile { first: [x, y], base, elevations })
}

/// Reads the record at `at` and moves on.
fn next(input: &mut Input, at: &mut u64, record: &mut [u8; RECORD]) -> Result<(), Error> {
    let read = input.reader.seek(SeekFrom::Start(*at)).and_then(|_| input.reader.read_exact(record));
    read.map_err(|e| input.error(format!("record at byte {at}"), e))?;
    *at += RECORD as u64;
    Ok(())
}
