//! Loaders: what is written is read back, what is broken is refused.

mod exact;
mod malformed;
mod options;
mod place;
mod real;
pub mod tiff_file;
pub mod tiny;
