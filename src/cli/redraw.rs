//! `cuesta report`: draws the report of a benchmark or of the stress suite again, from its rows.

use std::path::PathBuf;

use anyhow::Result;
use clap::Args;
use serde::Serialize;

use super::common::{Common, Outcome};
use super::report;
use crate::bench::results;
use crate::stress::rows;

/// Arguments of `cuesta report`.
#[derive(Args, Debug)]
pub struct ReportArgs {
    /// Folder of a benchmark or of the stress suite.
    pub folder: PathBuf,
}

#[derive(Serialize)]
struct Redrawn {
    report: String,
    results: String,
}

/// Runs the subcommand.
pub fn run(common: &Common, args: &ReportArgs) -> Result<Outcome> {
    let suite = args.folder.join(rows::FILE);
    if suite.exists() {
        let report = crate::report::write_stress(&args.folder)?.display().to_string();
        report::print(common, &Redrawn { report, results: suite.display().to_string() })?;
        return Ok(Outcome::Done);
    }
    let results = results::write(&args.folder)?.display().to_string();
    let report = crate::report::write(&args.folder)?.display().to_string();
    report::print(common, &Redrawn { report, results })?;
    Ok(Outcome::Done)
}
