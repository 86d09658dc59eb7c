//! Textures: those made at start, the same bytes on every machine, and a picture cut into pages' maps.

pub mod detail;
mod noise;
pub mod page_maps;
pub mod resident_maps;
