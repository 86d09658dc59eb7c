//! Height data: sources of heights, the files they are read from, and bounds over them.

pub mod bezier;
pub mod bounds;
pub mod cave;
mod cuts;
mod damage;
pub mod demo;
pub(crate) mod disk_cache;
mod field;
mod formats;
mod georef;
mod holes;
pub mod level_errors;
pub mod levels;
mod procedural;
pub mod progress;
mod raster;
mod replace;
pub mod rtin;
mod samples;
pub mod save;
mod source;
pub mod surface;
pub mod synth;
mod tiled;

pub use field::Field;
pub use formats::{
    Encoding, FORMATS, Footprint, Format, HoleFill, Loaded, Located, MAX_SIDE, Options, Order, RawLayout, SampleType,
    SourceFile, load, load_all, load_bytes, load_bytes_with, number, place_of,
};
pub use georef::{Place, Unit, extent::Extent, metres_per_degree};
pub use holes::Holes;
pub use procedural::Procedural;
pub use raster::{Raster, Statistics};
pub use samples::Samples;
pub use source::{Block, Coverage, HeightSource};
pub use tiled::Tiled;

/// An error about a file or an option: the file, the field or position in it, what was expected and what was found.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {place}: {what}")]
pub struct Error {
    /// The file's name as given.
    pub file: String,
    /// The header field, line, row or byte position at fault.
    pub place: String,
    /// The expected and the found content.
    pub what: String,
}

impl Error {
    /// Makes an error at a place of a file.
    pub fn new(file: impl Into<String>, place: impl Into<String>, what: impl ToString) -> Self {
        Self { file: file.into(), place: place.into(), what: damage::in_plain_words(one_line(what.to_string())) }
    }
}

/// Returns the text with spaces in place of line breaks and other control characters: decoders quote bytes of broken
/// files.
fn one_line(text: String) -> String {
    if text.contains(char::is_control) { text.replace(char::is_control, " ") } else { text }
}
