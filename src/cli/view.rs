//! `cuesta view`: shows a terrain in a window.

use std::sync::Arc;

use anyhow::{Result, bail};
use clap::{Args, ValueEnum};
use serde::Serialize;

use super::common::{Common, Outcome};
use super::scene::{LookArgs, TerrainArgs, ViewArgs};
use super::technique::TechniqueArgs;
use super::{interrupt, render, report};
use crate::height::Loaded;
use crate::lod::budget::Target;
use crate::viewer::times::Percentiles;
use crate::viewer::{self, Setup};

/// Arguments of `cuesta view`.
#[derive(Args, Debug)]
pub struct ViewerArgs {
    /// The height data.
    #[command(flatten)]
    pub terrain: TerrainArgs,
    /// The initial view.
    #[command(flatten)]
    pub view: ViewArgs,
    /// The initial technique.
    #[command(flatten)]
    pub technique: TechniqueArgs,
    /// The initial look.
    #[command(flatten)]
    pub look: LookArgs,
    /// Wait for the display's refresh before each frame.
    #[arg(long, value_enum, default_value_t = Switch::On)]
    pub vsync: Switch,
    /// Adjust the tolerance to keep N triangles per frame.
    #[arg(long, value_name = "N", conflicts_with = "frame_time")]
    pub triangles: Option<f64>,
    /// Adjust the tolerance to keep MS milliseconds per frame; turns vsync off.
    #[arg(long, value_name = "MS")]
    pub frame_time: Option<f64>,
    /// Close the window after S seconds.
    #[arg(long, value_name = "S")]
    pub seconds: Option<f64>,
}

/// Value of a flag that is on or off.
#[derive(ValueEnum, Clone, Copy, Debug, PartialEq, Eq)]
pub enum Switch {
    /// On.
    On,
    /// Off.
    Off,
}

#[derive(Serialize)]
struct Viewed {
    device: String,
    frames: u64,
    seconds: f64,
    frame_ms: Percentiles,
    validation_messages: Vec<String>,
}

/// Returns true unless the environment shows that there is no display: on Unix other than macOS, `DISPLAY` or
/// `WAYLAND_DISPLAY` must be set.
pub fn has_display() -> bool {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !cfg!(all(unix, not(target_os = "macos"))) || is_set("DISPLAY") || is_set("WAYLAND_DISPLAY")
}

/// Returns the target of `--triangles` or `--frame-time`.
fn target(args: &ViewerArgs) -> Result<Option<Target>> {
    let target = args.triangles.map(Target::Triangles).or(args.frame_time.map(Target::FrameMs));
    if let Some(cost) = target.map(|target| target.cost()).filter(|cost| !(cost.is_finite() && *cost > 0.0)) {
        let flag = if args.triangles.is_some() { "--triangles" } else { "--frame-time" };
        bail!("{flag} {cost}: expected a positive number");
    }
    Ok(target)
}

/// Runs the subcommand.
pub fn run(common: &Common, args: &ViewerArgs) -> Result<Outcome> {
    if !has_display() {
        bail!("view: there is no display: expected DISPLAY or WAYLAND_DISPLAY to be set");
    }
    if args.seconds.is_some_and(|s| !(s.is_finite() && s >= 0.0)) {
        bail!("--seconds: expected a number of seconds");
    }
    let target = target(args)?;
    let technique = args.technique.settings(&common.techniques)?;
    report::warn_of_idle(common, technique.0, &technique.1);
    let Loaded { field, footprint, .. } = args.terrain.load(common)?;
    let field = Arc::new(field);
    let (look, overlay) = args.look.build_for_window(common, &args.terrain.name(), (&field, &footprint))?;
    let spinner = report::preparing(common, technique.0.name, &technique.1.progress);
    let summary = viewer::run(&Setup {
        name: args.terrain.name(),
        view: args.view.build(&field, args.technique.tolerance()?)?,
        field,
        near: args.view.near,
        techniques: common.techniques.clone(),
        technique,
        choices: args.technique.settings.clone(),
        overlay,
        look,
        choice: render::choice(common),
        validate: common.validate,
        target,
        vsync: args.vsync == Switch::On && args.frame_time.is_none(),
        seconds: args.seconds,
        on_prepared: Box::new(move || spinner.finish_and_clear()),
        save: report::save,
        on_interrupt: interrupt::once,
    })?;
    for message in &summary.messages {
        report::note(format_args!("validation: {}", message.replace('\n', " ")));
    }
    let viewed = Viewed {
        device: summary.device,
        frames: summary.frames,
        seconds: summary.seconds,
        frame_ms: summary.frame_ms,
        validation_messages: summary.messages,
    };
    if common.json {
        report::print(common, &viewed)?;
    }
    Ok(if viewed.validation_messages.is_empty() { Outcome::Done } else { Outcome::LimitMissed })
}
