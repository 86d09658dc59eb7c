//! The program: one file a subcommand. Names and JSON fields are a contract for scripts.

pub mod bench;
pub mod cases;
pub mod common;
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

/// Large terrain drawn with a bounded error.
#[derive(Parser, Debug)]
#[command(name = "cuesta", version, about, args_override_self = true)]
pub struct Cli {
    /// What every subcommand takes.
    #[command(flatten)]
    pub common: Common,
    /// The subcommand; without one, `view demo` on a display and `render demo -o cuesta.png` elsewhere.
    #[command(subcommand)]
    pub command: Option<Command>,
}

/// The subcommands.
#[derive(Subcommand, Debug)]
pub enum Command {
    /// What was read from a height file; devices; the scene plan.
    Info(info::InfoArgs),
    /// One picture.
    #[cfg(feature = "vulkan")]
    Render(render::RenderArgs),
    /// Where a frame's time goes, draw by draw: tables and a trace.
    #[cfg(feature = "vulkan")]
    Profile(profile::ProfileArgs),
    /// The as-drawn mesh of one view: PLY, OBJ or GLB.
    Export(export::ExportArgs),
    /// The window.
    #[cfg(feature = "viewer")]
    View(view::ViewerArgs),
    /// Error against run time: every technique at every tolerance along named paths.
    Bench(bench::BenchArgs),
    /// The stability suite: every technique on stiff and extreme cases.
    Stress(stress::StressArgs),
    /// The report of a benchmark, drawn again from its rows.
    Report(redraw::ReportArgs),
    /// A synthetic field.
    Synth(synth::SynthArgs),
}

impl Cli {
    /// Parses a command line, the program's name first.
    pub fn parse_words(words: impl IntoIterator<Item: Into<OsString> + Clone>) -> Result<Self, clap::Error> {
        let mut command = command();
        let matches = command.try_get_matches_from_mut(words)?;
        Self::from_arg_matches(&matches).map_err(|error| error.format(&mut command))
    }
}

/// Parses the command line and runs it. Failures and wrong use are one line on stderr and exit code 2.
pub fn main() -> ExitCode {
    panic::set_hook(Box::new(fault));
    interrupt::install();
    let outcome = match Cli::parse_words(std::env::args_os()) {
        Ok(cli) => match panic::catch_unwind(AssertUnwindSafe(|| run(cli))) {
            Ok(outcome) => outcome,
            // The hook has told of it.
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

/// What is wrong with a command line, in one line.
pub fn one_line(error: &clap::Error) -> String {
    let text = error.to_string();
    let lines: Vec<_> = text.lines().map(str::trim).take_while(|line| !line.is_empty()).collect();
    let line = lines.join(" ");
    line.strip_prefix("error: ").map_or(line.clone(), str::to_string)
}

/// A fault of the program itself: where it is and what it says, in one line.
fn fault(info: &PanicHookInfo) {
    let place = info.location().map(|at| format!("{}:{}", at.file(), at.line())).unwrap_or_default();
    let said = info.payload_as_str().unwrap_or("no words").replace('\n', " ");
    report::note(format_args!("error: a fault of cuesta's own at {place}: {said}"));
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

#[cfg(feature = "vulkan")]
fn without_subcommand(common: &Common) -> Result<Outcome> {
    #[cfg(feature = "viewer")]
    if view::has_display() {
        return run_words(common, &["view", "demo"]);
    }
    report::note("no display: rendering cuesta.png instead");
    run_words(common, &["render", "demo", "-o", "cuesta.png"])
}

/// Runs a subcommand given as words, under the flags that were given.
#[cfg(feature = "vulkan")]
fn run_words(common: &Common, words: &[&str]) -> Result<Outcome> {
    let cli = Cli::parse_words(std::iter::once(&"cuesta").chain(words))?;
    run(Cli { common: common.clone(), ..cli })
}

#[cfg(not(feature = "vulkan"))]
fn without_subcommand(_: &Common) -> Result<Outcome> {
    report::say(command().render_help())?;
    Ok(Outcome::Done)
}

/// The command line's own description, for tests that hold documents against it.
pub fn command() -> clap::Command {
    numbers::with_negative(Cli::command())
}
