//! Loaders: what is written is read back, what is broken is refused.

mod checksums;
mod crs;
mod exact;
mod lzw;
mod malformed;
mod nodata;
mod options;
mod place;
mod real;
mod reports;
mod sidecar;
mod tiff_bands;
pub mod tiff_file;
mod tiff_types;
pub mod tiny;
