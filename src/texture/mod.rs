//! Textures made at start, the same bytes on every machine; and how fine a texture a triangle needs.

pub mod detail;
mod noise;
pub mod resolution;
