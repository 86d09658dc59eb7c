//! The savings of features left out of a plan, measured by keeping each of them once.

use anyhow::{Context, Result};

use super::renderer::{Copy, Scene, SceneRenderer};
use super::times::{Times, median};
use crate::gpu::pipelines;
use crate::lod::Technique;
use crate::plan::{FEATURES, Feature, ScenePlan, forced};
use crate::view::View;

/// The cost of one feature that the scene does not need.
#[derive(Clone, Debug)]
pub struct Saving {
    /// The feature.
    pub feature: &'static str,
    /// Device bytes.
    pub bytes: i64,
    /// Pipelines.
    pub pipelines: i64,
    /// Shader instructions of all shaders together, once constants are known.
    pub instructions: i64,
    /// Device time of a frame, as a ratio to that without the feature. Both are medians of frames drawn in turn.
    pub time: f64,
    /// Largest difference of a colour channel between the two pictures, and the number of pixels that differ.
    pub differs: (u8, usize),
}

/// The cost of a scene as planned.
#[derive(Clone, Debug)]
pub struct Lean {
    /// Device bytes.
    pub bytes: i64,
    /// Pipelines.
    pub pipelines: i64,
    /// Shader instructions.
    pub instructions: i64,
    /// Device time of a frame, milliseconds.
    pub gpu_ms: f64,
}

/// Draws a view `frames` times with each feature that the plan leaves out and that can be kept, and as often without it,
/// in turn. The two techniques are alike.
///
/// # Errors
/// If the device fails, or the technique does not settle.
pub fn measure(
    scene: &Scene,
    techniques: &mut [Box<dyn Technique>; 2],
    view: &View,
    frames: usize,
) -> Result<(Lean, Vec<Saving>)> {
    let [technique, other] = techniques;
    let before = bytes(scene);
    let mut renderer = settled(scene, technique.as_mut(), view)?;
    let own = bytes(scene) - before;
    let mut times = Vec::new();
    let mut savings = Vec::new();
    for (feature, plan) in left_out(scene)? {
        let kept = Scene { plan: &plan, ..scene.clone() };
        let before = bytes(scene);
        let mut with = settled(&kept, other.as_mut(), view)?;
        let bytes = bytes(scene) - before - own;
        let (mut lean, mut full) = (Vec::new(), Vec::new());
        for _ in 0..frames.max(1) {
            lean.push(device_ms(&renderer.draw(technique.as_mut(), view, Copy::Nothing)?));
            full.push(device_ms(&with.draw(other.as_mut(), view, Copy::Nothing)?));
        }
        let differs = differences(&renderer, &with);
        let [pipelines, instructions] = more(pipelines::size(&plan), pipelines::size(scene.plan));
        times.extend_from_slice(&lean);
        let time = median(full) / median(lean);
        savings.push(Saving { feature: feature.name, bytes, pipelines, instructions, time, differs });
    }
    let [pipelines, instructions] = more(pipelines::size(scene.plan), [0, 0]);
    let gpu_ms = if times.is_empty() { f64::NAN } else { median(times) };
    Ok((Lean { bytes: own, pipelines, instructions, gpu_ms }, savings))
}

fn more(with: [usize; 2], without: [usize; 2]) -> [i64; 2] {
    [0, 1].map(|k| with[k] as i64 - without[k] as i64)
}

/// Returns the features that a plan leaves out and that can be kept, each with the plan that keeps it.
fn left_out(scene: &Scene) -> Result<Vec<(&'static Feature, ScenePlan)>> {
    let mut found = Vec::new();
    for feature in FEATURES.iter().filter(|feature| feature.can_be(true)) {
        let plan = scene.plan.keeping(&forced::word(feature)).map_err(anyhow::Error::msg)?;
        if plan != *scene.plan {
            found.push((feature, plan));
        }
    }
    Ok(found)
}

/// Makes the renderer of a scene and draws a view until the technique has settled.
fn settled(scene: &Scene, technique: &mut dyn Technique, view: &View) -> Result<SceneRenderer> {
    let mut renderer = scene.renderer(technique, view.size)?;
    for _ in 0..MAX_FRAMES {
        renderer.draw(technique, view, Copy::Picture)?;
        if technique.is_settled() {
            return Ok(renderer);
        }
    }
    None.context("the technique does not settle in the view")
}

/// Most frames of one view until a technique has settled.
const MAX_FRAMES: usize = 1000;

fn bytes(scene: &Scene) -> i64 {
    scene.gpu.device_bytes().values().sum::<u64>() as i64
}

/// Returns the device time of a frame, or the host's time if the device has no timestamps.
fn device_ms(times: &Times) -> f64 {
    if times.gpu.total_ms > 0.0 { times.gpu.total_ms } else { times.frame_ms }
}

fn differences(a: &SceneRenderer, b: &SceneRenderer) -> (u8, usize) {
    let (a, b) = (a.picture(), b.picture());
    let apart = |(a, b): (&image::Rgba<u8>, &image::Rgba<u8>)| a.0.iter().zip(b.0).map(|(a, b)| a.abs_diff(b)).max();
    let apart: Vec<u8> = a.pixels().zip(b.pixels()).filter_map(apart).collect();
    (apart.iter().copied().max().unwrap_or(0), apart.iter().filter(|&&d| d > 0).count())
}
