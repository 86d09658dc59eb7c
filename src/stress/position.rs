//! Terrain far from the world's origin, and terrain of the largest size.

use std::sync::Arc;

use super::case::{Case, Kind, StressTerrain};
use super::fields::{hills, hills_at, with_views};
use super::finding::Finding;
use super::forms::TechniqueConfig;
use super::invariants::Violation;
use super::jitter;
use super::numbers::all_numbers;
use crate::bench::paths;
use crate::draw::DrawList;
use crate::view::{Metric, Tolerance};

const fn case(name: &'static str, kind: Kind) -> Case {
    Case { family: "position", name, kind }
}

/// The family `position`.
pub const CASES: &[Case] = &[
    case("origin at 1e5 m", Kind::Terrain(|| at(1e5))),
    case("origin at 1e7 m", Kind::Terrain(|| at(1e7))),
    case("origin at the Earth's radius and a millimetre", Kind::Terrain(|| at(jitter::EARTH_M))),
    case("500 000 x 500 000 samples", Kind::PerTechnique(half_a_million)),
    case("jitter at 0 m", Kind::Standalone("vertex-program", || jitter::findings(0.0))),
    case("jitter at 1e5 m", Kind::Standalone("vertex-program", || jitter::findings(1e5))),
    case("jitter at 1e7 m", Kind::Standalone("vertex-program", || jitter::findings(1e7))),
    case("jitter at the Earth's radius", Kind::Standalone("vertex-program", || jitter::findings(jitter::EARTH_M))),
];

/// Returns hills at a distance from the world's origin, metres.
fn at(origin_m: f64) -> StressTerrain {
    with_views(hills_at(origin_m))
}

/// Frames of the path.
const FRAMES: usize = 4;

/// Flies over a small field tiled to half a million samples a side, seen from near the ground to the horizon. Lists
/// must fit the limits and all numbers must be finite. Invariants that visit all samples would take days.
fn half_a_million(config: &TechniqueConfig) -> Vec<Finding> {
    let field = Arc::new(hills([512, 512], [5.0; 2], 300.0).tiled([977, 977]));
    let mut technique = match config.entry.prepare(&field, &config.settings) {
        Ok(technique) => technique,
        Err(why) => return vec![Finding::reported("refused with a reason", 1.0).with_reason(Some(why))],
    };
    let tolerance = Tolerance { px: 16.0, metric: Metric::Certified };
    let views = paths::find("corner").expect("a named path").views(&field, FRAMES, [160, 90], tolerance);
    let (mut fits, mut numbers) = (Ok(()), Ok(()));
    for view in &views {
        let mut list = DrawList::default();
        technique.select(view, &mut list);
        let named = ("corner", *view);
        let (size, limits) = (list.size(), technique.limits());
        if !limits.hold(&size) {
            fits = fits.and(Err(Violation::new(named, format!("{size:?} exceeds {limits:?}"))));
        }
        let fine = all_numbers(&field, technique.as_ref(), view, &list);
        numbers = numbers.and(fine.map_err(|why| Violation::new(named, why)));
    }
    vec![
        Finding::holds("lists fit the limits", fits),
        Finding::holds("no NaN, no subnormal, weights in [0, 1]", numbers),
    ]
}
