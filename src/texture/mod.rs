//! Textures: those made at start, the same bytes on every machine; a picture cut into pages' maps; and which part of a map
//! a frame needs, how fine, and texels for it.

pub mod detail;
pub mod drape;
pub mod ground;
pub mod hidden;
pub mod mip_spheres;
pub mod mipmaps;
mod noise;
pub mod overlay_pyramid;
pub mod page_table;
pub mod picture_bounds;
pub mod pieces;
pub mod resolution;
pub mod tile_cache;
pub mod virtual_ground;
pub mod virtual_layout;
pub mod virtual_overlay;
pub mod wedges;
pub mod working_set;
