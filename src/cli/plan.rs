//! `cuesta info --plan`: the features that a scene needs on the device, those that it leaves out, and the savings.

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

/// Features that are kept and left out, and data that the technique did not prepare.
#[derive(Serialize)]
struct Plan {
    technique: &'static str,
    kept: Vec<Decision>,
    left_out: Vec<LeftOut>,
    /// Data that the technique did not prepare for this field.
    omitted: Vec<Unprepared>,
    stats: Vec<Figure>,
    /// Measurement with all features kept.
    #[serde(skip_serializing_if = "Option::is_none")]
    whole: Option<Whole>,
}

#[derive(Serialize)]
struct LeftOut {
    feature: &'static str,
    reason: String,
    /// Device bytes, measured where `measured` exists.
    bytes_saved: i64,
    #[serde(flatten)]
    measured: Option<Saved>,
}

#[derive(Serialize)]
struct Unprepared {
    what: &'static str,
    reason: String,
    bytes_saved: u64,
}

/// Measured cost of a feature beside its bytes.
#[derive(Serialize)]
struct Saved {
    pipelines_saved: i64,
    instructions_saved: i64,
    /// Device time for a frame with the feature, relative to that without.
    time_with: f64,
    /// Number of pixels that differ with it, and the largest difference, of 255.
    pixels_changed: usize,
    largest_change: u8,
}

#[derive(Serialize)]
struct Whole {
    bytes: i64,
    pipelines: i64,
    instructions: i64,
    gpu_ms: f64,
}

#[derive(Serialize)]
struct Figure {
    name: &'static str,
    value: f64,
    unit: &'static str,
}

/// Runs the subcommand for a field that was read.
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

/// Field, look, and the overlay.
type Scenery<'a> = (&'a Arc<Field>, &'a Look, Option<&'a image::RgbaImage>);

/// Measurement with all features kept, and the cost of each feature that is left out.
type Measured = (Whole, Vec<(&'static str, i64, Saved)>);

#[cfg(feature = "vulkan")]
fn plan(
    common: &Common,
    args: &InfoArgs,
    (field, look, overlay): Scenery,
    technique: &dyn Technique,
) -> Result<(ScenePlan, Option<Measured>)> {
    use crate::scene::{self, Scene, savings};

    let gpu = super::render::open(common, false)?;
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

/// Without Vulkan, a plan assumes the limits of a common desktop device.
#[cfg(not(feature = "vulkan"))]
fn plan(
    _: &Common,
    args: &InfoArgs,
    (field, look, overlay): Scenery,
    technique: &dyn Technique,
) -> Result<(ScenePlan, Option<Measured>)> {
    use crate::plan::DeviceLimits;

    if args.measure.is_some() {
        bail!("--measure: this build is without Vulkan");
    }
    let device = DeviceLimits { image_side: 16384, image_layers: 2048, filters_heights: true };
    let picture = overlay.map(|picture| picture.dimensions().into());
    let plan = ScenePlan::builder(field, look, &device).overlay(picture);
    let plan = plan.requirements(technique.pipeline_requirements()).build().map_err(anyhow::Error::msg)?;
    Ok((plan, None))
}
