//! Height data: sources of heights, the files they are read from, and bounds over them.

pub mod bezier;
pub mod bounds;
pub mod cave;
mod damage;
pub mod demo;
pub(crate) mod disk_cache;
mod error;
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
mod statistics;
pub mod surface;
pub mod synth;
mod tiled;

pub use error::Error;
pub use field::Field;
pub use formats::{
    Encoding, FORMATS, Footprint, Format, HoleFill, Loaded, Located, MAX_SIDE, Options, Order, RawLayout, SampleType,
    SourceFile, load, load_all, load_bytes, load_bytes_with, number, place_of,
};
pub use georef::{Place, Unit, extent::Extent, metres_per_degree};
pub use holes::Holes;
pub use procedural::Procedural;
pub use raster::Raster;
pub use samples::Samples;
pub use source::{Block, Coverage, HeightSource};
pub use statistics::Statistics;
pub use tiled::Tiled;
