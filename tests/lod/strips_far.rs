//! Sorted strips with a far plane that approaches as the eye descends.

use std::sync::Arc;

use cuesta::internal::draw::DrawList;
use cuesta::internal::height::{Field, synth};
use cuesta::internal::lod::Technique;
use cuesta::internal::measure::watertight::{self, Kind};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};

use super::technique;

fn terrain() -> Arc<Field> {
    let mut field = synth::synth(synth::Kind::Fractal, [1025, 1025], 7);
    field.spacing = [10.0, 10.0];
    Arc::new(field)
}

fn view(field: &Field, above_m: f64) -> View {
    View {
        eye: field.world(500, 500) + glam::DVec3::Y * above_m,
        world_from_eye: View::turned(40.0, -10.0, 0.0),
        lens: Lens::Perspective { fov_x: 1.2 },
        size: [1280, 720],
        near: 1.0,
        tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
        time_s: 0.0,
    }
}

fn select(strips: &mut dyn Technique, view: &View) -> DrawList {
    let mut list = DrawList::default();
    strips.select(view, &mut list);
    list
}

#[test]
fn terrain_is_drawn_up_to_the_stated_reach() {
    let field = terrain();
    for level in ["level=certified", "level=uniform"] {
        let mut strips = technique(&field, "sorted-strips", &[level, "page=16", "far=4"]);
        let mut whole = technique(&field, "sorted-strips", &[level, "page=16"]);
        for above_m in [2.0, 20.0, 60.0, 150.0] {
            let view = view(&field, above_m);
            let (mut list, all) = (select(&mut *strips, &view), select(&mut *whole, &view));
            assert!((list.reach_m - 4.0 * (above_m + 160.0)).abs() < 1e-6, "{} m", list.reach_m);
            assert!(all.reach_m.is_infinite() && 10 * list.triangles() < 9 * all.triangles(), "{above_m} m");
            let prove = |list: &DrawList| {
                watertight::prove_list(&field, &view, strips.pipeline_requirements().seams, strips.resident(), list)
            };
            prove(&list).unwrap_or_else(|why| panic!("{level} {above_m} m: {why}"));
            // A list with a false, greater reach must be detected.
            list.reach_m *= 2.0;
            assert_eq!(prove(&list).map_err(|why| why.kind).err(), Some(Kind::Gap), "{level} {above_m} m");
        }
    }
}

#[test]
fn reach_shrinks_with_eye_height() {
    let field = terrain();
    let load = |far: &str| {
        let mut strips = technique(&field, "sorted-strips", &["level=uniform", "edge=8", "page=16", far]);
        [1000.0, 250.0, 60.0, 15.0].map(|above_m| select(&mut *strips, &view(&field, above_m)).triangles())
    };
    let [all, near] = ["far=0", "far=8"].map(load);
    assert!(near[0] == all[0] && 3 * near[3] < all[3], "{all:?} {near:?}");
    assert!(near[1] > near[2] && near[2] > near[3], "{near:?}");
}
