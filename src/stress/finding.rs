//! The result of one check: a value, its limit, and the reason of a failure.

use super::invariants::{self, Invariant, Subject, Violation};

/// The result of one check.
#[derive(Clone, Debug)]
pub struct Finding {
    /// Name of the check, with its unit if it has one.
    pub check: &'static str,
    /// Measured value.
    pub value: f64,
    /// Largest value that passes; `None` if the value is only reported.
    pub limit: Option<f64>,
    /// View in which the check failed, and the reason.
    pub violation: Option<Violation>,
    /// Reason of a failure that does not depend on a view.
    pub why: Option<String>,
}

impl Finding {
    /// Creates a finding that passes if the value is at most the limit.
    pub fn within(check: &'static str, value: f64, limit: f64) -> Self {
        Self { check, value, limit: Some(limit), violation: None, why: None }
    }

    /// Creates a finding without a limit, for comparison.
    pub fn reported(check: &'static str, value: f64) -> Self {
        Self { check, value, limit: None, violation: None, why: None }
    }

    /// Creates a finding with value 0 if the outcome is `Ok`, else 1; the limit is 0.
    pub fn holds(check: &'static str, outcome: Result<(), Violation>) -> Self {
        let violation = outcome.err();
        Self { violation: violation.clone(), ..Self::within(check, f64::from(u8::from(violation.is_some())), 0.0) }
    }

    /// Checks every invariant of a technique of this name.
    pub fn of_invariants(subject: &mut Subject, technique: &str) -> Vec<Self> {
        let holds = |invariant: &Invariant| Self::holds(invariant.name, (invariant.check)(subject));
        invariants::of_technique(technique).map(holds).collect()
    }

    /// Returns the finding with a reason.
    pub fn with_reason(self, why: Option<String>) -> Self {
        Self { why, ..self }
    }

    /// Returns true if the value is within its limit. NaN never is.
    pub fn passes(&self) -> bool {
        self.limit.is_none_or(|limit| self.value <= limit)
    }
}
