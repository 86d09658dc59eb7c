//! Tests of skirts in images: they hide every gap, they are counted, and their depth is invisible.

use std::sync::Arc;

use cuesta::internal::gpu::Gpu;
use cuesta::internal::height::{Field, synth};
use cuesta::internal::lod::Technique;
use cuesta::internal::plan::{Look, ScenePlan};
use cuesta::internal::scene::holes::{Truth, skirts as skirt_pixels};
use cuesta::internal::scene::{Copy, Scene};
use cuesta::internal::stress::views;
use cuesta::internal::view::View;

use super::{aslant, difference, on_device, render, technique};
use crate::altered::{Altered, scale_skirts};
use crate::conformance::cases;

/// Clusters with skirts `factor` times as deep.
fn skirted(field: &Arc<Field>, morph: &str, factor: f32) -> Altered {
    let clusters = technique(field, "clusters", &["block=8", morph, "seams=skirts"]);
    Altered::new(clusters).with_list(move |list| scale_skirts(list, factor))
}

/// Returns the number of pixels where sky shows through terrain.
fn hole_pixels(gpu: &Arc<Gpu>, field: &Arc<Field>, view: &View, picture: &image::RgbaImage) -> usize {
    let look = Look::default();
    let plan = ScenePlan::builder(field, &look, &gpu.device_limits()).build().unwrap();
    let scene = Scene { gpu, field, plan: &plan, look: &look, overlay: None };
    Truth::new(&scene, view).unwrap().hole_pixels(&scene, view, picture).unwrap().len()
}

fn count(picture: &image::RgbaImage) -> usize {
    skirt_pixels(picture).into_iter().filter(|&is| is).count()
}

#[test]
fn skirts_hide_every_gap_between_levels() {
    on_device(|gpu| {
        let field = Arc::new(synth::synth(synth::Kind::Fractal, [385, 290], 5));
        let outside = aslant(&field, [640, 480], 4.0);
        // Inside the field, because skirts at its edge are visible from outside.
        let eye = field.world_at(150.0, 200.0, f64::from(field.statistics().max) + 200.0);
        let within = View { eye, world_from_eye: View::turned(40.0, -25.0, 0.0), ..outside };
        for (view, is_within, morph) in [(outside, false), (within, true)]
            .into_iter()
            .flat_map(|(v, is)| ["morph=off", "morph=on"].map(|m| (v, is, m)))
        {
            let stitched = render(gpu, &field, technique(&field, "clusters", &["block=8", morph]).as_mut(), &view);
            let [flat, skirt_vertex, deeper] =
                [0.0, 1.0, 3.0].map(|factor| render(gpu, &field, &mut skirted(&field, morph, factor), &view).picture);
            let open =
                [&stitched.picture, &flat, &skirt_vertex].map(|picture| hole_pixels(gpu, &field, &view, picture));
            println!("{morph}: {open:?} hole pixels, {} skirt pixels", count(&skirt_vertex));
            assert!(open[0] == 0 && open[1] > 0 && open[2] == 0, "{morph}: {open:?} hole pixels");
            assert_eq!([count(&stitched.picture), count(&flat)], [0, 0]);
            assert!(count(&skirt_vertex) > 0, "{morph}");
            // The first few metres close a gap; the rest of a skirt is hidden.
            assert!(
                !is_within || deeper == skirt_vertex,
                "{morph}: {:?} differ",
                difference(&deeper, &skirt_vertex, 0)
            );
        }
    });
}

#[test]
fn skirts_leave_no_hole_pixels_on_any_test_field() {
    on_device(|gpu| {
        let mut seen = 0;
        for (name, field) in cases::fields() {
            let look = Look::default();
            let plan = ScenePlan::builder(&field, &look, &gpu.device_limits()).build().unwrap();
            let scene = Scene { gpu, field: &field, plan: &plan, look: &look, overlay: None };
            let views = views::views(&field).into_iter().map(|(what, view)| (what, views::with_tolerance(&view, 4.0)));
            let truths: Vec<_> = views.map(|(what, view)| (what, view, Truth::new(&scene, &view).unwrap())).collect();
            for morph in ["morph=off", "morph=on"] {
                let mut technique = skirted(&field, morph, 1.0);
                let plan = plan.with_requirements(technique.pipeline_requirements());
                let mut renderer = Scene { plan: &plan, ..scene.clone() }.renderer(&technique, [320, 180]).unwrap();
                for (what, view, truth) in &truths {
                    renderer.draw(&mut technique, view, Copy::Picture).unwrap();
                    let open = truth.hole_pixels(&scene, view, &renderer.picture()).unwrap().len();
                    assert_eq!(open, 0, "{name}, {what}, {morph}");
                    seen += count(&renderer.picture());
                }
            }
        }
        assert!(seen > 0);
        println!("{seen} skirt pixels");
    });
}
