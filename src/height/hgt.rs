//! SRTM `.hgt`: a square of big-endian 16-bit metres, 3 or 1 arc-seconds apart, edges shared with neighbours.
//!
//! The file has no header: the length gives the size, the name the position of the south-west corner.

use super::{
    Error,
    georef::{Place, Unit},
    load::{Options, Source},
    raster::Raster,
    raw::Rows,
    sample::{Order, SampleType},
};

/// The value of a void.
const VOID: f64 = -32768.0;

/// Samples a side of a file of this length, if there is such a file.
pub(super) fn side(len: u64) -> Option<u32> {
    [1201, 3601].into_iter().find(|&n| u64::from(n) * u64::from(n) * 2 == len)
}

/// Reads a tile.
pub(super) fn read(source: &mut Source, options: &Options) -> Result<Raster, Error> {
    let side = side(source.len).ok_or_else(|| source.error("length", "expected 1201² or 3601² samples"))?;
    let count = source.samples([u64::from(side); 2], options)?;
    let rows = Rows { sample: SampleType::I16, order: Order::Big, start: 0, stride: u64::from(side) * 2 };
    let samples = rows.read(source, [side; 2], count)?;
    let mut raster = Raster::new("SRTM HGT", "i16", [side; 2], samples);
    raster.nodata = Some(VOID);
    let corner = source.name.rsplit(['/', '\\']).find_map(south_west);
    if corner.is_none() {
        raster.warnings.push("the name has no position as N42E001 has: taken to lie at 0°N 0°E".to_owned());
    }
    let [lon, lat] = corner.unwrap_or([0.0, 0.0]);
    raster.place = Some(Place {
        origin: [lon, lat + 1.0],
        step: [1.0 / f64::from(side - 1); 2],
        unit: Unit::DEGREES,
        crs: Some("EPSG:4326".to_owned()),
    });
    Ok(raster)
}

/// Longitude and latitude in a name such as `N42E001.hgt`, degrees.
fn south_west(name: &str) -> Option<[f64; 2]> {
    let degrees = |at: usize, digits: usize, positive: u8, negative: u8| {
        let number: f64 = name.get(at + 1..at + 1 + digits)?.parse().ok()?;
        match name.as_bytes()[at].to_ascii_uppercase() {
            letter if letter == positive => Some(number),
            letter if letter == negative => Some(-number),
            _ => None,
        }
    };
    let (lat, lon) = (degrees(0, 2, b'N', b'S')?, degrees(3, 3, b'E', b'W')?);
    (lat.abs() <= 90.0 && lon.abs() <= 180.0).then_some([lon, lat])
}
