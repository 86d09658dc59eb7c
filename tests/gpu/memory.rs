//! Tests of exhausted device memory: an error that names the purpose at any allocation, without leaks or invalid use.

use std::sync::Arc;

use anyhow::Result;
use cuesta::internal::gpu::Gpu;
use cuesta::internal::height::{Field, synth};
use cuesta::internal::lod::{TECHNIQUES, Technique};
use cuesta::internal::plan::{Look, ScenePlan};
use cuesta::internal::scene::holes::Truth;
use cuesta::internal::scene::{Copy, Scene};

use super::{aslant, on_device, technique};

/// Draws an image.
pub fn drawn(gpu: &Arc<Gpu>, field: &Arc<Field>, technique: &mut dyn Technique) -> Result<()> {
    with_scene(gpu, field, technique, |scene, technique| {
        let view = aslant(field, [64, 40], 2.0);
        let mut renderer = scene.renderer(technique, view.size)?;
        renderer.draw(technique, &view, Copy::PictureAndDepth)?;
        renderer.complete()
    })
}

/// Runs all measurements with device memory of their own: shading-only baseline, capture, probe and reference image.
pub fn measured(gpu: &Arc<Gpu>, field: &Arc<Field>, technique: &mut dyn Technique) -> Result<()> {
    with_scene(gpu, field, technique, |scene, technique| {
        let view = aslant(field, [64, 40], 2.0);
        let mut renderer = scene.renderer(technique, view.size)?;
        renderer.draw(technique, &view, Copy::PictureAndDepth)?;
        renderer.complete()?;
        renderer.draw_shading_only(&view, Copy::Picture)?;
        renderer.capture(technique, &view)?;
        renderer.draw_probed(technique, "probed", &view)?;
        Truth::new(scene, &view).map(|_| ())
    })
}

fn with_scene(
    gpu: &Arc<Gpu>,
    field: &Arc<Field>,
    technique: &mut dyn Technique,
    work: impl FnOnce(&Scene, &mut dyn Technique) -> Result<()>,
) -> Result<()> {
    let look = Look::default();
    let plan = ScenePlan::builder(field, &look, &gpu.device_limits())
        .requirements(technique.pipeline_requirements())
        .build()
        .unwrap();
    work(&Scene { gpu, field, plan: &plan, look: &look, overlay: None }, technique)
}

pub type Work = fn(&Arc<Gpu>, &Arc<Field>, &mut dyn Technique) -> Result<()>;

/// Fails the first allocation, then the second, and so on. Returns the number of allocations.
fn fail_each(gpu: &Arc<Gpu>, field: &Arc<Field>, name: &str, work: Work) -> u64 {
    let bytes = || gpu.device_bytes().values().sum::<u64>();
    let empty = bytes();
    for failures in 0.. {
        gpu.limit_allocations(failures);
        let outcome = work(gpu, field, technique(field, name, &[]).as_mut());
        gpu.limit_allocations(u64::MAX);
        assert_eq!(bytes(), empty, "{name}: bytes left after {failures} allocations");
        let Err(error) = outcome else { return failures };
        let text = format!("{error:#}");
        assert!(text.contains("out of memory") && !text.contains('\n'), "{name}, {failures}: {text}");
    }
    unreachable!("ends when nothing fails")
}

#[test]
fn a_failed_allocation_is_an_error_and_leaks_nothing() {
    let field = Arc::new(synth::synth(synth::Kind::Fractal, [65, 49], 3));
    on_device(|gpu| {
        for entry in TECHNIQUES {
            let count = fail_each(gpu, &field, entry.name, drawn);
            println!("{}: an error at each of {count} allocations", entry.name);
            assert!(count > 10, "{}: {count} allocations", entry.name);
        }
        let gpu_selector = fail_each(gpu, &field, "clusters:gpu-driven", drawn);
        let all = fail_each(gpu, &field, "clusters", measured);
        println!("selecting on the device: {gpu_selector}; measured: {all}");
        assert!(gpu_selector > 10 && all > gpu_selector, "{gpu_selector} and {all}");
    });
}
