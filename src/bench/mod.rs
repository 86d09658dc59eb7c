//! Error against run time: named paths, cases run in turn in one process, rows that reach the file as they come,
//! and what changed from one run to another. The driver knows no device: whoever draws is a [`BenchBackend`].

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
