//! Loaders: what is written is read back, what is broken is refused.

mod exact;
mod known;
mod malformed;
mod mosaic;
mod options;
mod place;
mod real;
mod text_grids;
pub mod tiff_file;
mod tile_rows;
pub mod tiny;
