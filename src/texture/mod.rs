//! Textures: those made at start, the same bytes on every machine; a picture cut into pages' maps; and which part of a map
//! a frame needs, how fine, and texels for it.

pub mod detail;
pub mod drape;
pub mod ground;
pub mod ground_maps;
pub mod hidden;
pub mod mip_spheres;
pub mod mipmaps;
pub mod node_table;
mod noise;
pub mod page_maps;
pub mod picture_bounds;
pub mod picture_maps;
pub mod pieces;
pub mod resolution;
pub mod slots;
pub mod wedges;
pub mod working_set;
