//! Loaders: what is written is read back, what is broken is refused.

mod crs;
mod exact;
mod malformed;
mod options;
mod place;
mod real;
mod reports;
mod sidecar;
pub mod tiff_file;
pub mod tiny;
