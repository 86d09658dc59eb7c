//! Device memory that runs out: an error that says what for, wherever it happens; nothing leaks, nothing is misused.

use std::sync::Arc;

use anyhow::Result;
use cuesta::gpu::Gpu;
use cuesta::height::{Field, synth};
use cuesta::lod::{TECHNIQUES, Technique};
use cuesta::plan::{Look, ScenePlan};
use cuesta::scene::holes::Truth;
use cuesta::scene::{Copy, Scene};

use super::{aslant, on_device, technique};

/// Draws a picture and measures it with everything that has device memory of its own: capture, oracle, floor, truth.
fn measured(gpu: &Arc<Gpu>, field: &Arc<Field>, technique: &mut dyn Technique) -> Result<()> {
    let look = Look::default();
    let plan = ScenePlan::new(field, &look, &gpu.device_limits()).unwrap().with_manner(technique.manner());
    let scene = Scene { gpu, field, plan: &plan, look: &look, overlay: None };
    let view = aslant(field, [64, 40], 2.0);
    let mut stage = scene.stage(technique, view.size)?;
    stage.draw(technique, &view, Copy::PictureAndDepth)?;
    stage.complete()?;
    stage.draw_floor(&view, Copy::Picture)?;
    stage.capture(technique, &view)?;
    stage.errors(technique, &view)?;
    stage.draw_probed(technique, "probed", &view)?;
    Truth::new(&scene, &view)?;
    Ok(())
}

#[test]
fn running_out_at_any_allocation_is_an_error_and_leaks_nothing() {
    let field = Arc::new(synth::synth(synth::Kind::Fractal, [129, 97], 3));
    on_device(|gpu| {
        let bytes = || gpu.device_bytes().values().sum::<u64>();
        let empty = bytes();
        for entry in TECHNIQUES {
            let variants = entry.variants.iter().map(|variant| format!("{}:{}", entry.name, variant.name));
            for name in std::iter::once(entry.name.to_string()).chain(variants) {
                let mut failures = 0;
                loop {
                    gpu.limit_allocations(failures);
                    let outcome = measured(gpu, &field, technique(&field, &name, &[]).as_mut());
                    assert_eq!(bytes(), empty, "{name}: bytes left after {failures} allocations");
                    let Err(error) = outcome else { break };
                    let text = format!("{error:#}");
                    assert!(text.contains("out of memory") && !text.contains('\n'), "{name}, {failures}: {text}");
                    failures += 1;
                }
                assert!(failures > 10, "{name}: {failures} allocations");
                println!("{name}: an error at each of {failures} allocations");
            }
        }
        gpu.limit_allocations(u64::MAX);
    });
}
