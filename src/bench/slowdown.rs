//! Ratio of the times of two runs, compared frame by frame.
//!
//! Disturbances only ever lengthen a frame. Of a frame's times in all rounds, the shortest is therefore the best
//! estimate (J. Chen and J. Revels, "Robust benchmarking in noisy environments", 2016). It is divided by the shortest
//! time of the same frame in the other run. The result is the median of these ratios over all frames. Its interval
//! comes from a bootstrap over the rounds.

use super::results::CaseResult;
use super::rows::Times;
use super::statistics::{Estimate, middle, percentile, sorted};

/// Number of bootstrap resamples.
const RESAMPLES: usize = 1000;
/// Smallest number of rounds that allows an estimate of the noise.
pub const MIN_ROUNDS: usize = 3;

/// The same case in both runs, the earlier one first.
pub type Pair<'a> = (&'a CaseResult, &'a CaseResult);

/// The time of a frame that is compared.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Cost {
    /// Frame time.
    Frame,
    /// Frame time of the shading-only baseline.
    ShadingOnly,
    /// Frame time divided by that of the shading-only baseline, which cancels the speed of the machine.
    OverShadingOnly,
}

/// Returns true if every round of a case has a shading-only time for every frame.
pub fn has_shading_only(case: &CaseResult) -> bool {
    case.rounds
        .iter()
        .all(|round| !round.frames_ms.is_empty() && round.shading_only_frames_ms.len() == round.frames_ms.len())
}

/// Returns the cost in the second run divided by that in the first, over all frames of all `pairs`. The interval
/// leaves out the share `tail` of the bootstrap distribution on either side.
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

/// Returns the median ratio over all frames of all pairs, from the rounds `a` of the first run and `b` of the second.
fn median_ratio(pairs: &[Pair], cost: Cost, [a, b]: [&[usize]; 2]) -> f64 {
    middle(pairs.iter().flat_map(|pair| {
        let [before, after] = [costs(pair.0, cost, a), costs(pair.1, cost, b)];
        before.into_iter().zip(after).map(|(before, after)| after / before).collect::<Vec<_>>()
    }))
}

/// Returns the cost of each frame, from these rounds.
fn costs(case: &CaseResult, cost: Cost, rounds: &[usize]) -> Vec<f64> {
    match cost {
        Cost::Frame => shortest(case, rounds, frames_ms),
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

/// Returns the frame times of a round. Rows of older versions have only their median, which then stands for all.
fn frames_ms(round: &Times) -> &[f64] {
    if round.frames_ms.is_empty() { std::slice::from_ref(&round.frame_ms.p50) } else { &round.frames_ms }
}

/// Returns the shortest time of each frame in these rounds. Numbers beyond the last round start over at the first.
fn shortest(case: &CaseResult, rounds: &[usize], times: fn(&Times) -> &[f64]) -> Vec<f64> {
    let mut of_rounds = rounds.iter().map(|&k| times(&case.rounds[k % case.rounds.len()]));
    let mut shortest = of_rounds.next().unwrap_or_default().to_vec();
    for round in of_rounds {
        shortest.iter_mut().zip(round).for_each(|(min, &ms)| *min = min.min(ms));
    }
    shortest
}
