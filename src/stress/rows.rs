//! What the suite found, as rows: `stress.json`, and what the page is drawn from.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};

/// Version of `stress.json`.
pub const SCHEMA: u32 = 1;

/// Name of the file in a suite's directory.
pub const FILE: &str = "stress.json";

/// One check of one case with one technique.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// `data`, `position`, `view`, `time`, `arithmetic`, `stiff`, `file` or `sweep`.
    pub family: String,
    /// The case.
    pub name: String,
    /// The technique with its settings, or what else was tried.
    pub technique: String,
    /// What was checked, with its unit where it has one.
    pub check: String,
    /// What was found; `null` if it is no finite number.
    pub value: Option<f64>,
    /// The most that passes; `null` where the value is only told.
    pub limit: Option<f64>,
    /// Whether the value is within the limit.
    pub pass: bool,
    /// How it failed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
    /// The command that repeats it.
    pub repeat: String,
    /// Files of the counter-example.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub saved: Vec<String>,
}

/// A run of the suite.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stress {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Version of the program.
    pub program: String,
    /// The device that drew pictures, if there was one.
    pub device: Option<String>,
    /// Why not everything was tried, if so: it was stopped, or the device was lost.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<String>,
    /// All rows.
    pub cases: Vec<Row>,
    /// Pictures of what was measured: file and caption.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pictures: Vec<Picture>,
}

/// A picture beside the rows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// Its file's name.
    pub file: String,
    /// What it shows.
    pub caption: String,
}

impl Stress {
    /// Reads a suite's directory.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(FILE);
        let text = std::fs::read(&path).with_context(|| path.display().to_string())?;
        let stress: Self = serde_json::from_slice(&text).with_context(|| path.display().to_string())?;
        ensure!(stress.schema == SCHEMA, "{}: schema: expected {SCHEMA}, found {}", path.display(), stress.schema);
        Ok(stress)
    }

    /// How many rows pass and how many fail; what is only told counts for neither.
    pub fn counts(&self) -> [usize; 2] {
        let judged = || self.cases.iter().filter(|row| row.limit.is_some());
        let passed = judged().filter(|row| row.pass).count();
        [passed, judged().count() - passed]
    }
}
