//! Writes the files of a profile: tables, one document, and the trace. Each file appears only once it is complete.

use std::io::{self, Write};
use std::path::Path;

use serde::Serialize;
use serde_json::Value;

use super::rows::Profile;
use crate::height::Error;
use crate::height::save::{Out, replace};

/// File with the timeline of one frame.
pub const TRACE: &str = "trace.json";
/// File with all results as one document.
pub const DOCUMENT: &str = "profile.json";
/// Table with one line per pass.
pub const PASSES: &str = "passes.csv";
/// Table with one line per draw.
pub const DRAWS: &str = "draws.csv";
/// Table with one line per submission mode.
pub const MODES: &str = "modes.csv";

/// Creates the folder for the files.
///
/// # Errors
/// If the folder cannot be created.
pub fn make_folder(folder: &Path) -> Result<(), Error> {
    std::fs::create_dir_all(folder).map_err(|error| Error::new(folder.display().to_string(), "folder", error))
}

/// Writes tables, document and trace into a folder.
///
/// # Errors
/// If a file cannot be written.
pub fn write(folder: &Path, profile: &Profile, document: &impl Serialize, trace: &Value) -> Result<(), Error> {
    save(folder, PASSES, |out| csv(out, &profile.passes))?;
    save(folder, DRAWS, |out| csv(out, &profile.draws))?;
    save(folder, MODES, |out| csv(out, &profile.modes))?;
    save(folder, TRACE, |out| Ok(serde_json::to_writer(out, trace)?))?;
    save(folder, DOCUMENT, |out| {
        serde_json::to_writer_pretty(&mut *out, document)?;
        out.write_all(b"\n")
    })
}

fn save(folder: &Path, name: &str, write: impl FnOnce(&mut Out) -> io::Result<()>) -> Result<(), Error> {
    let path = folder.join(name);
    replace(&path, write).map_err(|error| Error::new(path.display().to_string(), "file", error))
}

fn csv(out: &mut Out, rows: &[impl Serialize]) -> io::Result<()> {
    let mut writer = csv::Writer::from_writer(out);
    for row in rows {
        writer.serialize(row).map_err(io::Error::other)?;
    }
    writer.flush()
}
