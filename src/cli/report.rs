//! Output of the subcommands: JSON or lines on stdout, progress and warnings on stderr. A closed pipe (`| head`) is no
//! error: the work goes on.

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

/// Prints a line on stderr; ignores a failure to write.
pub fn note(line: impl fmt::Display) {
    let _ = writeln!(io::stderr().lock(), "{line}");
}

/// Prints a result as one JSON document, or one line per field.
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

fn print_field(name: &str, value: &Value) -> Result<()> {
    match value {
        Value::Array(rows) if rows.iter().any(Value::is_object) => {
            say(format_args!("{name}:"))?;
            rows.iter().try_for_each(|row| say(format_args!("  {}", plain(row))))
        }
        _ => say(format_args!("{name}: {}", plain(value))),
    }
}

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

/// Prints a warning on stderr.
pub fn warn(common: &Common, text: &str) {
    if !common.quiet {
        note(format_args!("warning: {text}"));
    }
}

/// Warns if the tolerance of a list was scaled.
pub fn warn_of_tolerance(common: &Common, scale: f64) {
    if scale == f64::INFINITY {
        warn(common, "there is too much to draw in this view: no tolerance is kept (larger blocks or tiles hold more)");
    } else if scale > 1.0 {
        warn(common, &format!("there is too much to draw in this view: the tolerance is {scale:.3} times as wide"));
    }
}

/// Warns of settings without effect.
pub fn warn_of_idle(common: &Common, entry: &Entry, settings: &Settings) {
    settings.idle(entry).iter().for_each(|idle| warn(common, &format!("--set {idle}")));
}

/// Shows a spinner for a technique, with its progress once it is known.
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

/// Shows a spinner on a terminal until it is dropped.
pub fn spinner(common: &Common, what: impl Into<String>) -> ProgressBar {
    let bar = if common.quiet { ProgressBar::hidden() } else { ProgressBar::new_spinner() };
    bar.set_message(what.into());
    bar.enable_steady_tick(Duration::from_millis(120));
    bar
}

/// Writes the colours of a picture. Keeps an existing file if writing fails.
pub fn save(path: &Path, picture: &image::RgbaImage) -> Result<()> {
    let rgb = image::DynamicImage::from(picture.clone()).into_rgb8();
    let written = replace(path, |out| rgb.write_to(out, image::ImageFormat::Png).map_err(std::io::Error::other));
    Ok(written.map_err(|e| Error::new(path.display().to_string(), "file", e))?)
}
