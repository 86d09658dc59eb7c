//! `cuesta info --plan`: lists the features that a scene needs on the device and those that it leaves out.
//! `--measure` adds the measured cost of the latter.

use std::sync::Arc;

use anyhow::Result;
#[cfg(not(feature = "vulkan"))]
use anyhow::bail;
use serde::Serialize;

use super::common::{Common, Outcome};
use super::info_args::InfoArgs;
use super::report;
use crate::height::{Field, Loaded};
use crate::lod::Technique;
use crate::plan::{Decision, Look, ScenePlan};

/// The scene plan, and facts about the prepared technique.
#[derive(Serialize)]
struct Plan {
    technique: &'static str,
    kept: Vec<Decision>,
    left_out: Vec<LeftOut>,
    /// Data that the technique does not need for this field.
    omitted: Vec<Unprepared>,
    stats: Vec<Figure>,
    /// Measured cost of the scene as planned.
    #[serde(skip_serializing_if = "Option::is_none")]
    whole: Option<Whole>,
}

/// A feature that the scene leaves out.
#[derive(Serialize)]
struct LeftOut {
    feature: &'static str,
    reason: String,
    /// Device memory saved, bytes: measured if `measured` is present, otherwise calculated.
    bytes_saved: i64,
    #[serde(flatten)]
    measured: Option<Saved>,
}

/// Data that a technique does not prepare because the field does not need it.
#[derive(Serialize)]
struct Unprepared {
    what: &'static str,
    reason: String,
    /// Memory saved, bytes.
    bytes_saved: u64,
}

/// Measured cost of a feature that the scene leaves out.
#[derive(Serialize)]
struct Saved {
    pipelines_saved: i64,
    /// Shader instructions saved, all shaders together.
    instructions_saved: i64,
    /// Device time of a frame with the feature, divided by that without it.
    time_with: f64,
    /// Number of pixels that change with the feature.
    pixels_changed: usize,
    /// Largest change of a colour channel, of 255.
    largest_change: u8,
}

/// Measured cost of a scene.
#[derive(Serialize)]
struct Whole {
    /// Device memory, bytes.
    bytes: i64,
    pipelines: i64,
    /// Shader instructions, all shaders together.
    instructions: i64,
    /// Median device time of a frame, milliseconds.
    gpu_ms: f64,
}

/// A statistic of the technique with its unit.
#[derive(Serialize)]
struct Figure {
    name: &'static str,
    value: f64,
    unit: &'static str,
}

/// Runs `info --plan` for a terrain that was read. `terrain` is its name on the command line.
pub fn run(common: &Common, args: &InfoArgs, terrain: &str, loaded: Loaded) -> Result<Outcome> {
    let field = &Arc::new(loaded.field);
    let (look, overlay) = args.look.build(common, terrain, (field, &loaded.footprint))?;
    let (entry, _) = args.technique.settings(&common.techniques)?;
    let technique = args.technique.build(common, field)?;
    let (plan, savings) = plan(common, args, (field, &look, overlay.as_ref()), technique.as_ref())?;
    let (kept, left_out) = plan.decisions(field, Some(&technique.device_geometry()));
    let (whole, mut savings) = savings.unzip();
    let mut left_out: Vec<_> = left_out.into_iter().map(LeftOut::from).collect();
    for (feature, bytes, saved) in savings.take().into_iter().flatten() {
        if let Some(decision) = left_out.iter_mut().find(|decision| decision.feature == feature) {
            (decision.bytes_saved, decision.measured) = (bytes, Some(saved));
        }
    }
    let stats = technique.stats().into_iter().map(|(name, value, unit)| Figure { name, value, unit }).collect();
    let omitted = technique.omitted().into_iter();
    let omitted = omitted.map(|s| Unprepared { what: s.what, reason: s.reason, bytes_saved: s.bytes }).collect();
    report::print(common, &Plan { technique: entry.name, kept, left_out, omitted, stats, whole })?;
    Ok(Outcome::Done)
}

impl From<Decision> for LeftOut {
    fn from(Decision { feature, reason, bytes }: Decision) -> Self {
        Self { feature, reason, bytes_saved: bytes as i64, measured: None }
    }
}

/// Field, look, and overlay.
type Scenery<'a> = (&'a Arc<Field>, &'a Look, Option<&'a image::RgbaImage>);

/// The cost of the scene as planned; for each feature that is left out its name, device bytes, and other costs.
type Measured = (Whole, Vec<(&'static str, i64, Saved)>);

/// Plans the scene for the device that the command line names. Measures it if `--measure` is given.
#[cfg(feature = "vulkan")]
fn plan(
    common: &Common,
    args: &InfoArgs,
    (field, look, overlay): Scenery,
    technique: &dyn Technique,
) -> Result<(ScenePlan, Option<Measured>)> {
    use crate::scene::{self, Scene, savings};

    let gpu = super::render::open(common)?;
    let plan = scene::plan(&gpu, field, look, overlay, technique.pipeline_requirements())?;
    let Some(frames) = args.measure else {
        return Ok((plan, None));
    };
    let view = args.view.build(field, args.technique.tolerance()?)?;
    let mut techniques = [args.technique.build(common, field)?, args.technique.build(common, field)?];
    let scene = Scene { gpu: &gpu, field, plan: &plan, look, overlay };
    let (lean, savings) = savings::measure(&scene, &mut techniques, &view, frames)?;
    let whole =
        Whole { bytes: lean.bytes, pipelines: lean.pipelines, instructions: lean.instructions, gpu_ms: lean.gpu_ms };
    let saved = |s: savings::Saving| {
        let (largest_change, pixels_changed) = s.differs;
        let (pipelines_saved, instructions_saved, time_with) = (s.pipelines, s.instructions, s.time);
        let saved = Saved { pipelines_saved, instructions_saved, time_with, pixels_changed, largest_change };
        (s.feature, s.bytes, saved)
    };
    Ok((plan, Some((whole, savings.into_iter().map(saved).collect()))))
}

/// Plans the scene for the limits of a common desktop device, as this build has no Vulkan.
#[cfg(not(feature = "vulkan"))]
fn plan(
    _: &Common,
    args: &InfoArgs,
    (field, look, overlay): Scenery,
    technique: &dyn Technique,
) -> Result<(ScenePlan, Option<Measured>)> {
    use crate::plan::DeviceLimits;

    if args.measure.is_some() {
        bail!("--measure: built without Vulkan");
    }
    let device = DeviceLimits { image_side: 16384, image_layers: 2048, filters_heights: true };
    let picture = overlay.map(|picture| picture.dimensions().into());
    let plan = ScenePlan::builder(field, look, &device).overlay(picture);
    let plan = plan.requirements(technique.pipeline_requirements()).build().map_err(anyhow::Error::msg)?;
    Ok((plan, None))
}
