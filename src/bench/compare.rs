//! What changed from one benchmark to another: times as ratios with intervals, counts and errors exactly.
//!
//! The cases of a technique are tested together, as they tell much smaller changes from noise than one case with its
//! handful of rounds: round by round the mean over the cases of the time relative to the case's own middle, without the
//! extreme fifths. That is a regression if the whole interval lies above 1 + threshold. A single case is one if its
//! whole interval lies above 1 + twice the threshold. Many things are tested at once, so tails are divided among them
//! (Bonferroni): the chance of any false alarm stays below 5 % even if the truth is the threshold itself.

use std::collections::BTreeMap;

use serde::Serialize;

use super::results::{CaseResult, Results};
use super::rows::Errors;
use super::statistics::{Estimate, middle, trimmed_mean};

/// What is no regression yet: a tenth.
pub const THRESHOLD: f64 = 0.1;
/// Chance of any false alarm.
const ALARM: f64 = 0.05;

/// What changed.
#[derive(Debug, Serialize)]
pub struct Comparison {
    /// Cases that both have.
    pub matched: usize,
    /// Times by technique, all its cases together.
    pub techniques: Vec<Change>,
    /// Times by case.
    pub cases: Vec<Change>,
    /// Counts and errors that are not equal.
    pub differences: Vec<Difference>,
    /// Cases that only one of the two has.
    pub unmatched: Vec<String>,
    /// What is worse than the threshold allows, in words.
    pub regressions: Vec<String>,
}

/// The time of one thing in B over that in A.
#[derive(Clone, Debug, Serialize)]
pub struct Change {
    /// What was timed.
    pub what: String,
    /// The ratio, its interval widened for the number of tests.
    pub ratio: Estimate,
    /// Whether the whole interval lies above what is allowed.
    pub is_regression: bool,
}

/// One exact value in both.
#[derive(Clone, Debug, Serialize)]
pub struct Difference {
    /// The case.
    pub case: String,
    /// Which value.
    pub value: &'static str,
    /// In A.
    pub before: f64,
    /// In B.
    pub after: f64,
    /// Whether it is worse by more than the threshold, or a promise that is no longer kept.
    pub is_regression: bool,
}

/// Compares B with A.
pub fn compare(a: &Results, b: &Results, threshold: f64) -> Comparison {
    let partner = |case: &CaseResult| b.cases.iter().find(|other| other.case == case.case);
    let pairs: Vec<_> = a.cases.iter().filter_map(|case| partner(case).map(|other| (case, other))).collect();
    let timed: Vec<_> = pairs.iter().copied().filter(|(a, b)| a.time.is_some() && b.time.is_some()).collect();
    let test = |what: String, a: &[f64], b: &[f64], family: usize, allowed: f64| {
        let ratio = Estimate::ratio(a, b, ALARM / family as f64);
        Change { what, ratio, is_regression: ratio.low > 1.0 + allowed }
    };
    let cases: Vec<_> = timed
        .iter()
        .map(|(a, b)| test(a.case.to_string(), &times(a), &times(b), timed.len(), 2.0 * threshold))
        .collect();
    let families = by_technique(&timed);
    let pooled = families.iter().map(|(name, pairs)| {
        let [a, b] = pooled(pairs);
        test(format!("{name}, {} cases", pairs.len()), &a, &b, families.len(), threshold)
    });
    let techniques: Vec<_> = pooled.collect();
    let differences: Vec<_> = pairs.iter().flat_map(|(a, b)| differences(a, b, threshold)).collect();
    let regressions = regressions(&techniques, &cases, &differences);
    Comparison { matched: pairs.len(), techniques, cases, differences, unmatched: unmatched(a, b), regressions }
}

/// The median frame times of a case's rounds.
fn times(case: &CaseResult) -> Vec<f64> {
    case.rounds.iter().map(|round| round.frame_ms.p50).collect()
}

type Pairs<'a> = Vec<(&'a CaseResult, &'a CaseResult)>;

fn by_technique<'a>(pairs: &Pairs<'a>) -> BTreeMap<String, Pairs<'a>> {
    let mut families: BTreeMap<String, Pairs> = BTreeMap::new();
    for &(a, b) in pairs {
        families.entry(a.case.series()).or_default().push((a, b));
    }
    families
}

/// Round by round, the trimmed mean over the cases of the time relative to the middle of the case's times in both runs.
fn pooled(pairs: &Pairs) -> [Vec<f64>; 2] {
    let mut rounds: [BTreeMap<usize, Vec<f64>>; 2] = Default::default();
    for (a, b) in pairs {
        // Half way between the two medians, so that neither run's count of rounds shifts it.
        let centre = (middle(times(a)) * middle(times(b))).sqrt();
        for (side, case) in [a, b].into_iter().enumerate() {
            for round in &case.rounds {
                rounds[side].entry(round.round).or_default().push(round.frame_ms.p50 / centre);
            }
        }
    }
    rounds.map(|rounds| rounds.into_values().map(trimmed_mean).collect())
}

/// A value of the errors, and whether any growth of it breaks a promise.
type Exact = (&'static str, fn(&Errors) -> Option<f64>, bool);

/// What is compared exactly; larger is worse.
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

fn regressions(techniques: &[Change], cases: &[Change], differences: &[Difference]) -> Vec<String> {
    let slower = |change: &Change| {
        let Estimate { value, low, high } = change.ratio;
        format!("{}: {value:.3} times slower ({low:.3} to {high:.3})", change.what)
    };
    let times = techniques.iter().chain(cases).filter(|change| change.is_regression).map(slower);
    let worse = |d: &Difference| format!("{}: {} {} instead of {}", d.case, d.value, d.after, d.before);
    times.chain(differences.iter().filter(|d| d.is_regression).map(worse)).collect()
}
