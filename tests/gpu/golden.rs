//! Golden images of every technique, 96 × 64: at most 0.1 % of pixels may differ by more than 5/255.
//! `UPDATE_GOLDEN=1` rewrites them; view them before committing.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use cuesta::internal::gpu::Gpu;
use cuesta::internal::height::synth;
use cuesta::internal::lod;
use cuesta::internal::plan::{Colour, Look, ScenePlan};
use cuesta::internal::view::View;

use super::{aslant, difference, on_device, technique};

/// Largest channel difference of pixels that count as equal.
const THRESHOLD: u8 = 5;
/// Largest share of pixels that may differ by more.
const SHARE: f64 = 0.001;

fn compare(gpu: &Arc<Gpu>, name: &str, colour: Colour, file: &str) {
    compare_look(gpu, name, &[], &Look { colour, ..Look::default() }, file);
}

fn compare_look(gpu: &Arc<Gpu>, name: &str, settings: &[&str], look: &Look, file: &str) {
    let field = Arc::new(synth::synth(synth::Kind::Fractal, [385, 290], 5));
    let mut view = aslant(&field, [96, 64], 1.0);
    // Close to the ground at one end, so that every level occurs.
    let statistics = field.statistics();
    view.eye = field.world_at(20.0, 270.0, f64::from(statistics.max) + 200.0);
    view.world_from_eye = View::looking_along(field.world_at(180.0, 140.0, statistics.mean) - view.eye);
    let mut technique = technique(&field, name, settings);
    let plan = ScenePlan::builder(&field, look, &gpu.device_limits())
        .requirements(technique.pipeline_requirements())
        .build()
        .unwrap();
    let scene = cuesta::internal::scene::Scene { gpu, field: &field, plan: &plan, look, overlay: None };
    let drawn = scene.render(technique.as_mut(), &view, 1).unwrap().picture;
    check(&drawn, file);
}

/// Compares a picture with a golden one; panics if too many pixels differ.
pub(super) fn check(drawn: &image::RgbaImage, file: &str) {
    let path: PathBuf = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/golden").join(format!("{file}.png"));
    if std::env::var("UPDATE_GOLDEN").as_deref() == Ok("1") {
        drawn.save(&path).unwrap();
    }
    let golden = image::open(&path).unwrap_or_else(|e| panic!("{}: {e}", path.display())).into_rgba8();
    let (largest, share) = difference(drawn, &golden, THRESHOLD);
    if share > SHARE {
        let folder = std::env::temp_dir();
        let actual = folder.join(format!("cuesta-{file}-actual.png"));
        drawn.save(&actual).unwrap();
        panic!("{file}: {:.2} % of pixels differ, by up to {largest}: see {}", 100.0 * share, actual.display());
    }
}

#[test]
fn every_technique_matches_its_golden_image() {
    on_device(|gpu| {
        for entry in lod::TECHNIQUES {
            compare(gpu, entry.name, Colour::Height, entry.name);
            compare(gpu, entry.name, Colour::Level, &format!("{}-level", entry.name));
        }
        compare(gpu, "geomipmap", Colour::Normal, "geomipmap-normal");
        compare(gpu, "geomipmap", Colour::Error, "geomipmap-error");
        let detail = Look { detail: true, sun_speed: 20.0, ..Look::default() };
        compare_look(gpu, "geomipmap", &[], &detail.after(3.0), "geomipmap-detail");
        let normal = Look { colour: Colour::Normal, ..Look::default() };
        compare_look(gpu, "smooth-tiles", &["normals=vertex"], &normal, "smooth-tiles-normal");
    });
}
