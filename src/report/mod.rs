//! Draws the report of a benchmark or of the stress suite: a self-contained `index.html`, and one SVG file per chart of
//! a benchmark. It needs only the rows that were written, and no device.

mod axis;
mod bars;
mod chart;
mod figures;
mod html;
mod page;
mod pictures;
mod published;
mod suite;
mod tables;

use std::path::{Path, PathBuf};

use anyhow::{Context, Result, ensure};

use crate::bench::results::{self, Results};
use crate::stress::Stress;
use figures::Figures;

/// Name of the page.
pub const PAGE: &str = "index.html";
/// Folder of the SVG files.
pub const PLOTS: &str = "plots";

/// Draws the report of a benchmark's folder from its rows. Returns the path of the page.
///
/// # Errors
/// If the rows cannot be read, there are none, or a file cannot be written.
pub fn write(folder: &Path) -> Result<PathBuf> {
    let results = Results::read(folder)?;
    ensure!(!results.cases.is_empty(), "{}: {}: no rows yet", folder.display(), crate::bench::journal::ROWS);
    let figures = Figures::of(&results);
    let plots = folder.join(PLOTS);
    std::fs::create_dir_all(&plots).with_context(|| plots.display().to_string())?;
    for (name, svg) in figures.files() {
        results::save(&plots.join(format!("{name}.svg")), svg.as_bytes())?;
    }
    let path = folder.join(PAGE);
    results::save(&path, page::page(&results, &figures, folder).as_bytes())?;
    Ok(path)
}

/// Draws the page of a stress suite's folder from its rows. Returns its path.
///
/// # Errors
/// If the rows cannot be read or the page cannot be written.
pub fn write_stress(folder: &Path) -> Result<PathBuf> {
    let stress = Stress::read(folder)?;
    let path = folder.join(PAGE);
    results::save(&path, suite::page(&stress, folder).as_bytes())?;
    Ok(path)
}
