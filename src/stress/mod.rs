//! The stress suite: every technique on stiff and extreme fields, positions, views and times; the budget controller
//! on simulated loads; the file loaders on broken files. A case passes if images and numbers are right, not merely if
//! nothing crashes.
//!
//! [`FAMILIES`] lists the cases. Each technique and check of a case gives a [`Row`]. Every technique in the table
//! takes part automatically.

mod arithmetic;
mod fields;
mod file;
mod flight;
pub mod forms;
pub mod invariants;
pub mod jitter;
mod position;
pub mod rows;
pub mod saved;
pub mod simulated_loads;
pub mod stiff;
pub mod sweep;
mod terrain;
mod time;
pub mod views;

#[cfg(feature = "vulkan")]
pub mod device;

use std::any::Any;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use rayon::prelude::*;

use crate::height::Field;
use crate::lod::Techniques;
use crate::view::View;

pub use self::flight::Flight;
pub use self::forms::TechniqueConfig;
use self::invariants::Violation;
pub use self::rows::{Picture, Row, SCHEMA, Stress};
pub use self::terrain::StressTerrain;

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

    /// Returns the finding with a reason.
    pub fn with_reason(self, why: Option<String>) -> Self {
        Self { why, ..self }
    }

    /// Returns true if the value is within its limit. NaN never is.
    pub fn passes(&self) -> bool {
        self.limit.is_none_or(|limit| self.value <= limit)
    }
}

/// The action of a case.
pub enum Kind {
    /// Draws a field from several views with every technique and checks every invariant.
    Terrain(fn() -> StressTerrain),
    /// Flies over a field with every technique and each of its settings' words. Each frame must be one surface within
    /// its tolerance.
    Flight(fn() -> Flight),
    /// Runs a custom check with every technique.
    PerTechnique(fn(&TechniqueConfig) -> Vec<Finding>),
    /// Runs a check without techniques; the first value names its subject.
    Standalone(&'static str, fn() -> Vec<Finding>),
}

/// A case of the suite.
pub struct Case {
    /// Family: `data`, `position`, `view`, `time`, `arithmetic`, `stiff`, `file` or `sweep`.
    pub family: &'static str,
    /// Name, unique in its family.
    pub name: &'static str,
    /// Action.
    pub kind: Kind,
}

/// The cases of the suite by family.
pub const FAMILIES: &[&[Case]] = &[
    fields::CASES,
    position::CASES,
    views::CASES,
    time::CASES,
    arithmetic::CASES,
    stiff::CASES,
    file::CASES,
    sweep::CASES,
];

/// Returns all cases.
pub fn cases() -> impl Iterator<Item = &'static Case> {
    FAMILIES.iter().copied().flatten()
}

/// Draws cases on a GPU and checks the images.
pub trait ImageChecker {
    /// Draws a case with a technique and returns the findings.
    fn check(&mut self, case: &Case, config: &TechniqueConfig) -> Vec<Finding>;

    /// Draws one view of a field; `None` if that fails.
    fn picture(&mut self, field: &Arc<Field>, config: &TechniqueConfig, view: &View) -> Option<image::RgbaImage>;

    /// Returns the reason if the device is lost and nothing more can be drawn.
    fn device_loss(&self) -> Option<String> {
        None
    }
}

/// A case with one technique, or without one if it is standalone.
pub struct CaseRun {
    /// The case.
    pub case: &'static Case,
    /// The technique and its settings; `None` for a standalone case.
    pub config: Option<TechniqueConfig>,
}

impl CaseRun {
    /// Returns the name of the technique with its settings, or of a standalone case's subject.
    pub fn technique(&self) -> String {
        match (&self.config, &self.case.kind) {
            (Some(config), _) => config.name.clone(),
            (None, Kind::Standalone(subject, _)) => subject.to_string(),
            (None, _) => unreachable!("only standalone cases have no technique"),
        }
    }

    /// Returns true if an [`ImageChecker`] draws the run: terrain and flights, with the default settings of each
    /// variant.
    pub fn is_drawn(&self) -> bool {
        let has_picture = matches!(self.case.kind, Kind::Terrain(_) | Kind::Flight(_));
        has_picture && self.config.as_ref().is_some_and(|config| config.choices.is_empty())
    }

    /// Runs all checks that need no GPU. A panic becomes a finding.
    pub fn run(&self) -> Vec<Finding> {
        let findings = catch_unwind(AssertUnwindSafe(|| match (&self.case.kind, &self.config) {
            (Kind::Terrain(terrain), Some(config)) => terrain::examine(&terrain(), config),
            (Kind::Flight(flight), Some(config)) => flight::examine(&flight(), config),
            (Kind::PerTechnique(examine), Some(config)) => examine(config),
            (Kind::Standalone(_, examine), _) => examine(),
            (_, None) => Vec::new(),
        }));
        findings
            .unwrap_or_else(|panic| vec![Finding::within("panics", 1.0, 0.0).with_reason(Some(panic_text(&*panic)))])
    }
}

/// Returns the message of a panic.
fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(|text| text.to_string())).unwrap_or_default()
}

/// Combines cases with the techniques named (`name` or `name:variant`), or with all. Flights use every word of every
/// setting, other cases the default settings.
///
/// # Errors
/// If a name is unknown.
pub fn case_runs(cases: &[&'static Case], techniques: &Techniques, names: &[String]) -> Result<Vec<CaseRun>, String> {
    let mut runs = Vec::new();
    for &case in cases {
        let configs = match case.kind {
            Kind::Terrain(_) | Kind::PerTechnique(_) => forms::with_defaults(techniques, names)?,
            Kind::Flight(_) => forms::with_each_word(techniques, names)?,
            Kind::Standalone(..) => Vec::new(),
        };
        if let Kind::Standalone(..) = case.kind {
            runs.push(CaseRun { case, config: None });
        }
        runs.extend(configs.into_iter().map(|config| CaseRun { case, config: Some(config) }));
    }
    Ok(runs)
}

/// Findings of all runs, in the same order.
pub struct SuiteResult {
    /// Findings of each run; empty if it was not run.
    pub findings: Vec<Vec<Finding>>,
    /// Reason why the suite ended early, if it did.
    pub ended: Option<String>,
}

/// Executes runs on all cores, and then those with images on a GPU if there is a checker, until `stop` is set.
pub fn run(
    runs: &[CaseRun],
    checker: Option<&mut dyn ImageChecker>,
    stop: &AtomicBool,
    progress: impl Fn(&CaseRun) + Sync,
) -> SuiteResult {
    let execute = |run: &CaseRun| {
        (!stop.load(Relaxed)).then(|| {
            progress(run);
            run.run()
        })
    };
    let results: Vec<_> = runs.par_iter().map(execute).collect();
    let not_run = results.iter().filter(|findings| findings.is_none()).count();
    let mut findings: Vec<_> = results.into_iter().map(Option::unwrap_or_default).collect();
    let mut ended = (not_run > 0).then(|| format!("stopped: {not_run} of {} runs were not executed", runs.len()));
    if let Some(checker) = checker {
        ended = ended.or(draw(runs, &mut findings, checker, stop, &progress));
    }
    SuiteResult { findings, ended }
}

/// Draws the runs that have images. Returns the reason if it ended early.
fn draw(
    runs: &[CaseRun],
    findings: &mut [Vec<Finding>],
    checker: &mut dyn ImageChecker,
    stop: &AtomicBool,
    progress: &impl Fn(&CaseRun),
) -> Option<String> {
    for (run, findings) in runs.iter().zip(findings) {
        let Some(config) = run.config.as_ref().filter(|_| run.is_drawn()) else { continue };
        if stop.load(Relaxed) {
            return Some("stopped: not all images were drawn".to_string());
        }
        progress(run);
        findings.extend(checker.check(run.case, config));
        if let Some(why) = checker.device_loss() {
            return Some(format!("no more images: {why}"));
        }
    }
    None
}
