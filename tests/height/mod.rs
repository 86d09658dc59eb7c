//! Loaders: what is written is read back, what is broken is refused.

mod exact;
mod malformed;
mod options;
mod place;
mod real;
mod tiff_file;
mod tiny;
