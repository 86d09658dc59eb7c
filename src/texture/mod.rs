//! Textures made at start: the same bytes on every machine.

pub mod detail;
mod noise;
