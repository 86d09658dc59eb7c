//! `cuesta render`: draws one picture. `--measure` measures its error and proves the surface watertight.

use std::path::PathBuf;
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Result, ensure};
use clap::Args;
use serde::Serialize;

use super::common::{Common, Outcome};
use super::scene::{LookArgs, TerrainArgs, ViewArgs};
use super::technique::TechniqueArgs;
use super::{endless, report};
use crate::draw::expand;
use crate::draw::layout::Frame;
use crate::gpu::{Choice, Gpu, Instance};
use crate::height::{Error, Loaded};
use crate::lod::Technique;
use crate::measure::summary::Summary;
use crate::measure::{extended, geometric, watertight};
use crate::scene::holes::{Truth, skirts};
use crate::scene::{self, RenderResult, Scene};
use crate::texture::virtual_overlay;
use crate::view::{Metric, View};

/// Arguments of `cuesta render`.
#[derive(Args, Debug)]
pub struct RenderArgs {
    /// The height data.
    #[command(flatten)]
    pub terrain: TerrainArgs,
    /// Output file: .png.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// The view.
    #[command(flatten)]
    pub view: ViewArgs,
    /// The technique.
    #[command(flatten)]
    pub technique: TechniqueArgs,
    /// The look.
    #[command(flatten)]
    pub look: LookArgs,
    /// Scene time, seconds; moves the sun with `--sun-speed`.
    #[arg(long, value_name = "S", default_value_t = 0.0)]
    pub time: f64,
    /// Draw N times and print the median times.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub repeat: u32,
    /// Measure the error, prove the surface watertight, and count pixels that show holes or skirts.
    #[arg(long)]
    pub measure: bool,
}

#[derive(Serialize)]
struct Rendered {
    technique: String,
    metric: &'static str,
    tolerance_px: f64,
    size: [u32; 2],
    device: String,
    triangles: u64,
    vertices: Option<u64>,
    draws: usize,
    commands: usize,
    batches: usize,
    levels: Vec<usize>,
    /// Factor by which the tolerance was scaled so that the list fits its buffers; 1 if it fitted at once.
    #[serde(serialize_with = "extended::serialize")]
    tolerance_scale: f64,
    /// Time to prepare the technique, milliseconds.
    prepare_ms: f64,
    select_ms: f64,
    record_ms: f64,
    gpu_ms: f64,
    device_bytes: u64,
    /// Tile cache of an overlay that exceeds the texture memory.
    #[serde(skip_serializing_if = "Option::is_none")]
    texture_maps: Option<virtual_overlay::VirtualTextureStats>,
    validation_messages: Vec<String>,
    #[serde(flatten)]
    measured: Option<Measured>,
}

/// Results of `--measure`.
#[derive(Serialize)]
struct Measured {
    /// Screen error of the samples in view, pixels.
    error_px: Summary,
    /// Vertical error of the samples in view, metres.
    error_m: Summary,
    /// Number of pixels where the sky shows through terrain.
    hole_pixels: usize,
    /// Positions (x, y) of the first eight, from the top left corner.
    hole_pixels_at: Vec<[usize; 2]>,
    /// Number of pixels that show a skirt.
    skirt_pixels: usize,
    /// Number of triangles of skirts, which `triangles` does not count.
    skirt_triangles: usize,
    watertight: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    counter_example: Option<String>,
}

/// Opens the Vulkan device that `--device` names, or the best one, for drawing without a window.
///
/// # Errors
/// If there is no such device, or Vulkan fails.
pub fn open(common: &Common) -> Result<Arc<Gpu>> {
    let gpu = Gpu::new(&Instance::new(&[], common.validate)?, &choice(common), false)?;
    gpu.limit_allocations(common.allocations.unwrap_or(u64::MAX));
    gpu.lose_after(common.lose_device.unwrap_or(u64::MAX));
    Ok(gpu)
}

/// Returns the device that `--device` names.
pub fn choice(common: &Common) -> Choice {
    match common.device.as_deref() {
        None => Choice::Best,
        Some("cpu") => Choice::Cpu,
        Some(name) => Choice::Named(name.to_string()),
    }
}

/// Runs the subcommand.
pub fn run(common: &Common, args: &RenderArgs) -> Result<Outcome> {
    let output = args.output.display().to_string();
    if args.output.extension().and_then(|e| e.to_str()).is_none_or(|e| !e.eq_ignore_ascii_case("png")) {
        return Err(Error::new(output, "extension", "expected .png").into());
    }
    let Loaded { field, footprint, .. } = args.terrain.load(common)?;
    let field = Arc::new(field);
    if args.measure {
        endless::need_samples(&field, "--measure")?;
    }
    let (look, overlay) = args.look.build(common, &args.terrain.name(), (&field, &footprint))?;
    ensure!(args.time.is_finite(), "--time {}: expected seconds", args.time);
    let look = look.after(args.time);
    let view = args.view.build(&field, args.technique.tolerance()?)?;
    let prepared = Instant::now();
    let mut technique = args.technique.build(common, &field)?;
    let prepare_ms = ms(prepared);
    let gpu = open(common)?;
    let plan = scene::plan(&gpu, &field, &look, overlay.as_ref(), technique.pipeline_requirements())?;
    let scene = Scene { gpu: &gpu, field: &field, plan: &plan, look: &look, overlay: overlay.as_ref() };
    let rendered = scene.render(technique.as_mut(), &view, args.repeat)?;
    report::save(&args.output, &rendered.picture)?;
    report::warn_of_tolerance(common, rendered.list.tolerance_scale);
    let measured = if args.measure { Some(measure(&scene, technique.as_ref(), &view, &rendered)?) } else { None };
    let device = gpu.candidate.name.clone();
    let messages = Gpu::close(gpu);
    let missed = measured.as_ref().is_some_and(|m| {
        let over = technique.keeps_tolerance()
            && view.tolerance.metric == Metric::Certified
            && (m.error_px.max > view.tolerance.px || rendered.list.tolerance_scale > 1.0);
        over || m.hole_pixels > 0 || !m.watertight
    });
    let rendered = Rendered {
        technique: args.technique.technique.to_string(),
        metric: if view.tolerance.metric == Metric::Certified { "certified" } else { "paper" },
        tolerance_px: view.tolerance.px,
        size: view.size,
        device,
        triangles: rendered.list.triangles(),
        vertices: rendered.times.gpu.statistics.map(|s| s[0]),
        draws: rendered.list.draws.len(),
        commands: rendered.list.commands(),
        batches: rendered.list.draws.len(),
        levels: rendered.list.levels(),
        tolerance_scale: rendered.list.tolerance_scale,
        prepare_ms,
        select_ms: rendered.times.select_ms,
        record_ms: rendered.times.record_ms,
        gpu_ms: rendered.times.gpu.total_ms,
        device_bytes: rendered.device_bytes,
        texture_maps: rendered.maps,
        validation_messages: messages.clone(),
        measured,
    };
    report::print(common, &rendered)?;
    Ok(if missed || !messages.is_empty() { Outcome::LimitMissed } else { Outcome::Done })
}

/// Returns the time since an instant, milliseconds.
fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// Measures the triangles and the picture that were drawn.
fn measure(scene: &Scene, technique: &dyn Technique, view: &View, rendered: &RenderResult) -> Result<Measured> {
    let errors = geometric::errors(scene.field, view, technique.resident(), &rendered.list);
    let proof = watertight::prove_list(
        scene.field,
        view,
        technique.pipeline_requirements().seams,
        technique.resident(),
        &rendered.list,
    );
    let holes = Truth::new(scene, view)?.hole_pixels(scene, view, &rendered.picture)?;
    let (width, frame) = (view.size[0] as usize, Frame::placing(scene.field, view));
    Ok(Measured {
        error_px: errors.screen_px,
        error_m: errors.vertical_m,
        hole_pixels: holes.len(),
        hole_pixels_at: holes.iter().take(8).map(|k| [k % width, k / width]).collect(),
        skirt_pixels: skirts(&rendered.picture).into_iter().filter(|&is| is).count(),
        skirt_triangles: expand::skirts(scene.field, &frame, technique.resident(), &rendered.list).len(),
        watertight: proof.is_ok(),
        counter_example: proof.err().map(|e| e.to_string()),
    })
}
