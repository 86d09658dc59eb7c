//! Shrinks a failing sweep case to a simpler one that fails in the same way.

use super::case::{Failure, SweepCase};
use super::terrain::Voids;
use super::viewpoint::{CaseLens, Direction, Viewpoint};

/// Maximum number of cases tried.
const MAX_TRIES: usize = 400;

/// Returns the simplest failure of the same invariant found by changing one property at a time.
pub fn shrink(mut failure: Failure, check: impl Fn(&SweepCase) -> Result<(), Box<Failure>>) -> Failure {
    let mut tries = 0;
    loop {
        let same_failure = |case: SweepCase| check(&case).err().filter(|other| other.invariant == failure.invariant);
        let smaller = candidates(&failure.case).into_iter().take(MAX_TRIES - tries).find_map(|case| {
            tries += 1;
            same_failure(case)
        });
        match smaller {
            Some(smaller) => failure = *smaller,
            None => return failure,
        }
    }
}

/// Returns simplified copies of a case, each with one property changed, largest changes first.
fn candidates(case: &SweepCase) -> Vec<SweepCase> {
    let mut simpler = Vec::new();
    let mut with = |change: &dyn Fn(&mut SweepCase)| {
        let mut changed = case.clone();
        change(&mut changed);
        if changed != *case {
            simpler.push(changed);
        }
    };
    with(&|case| case.settings.clear());
    (0..case.settings.len()).for_each(|k| with(&|case| drop(case.settings.remove(k))));
    with(&|case| case.variant = None);
    with(&|case| case.terrain.tiles = [1, 1]);
    with(&|case| case.terrain.voids = Voids::None);
    with(&|case| case.terrain.origin = [0.0, 0.0]);
    with(&|case| case.terrain.spacing = [10.0, 10.0]);
    with(&|case| case.terrain.seed = 0);
    // Ordered from the simplest.
    let kinds = ["flat", "ramp", "cliff"];
    let rank = kinds.iter().position(|kind| *kind == case.terrain.kind).unwrap_or(kinds.len());
    kinds[..rank].iter().for_each(|kind| with(&|case| case.terrain.kind = kind.to_string()));
    for (k, step) in (0..2).flat_map(|k| [2, 4, 16, u32::MAX].map(|part| (k, part))) {
        let less = |n: u32| (n - (n / step).max(1)).max(2);
        with(&|case| case.terrain.size[k] = less(case.terrain.size[k]));
    }
    with(&|case| case.paper_metric = false);
    with(&|case| case.tolerance_px = 2f64.powi(case.tolerance_px.log2().round() as i32));
    let simple = overview();
    with(&|case| case.view = simple.clone());
    with(&|case| case.view.roll = 0.0);
    with(&|case| case.view.size = simple.size);
    with(&|case| case.view.near = simple.near);
    with(&|case| case.view.lens = simple.lens);
    with(&|case| case.view.direction = simple.direction);
    with(&|case| case.view.at = case.view.at.map(|n| (n * 4.0).round() / 4.0));
    with(&|case| case.view.above = 2f64.powi(case.view.above.abs().max(1e-9).log2().round() as i32));
    simpler
}

/// A view straight down on all of the terrain.
fn overview() -> Viewpoint {
    Viewpoint {
        at: [0.5, 0.5],
        above: 1.0,
        direction: Direction::Turned([0.0, -90.0]),
        roll: 0.0,
        lens: CaseLens::Degrees(90.0),
        size: [64, 64],
        near: 1e-4,
    }
}
