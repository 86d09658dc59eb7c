//! Position of a picture in its coordinate system, to lay it over a field.

use std::path::Path;

use tiff::decoder::Decoder;

use super::decoded::Decoded;
use super::georeference::Georeference;
use super::input::{self, Input};
use super::options::Options;
use super::sidecar;
use super::tiff::geokeys;
use crate::height::error::Error;
use crate::height::georef::place::Place;
use crate::height::samples::Samples;

/// Position of a picture.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Located {
    /// Place of its north-west texel's centre once turned, and length of a texel, if the file states them.
    pub place: Option<Place>,
    /// The file's rows are columns.
    pub transposed: bool,
    /// Once transposed, columns run west and rows north.
    pub flip: [bool; 2],
    /// Warnings for the user, one sentence each.
    pub warnings: Vec<String>,
}

/// Reads the position of a picture of this size from its GeoTIFF tags, `.aux.xml`, world file and `.prj`.
///
/// # Errors
/// If the file cannot be read.
pub fn place_of(path: &Path, size: [u32; 2]) -> Result<Located, Error> {
    input::with_input(path, |input| Ok(located(input, size)))
}

fn located(input: &mut Input, size: [u32; 2]) -> Located {
    let mut raster = Decoded::new("u8", size, Samples::F32(Vec::new()));
    if let Ok(mut decoder) = Decoder::new(&mut input.reader) {
        let (affine, crs) = geokeys::read(&mut decoder, &mut raster.warnings);
        raster.georeference = Georeference { affine, crs, ..Georeference::default() };
    }
    // Its values are colours, whose unit does not matter.
    let options = Options { height_scale: Some(1.0), ..Options::default() };
    sidecar::settle(input, &options, &mut raster);
    let Decoded { place, turn, mut warnings, .. } = raster;
    // A guess at the unit does not matter: coordinates without a system are the terrain's.
    warnings.retain(|warning| !warning.contains("--spacing"));
    Located { place, transposed: turn.transposed, flip: turn.flip, warnings }
}
