//! `cuesta bench`: measures error and run time along named camera paths. `cuesta bench compare`: compares two runs.

use std::path::PathBuf;
use std::time::SystemTime;

use anyhow::{Context, Result, ensure};
use clap::{Args, Subcommand};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use serde::Serialize;

pub use super::cases::MeasureArgs;
use super::cases::Planned;
use super::common::{Common, Outcome};
use super::comparison::Text;
use super::{interrupt, report};
use crate::bench::compare::{THRESHOLD, compare};
use crate::bench::results::{CaseResult, RESULTS, Results};
use crate::bench::rows::{Header, Machine};
use crate::bench::run::{Ended, Run};
use crate::bench::{BenchBackend, SCHEMA};
use crate::plan::Look;

/// Arguments of `cuesta bench`.
#[derive(Args, Debug)]
#[command(args_conflicts_with_subcommands = true, subcommand_negates_reqs = true)]
pub struct BenchArgs {
    /// Action on finished benchmarks, instead of measuring.
    #[command(subcommand)]
    pub action: Option<Action>,
    /// Fields, techniques, tolerances and paths to measure.
    #[command(flatten)]
    pub measure: MeasureArgs,
}

/// Actions on finished benchmarks.
#[derive(Subcommand, Debug)]
pub enum Action {
    /// Compare two benchmark runs; exit code 1 if anything got worse.
    Compare(CompareArgs),
}

/// Arguments of `cuesta bench compare`.
#[derive(Args, Debug)]
pub struct CompareArgs {
    /// Folder of the earlier run.
    pub a: PathBuf,
    /// Folder of the later run.
    pub b: PathBuf,
    /// Largest relative change that counts as noise: 0.1 is 10 %.
    #[arg(long, value_name = "SHARE", default_value_t = THRESHOLD)]
    pub threshold: f64,
}

/// Result of the subcommand.
#[derive(Serialize)]
struct Done {
    results: String,
    report: String,
    rows: usize,
    complete: bool,
    validation_messages: Vec<String>,
}

/// Runs the subcommand.
pub fn run(common: &Common, args: &BenchArgs) -> Result<Outcome> {
    match &args.action {
        Some(Action::Compare(compared)) => run_compare(common, compared),
        None => measure(common, &args.measure),
    }
}

fn run_compare(common: &Common, args: &CompareArgs) -> Result<Outcome> {
    let share = args.threshold;
    ensure!(share.is_finite() && share >= 0.0, "--threshold {share}: expected 0 or more");
    let comparison = compare(&Results::read(&args.a)?, &Results::read(&args.b)?, share);
    ensure!(comparison.matched > 0, "{}: no case in common with {}", args.b.display(), args.a.display());
    if common.json {
        report::print(common, &comparison)?;
    } else if !common.quiet {
        report::say(Text(&comparison))?;
    }
    Ok(if comparison.regressions.is_empty() { Outcome::Done } else { Outcome::LimitMissed })
}

/// Opens the device that the command line names, as a backend of the benchmark.
#[cfg(feature = "vulkan")]
fn backend(common: &Common, look: Look) -> Result<Box<dyn BenchBackend>> {
    let gpu = super::render::open(common)?;
    Ok(Box::new(crate::bench::device::DeviceBackend::new(gpu, look, common.techniques.clone())))
}

#[cfg(not(feature = "vulkan"))]
fn backend(_common: &Common, _look: Look) -> Result<Box<dyn BenchBackend>> {
    anyhow::bail!("bench: built without Vulkan; `report` and `bench compare` work without it")
}

fn measure(common: &Common, args: &MeasureArgs) -> Result<Outcome> {
    let folder = args.out.as_deref().context("--out DIR is missing")?;
    let planned = Planned::new(common, args)?;
    let mut backend = backend(common, args.ground.over(Look::default())?)?;
    let header = header(backend.as_mut(), &planned)?;
    // The first Ctrl-C ends the run after the current row, the second one immediately. Finished rows are kept.
    let stop = interrupt::flag();
    let run = Run {
        folder,
        cases: planned.cases,
        fields: planned.fields,
        rounds: planned.rounds,
        warm_up: planned.warm_up,
        stop: &stop,
    };
    let bar = progress(common);
    let ended = run.run(backend.as_mut(), header, &mut |step| {
        bar.set_length(step.done[1] as u64);
        bar.set_position(step.done[0] as u64);
        bar.set_message(step.case.to_string());
    });
    bar.finish_and_clear();
    // The report is drawn even if the run failed. The error of the run is reported first.
    let page = crate::report::write(folder);
    let (ended, page) = (ended?, page?);
    let found = Results::read(folder)?;
    let rows = crate::bench::journal::read(folder)?.1.len();
    let complete = ended == Ended::Complete;
    if !complete {
        report::warn(common, "stopped; the same command resumes the run");
    }
    let (results, page) = (folder.join(RESULTS).display().to_string(), page.display().to_string());
    let messages = backend.close();
    let is_missed = !complete || found.cases.iter().any(CaseResult::is_torn) || !messages.is_empty();
    report::print(common, &Done { results, report: page, rows, complete, validation_messages: messages })?;
    Ok(if is_missed { Outcome::LimitMissed } else { Outcome::Done })
}

/// Describes the run for its rows.
fn header(backend: &mut dyn BenchBackend, planned: &Planned) -> Result<Header> {
    let (device, plans) = backend.describe(&planned.fields)?;
    Ok(Header {
        schema: SCHEMA,
        program: env!("CARGO_PKG_VERSION").to_string(),
        commit: option_env!("CUESTA_COMMIT").map(str::to_string),
        date: humantime::format_rfc3339_seconds(SystemTime::now()).to_string(),
        arguments: planned.arguments.clone(),
        base: planned.base.clone(),
        machine: Machine::this(),
        device,
        plans,
    })
}

fn progress(common: &Common) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(None, ProgressDrawTarget::stderr());
    if common.quiet {
        bar.set_draw_target(ProgressDrawTarget::hidden());
    }
    if let Ok(style) = ProgressStyle::with_template("{bar:24} {pos}/{len} {eta} {wide_msg}") {
        bar.set_style(style);
    }
    bar.enable_steady_tick(std::time::Duration::from_millis(500));
    bar
}
