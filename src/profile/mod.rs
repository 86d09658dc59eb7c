//! Profile of a frame: device time and shader invocations of every pass, pipeline and draw, with the host's steps on the
//! same time line, and a comparison of submission modes for the same terrain.
//!
//! [`run()`] measures. All other modules turn its results into rows, a table and a trace, and need no device.

pub mod estimate;
pub mod files;
pub mod rows;
#[cfg(feature = "vulkan")]
pub mod run;
pub mod table;
#[cfg(feature = "vulkan")]
pub mod timeline;
pub mod trace;

pub use rows::{DrawRow, ModeRow, PassRow, Profile, StepRow};
#[cfg(feature = "vulkan")]
pub use run::{Form, run};
