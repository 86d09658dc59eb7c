//! GeoTIFF tags: where a TIFF's samples lie.

use std::io::{Read, Seek};

use tiff::{decoder::Decoder, tags::Tag};

use super::georef::{self, FOOT, Place, US_FOOT, Unit};

const MODEL_TYPE: u16 = 1024;
const RASTER_TYPE: u16 = 1025;
const GEOGRAPHIC_TYPE: u16 = 2048;
const PROJECTED_TYPE: u16 = 3072;
const LINEAR_UNITS: u16 = 3076;
const LINEAR_UNIT_SIZE: u16 = 3077;
const VERTICAL_UNITS: u16 = 4099;

/// The code for "described by further keys".
const USER_DEFINED: u16 = 32767;

/// What the tags say.
pub(super) struct Georeference {
    pub place: Option<Place>,
    /// Whether columns run west and rows north.
    pub flip: [bool; 2],
    /// Metres a unit of height.
    pub height_unit: f64,
    pub warnings: Vec<String>,
}

/// Reads the tags; ones that are absent or broken say nothing.
pub(super) fn read<R: Read + Seek>(decoder: &mut Decoder<R>, size: [u32; 2]) -> Georeference {
    let keys = Keys::read(decoder);
    let mut warnings = Vec::new();
    let centre = if keys.code(RASTER_TYPE) == Some(2) { 0.0 } else { 0.5 };
    let transform = affine(decoder, &mut warnings);
    let flip = transform.map_or([false; 2], |[_, dx, _, dy]| [dx < 0.0, dy > 0.0]);
    let place = transform.map(|[x, dx, y, dy]| {
        // The north-west sample is the last of a row or column that is flipped.
        let first = |flip: bool, side: u32| centre + if flip { f64::from(side - 1) } else { 0.0 };
        let origin = [x + first(flip[0], size[0]) * dx, y + first(flip[1], size[1]) * dy];
        let step = [dx.abs(), dy.abs()];
        match keys.unit() {
            Some(unit) => Place { origin, step, unit, crs: keys.crs() },
            None => {
                let (place, warning) = Place::guessed((origin, step), size);
                warnings.push(warning);
                place
            }
        }
    });
    let height_unit = keys.code(VERTICAL_UNITS).and_then(length_unit).unwrap_or(1.0);
    Georeference { place, flip, height_unit, warnings }
}

/// x and y of raster position (0, 0), and their steps along columns and rows: x, dx, y, dy.
fn affine<R: Read + Seek>(decoder: &mut Decoder<R>, warnings: &mut Vec<String>) -> Option<[f64; 4]> {
    let matrix = doubles(decoder, Tag::ModelTransformationTag);
    let scale = doubles(decoder, Tag::ModelPixelScaleTag);
    let tie = doubles(decoder, Tag::ModelTiepointTag);
    let affine = if let [a, b, _, x, d, e, _, y, ..] = matrix[..] {
        if b.abs() > 1e-6 * a.abs() || d.abs() > 1e-6 * e.abs() {
            warnings.push("the grid is rotated against north; it is shown unrotated".to_owned());
        }
        [x, a.hypot(d).copysign(a), y, b.hypot(e).copysign(e)]
    } else if let ([dx, dy, ..], [i, j, _, x, y, ..]) = (&scale[..], &tie[..]) {
        // A negative scale is a mistake of writers: by definition it means north up.
        let (dx, dy) = (dx.abs(), dy.abs());
        [x - i * dx, dx, y + j * dy, -dy]
    } else {
        return None;
    };
    if affine.iter().all(|n| n.is_finite()) && affine[1] != 0.0 && affine[3] != 0.0 {
        return Some(affine);
    }
    warnings.push("the georeference is degenerate and ignored".to_owned());
    None
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

    /// The unit of coordinates, if the keys name a coordinate system.
    fn unit(&self) -> Option<Unit> {
        let (geographic, projected) = (self.code(GEOGRAPHIC_TYPE), self.code(PROJECTED_TYPE));
        match (self.code(MODEL_TYPE), projected, geographic) {
            (Some(2), ..) | (None, None, Some(_)) => Some(Unit::Degrees),
            (Some(1), ..) | (None, Some(_), _) => {
                let mercator = [Some(3857), Some(3785)].contains(&projected);
                let named = projected.is_none_or(|code| code == USER_DEFINED);
                if mercator || named && georef::is_web_mercator(&self.text.to_uppercase()) {
                    return Some(Unit::Mercator);
                }
                let factor = self.code(LINEAR_UNITS).and_then(length_unit).or(self.double(LINEAR_UNIT_SIZE));
                Some(Unit::Metres(factor.unwrap_or(1.0)))
            }
            _ => None,
        }
    }

    fn crs(&self) -> Option<String> {
        let codes = [self.code(PROJECTED_TYPE), self.code(GEOGRAPHIC_TYPE)];
        match codes.into_iter().flatten().find(|code| *code != USER_DEFINED && *code != 0) {
            Some(code) if self.code(PROJECTED_TYPE) != Some(USER_DEFINED) => Some(format!("EPSG:{code}")),
            _ => self.text.split('|').next().map(str::trim).filter(|text| !text.is_empty()).map(str::to_owned),
        }
    }
}

/// Metres of an EPSG unit of length.
fn length_unit(code: u16) -> Option<f64> {
    match code {
        9001 => Some(1.0),
        9002 => Some(FOOT),
        9003 => Some(US_FOOT),
        9036 => Some(1000.0),
        _ => None,
    }
}
