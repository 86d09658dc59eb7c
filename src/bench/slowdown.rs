//! Ratio of two runs' times, frame by frame.
//!
//! What disturbs a frame only ever adds to its time: of a frame's times over the rounds the shortest is nearest to the
//! truth (Chen, Revels 2016, "Robust benchmarking in noisy environments"). It is held against the other run's shortest
//! time of the same frame. The median of these ratios over all frames is the result, and its interval that of a
//! bootstrap over the rounds, which are as independent of each other as anything in a run.

use super::results::CaseResult;
use super::rows::Times;
use super::statistics::{Estimate, middle, percentile, sorted};

/// Draws of the bootstrap.
const RESAMPLES: usize = 1000;
/// Fewer rounds tell nothing of the noise.
pub const MIN_ROUNDS: usize = 3;

/// One case in both runs.
pub type Pair<'a> = (&'a CaseResult, &'a CaseResult);

/// A time of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// Its time.
    FrameSample,
    /// The time of its floor: shading alone, and how fast the machine was.
    ShadingOnly,
    /// Its time over its floor's.
    OverShadingOnly,
}

/// Returns true if every round of a case has a shading-only time for every frame.
pub fn has_shading_only(case: &CaseResult) -> bool {
    case.rounds
        .iter()
        .all(|round| !round.frames_ms.is_empty() && round.shading_only_frames_ms.len() == round.frames_ms.len())
}

/// The cost of the second run over that of the first, all these cases together, and the interval that leaves a share
/// of `tail` out on either side.
pub fn slowdown(pairs: &[Pair], cost: Cost, tail: f64) -> Estimate {
    let count = |side: fn(&Pair) -> usize| pairs.iter().map(side).max().unwrap_or(0);
    let (a, b) = (count(|pair| pair.0.rounds.len()), count(|pair| pair.1.rounds.len()));
    let value = median_ratio(pairs, cost, [&Vec::from_iter(0..a), &Vec::from_iter(0..b)]);
    let mut random = fastrand::Rng::with_seed(1);
    let mut drawn = |count: usize| -> Vec<usize> { (0..count).map(|_| random.usize(..count)).collect() };
    let resampled = (0..RESAMPLES).map(|_| median_ratio(pairs, cost, [&drawn(a), &drawn(b)]));
    let resampled = sorted(resampled);
    Estimate { value, low: percentile(&resampled, tail), high: percentile(&resampled, 1.0 - tail) }
}

/// The median over all frames of all cases, looking at these rounds of either run.
fn median_ratio(pairs: &[Pair], cost: Cost, [a, b]: [&[usize]; 2]) -> f64 {
    middle(pairs.iter().flat_map(|pair| {
        let [before, after] = [costs(pair.0, cost, a), costs(pair.1, cost, b)];
        before.into_iter().zip(after).map(|(before, after)| after / before).collect::<Vec<_>>()
    }))
}

fn costs(case: &CaseResult, cost: Cost, rounds: &[usize]) -> Vec<f64> {
    match cost {
        Cost::FrameSample => shortest(case, rounds, frames_ms),
        Cost::ShadingOnly => shortest(case, rounds, |round| &round.shading_only_frames_ms),
        Cost::OverShadingOnly => {
            let shading_only = shortest(case, rounds, |round| &round.shading_only_frames_ms);
            shortest(case, rounds, frames_ms)
                .into_iter()
                .zip(shading_only)
                .map(|(frame, shading_only)| frame / shading_only)
                .collect()
        }
    }
}

/// A round's frames; one for all of them if it has but their median.
fn frames_ms(round: &Times) -> &[f64] {
    if round.frames_ms.is_empty() { std::slice::from_ref(&round.frame_ms.p50) } else { &round.frames_ms }
}

/// The shortest time of each frame in these rounds.
fn shortest(case: &CaseResult, rounds: &[usize], times: fn(&Times) -> &[f64]) -> Vec<f64> {
    let mut of_rounds = rounds.iter().map(|&k| times(&case.rounds[k % case.rounds.len()]));
    let mut shortest = of_rounds.next().unwrap_or_default().to_vec();
    for round in of_rounds {
        shortest.iter_mut().zip(round).for_each(|(min, &ms)| *min = min.min(ms));
    }
    shortest
}
