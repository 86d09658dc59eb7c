//! The random sweep: every technique on random terrain, in random settings and views, held against every invariant.
//!
//! A case is plain data, drawn from a seed and a number ([`random`]). It is held against [`INVARIANTS`](super::laws::LAWS) ([`case`]). One that
//! fails is made smaller as long as it fails in the same way ([`shrink`]), and is printed as one line of JSON that runs
//! again anywhere.

pub mod case;
pub mod random;
pub mod shrink;
pub mod terrain;
pub mod viewpoint;

use rayon::prelude::*;

pub use self::case::{Failure, SweepCase};
use super::case::{Case, Kind};
use super::finding::Finding;
use super::forms::Form;

/// The family `sweep`.
pub const CASES: &[Case] = &[Case { family: "sweep", name: "random cases", kind: Kind::Each(of_form) }];

/// Cases of each form that the stress suite runs, and their seed.
const SUITE_CASES: u64 = 200;
const SUITE_SEED: u64 = 19;

/// Failures that are made smaller, at most: each takes as long as hundreds of cases.
const MAX_SHRUNK: usize = 4;

/// Runs cases on all cores. Returns the failures in order, the first few of them shrunk.
pub fn run(cases: impl ParallelIterator<Item = SweepCase>) -> Vec<Failure> {
    let mut failures: Vec<Failure> = cases.filter_map(|case| case.check().err()).map(|failure| *failure).collect();
    let few = failures.len().min(MAX_SHRUNK);
    failures[..few].par_iter_mut().for_each(|failure| *failure = shrink::shrink(failure.clone(), SweepCase::check));
    failures
}

/// Random cases of one technique and variant.
fn of_form(form: &Form) -> Vec<Finding> {
    let case = |number| random::case(SUITE_SEED, number, form.entry, Some(form.variant));
    let failures = run((0..SUITE_CASES).into_par_iter().map(case));
    let first = failures.first();
    let count = Finding::within("cases that fail", failures.len() as f64, 0.0);
    vec![
        Finding { violation: first.map(|failure| failure.violation.clone()), ..count }
            .because(first.map(Failure::to_string)),
    ]
}
