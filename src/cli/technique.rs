//! The technique on the command line: its name, its settings, and the error it may make.

use std::sync::Arc;

use anyhow::{Result, anyhow, bail};
use clap::{Args, ValueEnum};

use super::common::Common;
use super::numbers::FINEST;
use super::report;
use super::scene::key_value;
use crate::height::Field;
use crate::lod::{self, Settings, Technique};
use crate::view::{Metric, Tolerance};

/// Which technique draws, and how well.
#[derive(Args, Debug, Clone)]
pub struct TechniqueArgs {
    /// Technique, or technique:variant.
    #[arg(long, value_name = "T", default_value = "geomipmap", help = technique_help())]
    pub technique: String,
    /// A setting of the technique; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE", value_parser = key_value)]
    pub settings: Vec<(String, String)>,
    /// Error allowed, pixels.
    #[arg(long, value_name = "PX", default_value_t = 1.0)]
    pub tolerance: f64,
    /// The meaning of a pixel of error.
    #[arg(long, value_enum, default_value_t = MetricArg::Certified)]
    pub metric: MetricArg,
}

/// [`Metric`] as a word.
#[derive(ValueEnum, Clone, Copy, Debug)]
pub enum MetricArg {
    /// A true bound for every pixel.
    Certified,
    /// As published.
    Paper,
}

impl MetricArg {
    /// As it is written.
    pub fn name(self) -> &'static str {
        match self {
            MetricArg::Certified => "certified",
            MetricArg::Paper => "paper",
        }
    }
}

fn technique_help() -> String {
    let names = lod::TECHNIQUES.iter().flat_map(|entry| {
        let variants = entry.variants.iter().map(|v| format!("{}:{}", entry.name, v.name));
        std::iter::once(entry.name.to_string()).chain(variants)
    });
    format!("Technique, or technique:variant: {}", names.collect::<Vec<_>>().join(", "))
}

/// Settings of a technique, with errors that name the flag at fault.
pub(super) fn settings(entry: &lod::Entry, variant: Option<&str>, choices: &[(String, String)]) -> Result<Settings> {
    Settings::new(entry, variant, choices).map_err(|what| {
        let is_variant = variant.is_some_and(|name| entry.variants.iter().all(|variant| variant.name != name));
        anyhow!("{}: {what}", if is_variant { "--technique" } else { "--set" })
    })
}

impl TechniqueArgs {
    /// The table's row, and the settings for it.
    pub fn settings(&self) -> Result<(&'static lod::Entry, Settings)> {
        let (name, variant) = match self.technique.split_once(':') {
            Some((name, variant)) => (name, Some(variant)),
            None => (self.technique.as_str(), None),
        };
        let entry = lod::find(name).ok_or_else(|| {
            let known: Vec<_> = lod::TECHNIQUES.iter().map(|entry| entry.name).collect();
            anyhow!("--technique {name}: expected one of {}", known.join(", "))
        })?;
        Ok((entry, settings(entry, variant, &self.settings)?))
    }

    /// The technique, prepared for the field.
    pub fn build(&self, common: &Common, field: &Arc<Field>) -> Result<Box<dyn Technique>> {
        let (entry, settings) = self.settings()?;
        report::warn_of_idle(common, entry, &settings);
        let _spinner = report::preparing(common, entry.name, &settings.progress);
        entry.prepare(field, &settings).map_err(anyhow::Error::msg)
    }

    /// The tolerance under the metric.
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
