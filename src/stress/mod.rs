//! The stability suite: every technique on stiff and extreme fields, positions, views and times; the budget
//! controller on loads that are hard to hold; the loaders on broken files. A case passes when the picture and the
//! numbers are right, not when nothing crashed.
//!
//! A case is a row of [`FAMILIES`]; what is found in it, a [`Row`] for each technique and check. A technique that is new
//! in the table is in the suite.

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
pub use self::forms::Form;
use self::invariants::Violation;
pub use self::rows::{Picture, Row, SCHEMA, Stress};
pub use self::terrain::StressTerrain;

/// What a check found.
#[derive(Clone, Debug)]
pub struct Finding {
    /// The check, with its unit where it has one.
    pub check: &'static str,
    /// What was found.
    pub value: f64,
    /// The most that passes; `None`: it is only told.
    pub limit: Option<f64>,
    /// Where it failed, and how.
    pub violation: Option<Violation>,
    /// How it failed, where no view is to blame.
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

    /// Whether the value is within its limit; no number never is.
    pub fn passes(&self) -> bool {
        self.limit.is_none_or(|limit| self.value <= limit)
    }
}

/// What is done in a case.
pub enum Kind {
    /// Every technique draws a field from views, and every law is held against what it draws.
    Terrain(fn() -> StressTerrain),
    /// Every technique, in every word of its settings, is flown; each frame is one surface within its tolerance.
    Flight(fn() -> Flight),
    /// Something of its own is done with every technique.
    Each(fn(&Form) -> Vec<Finding>),
    /// No technique takes part: whose it is, and what is done.
    Alone(&'static str, fn() -> Vec<Finding>),
}

/// A row of the suite.
pub struct Case {
    /// Which part of it: `data`, `position`, `view`, `time`, `arithmetic`, `stiff`, `file` or `sweep`.
    pub family: &'static str,
    /// Its name.
    pub name: &'static str,
    /// What is done.
    pub kind: Kind,
}

/// The suite, family by family.
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

/// All cases.
pub fn cases() -> impl Iterator<Item = &'static Case> {
    FAMILIES.iter().copied().flatten()
}

/// Looks at what a device draws.
pub trait ImageChecker {
    /// What it finds in the pictures of a case.
    fn look(&mut self, case: &Case, form: &Form) -> Vec<Finding>;

    /// A picture of a field, if it can be drawn.
    fn picture(&mut self, field: &Arc<Field>, form: &Form, view: &View) -> Option<image::RgbaImage>;

    /// Why it can look no more, if so.
    fn is_blind(&self) -> Option<String> {
        None
    }
}

/// A case with one technique or, if it needs none, without.
pub struct Trial {
    /// The case.
    pub case: &'static Case,
    /// The technique.
    pub form: Option<Form>,
}

impl Trial {
    /// Whose row it is.
    pub fn technique(&self) -> String {
        match (&self.form, &self.case.kind) {
            (Some(form), _) => form.name.clone(),
            (None, Kind::Alone(whose, _)) => whose.to_string(),
            (None, _) => unreachable!("only what stands alone has no technique"),
        }
    }

    /// Whether a device draws it, if there is one: a technique with its defaults and each variant.
    pub fn is_drawn(&self) -> bool {
        let has_picture = matches!(self.case.kind, Kind::Terrain(_) | Kind::Flight(_));
        has_picture && self.form.as_ref().is_some_and(|form| form.choices.is_empty())
    }

    /// What is found without a device. A panic is a finding.
    pub fn run(&self) -> Vec<Finding> {
        let findings = catch_unwind(AssertUnwindSafe(|| match (&self.case.kind, &self.form) {
            (Kind::Terrain(terrain), Some(form)) => terrain::examine(&terrain(), form),
            (Kind::Flight(flight), Some(form)) => flight::examine(&flight(), form),
            (Kind::Each(examine), Some(form)) => examine(form),
            (Kind::Alone(_, examine), _) => examine(),
            (_, None) => Vec::new(),
        }));
        findings.unwrap_or_else(|panic| vec![Finding::within("panics", 1.0, 0.0).because(Some(panic_text(&*panic)))])
    }
}

/// The text of a panic.
fn panic_text(panic: &(dyn Any + Send)) -> String {
    let text = panic.downcast_ref::<String>().cloned();
    text.or_else(|| panic.downcast_ref::<&str>().map(|text| text.to_string())).unwrap_or_default()
}

/// Returns the trials of some cases with the techniques named, or with all. A flight tries every word of every setting.
///
/// # Errors
/// If a name is unknown.
pub fn trials(cases: &[&'static Case], techniques: &Techniques, names: &[String]) -> Result<Vec<Trial>, String> {
    let mut trials = Vec::new();
    for &case in cases {
        let forms = match case.kind {
            Kind::Terrain(_) | Kind::Each(_) => forms::plain(techniques, names)?,
            Kind::Flight(_) => forms::every_word(techniques, names)?,
            Kind::Alone(..) => Vec::new(),
        };
        if let Kind::Alone(..) = case.kind {
            trials.push(Trial { case, form: None });
        }
        trials.extend(forms.into_iter().map(|form| Trial { case, form: Some(form) }));
    }
    Ok(trials)
}

/// What was found in trials, in their order.
pub struct Found {
    /// A list a trial; empty where it was not run.
    pub findings: Vec<Vec<Finding>>,
    /// Why there is no more, if something was left out.
    pub ended: Option<String>,
}

/// Runs trials on all cores, and then those with pictures on a device, if there is one, until `stop` is set.
pub fn run(
    trials: &[Trial],
    eye: Option<&mut dyn ImageChecker>,
    stop: &AtomicBool,
    progress: impl Fn(&Trial) + Sync,
) -> Found {
    let run = |trial: &Trial| {
        (!stop.load(Relaxed)).then(|| {
            progress(trial);
            trial.run()
        })
    };
    let found: Vec<_> = trials.par_iter().map(run).collect();
    let left_out = found.iter().filter(|findings| findings.is_none()).count();
    let mut findings: Vec<_> = found.into_iter().map(Option::unwrap_or_default).collect();
    let mut ended = (left_out > 0).then(|| format!("stopped: {left_out} of {} trials were not run", trials.len()));
    if let Some(eye) = eye {
        ended = ended.or(draw(trials, &mut findings, eye, stop, &progress));
    }
    Found { findings, ended }
}

/// Draws the trials that have pictures; why not all of them, if so.
fn draw(
    trials: &[Trial],
    findings: &mut [Vec<Finding>],
    eye: &mut dyn ImageChecker,
    stop: &AtomicBool,
    progress: &impl Fn(&Trial),
) -> Option<String> {
    for (trial, findings) in trials.iter().zip(findings) {
        let Some(form) = trial.form.as_ref().filter(|_| trial.is_drawn()) else { continue };
        if stop.load(Relaxed) {
            return Some("stopped: not all pictures were drawn".to_string());
        }
        progress(trial);
        findings.extend(eye.look(trial.case, form));
        if let Some(why) = eye.is_blind() {
            return Some(format!("no more pictures: {why}"));
        }
    }
    None
}
