//! Sorted strips beside the picture: terrain that a rotation brings into view is already fine enough.

use std::sync::Arc;

use cuesta::internal::draw::DrawList;
use cuesta::internal::height::synth;
use cuesta::internal::measure::pop;
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;

use super::technique;

const TOLERANCE: Tolerance = Tolerance { px: 1.0, metric: Metric::Certified };

/// Returns the largest jump, pixels, and the triangles, while the view rotates by `degrees` per frame.
fn rotate(guard: &str, lens: Lens, degrees: f64) -> (f64, u64) {
    let mut field = synth::synth(synth::Kind::Fractal, [257, 257], 5);
    field.spacing = [20.0, 20.0];
    let field = Arc::new(field);
    let mut strips = technique(&field, "sorted-strips", &[guard]);
    let eye = field.world_at(128.3, 127.6, f64::from(field.statistics().max)) + DVec3::Y * 60.0;
    let view = |k: u32| {
        let world_from_eye = View::turned(f64::from(k) * degrees, -15.0, 0.0);
        View { eye, world_from_eye, lens, size: [640, 360], near: 1.0, tolerance: TOLERANCE, time_s: 0.0 }
    };
    let (mut largest_px, mut triangles) = (0f64, 0);
    let mut before: Option<(View, DrawList)> = None;
    for k in 0..12 {
        let (view, mut list) = (view(k), DrawList::default());
        strips.select(&view, &mut list);
        triangles += list.triangles();
        if let Some((from, old)) = &before {
            let state = |view, list| pop::State { view, resident: strips.resident(), list };
            let found = pop::pop(&field, state(from, old), state(&view, &list));
            assert!(found.histogram.bins.iter().map(|bin| bin.count).sum::<u64>() > 1000, "land is seen twice");
            largest_px = largest_px.max(found.max_px);
        }
        before = Some((view, list));
    }
    (largest_px, triangles)
}

#[test]
fn rotation_within_the_band_does_not_pop() {
    let lens = Lens::Perspective { fov_x: 60f64.to_radians() };
    let (open_px, min) = rotate("guard=0", lens, 8.0);
    let (kept_px, max) = rotate("guard=0.25", lens, 8.0);
    println!("jumps of {open_px} px without a band and {kept_px} px with it, {min} and {max} triangles");
    // Both lists are within the tolerance, each in its own view.
    assert!(kept_px <= 3.0 * TOLERANCE.px && open_px > 5.0 * TOLERANCE.px, "{kept_px} {open_px}");
    assert!(max < 2 * min, "the band is no second picture: {max} of {min}");
}

#[test]
fn rotation_beyond_the_band_pops() {
    let lens = Lens::Perspective { fov_x: 60f64.to_radians() };
    let (px, _) = rotate("guard=0.02", lens, 25.0);
    assert!(px > 5.0 * TOLERANCE.px, "{px}");
}
