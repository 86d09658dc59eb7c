//! Comparison of two benchmarks: times as ratios with intervals, counts and errors exactly.
//!
//! Frames are held against each other as [`slowdown`] has it, over their floors: those tell how fast the machine was, and
//! are compared by themselves, as they tell of shading too.
//!
//! All cases of a technique are tested together: that is a regression if the whole interval lies above 1 + threshold.
//! A single case, or all floors together, are one if it lies above 1 + twice the threshold. Many things are tested at
//! once, so tails are divided among the techniques and among the cases (Bonferroni). With fewer than [`MIN_ROUNDS`]
//! rounds in either run no time is judged.

use std::collections::BTreeMap;

use serde::Serialize;

use super::results::{CaseResult, Results};
use super::rows::Errors;
use super::slowdown::{Cost, MIN_ROUNDS, Pair, has_shading_only, slowdown};
use super::statistics::Estimate;

/// Largest relative change that is no regression: a tenth.
pub const THRESHOLD: f64 = 0.1;
/// Share of intervals that may miss the truth, all of a kind together.
const ALARM: f64 = 0.05;

/// Changes between two benchmarks.
#[derive(Debug, Serialize)]
pub struct Comparison {
    /// Cases that both have.
    pub matched: usize,
    /// True if both runs have enough rounds to judge times.
    pub is_judged: bool,
    /// True if times are divided by the shading-only times; else one of the runs has none, and times are milliseconds.
    pub over_shading_only: bool,
    /// Times of the floors, all cases together.
    pub shading_only: Option<Change>,
    /// Times by technique, all its cases together.
    pub techniques: Vec<Change>,
    /// Times by case.
    pub cases: Vec<Change>,
    /// Counts and errors that are not equal.
    pub differences: Vec<Difference>,
    /// Cases that only one of the two has.
    pub unmatched: Vec<String>,
    /// Regressions beyond the threshold, in words.
    pub regressions: Vec<String>,
}

/// The time of one thing in B over that in A.
#[derive(Clone, Debug, Serialize)]
pub struct Change {
    /// Name of the timed case.
    pub what: String,
    /// The ratio, with an interval corrected for the number of comparisons.
    pub ratio: Estimate,
    /// True if the whole interval lies above the threshold.
    pub is_regression: bool,
}

/// One exact value in both.
#[derive(Clone, Debug, Serialize)]
pub struct Difference {
    /// The case.
    pub case: String,
    /// Name of the value.
    pub value: &'static str,
    /// In A.
    pub before: f64,
    /// In B.
    pub after: f64,
    /// True if it is worse by more than the threshold, or a guarantee no longer holds.
    pub is_regression: bool,
}

/// Compares B with A.
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
    let cost = if over_shading_only { Cost::OverShadingOnly } else { Cost::FrameSample };
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

fn by_technique<'a>(pairs: &[Pair<'a>]) -> BTreeMap<String, Vec<Pair<'a>>> {
    let mut families: BTreeMap<String, Vec<Pair>> = BTreeMap::new();
    for &(a, b) in pairs {
        families.entry(a.case.series()).or_default().push((a, b));
    }
    families
}

/// A value of the errors, and whether any growth of it breaks a promise.
type Exact = (&'static str, fn(&Errors) -> Option<f64>, bool);

/// Values compared exactly; larger is worse.
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

fn unmatched(a: &Results, b: &Results) -> Vec<String> {
    let lacks = |results: &Results, case: &CaseResult| results.cases.iter().all(|other| other.case != case.case);
    let only_a = a.cases.iter().filter(|case| lacks(b, case)).map(|case| format!("only in A: {}", case.case));
    let only_b = b.cases.iter().filter(|case| lacks(a, case)).map(|case| format!("only in B: {}", case.case));
    only_a.chain(only_b).collect()
}

fn regressions<'a>(changes: impl Iterator<Item = &'a Change>, differences: &[Difference]) -> Vec<String> {
    let slower = |change: &Change| {
        let Estimate { value, low, high } = change.ratio;
        format!("{}: {value:.3} times slower ({low:.3} to {high:.3})", change.what)
    };
    let times = changes.filter(|change| change.is_regression).map(slower);
    let worse = |d: &Difference| format!("{}: {} {} instead of {}", d.case, d.value, d.after, d.before);
    times.chain(differences.iter().filter(|d| d.is_regression).map(worse)).collect()
}
