//! The file `rows.jsonl`: a header and result rows, one JSON document per line.
//!
//! Each row is on the disk before the next one is measured. A killed process leaves at most one incomplete line at the
//! end. It is ignored when reading and removed when the run is resumed.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result, bail};

use super::rows::{Header, Row, SCHEMA};
use crate::renamed;

/// Name of the file in a benchmark's folder.
pub const ROWS: &str = "rows.jsonl";

/// The rows of one run, open for appending.
pub struct Journal {
    name: String,
    file: File,
    header: Header,
    rows: Vec<Row>,
}

impl Journal {
    /// Opens the rows of a folder, or creates them with this header.
    ///
    /// # Errors
    /// If the file cannot be read or written, or holds rows of a run with another header. Dates may differ.
    pub fn open(folder: &Path, header: Header) -> Result<Self> {
        std::fs::create_dir_all(folder).with_context(|| folder.display().to_string())?;
        let path = folder.join(ROWS);
        let name = path.display().to_string();
        let text = if path.exists() { std::fs::read(&path).with_context(|| name.clone())? } else { Vec::new() };
        let whole = text.iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
        let mut rows = parse(&text[..whole], &name)?;
        let file = OpenOptions::new().create(true).append(true).open(&path).with_context(|| name.clone())?;
        file.set_len(whole as u64).with_context(|| name.clone())?;
        if rows.is_empty() {
            let mut journal = Self { name, file, header: header.clone(), rows };
            journal.write(&Row::Header(header))?;
            return Ok(journal);
        }
        let Row::Header(found) = rows.remove(0) else { bail!("{name}: line 1: expected the header, found a row") };
        if let Some(what) = difference(&found, &header) {
            bail!("{name}: holds the rows of another run: {what}; expected the same run, or another --out");
        }
        Ok(Self { name, file, header: found, rows })
    }

    /// Appends a row and waits until it is on the disk.
    ///
    /// # Errors
    /// If the file cannot be written.
    pub fn append(&mut self, row: Row) -> Result<()> {
        self.write(&row)?;
        self.rows.push(row);
        Ok(())
    }

    fn write(&mut self, row: &Row) -> Result<()> {
        let mut value = serde_json::to_value(row)?;
        renamed::add_former_names(&mut value);
        let line = value.to_string() + "\n";
        let written = self.file.write_all(line.as_bytes()).and_then(|()| self.file.sync_data());
        written.with_context(|| self.name.clone())
    }

    /// Returns the header of the rows.
    pub fn header(&self) -> &Header {
        &self.header
    }

    /// Returns the rows so far.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }
}

/// Reads the header and the rows of a folder. An incomplete last line is ignored.
///
/// # Errors
/// If the file cannot be read, a line is not a row, or the header is missing or of another schema version.
pub fn read(folder: &Path) -> Result<(Header, Vec<Row>)> {
    let path = folder.join(ROWS);
    let name = path.display().to_string();
    let text = std::fs::read(&path).with_context(|| name.clone())?;
    let whole = text.iter().rposition(|&byte| byte == b'\n').map_or(0, |at| at + 1);
    let mut rows = parse(&text[..whole], &name)?.into_iter();
    match rows.next() {
        Some(Row::Header(header)) if header.schema == SCHEMA => Ok((header, rows.collect())),
        Some(Row::Header(header)) => bail!("{name}: line 1: expected schema {SCHEMA}, found {}", header.schema),
        _ => bail!("{name}: line 1: expected the header of a benchmark's rows"),
    }
}

/// Parses complete lines. `name` is the file's, for errors.
fn parse(text: &[u8], name: &str) -> Result<Vec<Row>> {
    let lines = text.split(|&byte| byte == b'\n').filter(|line| !line.is_empty()).enumerate();
    let row = |(k, line)| row(line).with_context(|| format!("{name}: line {}", k + 1));
    lines.map(row).collect()
}

fn row(line: &[u8]) -> serde_json::Result<Row> {
    let mut value = serde_json::from_slice(line)?;
    renamed::drop_former_names(&mut value);
    serde_json::from_value(value)
}

/// Describes the first header field in which two runs differ. Rows of such runs must not be mixed.
fn difference(found: &Header, wanted: &Header) -> Option<String> {
    let differ = |what: &str, a: &dyn std::fmt::Debug, b: &dyn std::fmt::Debug| {
        (format!("{a:?}") != format!("{b:?}")).then(|| format!("its {what} is {a:?} and not {b:?}"))
    };
    differ("schema", &found.schema, &wanted.schema)
        .or_else(|| differ("program version", &found.program, &wanted.program))
        .or_else(|| differ("commit", &found.commit, &wanted.commit))
        .or_else(|| differ("list of arguments", &found.arguments, &wanted.arguments))
        .or_else(|| differ("base technique", &found.base, &wanted.base))
        .or_else(|| differ("machine", &found.machine, &wanted.machine))
        .or_else(|| differ("device", &found.device, &wanted.device))
        .or_else(|| differ("scene plan", &found.plans, &wanted.plans))
}
