//! Tests of the painter's algorithm: sorted strips drawn back to front without a depth buffer give the same image as
//! with one.

use std::sync::Arc;

use cuesta::internal::bench::paths;
use cuesta::internal::draw::{DepthMode, DrawList};
use cuesta::internal::gpu::Gpu;
use cuesta::internal::height::{Field, synth};
use cuesta::internal::lod::Technique;
use cuesta::internal::plan::{Look, ScenePlan};
use cuesta::internal::scene::{Copy, Scene, SceneRenderer};
use cuesta::internal::view::{Metric, Tolerance, View};

use super::{aslant, mountains, on_device, render, technique};
use crate::altered::Altered;

const SIZE: [u32; 2] = [96, 64];

pub(super) fn renderer(gpu: &Arc<Gpu>, field: &Arc<Field>, technique: &dyn Technique, size: [u32; 2]) -> SceneRenderer {
    let look = Look::default();
    let plan = ScenePlan::builder(field, &look, &gpu.device_limits())
        .requirements(technique.pipeline_requirements())
        .build()
        .unwrap();
    Scene { gpu, field, plan: &plan, look: &look, overlay: None }.renderer(technique, size).unwrap()
}

/// A technique's lists drawn without a depth buffer.
fn painted(technique: Box<dyn Technique>) -> Box<dyn Technique> {
    Box::new(Altered::new(technique).with_requirements(|requirements| requirements.depth_mode = DepthMode::Painter))
}

/// Returns the bytes of all depth buffers.
fn depth_bytes(gpu: &Gpu) -> u64 {
    gpu.device_bytes().get("depth").copied().unwrap_or(0)
}

/// Returns the number of pixels that differ in any channel.
fn differing(a: &image::RgbaImage, b: &image::RgbaImage) -> usize {
    a.pixels().zip(b.pixels()).filter(|(a, b)| a != b).count()
}

#[test]
fn images_without_a_depth_buffer_are_equal_on_all_paths() {
    on_device(|gpu| {
        let mut field = synth::synth(synth::Kind::Fractal, [201, 170], 3);
        field.spacing = [20.0, 20.0];
        let field = Arc::new(field);
        let tolerance = Tolerance { px: 0.7, metric: Metric::Certified };
        let sorted = |settings: &[&str]| technique(&field, "sorted-strips", settings);
        let mut unsorted = 0;
        for level in ["level=certified", "level=uniform"] {
            let mut drawn: [Box<dyn Technique>; 3] = [
                sorted(&[level, "order=front"]),
                sorted(&[level, "order=painter"]),
                painted(sorted(&[level, "order=front"])),
            ];
            let mut stages = drawn.each_ref().map(|technique| renderer(gpu, &field, technique.as_ref(), SIZE));
            for path in paths::PATHS {
                let (mut wrong, mut terrain) = (0, 0);
                for view in path.views(&field, 200, SIZE, tolerance).iter().step_by(19) {
                    let mut picture = |k: usize| {
                        stages[k].draw(drawn[k].as_mut(), view, Copy::Picture).unwrap();
                        stages[k].picture()
                    };
                    let [with_depth, painted, nearest_first] = [0, 1, 2].map(&mut picture);
                    terrain += with_depth.pixels().filter(|p| p.0[3] > 0).count();
                    wrong += differing(&with_depth, &painted);
                    unsorted += differing(&with_depth, &nearest_first);
                }
                println!("{level} {}: {wrong} of {terrain} pixels differ", path.name);
                assert!(terrain > 0 && wrong == 0, "{level} {}: {wrong} pixels differ", path.name);
            }
        }
        assert!(unsorted > 1000, "the order matters: {unsorted} pixels differ nearest first");
    });
}

/// A caller that requests depths gets those of a depth buffer; otherwise none is allocated.
#[test]
fn depth_buffers_exist_only_on_request() {
    on_device(|gpu| {
        let field = mountains();
        let view = aslant(&field, SIZE, 1.0);
        let [deep, painted] = ["order=back", "order=painter"].map(|order| {
            let mut technique = technique(&field, "sorted-strips", &[order]);
            let mut renderer = renderer(gpu, &field, technique.as_ref(), SIZE);
            renderer.draw(technique.as_mut(), &view, Copy::Picture).unwrap();
            assert_eq!(depth_bytes(gpu) > 0, order == "order=back");
            renderer.draw(technique.as_mut(), &view, Copy::PictureAndDepth).unwrap();
            let (picture, depth) = (renderer.picture(), renderer.depth());
            renderer.draw_shading_only(&view, Copy::Picture).unwrap();
            (picture, depth, renderer.picture())
        });
        assert!(deep.1.iter().any(|&depth| depth > 0.0) && deep == painted);
    });
}

/// A frame whose draws are measured one by one needs no depth buffer either.
#[test]
fn a_probed_frame_uses_no_depth_buffer() {
    on_device(|gpu| {
        let field = mountains();
        let view = aslant(&field, SIZE, 1.0);
        let mut sorted = technique(&field, "sorted-strips", &["order=painter"]);
        let shown = render(gpu, &field, sorted.as_mut(), &view).picture;
        let mut renderer = renderer(gpu, &field, sorted.as_ref(), SIZE);
        renderer.draw_probed(sorted.as_mut(), "sorted-strips", &view).unwrap();
        assert_eq!(differing(&renderer.picture(), &shown), 0);
        assert_eq!(depth_bytes(gpu), 0);
    });
}

/// Front to back, every pixel is drawn once. In random order some are overdrawn, and back to front most.
#[test]
fn front_to_back_order_has_no_overdraw() {
    on_device(|gpu| {
        let field = mountains();
        let mut view = aslant(&field, SIZE, 1.0);
        // Low over the terrain, so that much of it is hidden by other terrain.
        view.eye = field.world_at(3.3, 92.6, f64::from(field.height(3, 92))) + glam::DVec3::Y * 150.0;
        view.world_from_eye = View::turned(-35.0, -3.0, 0.0);
        let passed = ["front", "shuffled", "back", "painter"].map(|order| {
            let mut technique = technique(&field, "sorted-strips", &[&format!("order={order}")]);
            let mut renderer = renderer(gpu, &field, technique.as_ref(), SIZE);
            let times = renderer.draw(technique.as_mut(), &view, Copy::PictureAndDepth).unwrap();
            let covered = renderer.picture().pixels().filter(|p| p.0[3] > 0).count() as u64;
            times.gpu.passed.map(|passed| (passed, covered))
        });
        println!("fragments past the depth test, and pixels of terrain: {passed:?}");
        let [Some((front, terrain)), Some((shuffled, _)), Some((back, _)), Some((painter, _))] = passed else {
            return println!("skipped: this device does not count fragments");
        };
        assert!(terrain > 1000 && front == terrain, "{passed:?}");
        assert!(shuffled > front + 50 && back > shuffled + 50 && painter >= back, "{passed:?}");
    });
}

/// Indices are 16 bits wide if all of a frame's fit. Indices of rows of pages fit, those of a whole frame do not.
#[test]
fn narrow_and_wide_indices_give_the_same_image() {
    on_device(|gpu| {
        let field = Arc::new(synth::synth(synth::Kind::Fractal, [385, 290], 5));
        let view = aslant(&field, SIZE, 1e-6);
        let [narrow, wide] = ["order=front", "order=shuffled"]
            .map(|order| render(gpu, &field, technique(&field, "sorted-strips", &[order]).as_mut(), &view));
        let highest = |list: &DrawList| list.streamed.indices.iter().copied().max();
        assert!(highest(&narrow.list) <= Some(65535) && highest(&wide.list) > Some(65535));
        assert!(narrow.picture.pixels().filter(|p| p.0[3] > 0).count() > 1000);
        assert_eq!(differing(&narrow.picture, &wide.picture), 0);
    });
}
