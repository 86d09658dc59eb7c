//! All cases, run on all cores, and drawn on a GPU if there is one.

use std::sync::atomic::{AtomicBool, Ordering::Relaxed};

use rayon::prelude::*;

use super::case::Case;
use super::case_run::CaseRun;
use super::finding::Finding;
use super::image_checker::ImageChecker;
use super::{arithmetic, extreme_views, fields, file, position, stiff, sweep, time};

/// The cases of the suite by family.
pub const FAMILIES: &[&[Case]] = &[
    fields::CASES,
    position::CASES,
    extreme_views::CASES,
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
