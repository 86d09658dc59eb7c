//! Synthetic fields: bytes that never change, and the files they are saved to.

mod assets;
mod fields;
mod save;
