//! Textures made at start, the same bytes on every machine; and which part of a map a frame needs, how fine.

pub mod detail;
pub mod mip_spheres;
mod noise;
pub mod resolution;
pub mod working_set;
