//! GeoTIFF tags: the position of a TIFF's samples, and the units of coordinates and heights.

use std::io::{Read, Seek};

use tiff::{decoder::Decoder, tags::Tag};

use crate::height::georef::affine::Affine;
use crate::height::georef::crs::Crs;
use crate::height::georef::ellipsoid::Ellipsoid;
use crate::height::georef::epsg::from_epsg;
use crate::height::georef::mercator::is_web_mercator;
use crate::height::georef::unit::Unit;
use crate::height::georef::{registry, units, wkt};

const MODEL_TYPE: u16 = 1024;
const RASTER_TYPE: u16 = 1025;
const GEOGRAPHIC_TYPE: u16 = 2048;
const ANGULAR_UNITS: u16 = 2054;
const ANGULAR_UNIT_SIZE: u16 = 2055;
const SEMI_MAJOR_AXIS: u16 = 2057;
const SEMI_MINOR_AXIS: u16 = 2058;
const INVERSE_FLATTENING: u16 = 2059;
const PROJECTED_TYPE: u16 = 3072;
const LINEAR_UNITS: u16 = 3076;
const LINEAR_UNIT_SIZE: u16 = 3077;
const VERTICAL_TYPE: u16 = 4096;
const VERTICAL_UNITS: u16 = 4099;

/// The code for "described by further keys".
const USER_DEFINED: u16 = 32767;

/// Reads position and system; absent and broken tags are ignored.
pub fn read<R: Read + Seek>(decoder: &mut Decoder<R>, warnings: &mut Vec<String>) -> (Option<Affine>, Option<Crs>) {
    let keys = Keys::read(decoder);
    let centre = if keys.code(RASTER_TYPE) == Some(2) { 0.0 } else { 0.5 };
    let affine = affine(decoder, warnings).map(|affine| affine.shifted([centre; 2]));
    (affine, keys.crs(warnings))
}

/// The transformation of raster positions, of which (0, 0) is the corner or the centre of the first sample.
fn affine<R: Read + Seek>(decoder: &mut Decoder<R>, warnings: &mut Vec<String>) -> Option<Affine> {
    let matrix = doubles(decoder, Tag::ModelTransformationTag);
    let scale = doubles(decoder, Tag::ModelPixelScaleTag);
    let tie = doubles(decoder, Tag::ModelTiepointTag);
    if let [a, b, _, x, d, e, _, y, ..] = matrix[..] {
        return Some(Affine { origin: [x, y], column: [a, d], row: [b, e] });
    }
    match (&scale[..], &tie[..]) {
        ([dx, dy, ..], [i, j, _, x, y, ..]) => {
            if *dy < 0.0 {
                warnings
                    .push("ModelPixelScale: expected a positive y, found a negative one; taken as north up".to_owned());
            }
            Some(Affine { origin: [*x, *y], column: [*dx, 0.0], row: [0.0, -dy.abs()] }.shifted([-i, -j]))
        }
        ([], [_, _, _, _, _, _, _, ..]) => {
            warnings
                .push("ModelTiepoint: expected a pixel scale, found ground control points only; ignored".to_owned());
            None
        }
        _ => None,
    }
}

fn doubles<R: Read + Seek>(decoder: &mut Decoder<R>, tag: Tag) -> Vec<f64> {
    decoder.get_tag_f64_vec(tag).unwrap_or_default()
}

/// The directory of geographic keys.
struct Keys {
    /// Key, tag of the value, count, value or offset.
    entries: Vec<[u16; 4]>,
    doubles: Vec<f64>,
    text: String,
}

impl Keys {
    fn read<R: Read + Seek>(decoder: &mut Decoder<R>) -> Self {
        let directory = decoder.get_tag_u16_vec(Tag::GeoKeyDirectoryTag).unwrap_or_default();
        Self {
            entries: directory.as_chunks().0.iter().skip(1).copied().collect(),
            doubles: doubles(decoder, Tag::GeoDoubleParamsTag),
            text: decoder.get_tag_ascii_string(Tag::GeoAsciiParamsTag).unwrap_or_default(),
        }
    }

    fn code(&self, key: u16) -> Option<u16> {
        self.entries.iter().find(|entry| entry[0] == key && entry[1] == 0).map(|entry| entry[3])
    }

    fn double(&self, key: u16) -> Option<f64> {
        let entry = self.entries.iter().find(|entry| entry[0] == key && entry[1] != 0)?;
        self.doubles.get(usize::from(entry[3])).copied()
    }

    /// Returns a key's code, unless it is the code for "user-defined".
    fn registered(&self, key: u16) -> Option<u16> {
        self.code(key).filter(|code| *code != USER_DEFINED && *code != 0)
    }

    /// Returns the unit of a key, or the size of a user-defined unit from another key.
    fn unit(&self, key: u16, size: u16, known: fn(u16) -> Option<f64>) -> Option<f64> {
        let size = || self.double(size).filter(|size| size.is_finite() && *size > 0.0);
        self.code(key).and_then(known).or_else(size)
    }

    /// The coordinate reference system, if the keys name one.
    fn crs(&self, warnings: &mut Vec<String>) -> Option<Crs> {
        let horizontal = match (self.code(MODEL_TYPE), self.code(PROJECTED_TYPE), self.code(GEOGRAPHIC_TYPE)) {
            (Some(2), ..) | (None, None, Some(_)) => self.geographic(warnings),
            (Some(1), ..) | (None, Some(_), _) => self.projected(warnings),
            _ => return None,
        };
        let vertical = self.vertical(warnings);
        let height_unit = vertical.height_unit.or(horizontal.height_unit);
        Some(Crs { height_unit, is_depth: vertical.is_depth || horizontal.is_depth, ..horizontal })
    }

    /// The vertical system by its code, else by the unit that a key declares.
    fn vertical(&self, warnings: &mut Vec<String>) -> Crs {
        let by_code = self.registered(VERTICAL_TYPE).and_then(|code| registry::vertical(code.into()));
        let by_code = by_code.unwrap_or_default();
        let declared = self.code(VERTICAL_UNITS).and_then(units::length);
        if let (Some(registered), Some(declared)) = (by_code.height_unit, declared)
            && (registered / declared - 1.0).abs() > 1e-9
        {
            warnings.push(format!(
                "VerticalUnits: expected {registered} m as the vertical system has, found {declared} m; the system's is taken"
            ));
        }
        Crs { height_unit: by_code.height_unit.or(declared), ..by_code }
    }

    /// The system that a key names by code or a citation by well-known text.
    fn named(&self, key: u16, default: &str, warnings: &mut Vec<String>) -> Crs {
        let code = self.registered(key);
        let known = match code {
            Some(code) => from_epsg(code.into()).filter(|crs| crs.unit.is_some()),
            None => self.cited(),
        };
        if let (Some(code), None) = (code, &known) {
            warnings.push(format!("EPSG:{code}: expected a known system; taken as one in {default} (--spacing)"));
        }
        let name = code.map(|code| format!("EPSG:{code}")).or_else(|| self.citation());
        Crs { name, ..known.unwrap_or_default() }
    }

    fn geographic(&self, warnings: &mut Vec<String>) -> Crs {
        let named = self.named(GEOGRAPHIC_TYPE, "degrees on WGS 84", warnings);
        let (known_radians, known_ellipsoid) = match named.unit {
            Some(Unit::Angles { radians, ellipsoid }) => (Some(radians), Some(ellipsoid)),
            _ => (None, None),
        };
        let radians = self.unit(ANGULAR_UNITS, ANGULAR_UNIT_SIZE, units::angle).or(known_radians);
        let ellipsoid = self.ellipsoid().or(known_ellipsoid);
        let unit = Unit::Angles {
            radians: radians.unwrap_or(1f64.to_radians()),
            ellipsoid: ellipsoid.unwrap_or(Ellipsoid::WGS84),
        };
        Crs { unit: Some(unit), ..named }
    }

    fn projected(&self, warnings: &mut Vec<String>) -> Crs {
        let named = self.named(PROJECTED_TYPE, "metres", warnings);
        let is_named = self.registered(PROJECTED_TYPE).is_some();
        let is_earth = self.ellipsoid().is_none_or(Ellipsoid::is_earth);
        let is_mercator = named.unit == Some(Unit::Mercator);
        if is_mercator || !is_named && is_earth && is_web_mercator(&self.text) {
            return Crs { unit: Some(Unit::Mercator), ..named };
        }
        let known = match named.unit {
            Some(Unit::Metres(metres)) => Some(metres),
            _ => None,
        };
        let metres = self.unit(LINEAR_UNITS, LINEAR_UNIT_SIZE, units::length).or(known);
        Crs { unit: Some(Unit::Metres(metres.unwrap_or(1.0))), ..named }
    }

    /// Returns the ellipsoid of user-defined axes.
    fn ellipsoid(&self) -> Option<Ellipsoid> {
        let a = self.double(SEMI_MAJOR_AXIS)?;
        let by_inverse =
            self.double(INVERSE_FLATTENING).map(|inverse| if inverse == 0.0 { 0.0 } else { 1.0 / inverse });
        let flattening = by_inverse.or_else(|| self.double(SEMI_MINOR_AXIS).map(|b| (a - b) / a));
        Ellipsoid::new(a, flattening.unwrap_or(0.0))
    }

    /// The system in a citation that holds ESRI's text of it.
    fn cited(&self) -> Option<Crs> {
        let (_, text) = self.text.split_once("ESRI PE String =")?;
        wkt::parse(text.split('|').next()?)
    }

    fn citation(&self) -> Option<String> {
        self.text.split('|').next().map(str::trim).filter(|text| !text.is_empty()).map(str::to_owned)
    }
}
