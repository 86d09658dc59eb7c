//! Tests that need a GPU. Every test runs with core and synchronization validation and fails on any message. Without
//! a device the tests are skipped, unless REQUIRE_GPU=1.

mod bench;
mod capture;
mod cave;
mod detail;
mod draw_list;
mod embed;
mod endless;
mod golden;
mod gpu_selection;
mod ground;
mod holes;
mod layout;
mod loss;
mod maps;
mod memory;
mod overlay;
mod painter;
mod parts;
mod plan;
mod position_check;
mod skirts;
mod soak;

use std::sync::Arc;

use cuesta::internal::gpu::{Choice, Gpu, Instance};
use cuesta::internal::height::{Field, Holes, Samples, synth};
use cuesta::internal::lod::Technique;
use cuesta::internal::plan::{Look, ScenePlan};
use cuesta::internal::scene::{RenderResult, Scene};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;

use crate::prepared::technique;

/// Runs a test on a device under validation.
pub(crate) fn on_device(test: impl FnOnce(&Arc<Gpu>)) {
    on_device_with(true, test);
}

/// Runs a test on a device, with the validation layers or without.
fn on_device_with(layers: bool, test: impl FnOnce(&Arc<Gpu>)) {
    let gpu = Instance::new(&[], layers).and_then(|instance| Gpu::new(&instance, &Choice::Best, false));
    match gpu {
        Ok(gpu) => {
            test(&gpu);
            let instance = Arc::clone(&gpu.instance);
            drop(gpu);
            let messages = instance.messages.lock().unwrap();
            assert!(messages.is_empty(), "validation:\n{}", messages.join("\n"));
        }
        Err(error) => {
            assert!(std::env::var("REQUIRE_GPU").as_deref() != Ok("1"), "no device: {error:#}");
            println!("skipped: no Vulkan device, or no validation layers: {error:#}");
        }
    }
}

/// Renders a field with a plan.
fn render_planned(
    gpu: &Arc<Gpu>,
    field: &Arc<Field>,
    plan: &ScenePlan,
    technique: &mut dyn Technique,
    view: &View,
) -> RenderResult {
    let look = Look::default();
    Scene { gpu, field, plan, look: &look, overlay: None }.render(technique, view, 1).expect("a picture")
}

/// Renders a field with the default look.
fn render(gpu: &Arc<Gpu>, field: &Arc<Field>, technique: &mut dyn Technique, view: &View) -> RenderResult {
    let plan = ScenePlan::builder(field, &Look::default(), &gpu.device_limits())
        .requirements(technique.pipeline_requirements())
        .build()
        .unwrap();
    render_planned(gpu, field, &plan, technique, view)
}

/// Mountains with a hole: 16-bit, not square.
pub(crate) fn mountains() -> Arc<Field> {
    let terrain = synth::synth(synth::Kind::Fractal, [131, 97], 5);
    let codes = (0..terrain.samples().len()).map(|k| (terrain.samples().height(k) * 10.0).round() as u16).collect();
    let samples = Samples::Coded { codes, zero: 0.0, scale: 0.1 };
    let mut holes = Holes::none(samples.len());
    for (j, i) in (30..45).flat_map(|j| (60..85).map(move |i| (j, i))) {
        holes.insert(j * 131 + i);
    }
    Arc::new(Field::new(samples, [131, 97], [20.0, 25.0], holes))
}

/// The same heights as f32.
fn as_f32(field: &Field) -> Arc<Field> {
    let heights = (0..field.samples().len()).map(|k| field.samples().height(k)).collect();
    let mut same = Field::new(Samples::F32(heights), field.stored(), field.spacing, field.holes().clone());
    same.origin = field.origin;
    Arc::new(same)
}

/// A view from beyond the south-west corner over the terrain.
pub(crate) fn aslant(field: &Field, size: [u32; 2], px: f64) -> View {
    let [w, h] = field.size().map(f64::from);
    let (low, high) = (field.world_at(0.0, 0.0, 0.0), field.world_at(w - 1.0, h - 1.0, 0.0));
    let top = f64::from(field.statistics().max);
    let eye =
        DVec3::new(low.x - 0.1 * (high.x - low.x), top + 0.25 * (high.x - low.x), high.z + 0.2 * (high.z - low.z));
    let target = (low + high) / 2.0 + DVec3::Y * field.statistics().mean;
    View {
        eye,
        world_from_eye: View::looking_along(target - eye),
        lens: Lens::Perspective { fov_x: 60f64.to_radians() },
        size,
        near: 1.0,
        tolerance: Tolerance { px, metric: Metric::Certified },
        time_s: 0.0,
    }
}

/// Returns the largest channel difference, and the share of pixels that differ by more than `threshold`.
fn difference(a: &image::RgbaImage, b: &image::RgbaImage, threshold: u8) -> (u8, f64) {
    assert_eq!(a.dimensions(), b.dimensions());
    let pixel = |(p, q): (&image::Rgba<u8>, &image::Rgba<u8>)| {
        p.0.iter().zip(q.0).map(|(x, y)| x.abs_diff(y)).max().unwrap_or(0)
    };
    let differences: Vec<u8> = a.pixels().zip(b.pixels()).map(pixel).collect();
    let over = differences.iter().filter(|&&d| d > threshold).count();
    (differences.iter().copied().max().unwrap_or(0), over as f64 / differences.len() as f64)
}

#[test]
fn holes_show_sky_and_all_else_terrain() {
    on_device(|gpu| {
        let field = mountains();
        let mut view = aslant(&field, [131, 97], 1.0);
        // From straight above, one pixel per sample.
        let [w, h] = field.size().map(|n| f64::from(n - 1));
        view.eye = field.world_at(w / 2.0, h / 2.0, 9000.0);
        view.world_from_eye = View::looking_along(DVec3::NEG_Y);
        view.lens = Lens::Orthographic { width: 131.0 * 20.0, far: 20_000.0 };
        for name in ["brute-force", "geomipmap"] {
            let rendered = render(gpu, &field, technique(&field, name, &[]).as_mut(), &view);
            let mut seen = [0; 2];
            for (x, y, pixel) in rendered.picture.enumerate_pixels() {
                // Ground under the pixel's centre, in samples.
                let i = f64::from(x) + 0.5 - 0.5;
                let j = (f64::from(y) + 0.5 - 97.0 / 2.0) * 20.0 / 25.0 + h / 2.0;
                let near = |n: f64, low: f64, high: f64| (n - low).abs().min((n - high).abs()) < 1.1;
                if !(1.0..w - 1.0).contains(&i) || !(1.0..h - 1.0).contains(&j) {
                    continue;
                }
                let (in_x, in_z) = ((59.0..85.0).contains(&i), (29.0..45.0).contains(&j));
                if (in_x && near(j, 29.0, 45.0)) || (in_z && near(i, 59.0, 85.0)) {
                    continue;
                }
                let hole = in_x && in_z;
                seen[usize::from(hole)] += 1;
                assert_eq!(pixel.0[3] == 0, hole, "{name}: pixel ({x}, {y}), sample ({i}, {j})");
            }
            assert!(seen[0] > 5000 && seen[1] > 200, "{seen:?}");
        }
    });
}

/// At a tolerance far below a pixel the image equals that of brute force.
#[test]
fn a_tiny_tolerance_draws_what_brute_force_draws() {
    on_device(|gpu| {
        let field = mountains();
        let view = aslant(&field, [160, 120], 1e-6);
        let truth = render(gpu, &field, technique(&field, "brute-force", &[]).as_mut(), &view);
        for settings in [&["block=9"][..], &["block=65", "masks=16"]] {
            let drawn = render(gpu, &field, technique(&field, "geomipmap", settings).as_mut(), &view);
            assert_eq!(drawn.picture, truth.picture, "{settings:?}");
        }
        let coarse =
            render(gpu, &field, technique(&field, "geomipmap", &[]).as_mut(), &aslant(&field, [160, 120], 8.0));
        assert_ne!(coarse.picture, truth.picture, "a wide tolerance must change the image");
    });
}

#[test]
fn the_image_is_the_same_ten_million_metres_from_the_origin() {
    on_device(|gpu| {
        let field = mountains();
        let mut far = (*field).clone();
        far.origin = [1.0e7, -6.4e6];
        let far = Arc::new(far);
        let here = aslant(&field, [160, 120], 1.0);
        let there = View { eye: here.eye + DVec3::new(1.0e7, 0.0, -6.4e6), ..here };
        let a = render(gpu, &field, technique(&field, "geomipmap", &[]).as_mut(), &here);
        let b = render(gpu, &far, technique(&far, "geomipmap", &[]).as_mut(), &there);
        // The eye is rounded to 2 nm there; no pixel may change visibly.
        assert!(difference(&a.picture, &b.picture, 2).1 < 0.001);
    });
}

#[test]
fn direct_and_indirect_draws_give_the_same_image() {
    on_device(|gpu| {
        let field = mountains();
        let view = aslant(&field, [160, 120], 1.0);
        let indirect = render(gpu, &field, technique(&field, "geomipmap", &["block=17"]).as_mut(), &view);
        let direct = render(gpu, &field, technique(&field, "geomipmap:draw-per-block", &["block=17"]).as_mut(), &view);
        assert_eq!(indirect.list.triangles(), direct.list.triangles());
        assert_eq!(indirect.picture, direct.picture);
        assert_eq!(indirect.list.commands(), 1);
        assert!(direct.list.commands() > 20);
        let statistics = [&indirect, &direct].map(|s| s.times.gpu.statistics.map(|s| s[2]));
        assert_eq!(statistics[0], statistics[1], "fragments run");
        assert!(indirect.times.gpu.total_ms > 0.0);
    });
}
