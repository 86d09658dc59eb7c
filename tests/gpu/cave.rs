//! Tests of caves: a floor and a ceiling drawn on the GPU.

use std::sync::Arc;

use cuesta::internal::bench::paths;
use cuesta::internal::draw::expand::{self, Drawn};
use cuesta::internal::draw::layout::Frame;
use cuesta::internal::gpu::Gpu;
use cuesta::internal::height::Field;
use cuesta::internal::height::cave::Cave;
use cuesta::internal::height::synth::{Kind, synth};
use cuesta::internal::lod::Technique;
use cuesta::internal::measure::geometric;
use cuesta::internal::plan::{Colour, Look, ScenePlan};
use cuesta::internal::scene::holes::Truth;
use cuesta::internal::scene::{Copy, Scene, SceneRenderer};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};

use super::{difference, on_device, technique};

/// Returns the floor of a cave, which carries its ceiling.
fn cave() -> Arc<Field> {
    let [floor, ceiling] = [Kind::CaveFloor, Kind::CaveCeiling].map(|kind| synth(kind, [257, 193], 7));
    Arc::clone(Cave::new(&floor, &ceiling, "ceiling").expect("two fields of one size").floor())
}

/// Views along the flight through the cave.
fn flight(field: &Field, frames: usize, px: f64) -> Vec<View> {
    let tolerance = Tolerance { px, metric: Metric::Certified };
    paths::find("cave").expect("a named path").views(field, frames, [240, 160], tolerance)
}

fn plan(gpu: &Gpu, field: &Field, look: &Look, technique: &dyn Technique) -> ScenePlan {
    ScenePlan::builder(field, look, &gpu.device_limits())
        .requirements(technique.pipeline_requirements())
        .build()
        .unwrap()
}

fn renderer(gpu: &Arc<Gpu>, field: &Arc<Field>, look: &Look, technique: &dyn Technique, view: &View) -> SceneRenderer {
    let plan = plan(gpu, field, look, technique);
    Scene { gpu, field, plan: &plan, look, overlay: None }.renderer(technique, view.size).unwrap()
}

/// Returns the share of an image's pixels that satisfy `of`.
fn share(picture: &image::RgbaImage, of: impl Fn([u8; 4]) -> bool) -> f64 {
    picture.pixels().filter(|pixel| of(pixel.0)).count() as f64 / picture.pixels().len() as f64
}

#[test]
fn the_gpu_draws_the_floor_and_ceiling_of_the_cpu_expansion() {
    on_device(|gpu| {
        let field = cave();
        let mut technique = technique(&field, "sorted-strips", &[]);
        for view in flight(&field, 4, 1.5) {
            let mut renderer = renderer(gpu, &field, &Look::default(), technique.as_ref(), &view);
            renderer.draw(technique.as_mut(), &view, Copy::Picture).unwrap();
            let [captured, skirts] = renderer.capture(technique.as_ref(), &view).unwrap();
            let captured: Vec<Drawn> = captured.iter().map(|t| t.drawn).collect();
            let frame = Frame::placing(&field, &view);
            assert_eq!(captured, expand::triangles(&field, &frame, technique.resident(), &renderer.list));
            assert!(captured.len() > 500 && skirts.is_empty(), "{} triangles", captured.len());
            let errors = geometric::errors(&field, &view, technique.resident(), &renderer.list);
            assert!(errors.samples > 1000 && errors.screen_px.max <= 1.5, "{errors:?}");
        }
    });
}

#[test]
fn a_flight_through_a_cave_shows_no_sky_through_rock() {
    on_device(|gpu| {
        let (field, look) = (cave(), Look::default());
        let mut technique = technique(&field, "sorted-strips", &[]);
        let plan = plan(gpu, &field, &look, technique.as_ref());
        let scene = Scene { gpu, field: &field, plan: &plan, look: &look, overlay: None };
        for (k, view) in flight(&field, 8, 1.0).iter().enumerate() {
            let rendered = scene.render(technique.as_mut(), view, 1).unwrap();
            let truth = Truth::new(&scene, view).unwrap();
            assert_eq!(truth.hole_pixels(&scene, view, &rendered.picture).unwrap(), [0; 0], "frame {k}");
            // The path ends at the field's edge, where the cave is open.
            let closed = share(&rendered.picture, |[_, _, _, a]| a > 0);
            println!("frame {k}: {closed:.3} of the pixels are rock; eye {:?}, forward {:?}", view.eye, view.forward());
            assert!(closed > if (2..6).contains(&k) { 0.9 } else { 0.3 }, "frame {k}: {closed} of the pixels are rock");
            let (_, apart) = difference(&rendered.picture, &truth.picture, 24);
            assert!(apart < 0.05, "frame {k}: {apart} of the pixels are not those of all samples");
        }
    });
}

/// Straight up shows the ceiling, with normals pointing down and heights of the ceiling; straight down shows the
/// floor.
#[test]
fn floor_and_ceiling_are_lit_by_their_own_normals() {
    on_device(|gpu| {
        let field = cave();
        let mut technique = technique(&field, "sorted-strips", &[]);
        // Along the view axis even a large error moves no pixel; a tiny tolerance removes both.
        for view in &flight(&field, 5, 1e-9)[1..4] {
            for (pitch, points_down) in [(90.0, true), (-90.0, false)] {
                let lens = Lens::Perspective { fov_x: 0.4 };
                let view = View { world_from_eye: View::turned(0.0, pitch, 0.0), lens, ..*view };
                let mut picture = |colour| {
                    let look = Look { colour, ..Look::default() };
                    let mut renderer = renderer(gpu, &field, &look, technique.as_ref(), &view);
                    renderer.draw(technique.as_mut(), &view, Copy::Picture).unwrap();
                    renderer.picture()
                };
                // A normal's y is encoded as green, 188 for y = 0.
                let normals = picture(Colour::Normal);
                let down = share(&normals, |[_, g, _, a]| a > 0 && g < 188);
                assert!(if points_down { down > 0.95 } else { down < 0.05 }, "{down} of the normals point down");
                let errors = picture(Colour::Error);
                let exact = share(&errors, |[r, _, b, a]| a > 0 && b > r);
                assert!(exact > 0.95, "{exact} of the pixels are where the samples are: {pitch} {:?}", view.eye);
            }
        }
    });
}

#[test]
fn the_shading_only_baseline_lights_a_cave_alike() {
    on_device(|gpu| {
        let field = cave();
        let mut technique = technique(&field, "sorted-strips", &[]);
        for view in flight(&field, 3, 0.5) {
            let mut renderer = renderer(gpu, &field, &Look::default(), technique.as_ref(), &view);
            renderer.draw(technique.as_mut(), &view, Copy::Picture).unwrap();
            let drawn = renderer.picture();
            renderer.draw_shading_only(&view, Copy::Picture).unwrap();
            let (largest, share) = difference(&drawn, &renderer.picture(), 6);
            assert!(share < 0.01, "{largest} at worst, {share} of the pixels differ");
        }
    });
}

/// A field without a ceiling allocates none on the device.
#[test]
fn only_caves_allocate_a_ceiling() {
    on_device(|gpu| {
        let cave = cave();
        let bytes = |field: &Arc<Field>| {
            let technique = technique(field, "sorted-strips", &[]);
            let view = flight(field, 1, 1.0)[0];
            let _stage = renderer(gpu, field, &Look::default(), technique.as_ref(), &view);
            gpu.device_bytes().get("ceiling").copied().unwrap_or(0)
        };
        assert!(bytes(&cave) >= 4 * 257 * 193);
        let alone = Arc::new(synth(Kind::CaveFloor, [257, 193], 7));
        assert_eq!(bytes(&alone), 0);
        assert!(!ScenePlan::builder(&alone, &Look::default(), &gpu.device_limits()).build().unwrap().ceiling);
    });
}
