//! Results of the stress suite as rows: the contents of `stress.json`, from which the report page is drawn.

use std::path::Path;

use anyhow::{Context, Result, ensure};
use serde::{Deserialize, Serialize};

/// Version of `stress.json`.
pub const SCHEMA: u32 = 1;

/// File name in a suite's directory.
pub const FILE: &str = "stress.json";

/// One check of one case with one technique.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Row {
    /// Family: `data`, `position`, `view`, `time`, `arithmetic`, `stiff`, `file` or `sweep`.
    pub family: String,
    /// Name of the case.
    pub name: String,
    /// The technique with its settings, or the subject of a standalone case.
    pub technique: String,
    /// Name of the check, with its unit if it has one.
    pub check: String,
    /// Measured value; `null` if it is not finite.
    pub value: Option<f64>,
    /// Largest value that passes; `null` if the value is only reported.
    pub limit: Option<f64>,
    /// True if the value is within the limit.
    pub pass: bool,
    /// Reason of a failure.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub why: Option<String>,
    /// Command that repeats the check.
    pub repeat: String,
    /// Files of the counter-example.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub saved: Vec<String>,
}

/// One run of the suite.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Stress {
    /// Version of the file format, [`SCHEMA`].
    pub schema: u32,
    /// Version of the program.
    pub program: String,
    /// Device that drew images, if any.
    pub device: Option<String>,
    /// Reason why the suite ended early: stopped, or device lost.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ended: Option<String>,
    /// All rows.
    pub cases: Vec<Row>,
    /// Images of measurements.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub pictures: Vec<Picture>,
}

/// An image beside the rows.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Picture {
    /// File name.
    pub file: String,
    /// Caption.
    pub caption: String,
}

impl Stress {
    /// Reads the results from a suite's directory.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(FILE);
        let text = std::fs::read(&path).with_context(|| path.display().to_string())?;
        let stress: Self = serde_json::from_slice(&text).with_context(|| path.display().to_string())?;
        ensure!(stress.schema == SCHEMA, "{}: schema: expected {SCHEMA}, found {}", path.display(), stress.schema);
        Ok(stress)
    }

    /// Returns the numbers of passed and failed checks. Values without a limit are not counted.
    pub fn counts(&self) -> [usize; 2] {
        let judged = || self.cases.iter().filter(|row| row.limit.is_some());
        let passed = judged().filter(|row| row.pass).count();
        [passed, judged().count() - passed]
    }
}
