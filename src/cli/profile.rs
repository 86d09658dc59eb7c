//! `cuesta profile`: measures the time of each draw of a frame, and compares submission modes.

use std::path::PathBuf;
use std::sync::Arc;

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use super::common::{Common, Outcome};
use super::render::open;
use super::scene::{LookArgs, TerrainArgs, ViewArgs};
use super::technique::TechniqueArgs;
use super::{endless, report};
use crate::draw::PipelineRequirements;
use crate::gpu::Gpu;
use crate::gpu::renderdoc::RenderDoc;
use crate::height::{Field, Loaded};
use crate::lod::Settings;
use crate::profile::run::Measured;
use crate::profile::{self, Form, Profile, files, rows, table};
use crate::scene::{self, Scene};

/// Arguments of `cuesta profile`.
#[derive(Args, Debug)]
pub struct ProfileArgs {
    /// The height data.
    #[command(flatten)]
    pub terrain: TerrainArgs,
    /// Folder for trace.json, profile.json, passes.csv, draws.csv and modes.csv.
    #[arg(long, value_name = "DIR")]
    pub out: PathBuf,
    /// Number of frames to measure.
    #[arg(long, value_name = "N", default_value_t = 15, value_parser = clap::value_parser!(u32).range(1..=1000))]
    pub frames: u32,
    /// Capture a frame of the slowest submission mode, if RenderDoc is loaded.
    #[arg(long)]
    pub renderdoc: bool,
    /// The view.
    #[command(flatten)]
    pub view: ViewArgs,
    /// The technique.
    #[command(flatten)]
    pub technique: TechniqueArgs,
    /// The look.
    #[command(flatten)]
    pub look: LookArgs,
}

/// The document `profile.json`.
#[derive(Serialize)]
struct Document {
    schema: u32,
    program: String,
    terrain: String,
    technique: String,
    metric: &'static str,
    tolerance_px: f64,
    size: [u32; 2],
    device: String,
    driver: String,
    is_software: bool,
    #[serde(flatten)]
    profile: Profile,
    trace: PathBuf,
    #[serde(skip_serializing_if = "Option::is_none")]
    capture: Option<Capture>,
    validation_messages: Vec<String>,
}

/// A RenderDoc capture of one frame.
#[derive(Serialize)]
struct Capture {
    mode: String,
    file: PathBuf,
}

/// Runs the subcommand.
pub fn run(common: &Common, args: &ProfileArgs) -> Result<Outcome> {
    let Loaded { field, footprint, .. } = args.terrain.load(common)?;
    let field = Arc::new(field);
    endless::need_samples(&field, "profile")?;
    let (look, overlay) = args.look.build(common, &args.terrain.name(), (&field, &footprint))?;
    let view = args.view.build(&field, args.technique.tolerance()?)?;
    let forms = forms(common, args, &field)?;
    let gpu = open(common)?;
    let plan = scene::plan(&gpu, &field, &look, overlay.as_ref(), PipelineRequirements::default())?;
    let scene = Scene { gpu: &gpu, field: &field, plan: &plan, look: &look, overlay: overlay.as_ref() };
    files::make_folder(&args.out)?;
    let spinner = report::spinner(common, "profiling");
    let progress = |done, all| spinner.set_message(format!("profiling: round {done} of {all}"));
    let mut measured = profile::run(&scene, &view, forms, args.frames, progress)?;
    let capture = if args.renderdoc { capture(common, &mut measured)? } else { None };
    drop(spinner);
    let (profile, trace) = measured.finish();
    let candidate = gpu.candidate.clone();
    let document = Document {
        schema: rows::SCHEMA,
        program: format!("cuesta {}", env!("CARGO_PKG_VERSION")),
        terrain: args.terrain.name(),
        technique: args.technique.technique.to_string(),
        metric: args.technique.metric.name(),
        tolerance_px: view.tolerance.px,
        size: view.size,
        device: candidate.name.clone(),
        driver: candidate.driver.clone(),
        is_software: candidate.is_software(),
        trace: args.out.join(files::TRACE),
        capture,
        validation_messages: Gpu::close(gpu),
        profile,
    };
    files::write(&args.out, &document.profile, &document, &trace)?;
    if common.json {
        report::print(common, &document)?;
    } else if !common.quiet {
        say(&document)?;
    }
    Ok(if document.validation_messages.is_empty() { Outcome::Done } else { Outcome::LimitMissed })
}

/// Returns the requested variant of the technique, followed by its other variants with the same settings.
fn forms(common: &Common, args: &ProfileArgs, field: &Arc<Field>) -> Result<Vec<Form>> {
    let (entry, chosen) = args.technique.settings(&common.techniques)?;
    report::warn_of_idle(common, entry, &chosen);
    let variants = std::iter::once(None).chain(entry.variants.iter().map(|variant| Some(variant.name)));
    let mut variants: Vec<_> = variants.collect();
    variants.sort_by_key(|variant| *variant != chosen.variant());
    let form = |variant: Option<&'static str>| {
        let name = variant.map_or(entry.name.to_string(), |variant| format!("{}:{variant}", entry.name));
        let settings = Settings::new(entry, variant, &args.technique.settings).map_err(anyhow::Error::msg)?;
        let _spinner = report::preparing(common, &name, &settings.progress);
        let technique = entry.prepare(field, &settings).map_err(anyhow::Error::msg)?;
        Ok(Form { technique, name })
    };
    variants.into_iter().map(form).collect()
}

/// Captures a frame of the slowest mode. Warns if RenderDoc is not loaded.
fn capture(common: &Common, measured: &mut Measured) -> Result<Option<Capture>> {
    let Some(renderdoc) = RenderDoc::loaded() else {
        report::warn(common, "--renderdoc: no capture: RenderDoc's library is not loaded in this process");
        return Ok(None);
    };
    let (file, mode) = measured.capture_worst(&renderdoc)?;
    Ok(Some(Capture { mode, file }))
}

/// Prints the results as text.
fn say(document: &Document) -> Result<()> {
    report::say(table::text(&document.profile).trim_end())?;
    report::say(format_args!("trace: {} (open it in https://ui.perfetto.dev)", document.trace.display()))?;
    if let Some(capture) = &document.capture {
        report::say(format_args!("capture: {} of {}", capture.file.display(), capture.mode))?;
    }
    for message in &document.validation_messages {
        report::note(format_args!("validation: {}", message.replace('\n', " ")));
    }
    Ok(())
}
