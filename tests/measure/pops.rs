//! The pop meter on geomipmap, against heights laid out and projected one by one.

use std::collections::HashMap;
use std::sync::Arc;

use cuesta::internal::draw::expand::Drawn;
use cuesta::internal::height::synth::{self, Kind};
use cuesta::internal::height::{Field, surface};
use cuesta::internal::measure::in_view;
use cuesta::internal::measure::pop::{self, Pop, State};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;

use super::{drawn, select, technique};

fn terrain() -> Arc<Field> {
    let mut field = synth::synth(Kind::Fractal, [129, 129], 5);
    field.spacing = [20.0, 20.0];
    Arc::new(field)
}

/// A slow way towards the land.
fn view(field: &Field, k: u32) -> View {
    let target = field.world(64, 64);
    let eye = target + DVec3::new(-0.7, 0.5, 0.6) * 4000.0 * 0.98f64.powi(k as i32);
    View {
        eye,
        world_from_eye: View::looking_along(target - eye),
        lens: Lens::Perspective { fov_x: 0.5 },
        size: [1280, 720],
        near: 1.0,
        tolerance: Tolerance { px: 4.0, metric: Metric::Certified },
        time_s: 0.0,
    }
}

fn heights(triangles: &[Drawn]) -> HashMap<[u32; 2], f64> {
    let mut heights = HashMap::new();
    for triangle in triangles {
        surface::visit_samples(&triangle.corners, |x, z, y| {
            heights.insert([x, z], y);
        });
    }
    heights
}

/// Returns the measured pops from frame to frame, and the largest displacement computed by hand.
fn journey(settings: &[&str]) -> Vec<(Pop, f64)> {
    let field = terrain();
    let mut technique = technique(&field, "geomipmap", settings);
    let lists: Vec<_> = (0..40).map(|k| select(&mut *technique, &view(&field, k))).collect();
    let pair = |k: usize| {
        let ([old_view, view], resident) = ([k - 1, k].map(|k| view(&field, k as u32)), technique.resident());
        let before = State { view: &old_view, resident, list: &lists[k - 1] };
        let found = pop::pop(&field, before, State { view: &view, resident, list: &lists[k] });
        let [old, new] = [&lists[k - 1], &lists[k]].map(|list| heights(&drawn(&field, &view, &*technique, list)));
        let moved = old.iter().filter_map(|(&[x, z], &from)| {
            let [from, to] = [from, *new.get(&[x, z])?].map(|y| field.world_at(x.into(), z.into(), y));
            in_view(&view, to).then(|| view.displacement_px(from, to))
        });
        (found, moved.fold(0.0, f64::max))
    };
    (1..lists.len()).map(pair).collect()
}

#[test]
fn jumps_are_those_found_by_hand_and_morphing_has_fewer() {
    let largest = ["morph=off", "morph=on"].map(|morph| {
        let pops = journey(&["block=17", morph]);
        for (k, (found, by_hand)) in pops.iter().enumerate() {
            assert!((found.max_px - by_hand).abs() < 1e-9, "frame {k}: {} px, by hand {by_hand}", found.max_px);
            assert!(
                found.histogram.bins.iter().map(|bin| bin.count).sum::<u64>() > 1000 && found.p99_px <= found.max_px
            );
        }
        pops.iter().map(|(found, _)| found.max_px).fold(0.0, f64::max)
    });
    println!("largest pop: {:.3} px at once, {:.3} px morphing", largest[0], largest[1]);
    assert!(largest[0] > 1.0 && largest[1] < largest[0] / 2.0, "{largest:?}");
}

/// A list from before may be expanded in a later view: instances hold positions of the lattice, not of the eye.
#[test]
fn an_expanded_list_is_the_same_in_every_view() {
    let field = terrain();
    let mut technique = technique(&field, "geomipmap", &["morph=on"]);
    let list = select(&mut *technique, &view(&field, 3));
    let corners = |k: u32| -> Vec<_> {
        let mut far = view(&field, k);
        far.eye.x += 1e7 * f64::from(k);
        drawn(&field, &far, &*technique, &list).iter().map(|t| t.corners).collect()
    };
    assert!(!corners(0).is_empty());
    assert_eq!(corners(0), corners(30));
}
