//! The result of one check.

use std::any::Any;

use super::invariants::Violation;

/// Result of a check.
#[derive(Clone, Debug)]
pub struct Finding {
    /// The check, with its unit where it has one.
    pub check: &'static str,
    /// Measured value.
    pub value: f64,
    /// The most that passes; `None`: it is only told.
    pub limit: Option<f64>,
    /// View and reason of the failure.
    pub violation: Option<Violation>,
    /// Reason of a failure that belongs to no view.
    pub why: Option<String>,
}

impl Finding {
    /// A value that is at most a limit.
    pub fn within(check: &'static str, value: f64, limit: f64) -> Self {
        Self { check, value, limit: Some(limit), violation: None, why: None }
    }

    /// A value that is only told: what others are compared with.
    pub fn reported(check: &'static str, value: f64) -> Self {
        Self { check, value, limit: None, violation: None, why: None }
    }

    /// 0 where something holds, else 1.
    pub fn holds(check: &'static str, outcome: Result<(), Violation>) -> Self {
        let violation = outcome.err();
        Self { violation: violation.clone(), ..Self::within(check, f64::from(u8::from(violation.is_some())), 0.0) }
    }

    /// The same, with how it failed.
    pub fn because(self, why: Option<String>) -> Self {
        Self { why, ..self }
    }

    /// Returns true if the value is within its limit; NaN never is.
    pub fn passes(&self) -> bool {
        self.limit.is_none_or(|limit| self.value <= limit)
    }
}

/// The text of a panic.
pub(super) fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(|text| text.to_string())).unwrap_or_default()
}
