//! The result of every reader: samples as a file stores them.

use super::georeference::Georeference;
use crate::height::georef::affine::Turn;
use crate::height::georef::place::Place;
use crate::height::holes::Holes;
use crate::height::samples::Samples;

/// Samples as a file stores them, before crop, holes and metres.
pub(super) struct Decoded {
    /// Name of the file format.
    pub format: &'static str,
    /// Name of the reader's own, in place of that of its row in [`FORMATS`](super::FORMATS).
    pub variant: Option<&'static str>,
    /// Name of the type of a stored sample, as in `i16`.
    pub sample_type: String,
    /// Samples along (x, z).
    pub size: [u32; 2],
    /// The values, in the order of the file.
    pub samples: Samples,
    /// Samples that the file marks as missing otherwise than by a value.
    pub holes: Holes,
    /// The value that means "no data", times `step`.
    pub nodata: Option<f64>,
    /// Units a value counts.
    pub step: f64,
    /// The band's own scale, which multiplies that.
    pub scale: f64,
    /// Added to the scaled value, units.
    pub offset: f64,
    /// Metres a unit.
    pub unit: f64,
    /// Statements about position and units that are yet to be settled.
    pub georeference: Georeference,
    /// Position of the samples once turned.
    pub place: Option<Place>,
    /// The turn that lays the file's samples north up.
    pub turn: Turn,
    /// Warnings for the user, one sentence each.
    pub warnings: Vec<String>,
}

impl Decoded {
    /// Values in metres without holes or place.
    pub fn new(sample_type: &str, size: [u32; 2], samples: Samples) -> Self {
        let holes = Holes::none(samples.len());
        Self {
            format: "",
            variant: None,
            sample_type: sample_type.to_owned(),
            size,
            samples,
            holes,
            nodata: None,
            step: 1.0,
            scale: 1.0,
            offset: 0.0,
            unit: 1.0,
            georeference: Georeference::default(),
            place: None,
            turn: Turn::default(),
            warnings: Vec::new(),
        }
    }
}
