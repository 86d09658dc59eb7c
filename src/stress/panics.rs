//! Panics as results: work that panics fails its check and does not end the suite.

use std::panic::{AssertUnwindSafe, catch_unwind};

/// Runs some work. Returns the message of its panic if it panics.
pub fn caught<T>(work: impl FnOnce() -> T) -> Result<T, String> {
    catch_unwind(AssertUnwindSafe(work)).map_err(|panic| {
        let text = panic.downcast_ref::<String>().cloned();
        text.or_else(|| panic.downcast_ref::<&str>().map(|text| text.to_string())).unwrap_or_default()
    })
}
