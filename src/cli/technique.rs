//! Arguments for the technique, its settings and the tolerance.

use std::ffi::OsString;
use std::sync::Arc;

use anyhow::{Error, Result, anyhow, bail};
use clap::{Args, Command, ValueEnum};

use super::common::Common;
use super::numbers::FINEST;
use super::report;
use super::scene::key_value;
use crate::height::Field;
use crate::lod::{Entry, Setting, Settings, Technique, TechniqueSpec, Techniques};
use crate::view::{Metric, Tolerance};

/// Technique, settings and tolerance.
#[derive(Args, Debug, Clone)]
pub struct TechniqueArgs {
    /// Technique, or technique:variant.
    #[arg(long, value_name = "T", default_value = "geomipmap")]
    pub technique: TechniqueSpec,
    /// A setting of the technique; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    pub settings: Vec<(String, String)>,
    /// Tolerance: largest allowed error on the screen, pixels.
    #[arg(long, value_name = "PX", default_value_t = 1.0)]
    pub tolerance: f64,
    /// Formula that converts metres of error to pixels.
    #[arg(long, value_enum, default_value_t = MetricArg::Certified)]
    pub metric: MetricArg,
}

/// [`Metric`] on the command line.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub enum MetricArg {
    /// An upper bound of the error at every pixel.
    Certified,
    /// The formula of the technique's paper: no bound off the view axis.
    Paper,
}

impl MetricArg {
    /// Returns the name on the command line and in results.
    pub fn name(self) -> &'static str {
        match self {
            MetricArg::Certified => "certified",
            MetricArg::Paper => "paper",
        }
    }
}

/// Lists all techniques in the help of `--technique`, in each subcommand that takes one technique.
pub(super) fn with_names(command: Command, techniques: &Techniques) -> Command {
    let specs: Vec<_> = techniques.specs().iter().map(TechniqueSpec::to_string).collect();
    let help = format!("Technique, or technique:variant: {}", specs.join(", "));
    let takes_one = |command: &&Command| {
        command.get_arguments().any(|arg| arg.get_id() == "technique" && !arg.get_default_values().is_empty())
    };
    let names: Vec<_> = command.get_subcommands().filter(takes_one).map(|c| c.get_name().to_string()).collect();
    let listed = |command: Command| command.mut_arg("technique", |arg| arg.help(&help));
    names.into_iter().fold(command, |command, name| command.mut_subcommand(name, listed))
}

/// Adds the variants and settings of the techniques that a command line names to the help of all subcommands.
pub(super) fn with_settings(command: Command, techniques: &Techniques, words: &[OsString]) -> Command {
    let words = words.iter().map(|word| word.to_string_lossy());
    let named = words.clone().zip(words.skip(1)).filter_map(|(word, next)| match word.strip_prefix("--technique") {
        Some("") => Some(next.into_owned()),
        Some(value) => value.strip_prefix('=').map(str::to_owned),
        None => next.strip_prefix("--technique=").map(str::to_owned),
    });
    let specs: Vec<TechniqueSpec> =
        named.flat_map(|list| list.split(',').map(str::to_owned).collect::<Vec<_>>()).flat_map(|s| s.parse()).collect();
    let mut entries: Vec<_> = specs.iter().filter_map(|spec| techniques.entry(spec).ok()).collect();
    entries.dedup_by_key(|entry| entry.name);
    let text: String = entries.into_iter().map(settings_help).collect();
    if text.is_empty() { command } else { command.mut_subcommands(|sub| sub.after_help(text.trim_end().to_owned())) }
}

/// Describes the variants and settings of a technique.
fn settings_help(entry: &Entry) -> String {
    let mut text = format!("{}: {}\n", entry.name, entry.about);
    for variant in entry.variants {
        text += &format!("  --technique {}:{}\n          {}\n", entry.name, variant.name, variant.about);
    }
    for setting in entry.settings {
        let Setting { key, values, default, about } = setting;
        text += &format!("  --set {key}=VALUE\n          {about} [{values}; default: {default}]\n");
    }
    if entry.settings.is_empty() { text + "  It has no settings.\n" } else { text }
}

/// Returns the technique that `--technique` names.
///
/// # Errors
/// If there is no such technique. The error names the flag.
pub(super) fn entry(techniques: &Techniques, spec: &TechniqueSpec) -> Result<&'static Entry> {
    techniques.entry(spec).map_err(|why| anyhow!("--technique {why}"))
}

/// Checks the settings of a technique.
///
/// # Errors
/// If a variant, key or value is unknown. The error names the flag at fault.
pub(super) fn settings(entry: &Entry, variant: Option<&str>, choices: &[(String, String)]) -> Result<Settings> {
    Settings::new(entry, variant, choices).map_err(|what| {
        let is_variant = variant.is_some_and(|name| entry.variants.iter().all(|variant| variant.name != name));
        anyhow!("{}: {what}", if is_variant { "--technique" } else { "--set" })
    })
}

impl TechniqueArgs {
    /// Returns the technique's table row and its checked settings.
    ///
    /// # Errors
    /// If a name or value is unknown.
    pub fn settings(&self, techniques: &Techniques) -> Result<(&'static Entry, Settings)> {
        let entry = entry(techniques, &self.technique)?;
        Ok((entry, settings(entry, self.technique.variant.as_deref(), &self.settings)?))
    }

    /// Prepares the technique for a field. Warns of settings without effect and shows the progress.
    ///
    /// # Errors
    /// If a name or value is unknown, or the technique cannot draw the field.
    pub fn build(&self, common: &Common, field: &Arc<Field>) -> Result<Box<dyn Technique>> {
        let (entry, settings) = self.settings(&common.techniques)?;
        report::warn_of_idle(common, entry, &settings);
        let _spinner = report::preparing(common, entry.name, &settings.progress);
        entry.prepare(field, &settings).map_err(Error::msg)
    }

    /// Returns the tolerance and its metric.
    ///
    /// # Errors
    /// If the tolerance is not finite or is below 1e-9 px.
    pub fn tolerance(&self) -> Result<Tolerance> {
        if !(self.tolerance.is_finite() && self.tolerance >= FINEST) {
            bail!("--tolerance {:?}: expected at least {FINEST:e} pixels", self.tolerance);
        }
        let metric = match self.metric {
            MetricArg::Certified => Metric::Certified,
            MetricArg::Paper => Metric::Paper,
        };
        Ok(Tolerance { px: self.tolerance, metric })
    }
}
