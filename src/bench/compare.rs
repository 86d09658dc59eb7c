//! Comparison of two benchmark runs: times as ratios with confidence intervals, counts and errors exactly.
//!
//! Frame times are divided by the shading-only times of the same frames before the runs are compared ([`slowdown`]).
//! This cancels the speed of the machine. Shading-only times are also compared on their own, so that slower shading
//! is found too.
//!
//! A technique regresses if the interval of all its cases together lies above 1 + threshold. A single case, or the
//! shading-only times of all cases, regress if the interval lies above 1 + 2 · threshold. The error probability is
//! divided by the number of techniques, and by the number of cases (Bonferroni correction). Times are not judged if
//! either run has fewer than [`MIN_ROUNDS`] rounds.

use std::collections::BTreeMap;

use serde::Serialize;

use super::results::{CaseResult, Results};
use super::rows::Errors;
use super::slowdown::{Cost, MIN_ROUNDS, Pair, has_shading_only, slowdown};
use super::statistics::Estimate;

/// Default threshold: relative changes of up to 10 % are not regressions.
pub const THRESHOLD: f64 = 0.1;
/// Error probability on either side of the intervals, shared by all comparisons of one kind.
const ALARM: f64 = 0.05;

/// Changes from benchmark run A to benchmark run B.
#[derive(Debug, Serialize)]
pub struct Comparison {
    /// Number of cases that both runs contain.
    pub matched: usize,
    /// True if both runs have enough rounds to judge times.
    pub is_judged: bool,
    /// True if frame times were divided by shading-only times. False if a run lacks these: frame times are then
    /// compared directly.
    pub over_shading_only: bool,
    /// Change of the shading-only times, all cases together.
    pub shading_only: Option<Change>,
    /// Change of the frame times of each technique, all its cases together.
    pub techniques: Vec<Change>,
    /// Change of the frame times of each case.
    pub cases: Vec<Change>,
    /// Counts and errors that differ between the runs.
    pub differences: Vec<Difference>,
    /// Cases that only one of the runs contains.
    pub unmatched: Vec<String>,
    /// One sentence for each regression.
    pub regressions: Vec<String>,
}

/// Change of a time from A to B.
#[derive(Clone, Debug, Serialize)]
pub struct Change {
    /// The case, the technique with its number of cases, or "shading only".
    pub what: String,
    /// Time in B divided by time in A. The interval is corrected for the number of comparisons.
    pub ratio: Estimate,
    /// True if times are judged and the whole interval lies above the threshold.
    pub is_regression: bool,
}

/// A count or an error that differs between A and B.
#[derive(Clone, Debug, Serialize)]
pub struct Difference {
    /// The case.
    pub case: String,
    /// Name of the value.
    pub value: &'static str,
    /// The value in A.
    pub before: f64,
    /// The value in B.
    pub after: f64,
    /// True if B is worse by more than the threshold, or by any amount where the value counts broken guarantees.
    pub is_regression: bool,
}

/// Compares run B with run A. `threshold` is the relative change that still counts as noise, 0.1 for 10 %.
pub fn compare(a: &Results, b: &Results, threshold: f64) -> Comparison {
    let partner = |case: &CaseResult| b.cases.iter().find(|other| other.case == case.case);
    let pairs: Vec<_> = a.cases.iter().filter_map(|case| partner(case).map(|other| (case, other))).collect();
    let timed: Vec<_> = pairs.iter().copied().filter(|(a, b)| a.time.is_some() && b.time.is_some()).collect();
    let is_judged = timed.iter().all(|(a, b)| a.rounds.len().min(b.rounds.len()) >= MIN_ROUNDS);
    let over_shading_only = timed.iter().all(|(a, b)| has_shading_only(a) && has_shading_only(b));
    let change = |what: String, pairs: &[Pair], cost: Cost, family: usize, allowed: f64| {
        let ratio = slowdown(pairs, cost, ALARM / family as f64);
        Change { what, ratio, is_regression: is_judged && ratio.low > 1.0 + allowed }
    };
    let cost = if over_shading_only { Cost::OverShadingOnly } else { Cost::Frame };
    let of_case = |pair: &Pair| change(pair.0.case.to_string(), &[*pair], cost, timed.len(), 2.0 * threshold);
    let cases: Vec<_> = timed.iter().map(of_case).collect();
    let families = by_technique(&timed);
    let together = |name: &str, pairs: &[Pair]| format!("{name}, {} cases", pairs.len());
    let of_technique =
        |(name, pairs): (&String, &Vec<Pair>)| change(together(name, pairs), pairs, cost, families.len(), threshold);
    let techniques: Vec<_> = families.iter().map(of_technique).collect();
    let has_shading_only = over_shading_only && !timed.is_empty();
    let shading_only = has_shading_only
        .then(|| change(together("shading only", &timed), &timed, Cost::ShadingOnly, 1, 2.0 * threshold));
    let differences: Vec<_> = pairs.iter().flat_map(|(a, b)| differences(a, b, threshold)).collect();
    let regressions = regressions(shading_only.iter().chain(&techniques).chain(&cases), &differences);
    let matched = pairs.len();
    let unmatched = unmatched(a, b);
    Comparison {
        matched,
        is_judged,
        over_shading_only,
        shading_only,
        techniques,
        cases,
        differences,
        unmatched,
        regressions,
    }
}

/// Groups pairs of cases by technique, settings, metric and goal.
fn by_technique<'a>(pairs: &[Pair<'a>]) -> BTreeMap<String, Vec<Pair<'a>>> {
    let mut families: BTreeMap<String, Vec<Pair>> = BTreeMap::new();
    for &(a, b) in pairs {
        families.entry(a.case.series()).or_default().push((a, b));
    }
    families
}

/// Name and accessor of an error value, and true if any increase is a regression.
type Exact = (&'static str, fn(&Errors) -> Option<f64>, bool);

/// Error values that are compared exactly. Larger is worse for all of them.
const EXACT: &[Exact] = &[
    ("error_px.rms", |e| Some(e.error_px.rms), false),
    ("error_px.p999", |e| Some(e.error_px.p999), false),
    ("error_px.max", |e| Some(e.error_px.max), false),
    ("error_m.max", |e| Some(e.error_m.max), false),
    ("frames beyond the tolerance", |e| e.within.map(|w| 1.0 - w.frames), true),
    ("samples beyond the tolerance", |e| e.within.map(|w| 1.0 - w.samples), true),
    ("not watertight", |e| e.watertight.map(|is| f64::from(u8::from(!is))), true),
    ("hole_pixels", |e| e.hole_pixels.map(|n| n as f64), true),
    ("skirt_pixels", |e| e.skirt_pixels.map(|n| n as f64), false),
    ("pending.pixels", |e| e.pending.map(|w| w.pixels as f64), true),
    ("pending.excess_px", |e| e.pending.map(|w| w.excess_px), true),
    ("pop.p99_px", |e| e.pop.as_ref().map(|p| p.p99_px), false),
    ("pop.max_px", |e| e.pop.as_ref().map(|p| p.max_px), false),
];

/// Returns the counts and errors of a case that differ between the runs.
fn differences(a: &CaseResult, b: &CaseResult, threshold: f64) -> Vec<Difference> {
    let mut values = Vec::new();
    if let (Some(a), Some(b)) = (&a.time, &b.time) {
        values.push(("triangles", a.triangles, b.triangles, false));
        values.push(("draws", a.draws, b.draws, false));
    }
    if let (Some(a), Some(b)) = (&a.errors, &b.errors) {
        let both = |&(name, value, promise): &Exact| Some((name, value(a)?, value(b)?, promise));
        values.extend(EXACT.iter().filter_map(both));
    }
    let difference = |(value, before, after, promise): (&'static str, f64, f64, bool)| {
        let allowed = if promise { before } else { before * (1.0 + threshold) };
        Difference { case: a.case.to_string(), value, before, after, is_regression: after > allowed }
    };
    values.into_iter().filter(|(_, before, after, _)| before != after).map(difference).collect()
}

/// Lists the cases that only one of the runs contains.
fn unmatched(a: &Results, b: &Results) -> Vec<String> {
    let lacks = |results: &Results, case: &CaseResult| results.cases.iter().all(|other| other.case != case.case);
    let only_a = a.cases.iter().filter(|case| lacks(b, case)).map(|case| format!("only in A: {}", case.case));
    let only_b = b.cases.iter().filter(|case| lacks(a, case)).map(|case| format!("only in B: {}", case.case));
    only_a.chain(only_b).collect()
}

/// Describes each regression in a sentence.
fn regressions<'a>(changes: impl Iterator<Item = &'a Change>, differences: &[Difference]) -> Vec<String> {
    let slower = |change: &Change| {
        let Estimate { value, low, high } = change.ratio;
        format!("{}: {value:.3} times slower ({low:.3} to {high:.3})", change.what)
    };
    let times = changes.filter(|change| change.is_regression).map(slower);
    let worse = |d: &Difference| format!("{}: {} {} instead of {}", d.case, d.value, d.after, d.before);
    times.chain(differences.iter().filter(|d| d.is_regression).map(worse)).collect()
}
