//! Height files: one table of all formats, and a reader for each that is read.
//!
//! A format is a file of this folder with a function that reads it, and a row of [`FORMATS`].

mod archive;
mod asc;
mod bare_header;
mod bil;
mod companions;
mod decoded;
mod encoding;
mod envi;
mod finish;
mod folder;
mod format;
mod gather;
mod georeference;
mod head;
mod hgt;
mod input;
mod load;
mod loaded;
mod located;
mod metadata;
mod mosaic;
mod nodata;
mod options;
mod picture;
mod png;
mod raster_file;
mod raw;
mod raw_layout;
mod rounding;
mod sample;
mod sidecar;
mod table;
mod terrain_rgb;
mod text;
mod tiff;
mod tile_grid;
mod tiles;
mod unplaced;
mod usgs_dem;
mod words;
mod world_file;

pub use encoding::Encoding;
pub use finish::MAX_SIDE;
pub use format::Format;
pub use load::{load, load_all, load_bytes, load_bytes_with};
pub use loaded::{Footprint, Loaded, SourceFile};
pub use located::{Located, place_of};
pub use nodata::number;
pub use options::{HoleFill, Options};
pub use raw_layout::RawLayout;
pub use sample::{Order, SampleType};
pub use table::FORMATS;
