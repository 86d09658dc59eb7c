//! Where a frame's time goes: every pass, pipeline and draw with its label, device time and programs run; the host's
//! steps beside it on one line of time; and the ways to submit the same land side by side.
//!
//! [`run()`] measures, everything else turns what it found into rows, a table and a trace, and needs no device.

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
