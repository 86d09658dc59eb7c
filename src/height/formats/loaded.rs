//! The result of reading height files.

use serde::Serialize;

use crate::height::field::Field;
use crate::height::georef::place::Place;

/// A field read from a file, and information about the file.
#[derive(Clone, Debug)]
pub struct Loaded {
    /// The heights.
    pub field: Field,
    /// Name of the file format.
    pub format: &'static str,
    /// Name of the type of a stored sample, as in `i16`.
    pub sample_type: String,
    /// True if 16 bits a sample hold every height without loss.
    pub exact_in_16_bit: bool,
    /// Part of the file that was read, and its position.
    pub footprint: Footprint,
    /// Warnings for the user, one sentence each.
    pub warnings: Vec<String>,
    /// The files that the heights come from, in the order in which a later one overlies an earlier one.
    pub sources: Vec<SourceFile>,
}

/// A file that heights come from, and its position in the field before the crop.
#[derive(Clone, Debug, PartialEq, Eq, Serialize)]
pub struct SourceFile {
    /// The file's name; of a member of an archive after the archive's name.
    pub file: String,
    /// Name of the file format.
    pub format: &'static str,
    /// Column and row of its north-west sample.
    pub at: [u32; 2],
    /// Samples along (x, z).
    pub size: [u32; 2],
}

/// The part of a file that a field was read from, and its position.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Footprint {
    /// Samples of the whole file (x, z).
    pub whole: [u32; 2],
    /// The field's first sample in it.
    pub first: [u32; 2],
    /// Place of that sample, if the file states one.
    pub place: Option<Place>,
}
