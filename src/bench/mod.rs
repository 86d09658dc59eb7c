//! Benchmark of error against run time: named camera paths, interleaved cases, result rows and the comparison of two
//! runs.
//!
//! [`run`] calls a [`BenchBackend`] to draw and measure, and writes one row at a time. The backend for a Vulkan device
//! is in the module `device`; everything else works without one.

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
