//! The command-line program, with one file per subcommand. Names of commands, flags and JSON fields are stable.

pub mod bench;
pub mod cases;
pub mod common;
mod comparison;
pub mod endless;
pub mod export;
pub mod info;
pub mod info_args;
pub mod interrupt;
pub mod numbers;
pub mod overlay;
pub mod plan;
#[cfg(feature = "vulkan")]
pub mod profile;
pub mod redraw;
#[cfg(feature = "vulkan")]
pub mod render;
pub mod report;
pub mod scene;
mod several;
pub mod stress;
pub mod synth;
pub mod technique;
#[cfg(feature = "viewer")]
pub mod view;
pub mod whole;
pub mod working_set;

use std::ffi::OsString;
use std::panic::{self, AssertUnwindSafe, PanicHookInfo};
use std::process::ExitCode;

use anyhow::{Result, anyhow};
use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};

pub use common::{Common, Outcome};

use crate::lod::Techniques;

/// Draw large terrain with a bounded error.
#[derive(Parser, Debug)]
#[command(name = "cuesta", version, about, args_override_self = true)]
pub struct Cli {
    /// Flags of every subcommand.
    #[command(flatten)]
    pub common: Common,
    /// The subcommand; without one, `view demo` on a display and `render demo -o cuesta.png` elsewhere.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// The subcommands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// Describe height files, the scene plan, or the Vulkan devices.
    Info(info::InfoArgs),
    /// Draw one picture.
    #[cfg(feature = "vulkan")]
    Render(render::RenderArgs),
    /// Measure the time of each draw of a frame.
    #[cfg(feature = "vulkan")]
    Profile(profile::ProfileArgs),
    /// Write the mesh drawn in one view as PLY, OBJ or GLB.
    Export(export::ExportArgs),
    /// Show the terrain in a window.
    #[cfg(feature = "viewer")]
    View(view::ViewerArgs),
    /// Measure error and run time of techniques along camera paths.
    Bench(bench::BenchArgs),
    /// Run the stress suite: check every technique on stiff and extreme cases.
    Stress(stress::StressArgs),
    /// Draw the report of a benchmark or of the stress suite again.
    Report(redraw::ReportArgs),
    /// Write a synthetic field to a file.
    Synth(synth::SynthArgs),
}

impl Cli {
    /// Parses a command line with the built-in techniques. The first word is the program's name.
    ///
    /// # Errors
    /// If the command line is wrong. Help and version are also returned as errors.
    pub fn parse_words(words: impl IntoIterator<Item: Into<OsString> + Clone>) -> Result<Self, clap::Error> {
        Self::parse_with(words, &Techniques::built_in())
    }

    fn parse_with(
        words: impl IntoIterator<Item: Into<OsString>>,
        techniques: &Techniques,
    ) -> Result<Self, clap::Error> {
        let words: Vec<OsString> = words.into_iter().map(Into::into).collect();
        let mut command = technique::with_settings(technique::with_names(command(), techniques), techniques, &words);
        let matches = command.try_get_matches_from_mut(words)?;
        let mut cli = Self::from_arg_matches(&matches).map_err(|error| error.format(&mut command))?;
        cli.common.techniques = techniques.clone();
        Ok(cli)
    }
}

/// Runs the program `cuesta` with the process's command line and these techniques. Returns the exit code: 0 if it
/// finished, 1 if a limit was missed, 2 for wrong use or a failure, which prints one line on stderr.
///
/// Replaces the panic hook, and handles Ctrl-C.
pub fn main(techniques: &Techniques) -> ExitCode {
    panic::set_hook(Box::new(fault));
    interrupt::install();
    let outcome = match Cli::parse_with(std::env::args_os(), techniques) {
        Ok(cli) => match panic::catch_unwind(AssertUnwindSafe(|| run(cli))) {
            Ok(outcome) => outcome,
            // The panic hook has printed it.
            Err(_) => return ExitCode::from(2),
        },
        Err(error) if !error.use_stderr() => report::say(error.to_string().trim_end()).map(|()| Outcome::Done),
        Err(error) => Err(anyhow!(one_line(&error))),
    };
    match outcome {
        Ok(Outcome::Done) => ExitCode::SUCCESS,
        Ok(Outcome::LimitMissed) => ExitCode::from(1),
        Err(error) => {
            report::note(format!("error: {error:#}").replace('\n', " "));
            ExitCode::from(2)
        }
    }
}

/// Formats clap's error in one line, without its hints.
pub fn one_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let lines: Vec<_> = text.lines().map(str::trim).take_while(|line| !line.is_empty()).collect();
    let line = lines.join(" ");
    line.strip_prefix("error: ").map_or(line.clone(), str::to_string)
}

/// Prints a panic in one line on stderr: source position and message.
fn fault(info: &PanicHookInfo) {
    let place = info.location().map(|at| format!("{}:{}", at.file(), at.line())).unwrap_or_default();
    let message = info.payload_as_str().unwrap_or("no message").replace('\n', " ");
    report::note(format_args!("error: internal error at {place}: {message}"));
}

fn run(cli: Cli) -> Result<Outcome> {
    let common = cli.common;
    match cli.command {
        Some(Command::Info(args)) => info::run(&common, &args),
        #[cfg(feature = "vulkan")]
        Some(Command::Render(args)) => render::run(&common, &args),
        #[cfg(feature = "vulkan")]
        Some(Command::Profile(args)) => profile::run(&common, &args),
        Some(Command::Export(args)) => export::run(&common, &args),
        #[cfg(feature = "viewer")]
        Some(Command::View(args)) => view::run(&common, &args),
        Some(Command::Bench(args)) => bench::run(&common, &args),
        Some(Command::Stress(args)) => stress::run(&common, &args),
        Some(Command::Report(args)) => redraw::run(&common, &args),
        Some(Command::Synth(args)) => synth::run(&common, &args),
        None => without_subcommand(&common),
    }
}

/// Opens a window with the demo terrain, or draws a picture of it if there is no display.
#[cfg(feature = "vulkan")]
fn without_subcommand(common: &Common) -> Result<Outcome> {
    #[cfg(feature = "viewer")]
    if view::has_display() {
        return run_words(common, &["view", "demo"]);
    }
    report::note("no display: drawing cuesta.png instead");
    run_words(common, &["render", "demo", "-o", "cuesta.png"])
}

/// Runs a subcommand with the common flags of the actual command line.
#[cfg(feature = "vulkan")]
fn run_words(common: &Common, words: &[&str]) -> Result<Outcome> {
    let cli = Cli::parse_words(std::iter::once(&"cuesta").chain(words))?;
    run(Cli { common: common.clone(), ..cli })
}

/// Prints the help.
#[cfg(not(feature = "vulkan"))]
fn without_subcommand(_: &Common) -> Result<Outcome> {
    report::say(command().render_help())?;
    Ok(Outcome::Done)
}

/// Returns clap's description of the command line.
pub fn command() -> clap::Command {
    numbers::with_negative(Cli::command())
}
