//! Textures: those made at start, the same bytes on every machine; a picture cut into pages' maps; and which part of a map
//! a frame needs, how fine.

pub mod detail;
pub mod hidden;
pub mod mip_spheres;
mod noise;
pub mod page_maps;
pub mod picture_maps;
pub mod pieces;
pub mod resolution;
pub mod slots;
pub mod wedges;
pub mod working_set;
