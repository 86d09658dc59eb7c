//! Scene time that stops, creeps, jumps or runs backwards, and cameras that oscillate.

use std::collections::HashSet;
use std::sync::Arc;

use super::case::{Case, Flight, Kind};
use super::fields::hills;
use super::finding::Finding;
use super::forms::TechniqueConfig;
use super::threshold::Threshold;
use crate::bench::paths::{self, TIME_STEP_S};
use crate::draw::expand;
use crate::draw::layout::Frame;
use crate::height::Field;
use crate::lod::Technique;
use crate::view::{Metric, Tolerance, View};

const fn case(name: &'static str, flight: fn() -> Flight) -> Case {
    Case { family: "time", name, kind: Kind::Flight(flight) }
}

/// The family `time`.
pub const CASES: &[Case] = &[
    case("no time between frames", || flown("circle", |_| 0.0)),
    case("1 microsecond between frames", || flown("circle", |frame| 1e-6 * frame as f64)),
    case("10 s between frames", || flown("circle", |frame| 10.0 * frame as f64)),
    case("time jumps forwards and backwards", || flown("skim", |frame| if frame % 3 == 0 { 1e6 } else { -5.0 })),
    case("back again in mid-morph", there_and_back),
    case("a teleport each frame", || flown("teleport", |frame| TIME_STEP_S * frame as f64)),
    Case { family: "time", name: "back and forth across a threshold", kind: Kind::PerTechnique(oscillation) },
];

/// Frames of a flight.
const FRAMES: usize = 24;

fn terrain() -> Field {
    hills([129, 97], [10.0; 2], 400.0)
}

fn path(field: &Field, name: &str, frames: usize) -> Vec<View> {
    let tolerance = Tolerance { px: 2.0, metric: Metric::Certified };
    paths::find(name).expect("a named path").views(field, frames, [320, 180], tolerance)
}

/// Returns a named path with custom scene times, seconds by frame.
fn flown(name: &str, time_s: fn(usize) -> f64) -> Flight {
    let field = Arc::new(terrain());
    let views = path(&field, name, FRAMES);
    let views = views.into_iter().enumerate().map(|(frame, view)| View { time_s: time_s(frame), ..view }).collect();
    Flight { views, field }
}

/// Returns a flight of six short steps forwards and backwards, repeated.
fn there_and_back() -> Flight {
    let field = Arc::new(terrain());
    let fine = path(&field, "circle", 40 * FRAMES);
    let frame = |k: usize| View {
        time_s: TIME_STEP_S * k as f64,
        ..fine[if (k / 6).is_multiple_of(2) { k % 6 } else { 5 - k % 6 }]
    };
    Flight { views: (0..2 * FRAMES).map(frame).collect(), field }
}

/// Number of threshold crossings.
const CROSSINGS: usize = 12;

/// Moves the camera back and forth across a threshold. The mesh may change at most once per crossing.
fn oscillation(config: &TechniqueConfig) -> Vec<Finding> {
    let field = Arc::new(terrain());
    let mut technique = (config.entry.build)(Arc::clone(&field), &config.settings);
    let Some(Threshold { start, sides: [before, behind] }) = Threshold::find(&field, &mut *technique) else {
        return vec![Finding::reported("every list is the same", 1.0)];
    };
    // Views just before and behind the threshold, one frame each.
    let margin = (behind.eye - start.eye) * 1e-9;
    let sides = [View { eye: before.eye - margin, ..before }, View { eye: behind.eye + margin, ..behind }];
    let meshes: Vec<_> = (0..=CROSSINGS)
        .map(|k| mesh(&field, &mut *technique, &View { time_s: TIME_STEP_S * k as f64, ..sides[k % 2] }))
        .collect();
    let changes = meshes.windows(2).filter(|pair| pair[0] != pair[1]).count();
    let kinds = meshes.iter().map(Vec::len).collect::<HashSet<_>>().len();
    vec![
        Finding::within("meshes a crossing", changes as f64 / CROSSINGS as f64, 1.0),
        Finding::within("numbers of triangles", kinds as f64, 3.0),
    ]
}

/// Returns the lattice corners of the next list's triangles, without heights, sorted.
fn mesh(field: &Field, technique: &mut dyn Technique, view: &View) -> Vec<[[i32; 2]; 3]> {
    let mut list = crate::draw::DrawList::default();
    technique.select(view, &mut list);
    let triangles = expand::triangles(field, &Frame::placing(field, view), technique.resident(), &list);
    let mut corners: Vec<_> = triangles.iter().map(|t| t.corners.map(|corner| [corner.x, corner.z])).collect();
    corners.sort_unstable();
    corners
}
