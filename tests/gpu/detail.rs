//! Tests of detail textures: identical wherever the field repeats, and invisible from afar.

use std::sync::Arc;

use cuesta::internal::gpu::Gpu;
use cuesta::internal::height::{Field, Holes, Samples, synth};
use cuesta::internal::plan::{Look, ScenePlan};
use cuesta::internal::scene::Scene;
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;
use image::RgbaImage;

use super::{difference, on_device, technique};

fn render(gpu: &Arc<Gpu>, field: &Arc<Field>, detail: bool, view: &View) -> RgbaImage {
    let look = Look { detail, ..Look::default() };
    let mut technique = technique(field, "clusters", &["block=16"]);
    let plan = ScenePlan::builder(field, &look, &gpu.device_limits())
        .requirements(technique.pipeline_requirements())
        .build()
        .unwrap();
    let scene = Scene { gpu, field, plan: &plan, look: &look, overlay: None };
    scene.render(technique.as_mut(), view, 1).unwrap().picture
}

fn view(eye: DVec3, pitch: f64) -> View {
    View {
        eye,
        world_from_eye: View::turned(20.0, pitch, 0.0),
        lens: Lens::Perspective { fov_x: 60f64.to_radians() },
        size: [160, 100],
        near: 0.1,
        tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
        time_s: 0.0,
    }
}

/// Returns the mean difference of neighbouring pixels.
fn roughness(picture: &RgbaImage) -> f64 {
    let steps = picture.pixels().zip(picture.pixels().skip(1)).map(|(a, b)| f64::from(a.0[1].abs_diff(b.0[1])));
    steps.sum::<f64>() / f64::from(picture.width() * picture.height())
}

/// Half a million samples from the field's first one, where f32 has steps of 1/32 sample, the detail under the eye is
/// the same.
#[test]
fn detail_repeats_with_the_field_half_a_million_samples_away() {
    on_device(|gpu| {
        let mut tile = synth::synth(synth::Kind::Fractal, [64, 64], 3);
        tile.spacing = [16.0, 16.0];
        let field = Arc::new(tile.tiled([7900, 7900]));
        assert!(field.size()[0] > 500_000);
        // 4096 m are four tiles.
        let here = view(field.world_at(4.0 * 64.0 + 20.0, 4.0 * 64.0 + 30.0, 0.0), -50.0);
        let above = |view: &View| field.height_at(view.eye.x, view.eye.z).unwrap() + 3.0;
        let here = View { eye: DVec3 { y: above(&here), ..here.eye }, ..here };
        let there = View { eye: here.eye + DVec3::new(1950.0, 0.0, 1940.0) * 4096.0, ..here };
        let [a, b] = [here, there].map(|view| render(gpu, &field, true, &view));
        assert!(roughness(&a) > 2.0, "detail is visible: {}", roughness(&a));
        assert!(difference(&a, &b, 2).1 < 0.001, "{:?}", difference(&a, &b, 2));
        // A metre aside the detail differs.
        let aside = View { eye: there.eye + DVec3::X, ..there };
        assert!(difference(&a, &render(gpu, &field, true, &aside), 2).1 > 0.3);
    });
}

#[test]
fn detail_fades_into_its_mean_from_afar() {
    on_device(|gpu| {
        let flat = Field::new(Samples::F32(vec![0.0; 129 * 129]), [129; 2], [400.0; 2], Holes::none(129 * 129));
        let field = Arc::new(flat);
        let rough =
            |height: f64| roughness(&render(gpu, &field, true, &view(field.world_at(64.0, 64.0, height), -90.0)));
        let [near, far] = [2.0, 15_000.0].map(rough);
        let plain = roughness(&render(gpu, &field, false, &view(field.world_at(64.0, 64.0, 2.0), -90.0)));
        println!("{near} near, {far} far, {plain} without");
        assert!(near > 3.0 && far < near / 3.0 && plain < 0.1, "{near} near, {far} far, {plain} without");
    });
}

/// Device memory does not depend on the number of tiles.
#[test]
fn memory_does_not_grow_with_the_tiling() {
    on_device(|gpu| {
        let bytes = [1500, 7900].map(|tiles| {
            let field = Arc::new(synth::synth(synth::Kind::Fractal, [64, 64], 3).tiled([tiles, tiles]));
            let view = view(field.world_at(300.0, 300.0, 2000.0), -30.0);
            let look = Look { detail: true, ..Look::default() };
            let mut technique = technique(&field, "clusters", &["block=16"]);
            let plan = ScenePlan::builder(&field, &look, &gpu.device_limits())
                .requirements(technique.pipeline_requirements())
                .build()
                .unwrap();
            let scene = Scene { gpu, field: &field, plan: &plan, look: &look, overlay: None };
            scene.render(technique.as_mut(), &view, 1).unwrap().device_bytes
        });
        assert_eq!(bytes[0], bytes[1]);
    });
}
