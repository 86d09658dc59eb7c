//! The benchmark's driver, rows and comparison, with a backend that makes its numbers up.

mod comparing;
mod holding;
pub mod mock;
mod paths;
mod resuming;
mod schema;
