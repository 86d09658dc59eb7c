//! The budget controller on real techniques: a circle flown low over terrain, at several targets.

use std::sync::Arc;

use cuesta::internal::bench::paths;
use cuesta::internal::draw::DrawList;
use cuesta::internal::height::{Field, synth};
use cuesta::internal::lod::budget::{Controller, RANGE_PX, Target};
use cuesta::internal::view::{Metric, Tolerance, View};
use rayon::prelude::*;

use super::technique;

/// Target numbers of triangles.
const TARGETS: [f64; 3] = [4e4, 8e4, 16e4];
/// Number of frames flown of the path's thousand.
const FLOWN: usize = 100;
/// Frames in which the controller settles.
const SETTLING: usize = 15;

/// Returns the triangles relative to the target, frame by frame.
fn flown(field: &Arc<Field>, name: &str, settings: &[&str], target: f64, views: &[View]) -> Vec<f64> {
    let mut technique = technique(field, name, settings);
    let mut controller = Controller::new(Target::Triangles(target), 1.0, RANGE_PX);
    let mut list = DrawList::default();
    let frame = |view: &View| {
        let px = controller.tolerance_px();
        list.clear();
        technique.select(&View { tolerance: Tolerance { px, ..view.tolerance }, ..*view }, &mut list);
        controller.learn(px, list.triangles() as f64);
        list.triangles() as f64 / target
    };
    views.iter().map(frame).collect()
}

/// The load jumps if whole pages or blocks come into view; one frame is off before that is known.
#[test]
fn holds_targets_along_a_circle() {
    let mut field = synth::synth(synth::Kind::Eroded, [1025, 1025], 7);
    field.spacing = [10.0, 10.0];
    let field = Arc::new(field);
    let tolerance = Tolerance { px: 1.0, metric: Metric::Certified };
    let mut views = paths::find("circle").expect("a named path").views(&field, 1000, [1280, 720], tolerance);
    views.truncate(FLOWN);
    let techniques: [(&str, &[&str]); 4] = [
        ("sorted-strips", &[]),
        ("clusters", &["block=8"]),
        ("geomipmap", &["block=9"]),
        ("smooth-tiles", &["tile=9"]),
    ];
    let cases: Vec<_> = techniques.iter().flat_map(|form| TARGETS.map(|target| (*form, target))).collect();
    let report = |&((name, settings), target): &((&str, &[&str]), f64)| {
        let costs = flown(&field, name, settings, target, &views);
        let after = &costs[SETTLING..];
        let share = after.iter().filter(|cost| (**cost - 1.0).abs() <= 0.05).count() as f64 / after.len() as f64;
        let mean = after.iter().sum::<f64>() / after.len() as f64;
        let what = format!("{name} {settings:?} at {target}");
        println!("{what}: {:.2} % within 5 %, {:.2} % of it on average", 100.0 * share, 100.0 * mean);
        (what, share, mean)
    };
    let reports: Vec<_> = cases.par_iter().map(report).collect();
    for (what, share, mean) in reports {
        assert!(share >= 0.85 && (mean - 1.0).abs() <= 0.02, "{what}: {share} {mean}");
    }
}
