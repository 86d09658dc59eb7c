//! Error against run time: named camera paths, cases run in turn in one process, and the comparison of two runs.
//!
//! Rows reach the file one by one. The driver needs no device: a [`BenchBackend`] draws.

pub mod compare;
pub mod controller;
#[cfg(feature = "vulkan")]
pub mod device;
pub mod goal;
pub mod journal;
pub mod kit;
pub mod machine;
pub mod paths;
pub mod pool;
pub mod results;
pub mod rows;
pub mod run;
pub mod sample;
pub mod slowdown;
pub mod statistics;

pub use rows::{Case, Errors, Header, Row, SCHEMA, Terrain, Times};
pub use run::{BenchBackend, BenchScene, Timed};
pub use sample::FrameSample;
