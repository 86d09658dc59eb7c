//! The random sweep: every technique on random terrain, with random settings and views, checked against every
//! invariant.
//!
//! A case is plain data, derived from a seed and a number ([`random`]). [`case`] checks it against
//! [`INVARIANTS`](super::invariants::INVARIANTS). [`shrink`] reduces a failing case while it fails in the same way;
//! it is printed as one line of JSON that reproduces the failure anywhere.

pub mod case;
pub mod random;
pub mod shrink;
pub mod terrain;
pub mod viewpoint;

use rayon::prelude::*;

pub use self::case::{Failure, SweepCase};
use super::case::{Case, Kind};
use super::finding::Finding;
use super::forms::TechniqueConfig;

/// The family `sweep`.
pub const CASES: &[Case] = &[Case { family: "sweep", name: "random cases", kind: Kind::PerTechnique(of_config) }];

/// Cases per configuration in the stress suite, and their seed.
const SUITE_CASES: u64 = 200;
const SUITE_SEED: u64 = 19;

/// Maximum number of failures that are shrunk; each takes as long as hundreds of cases.
const MAX_SHRUNK: usize = 4;

/// Checks cases on all cores. Returns the failures in order, the first few of them shrunk.
pub fn run(
    cases: impl ParallelIterator<Item = SweepCase>,
    check: impl Fn(&SweepCase) -> Result<(), Box<Failure>> + Sync,
) -> Vec<Failure> {
    let mut failures: Vec<Failure> = cases.filter_map(|case| check(&case).err()).map(|failure| *failure).collect();
    let few = failures.len().min(MAX_SHRUNK);
    failures[..few].par_iter_mut().for_each(|failure| *failure = shrink::shrink(failure.clone(), &check));
    failures
}

/// Checks random cases of one technique and variant.
fn of_config(config: &TechniqueConfig) -> Vec<Finding> {
    let case = |number| random::case(SUITE_SEED, number, config.entry, Some(config.variant));
    let check = |case: &SweepCase| case.check(config.entry);
    let failures = run((0..SUITE_CASES).into_par_iter().map(case), check);
    let first = failures.first();
    let count = Finding::within("cases that fail", failures.len() as f64, 0.0);
    vec![
        Finding { violation: first.map(|failure| failure.violation.clone()), ..count }
            .with_reason(first.map(Failure::to_string)),
    ]
}
