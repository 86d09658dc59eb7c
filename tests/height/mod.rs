//! Loaders: what is written is read back, what is broken is refused.

mod checksums;
mod crs;
mod damaged;
mod exact;
mod known;
mod lzw;
mod malformed;
mod mosaic;
mod nodata;
mod options;
mod place;
mod real;
mod reports;
mod sidecar;
mod text_grids;
mod tiff_bands;
pub mod tiff_file;
mod tiff_types;
mod tile_rows;
pub mod tiny;
