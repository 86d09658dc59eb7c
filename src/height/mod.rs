//! Height data: sources of heights, the files they are read from, and bounds over them.

mod affine;
mod archive;
mod asc;
pub mod bezier;
mod bil;
pub mod bounds;
pub mod cave;
mod crs;
mod cuts;
mod decoded;
pub mod demo;
pub(crate) mod disk_cache;
mod envi;
mod field;
mod folder;
mod geokeys;
mod georef;
mod geotiff;
mod hgt;
mod holes;
mod known_formats;
pub mod level_errors;
pub mod levels;
mod load;
mod located;
mod metadata;
mod mosaic;
mod nodata;
mod png;
mod procedural;
pub mod progress;
mod raster;
mod raw;
mod replace;
mod rounding;
pub mod rtin;
mod sample;
mod samples;
pub mod save;
mod sidecar;
mod source;
pub mod surface;
pub mod synth;
mod terrain_rgb;
mod text;
mod tiff_bands;
mod tiff_codec;
mod tiff_directory;
mod tiff_layout;
mod tiff_mask;
mod tiff_sample;
mod tile_grid;
mod tiled;
mod tiles;
mod units;
mod unplaced;
mod usgs_dem;
mod wkt;
mod world_file;

pub use decoded::MAX_SIDE;
pub use field::Field;
pub use georef::{Place, Unit, metres_per_degree};
pub use holes::Holes;
pub use load::{
    Encoding, HoleFill, Loaded, Options, RawLayout, SourceFile, load, load_all, load_bytes, load_bytes_with,
};
pub use located::{Footprint, Located, place_of};
pub use nodata::number;
pub use procedural::Procedural;
pub use raster::{Raster, Statistics};
pub use sample::{Order, SampleType};
pub use samples::Samples;
pub use source::{Block, Coverage, HeightSource};
pub use tiled::Tiled;

/// What is wrong with a file or a wish about it: the file, the field or position in it, and what was found.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {place}: {what}")]
pub struct Error {
    /// The file's name as given.
    pub file: String,
    /// The header field, line, row or byte position at fault.
    pub place: String,
    /// What was expected and what was found.
    pub what: String,
}

impl Error {
    /// An error at a place of a file.
    pub fn new(file: impl Into<String>, place: impl Into<String>, what: impl ToString) -> Self {
        Self { file: file.into(), place: place.into(), what: one_line(what.to_string()) }
    }
}

/// The text with spaces in place of line breaks and other control characters: decoders quote bytes of broken files.
fn one_line(text: String) -> String {
    if text.contains(char::is_control) { text.replace(char::is_control, " ") } else { text }
}
