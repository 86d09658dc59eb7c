//! Synthetic fields: bytes that never change, and the files they are saved to.

pub mod assets;
mod fields;
mod overlay;
mod save;
