//! Profile of a frame: device time and shader invocations of every pass and draw, and the host's steps on the same
//! timeline. Also compares ways to submit the same draws.
//!
//! [`run()`] measures on a device. The other modules turn its results into rows, text tables and a trace.

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
