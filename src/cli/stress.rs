//! `cuesta stress`: runs the stress suite.

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, bail};
use clap::Args;
use indicatif::ProgressBar;

use super::common::{Common, Outcome};
use super::{interrupt, report};
use crate::height::save::replace;
use crate::stress::{
    self, Case, CaseRun, Finding, ImageChecker, Kind, Row, SCHEMA, Stress, jitter, rows, saved, stiff,
};

/// Folder for counter-examples without `--out`.
const FOLDER: &str = "cuesta-stress";

/// Arguments of `cuesta stress`.
#[derive(Args, Debug)]
pub struct StressArgs {
    /// Run only this family: data, position, view, time, arithmetic, stiff, file or sweep; may be repeated.
    #[arg(long, value_name = "F")]
    pub family: Vec<String>,
    /// Run only cases whose name contains this text; may be repeated.
    #[arg(long, value_name = "NAME")]
    pub case: Vec<String>,
    /// Run only this technique, or technique:variant; may be repeated.
    #[arg(long, value_name = "T")]
    pub technique: Vec<String>,
    /// Folder for stress.json, index.html and pictures. Without it, only counter-examples are written, to
    /// cuesta-stress.
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Skip all checks that need a Vulkan device.
    #[arg(long)]
    pub no_device: bool,
    /// List the cases and exit.
    #[arg(long)]
    pub list: bool,
}

/// Runs the subcommand.
pub fn run(common: &Common, args: &StressArgs) -> Result<Outcome> {
    let cases = chosen(args)?;
    if args.list {
        cases.iter().try_for_each(|case| report::say(format_args!("{}: {}", case.family, case.name)))?;
        return Ok(Outcome::Done);
    }
    let mut trials = stress::case_runs(&cases, &common.techniques, &args.technique).map_err(anyhow::Error::msg)?;
    if !args.technique.is_empty() {
        trials.retain(|trial| !matches!(trial.case.kind, Kind::Standalone(..)) || !args.family.is_empty());
    }
    let mut device = Device::open(common, args)?;
    let bar = progress(common, &trials, device.checker().is_some());
    let stop = interrupt::flag();
    let found = stress::run(&trials, device.checker(), &stop, |trial| {
        bar.set_message(format!("{}: {}, {}", trial.case.family, trial.case.name, trial.technique()));
        bar.inc(1);
    });
    bar.finish_and_clear();
    let folder = args.out.clone().unwrap_or_else(|| FOLDER.into());
    let mut rows = Vec::new();
    for (trial, findings) in trials.iter().zip(&found.findings) {
        for finding in findings {
            rows.push(row(common, &folder, trial, finding, device.checker()));
        }
    }
    let (name, messages) = device.close();
    rows.extend(name.is_some().then(|| validation(&messages)).filter(|_| common.validate));
    let program = format!("cuesta {}", env!("CARGO_PKG_VERSION"));
    let ended = found.ended;
    let mut stress = Stress { schema: SCHEMA, program, device: name, ended, cases: rows, pictures: Vec::new() };
    let kept = args.out.as_ref().map_or(Ok(()), |folder| keep(folder, &mut stress));
    // Findings are printed even if their files cannot be written.
    say(common, &stress)?;
    kept?;
    let [_, failed] = stress.counts();
    // A stopped run has not passed.
    Ok(if failed == 0 && stress.ended.is_none() { Outcome::Done } else { Outcome::LimitMissed })
}

/// Returns the cases that `--family` and `--case` select.
fn chosen(args: &StressArgs) -> Result<Vec<&'static Case>> {
    let families: Vec<_> = stress::FAMILIES.iter().filter_map(|cases| Some(cases.first()?.family)).collect();
    if let Some(unknown) = args.family.iter().find(|family| !families.contains(&family.as_str())) {
        bail!("--family {unknown}: expected one of {}", families.join(", "));
    }
    let is_wanted = |case: &&Case| {
        let of_family = args.family.is_empty() || args.family.iter().any(|family| family == case.family);
        of_family && (args.case.is_empty() || args.case.iter().any(|part| case.name.contains(part)))
    };
    let cases: Vec<_> = stress::cases().filter(is_wanted).collect();
    if cases.is_empty() {
        bail!("--case {}: no case matches, see cuesta stress --list", args.case.join(", "));
    }
    Ok(cases)
}

/// Makes a progress bar over all runs; those that are also drawn count twice.
fn progress(common: &Common, trials: &[CaseRun], draws: bool) -> ProgressBar {
    let drawn = trials.iter().filter(|trial| draws && trial.is_drawn()).count();
    let bar = if common.quiet || common.json { ProgressBar::hidden() } else { ProgressBar::no_length() };
    bar.set_length((trials.len() + drawn) as u64);
    bar
}

/// Makes the row of a finding, and writes its counter-example to `folder` if it failed.
fn row(
    common: &Common,
    folder: &Path,
    trial: &CaseRun,
    finding: &Finding,
    checker: Option<&mut dyn ImageChecker>,
) -> Row {
    let finite = |value: f64| value.is_finite().then_some(value);
    // A failure to write the counter-example must not lose the row.
    let files = counter_example(folder, trial, finding, checker).unwrap_or_else(|error| {
        report::warn(common, &format!("no counter-example: {error:#}"));
        Vec::new()
    });
    Row {
        family: trial.case.family.to_string(),
        name: trial.case.name.to_string(),
        technique: trial.technique(),
        check: finding.check.to_string(),
        value: finite(finding.value),
        limit: finding.limit.and_then(finite),
        pass: finding.passes(),
        why: finding.violation.as_ref().map(ToString::to_string).or_else(|| finding.why.clone()),
        repeat: saved::command(trial),
        saved: files.iter().map(|file| file.display().to_string()).collect(),
    }
}

/// Writes the counter-example of a failed finding. Returns its files; none if the finding passed.
fn counter_example(
    folder: &Path,
    trial: &CaseRun,
    finding: &Finding,
    checker: Option<&mut dyn ImageChecker>,
) -> Result<Vec<PathBuf>> {
    if finding.passes() {
        return Ok(Vec::new());
    }
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    saved::counter_example(folder, trial, finding, checker)
}

/// Makes the row for the messages of the validation layers.
fn validation(messages: &[String]) -> Row {
    Row {
        family: "arithmetic".to_string(),
        name: "all pictures".to_string(),
        technique: "device".to_string(),
        check: "validation messages".to_string(),
        value: Some(messages.len() as f64),
        limit: Some(0.0),
        pass: messages.is_empty(),
        why: messages.first().cloned(),
        repeat: "cuesta stress --validate".to_string(),
        saved: Vec::new(),
    }
}

/// Writes the rows, the pictures of measurements and the page.
fn keep(folder: &Path, stress: &mut Stress) -> Result<()> {
    std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
    if stress.cases.iter().any(|row| row.name.starts_with("jitter")) {
        stress.pictures.extend(jitter::save_maps(folder)?);
    }
    if stress.cases.iter().any(|row| row.family == "stiff") {
        stress.pictures.extend(stiff::save_regions(folder)?);
    }
    let path = folder.join(rows::FILE);
    replace(&path, |out| Ok(serde_json::to_writer_pretty(out, stress)?)).with_context(|| path.display().to_string())?;
    crate::report::write_stress(folder)?;
    Ok(())
}

/// Prints the results: as JSON, or one line per row and their sum. `--quiet` prints only failures and the sum.
fn say(common: &Common, stress: &Stress) -> Result<()> {
    if let Some(why) = &stress.ended {
        report::warn(common, why);
    }
    if common.json {
        return report::print(common, stress);
    }
    let [passed, failed] = stress.counts();
    if !common.quiet {
        stress.cases.iter().try_for_each(|row| report::say(line(row)))?;
    }
    stress.cases.iter().filter(|row| !row.pass && common.quiet).try_for_each(|row| report::say(line(row)))?;
    report::say(format_args!("{passed} checks passed, {failed} failed"))
}

/// Formats a row on one line.
fn line(row: &Row) -> String {
    let number = |value: Option<f64>| value.map_or("-".to_string(), |value| format!("{value:.6}"));
    let number = |value| {
        let text = number(value);
        if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
    };
    let verdict = match (row.limit, row.pass) {
        (None, true) => "info",
        (_, true) => "pass",
        (_, false) => "FAIL",
    };
    let Row { family, name, technique, check, value, limit, why, .. } = row;
    let why = why.as_ref().map(|why| format!(" ({why})")).unwrap_or_default();
    format!("{verdict}  {family}: {name}, {technique}: {check}: {} of {}{why}", number(*value), number(*limit))
}

/// Name and image checker of the Vulkan device; `None` if there is none or `--no-device` is given.
#[cfg(feature = "vulkan")]
struct Device(Option<(String, stress::device::DeviceImageChecker)>);

#[cfg(feature = "vulkan")]
impl Device {
    /// Opens the device. A missing one is an error only if the command line names a device or asks for validation.
    fn open(common: &Common, args: &StressArgs) -> Result<Self> {
        if args.no_device {
            return Ok(Self(None));
        }
        match super::render::open(common) {
            Ok(gpu) => {
                let name = gpu.candidate.name.clone();
                Ok(Self(Some((name, stress::device::DeviceImageChecker::new(gpu)))))
            }
            Err(error) if common.device.is_some() || common.validate => Err(error),
            Err(error) => {
                report::warn(common, &format!("no pictures: {error:#}"));
                Ok(Self(None))
            }
        }
    }

    fn checker(&mut self) -> Option<&mut dyn ImageChecker> {
        self.0.as_mut().map(|(_, checker)| checker as &mut dyn ImageChecker)
    }

    /// Closes the device. Returns its name and validation messages.
    fn close(self) -> (Option<String>, Vec<String>) {
        self.0.map_or((None, Vec::new()), |(name, checker)| (Some(name), checker.close()))
    }
}

/// Stands in for the device in a build without Vulkan.
#[cfg(not(feature = "vulkan"))]
struct Device;

#[cfg(not(feature = "vulkan"))]
impl Device {
    fn open(_: &Common, _: &StressArgs) -> Result<Self> {
        Ok(Self)
    }

    fn checker(&mut self) -> Option<&mut dyn ImageChecker> {
        None
    }

    fn close(self) -> (Option<String>, Vec<String>) {
        (None, Vec::new())
    }
}
