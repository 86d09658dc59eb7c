//! The random sweep: every technique on random terrain, in random settings and views, held against every invariant.
//!
//! A case is plain data, drawn from a seed and a number ([`random`]). It is held against [`INVARIANTS`](super::invariants::INVARIANTS) ([`case`]). One that
//! fails is made smaller as long as it fails in the same way ([`shrink`]), and is printed as one line of JSON that runs
//! again anywhere.

pub mod case;
pub mod random;
pub mod shrink;
pub mod terrain;
pub mod viewpoint;

use rayon::prelude::*;

pub use self::case::SweepCase;
use super::forms::Form;
use super::invariants::Violation;
use super::{Case, Finding, Kind};

/// The family `sweep`.
pub const CASES: &[Case] = &[Case { family: "sweep", name: "random cases", kind: Kind::Each(of_form) }];

/// Cases of each form that the stress suite runs, and their seed.
const SUITE_CASES: u64 = 200;
const SUITE_SEED: u64 = 19;

/// Failures that are made smaller, at most: each takes as long as hundreds of cases.
const MAX_SHRUNK: usize = 4;

/// A case that does not keep an invariant.
#[derive(Clone, Debug)]
pub struct Failure {
    /// The case.
    pub case: SweepCase,
    /// The invariant.
    pub invariant: &'static str,
    /// The view and the reason.
    pub violation: Violation,
}

impl std::fmt::Display for Failure {
    fn fmt(&self, f: &mut std::fmt::Formatter) -> std::fmt::Result {
        write!(f, "{}: {}\n  SWEEP_CASE='{}'", self.invariant, self.violation.why, self.case)
    }
}

/// Runs cases of built-in techniques on all cores. Returns the failures in order, the first few of them shrunk.
pub fn run(cases: impl ParallelIterator<Item = SweepCase>) -> Vec<Failure> {
    run_with(cases, SweepCase::check)
}

fn run_with(
    cases: impl ParallelIterator<Item = SweepCase>,
    check: impl Fn(&SweepCase) -> Result<(), Box<Failure>> + Sync,
) -> Vec<Failure> {
    let mut failures: Vec<Failure> = cases.filter_map(|case| check(&case).err()).map(|failure| *failure).collect();
    let few = failures.len().min(MAX_SHRUNK);
    failures[..few].par_iter_mut().for_each(|failure| *failure = shrink::shrink(failure.clone(), &check));
    failures
}

/// Random cases of one technique and variant.
fn of_form(form: &Form) -> Vec<Finding> {
    let case = |number| random::case(SUITE_SEED, number, form.entry, Some(form.variant));
    let check = |case: &SweepCase| case.check_with(form.entry);
    let failures = run_with((0..SUITE_CASES).into_par_iter().map(case), check);
    let first = failures.first();
    let count = Finding::within("cases that fail", failures.len() as f64, 0.0);
    vec![
        Finding { violation: first.map(|failure| failure.violation.clone()), ..count }
            .because(first.map(Failure::to_string)),
    ]
}
