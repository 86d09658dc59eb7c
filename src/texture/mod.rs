//! Textures, on the CPU: generated detail materials, overlay images, and the working sets of virtual textures.
//!
//! Everything generated here is bit-identical on every machine.

pub mod detail;
pub mod drape;
pub mod ground;
pub mod hidden;
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
