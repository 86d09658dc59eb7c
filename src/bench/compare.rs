//! What changed from one benchmark to another: times as ratios with intervals, counts and errors exactly.
//!
//! A case's time is taken over the floor's of the same frames, drawn in turn with them: what slows the whole machine
//! down slows both. The floors are compared by themselves, as they tell of shading or of the machine.
//!
//! The cases of a technique are tested together, as they tell much smaller changes from noise than one case with its
//! handful of rounds: round by round the mean over the cases of the time relative to the case's own middle, without the
//! extreme fifths. That is a regression if the whole interval lies above 1 + threshold. A single case, or all floors
//! together, are one if the whole interval lies above 1 + twice the threshold. Many things are tested at once, so tails
//! are divided among the techniques and among the cases (Bonferroni): the chance of any false alarm among them stays
//! below 5 % even if the truth is the threshold itself.

use std::collections::BTreeMap;

use serde::Serialize;

use super::results::{CaseResult, Results};
use super::rows::{Errors, Times};
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
    /// Whether times are over the floor's; milliseconds where one of the two has no floors.
    pub over_floor: bool,
    /// Times of the floors, all cases together.
    pub floors: Option<Change>,
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
    let over_floor = timed.iter().all(|(a, b)| [a, b].iter().all(|case| case.rounds.iter().all(has_floor)));
    let cost = if over_floor { frame_over_floor } else { frame_ms };
    let cases: Vec<_> = timed
        .iter()
        .map(|(a, b)| {
            let costs = [a, b].map(|case| case.rounds.iter().map(cost).collect());
            Change::new(a.case.to_string(), &costs, timed.len(), 2.0 * threshold)
        })
        .collect();
    let together = |name: &str, pairs: &Pairs, cost: Cost, family: usize, allowed: f64| {
        Change::new(format!("{name}, {} cases", pairs.len()), &pooled(pairs, cost), family, allowed)
    };
    let families = by_technique(&timed);
    let techniques: Vec<_> =
        families.iter().map(|(name, pairs)| together(name, pairs, cost, families.len(), threshold)).collect();
    let floors = (over_floor && !timed.is_empty()).then(|| together("floor", &timed, floor_ms, 1, 2.0 * threshold));
    let differences: Vec<_> = pairs.iter().flat_map(|(a, b)| differences(a, b, threshold)).collect();
    let regressions = regressions(floors.iter().chain(&techniques).chain(&cases), &differences);
    Comparison {
        matched: pairs.len(),
        over_floor,
        floors,
        techniques,
        cases,
        differences,
        unmatched: unmatched(a, b),
        regressions,
    }
}

/// What a round says of a case.
type Cost = fn(&Times) -> f64;

fn has_floor(round: &Times) -> bool {
    round.floor_ms.is_some()
}

fn frame_ms(round: &Times) -> f64 {
    round.frame_ms.p50
}

fn floor_ms(round: &Times) -> f64 {
    round.floor_ms.map_or(f64::NAN, |floor| floor.p50)
}

fn frame_over_floor(round: &Times) -> f64 {
    frame_ms(round) / floor_ms(round)
}

impl Change {
    /// From the values of both; one of a family of so many tests.
    fn new(what: String, [a, b]: &[Vec<f64>; 2], family: usize, allowed: f64) -> Self {
        let ratio = Estimate::ratio(a, b, ALARM / family as f64);
        Self { what, ratio, is_regression: ratio.low > 1.0 + allowed }
    }
}

type Pairs<'a> = Vec<(&'a CaseResult, &'a CaseResult)>;

fn by_technique<'a>(pairs: &Pairs<'a>) -> BTreeMap<String, Pairs<'a>> {
    let mut families: BTreeMap<String, Pairs> = BTreeMap::new();
    for &(a, b) in pairs {
        families.entry(a.case.series()).or_default().push((a, b));
    }
    families
}

/// Round by round, the trimmed mean over the cases of the cost relative to the middle of the case's costs in both runs.
fn pooled(pairs: &Pairs, cost: Cost) -> [Vec<f64>; 2] {
    let mut rounds: [BTreeMap<usize, Vec<f64>>; 2] = Default::default();
    for (a, b) in pairs {
        // Half way between the two medians, so that neither run's count of rounds shifts it.
        let centre = [a, b].map(|case| middle(case.rounds.iter().map(cost))).iter().product::<f64>().sqrt();
        for (side, case) in [a, b].into_iter().enumerate() {
            for round in &case.rounds {
                rounds[side].entry(round.round).or_default().push(cost(round) / centre);
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

fn regressions<'a>(changes: impl Iterator<Item = &'a Change>, differences: &[Difference]) -> Vec<String> {
    let slower = |change: &Change| {
        let Estimate { value, low, high } = change.ratio;
        format!("{}: {value:.3} times slower ({low:.3} to {high:.3})", change.what)
    };
    let times = changes.filter(|change| change.is_regression).map(slower);
    let worse = |d: &Difference| format!("{}: {} {} instead of {}", d.case, d.value, d.after, d.before);
    times.chain(differences.iter().filter(|d| d.is_regression).map(worse)).collect()
}
