//! Output of the subcommands: results as JSON or text on stdout, progress and warnings on stderr. A closed pipe, as in
//! `cuesta … | head`, is not an error.

use std::fmt;
use std::io::{self, ErrorKind, Write};
use std::path::Path;
use std::time::Duration;

use anyhow::{Context, Result};
use indicatif::{ProgressBar, ProgressState, ProgressStyle};
use serde::Serialize;
use serde_json::Value;

use super::common::Common;
use crate::height::Error;
use crate::height::progress::Progress;
use crate::height::save::replace;
use crate::lod::{Entry, Settings};
use crate::renamed;

/// Prints a line on stdout.
///
/// # Errors
/// If writing fails, except to a closed pipe.
pub fn say(line: impl fmt::Display) -> Result<()> {
    match writeln!(io::stdout().lock(), "{line}") {
        Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
        written => written.context("stdout"),
    }
}

/// Prints a line on stderr. Failures to write are ignored.
pub fn note(line: impl fmt::Display) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}

/// Prints a result: as one JSON document with `--json`, otherwise one line per field, or nothing with `--quiet`.
///
/// # Errors
/// If stdout cannot be written.
pub fn print(common: &Common, result: &impl Serialize) -> Result<()> {
    let mut value = serde_json::to_value(result)?;
    if common.json {
        renamed::add_former_names(&mut value);
        say(serde_json::to_string_pretty(&value)?)?;
    } else if let (Value::Object(fields), false) = (value, common.quiet) {
        for (name, value) in fields.iter().filter(|(_, value)| !value.is_null()) {
            print_field(&name.replace('_', " "), value)?;
        }
    }
    Ok(())
}

/// Prints a field on one line. A list of objects gets one line per object.
fn print_field(name: &str, value: &Value) -> Result<()> {
    match value {
        Value::Array(rows) if rows.iter().any(Value::is_object) => {
            say(format_args!("{name}:"))?;
            rows.iter().try_for_each(|row| say(format_args!("  {}", plain(row))))
        }
        _ => say(format_args!("{name}: {}", plain(value))),
    }
}

/// Formats a value as text on one line.
fn plain(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Array(items) if items.is_empty() => "none".to_string(),
        Value::Array(items) => items.iter().map(plain).collect::<Vec<_>>().join(", "),
        Value::Object(fields) => {
            fields.iter().map(|(name, value)| format!("{name} {}", plain(value))).collect::<Vec<_>>().join(", ")
        }
        other => other.to_string(),
    }
}

/// Prints a warning on stderr, unless `--quiet` is given.
pub fn warn(common: &Common, text: &str) {
    if !common.quiet {
        note(format_args!("warning: {text}"));
    }
}

/// Warns if the tolerance was scaled because the draw list did not fit its buffers. `scale` is the factor.
pub fn warn_of_tolerance(common: &Common, scale: f64) {
    if scale == f64::INFINITY {
        warn(common, "the view exceeds the draw buffers: no tolerance is kept (larger blocks or tiles may fit)");
    } else if scale > 1.0 {
        warn(common, &format!("the view exceeds the draw buffers: the tolerance was multiplied by {scale:.3}"));
    }
}

/// Warns of settings that have no effect in combination with the others.
pub fn warn_of_idle(common: &Common, entry: &Entry, settings: &Settings) {
    settings.idle(entry).iter().for_each(|idle| warn(common, &format!("--set {idle}")));
}

/// Shows a spinner on a terminal while a technique is prepared, with the share done once that is known. Dropping it
/// removes it.
pub fn preparing(common: &Common, what: &str, progress: &Progress) -> ProgressBar {
    let bar = spinner(common, format!("preparing {what}"));
    let progress = progress.clone();
    let share = move |_: &ProgressState, out: &mut dyn fmt::Write| {
        let _ = progress.share().map_or(Ok(()), |share| write!(out, " {:.0} %", 100.0 * share));
    };
    if let Ok(style) = ProgressStyle::with_template("{spinner} {msg}{share}") {
        bar.set_style(style.with_key("share", share));
    }
    bar
}

/// Shows a spinner on a terminal, unless `--quiet` is given. Dropping it removes it.
pub fn spinner(common: &Common, what: impl Into<String>) -> ProgressBar {
    let bar = if common.quiet { ProgressBar::hidden() } else { ProgressBar::new_spinner() };
    bar.set_message(what.into());
    bar.enable_steady_tick(Duration::from_millis(120));
    bar
}

/// Writes a picture as PNG without its alpha channel. If that fails, an existing file is unchanged.
///
/// # Errors
/// If the file cannot be written.
pub fn save(path: &Path, picture: &image::RgbaImage) -> Result<()> {
    let rgb = image::DynamicImage::from(picture.clone()).into_rgb8();
    let written = replace(path, |out| rgb.write_to(out, image::ImageFormat::Png).map_err(std::io::Error::other));
    Ok(written.map_err(|e| Error::new(path.display().to_string(), "file", e))?)
}
