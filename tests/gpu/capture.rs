//! Tests of measurements on the GPU: captured triangles against their CPU expansion, and the shading-only baseline
//! against the frame it stands for.

use std::sync::Arc;

use cuesta::internal::draw::layout::Frame;
use cuesta::internal::draw::place::relative_position;
use cuesta::internal::draw::{Seams, expand};
use cuesta::internal::gpu::Gpu;
use cuesta::internal::height::{Field, synth};
use cuesta::internal::lod::Technique;
use cuesta::internal::plan::{Look, ScenePlan};
use cuesta::internal::scene::{Copy, Scene, SceneRenderer};
use cuesta::internal::view::View;

use super::draw_list::{Explicit, Way};
use super::{as_f32, aslant, difference, mountains, on_device, technique};

fn renderer(gpu: &Arc<Gpu>, field: &Arc<Field>, technique: &mut dyn Technique, view: &View) -> SceneRenderer {
    let look = Look::default();
    let plan = ScenePlan::builder(field, &look, &gpu.device_limits())
        .requirements(technique.pipeline_requirements())
        .build()
        .unwrap();
    let mut renderer =
        Scene { gpu, field, plan: &plan, look: &look, overlay: None }.renderer(technique, view.size).unwrap();
    renderer.draw(technique, view, Copy::PictureAndDepth).unwrap();
    renderer
}

fn compare(gpu: &Arc<Gpu>, field: &Arc<Field>, name: &str, technique: &mut dyn Technique) {
    let view = aslant(field, [160, 100], 2.0);
    let mut renderer = renderer(gpu, field, technique, &view);
    assert_same(&mut renderer, technique, field, &view, name);
}

/// Asserts that the GPU draws the last list as the CPU expands it.
fn assert_same(
    renderer: &mut SceneRenderer,
    technique: &mut dyn Technique,
    field: &Arc<Field>,
    view: &View,
    name: &str,
) {
    let captured = renderer.capture(technique, view).unwrap();
    let frame = Frame::placing(field, view).with_fractions(renderer.list.fraction_bits);
    let expanded = [expand::triangles, expand::skirts].map(|e| e(field, &frame, technique.resident(), &renderer.list));
    assert_eq!(captured.each_ref().map(Vec::len), expanded.each_ref().map(Vec::len), "{name}");
    assert_eq!(expanded[1].is_empty(), technique.pipeline_requirements().seams == Seams::Shared, "{name}");
    let bits = |t: &expand::Drawn| (t.instance, t.corners.map(|c| (c.x, c.z, c.y.to_bits())));
    for (there, here) in captured.iter().flatten().zip(expanded.iter().flatten()) {
        assert_eq!(bits(&there.drawn), bits(here), "{name}: {there:?} {here:?}");
        let relative = here.corners.map(|c| relative_position(&frame, [c.x, c.z], c.y).map(f32::to_bits));
        assert_eq!(there.relative.map(|corner| corner.map(f32::to_bits)), relative, "{name}: {there:?}");
    }
}

#[test]
fn captured_triangles_equal_their_cpu_expansion() {
    on_device(|gpu| {
        let terrain = Arc::new(synth::synth(synth::Kind::Fractal, [513, 400], 9));
        for field in [mountains(), as_f32(&mountains()), terrain] {
            let configs = [
                ("brute-force", &[][..]),
                ("geomipmap", &[]),
                ("geomipmap", &["block=17", "morph=on"]),
                ("clusters", &["block=8"]),
                ("clusters", &["block=8", "morph=on"]),
                ("clusters:draw-per-block", &["block=16", "morph=on"]),
                ("clusters", &["block=8", "seams=skirts"]),
                ("clusters", &["block=8", "seams=skirts", "morph=on"]),
                ("clusters:draw-per-block", &["block=8", "seams=skirts", "morph=on"]),
                ("clusters:gpu-driven", &["block=8", "morph=on"]),
                ("smooth-tiles", &["tile=17"]),
                ("smooth-tiles", &["tile=9", "morph=off"]),
                ("clusters:gpu-driven", &["block=8", "seams=skirts", "morph=on"]),
                ("clusters", &["block=8", "morph=distance"]),
                ("clusters:draw-per-block", &["block=8", "morph=distance"]),
                ("clusters:gpu-driven", &["block=8", "morph=distance"]),
                ("sorted-strips", &["level=uniform", "blend=height"]),
                ("sorted-strips", &["level=uniform", "blend=end"]),
                ("sorted-strips", &["level=uniform", "blend=end", "topology=strip"]),
            ];
            for (name, settings) in configs {
                compare(gpu, &field, name, technique(&field, name, settings).as_mut());
            }
        }
        let field = mountains();
        for way in [Way::Resident, Way::Streamed, Way::Uploaded, Way::Strips] {
            compare(gpu, &field, &format!("{way:?}"), &mut Explicit::new(&field, way));
        }
    });
}

#[test]
fn morphing_and_rebuilt_chunks_equal_their_cpu_expansion() {
    on_device(|gpu| {
        let field = Arc::new(synth::synth(synth::Kind::Fractal, [193, 160], 9));
        let start = aslant(&field, [160, 100], 2.0);
        for settings in [["tile=9", "rebuild=3", "clock=frames"], ["tile=17", "rebuild=100000", "clock=speed"]] {
            let mut technique = technique(&field, "smooth-tiles", &settings);
            let mut renderer = renderer(gpu, &field, technique.as_mut(), &start);
            let mut rebuilt = 0;
            for k in 1..30 {
                // Forwards, then back at twice the speed.
                let along = f64::from(if k < 20 { k } else { 60 - 2 * k });
                let view = View { eye: start.eye + start.forward() * 12.0 * along, ..start };
                renderer.draw(technique.as_mut(), &view, Copy::Nothing).unwrap();
                rebuilt += usize::from(!renderer.list.uploads.is_empty());
                assert_same(&mut renderer, technique.as_mut(), &field, &view, &format!("{settings:?}, frame {k}"));
            }
            assert!(rebuilt > 5, "{settings:?}: chunks were uploaded in {rebuilt} frames");
        }
    });
}

#[test]
fn the_shading_only_baseline_shows_the_same_image() {
    on_device(|gpu| {
        for field in [mountains(), as_f32(&mountains())] {
            let view = aslant(&field, [320, 200], 0.5);
            let mut technique = technique(&field, "brute-force", &[]);
            let mut renderer = renderer(gpu, &field, technique.as_mut(), &view);
            let (drawn, depth) = (renderer.picture(), renderer.depth());
            let covered = |p: &image::Rgba<u8>| p.0[3] > 0;
            assert!(
                drawn.pixels().zip(&depth).all(|(p, &d)| covered(p) == (d > 0.0)),
                "terrain and depth cover the same pixels"
            );
            let times = renderer.draw_shading_only(&view, Copy::Picture).unwrap();
            let baseline = renderer.picture();
            let (largest, share) = difference(&drawn, &baseline, 6);
            assert!(share < 0.002, "{largest} at worst, {share} of the pixels differ");
            assert_eq!(times.gpu.passes.iter().map(|(name, _)| *name).collect::<Vec<_>>(), ["shading only"]);
        }
    });
}
