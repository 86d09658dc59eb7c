//! The stress suite: every technique on stiff and extreme fields, positions, views and times; the budget controller
//! on simulated loads; the file loaders on broken files. A case passes if images and numbers are right, not merely if
//! nothing crashes.
//!
//! [`FAMILIES`] lists the cases. Each technique and check of a case gives a [`Row`]. Every technique in the table
//! takes part automatically.

mod arithmetic;
mod case;
mod case_run;
mod extreme_views;
mod fields;
mod file;
mod finding;
mod flight;
pub mod forms;
mod image_checker;
pub mod invariants;
pub mod jitter;
mod numbers;
mod panics;
mod position;
pub mod rows;
pub mod saved;
pub mod simulated_loads;
pub mod stiff;
mod suite;
pub mod sweep;
mod terrain;
mod threshold;
mod time;
pub mod views;

#[cfg(feature = "vulkan")]
pub mod device;

pub use self::case::{Case, Flight, Kind, StressTerrain};
pub use self::case_run::{CaseRun, case_runs};
pub use self::finding::Finding;
pub use self::forms::TechniqueConfig;
pub use self::image_checker::ImageChecker;
pub use self::rows::{Picture, Row, SCHEMA, Stress};
pub use self::suite::{FAMILIES, SuiteResult, cases, run};
