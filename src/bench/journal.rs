//! `rows.jsonl`: rows appended one by one, each on the disk before the next is begun. A process that is killed
//! leaves at most one torn line at the end, which is dropped when the run is resumed.

use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::Path;

use anyhow::{Context, Result, bail};

use super::rows::{Header, Row, SCHEMA};
use crate::renamed;

/// Name of the file in a benchmark's directory.
pub const ROWS: &str = "rows.jsonl";

/// The file of rows of one run, open for more.
pub struct Journal {
    name: String,
    file: File,
    header: Header,
    rows: Vec<Row>,
}

impl Journal {
    /// Opens the rows of `folder`, or begins them. Rows of a run with another header are refused; its date is not
    /// compared.
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
            bail!("{name}: holds another run's rows, whose {what}; expected the same, or another --out");
        }
        Ok(Self { name, file, header: found, rows })
    }

    /// Adds a row; on return it is on the disk.
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

    /// The rows so far.
    pub fn rows(&self) -> &[Row] {
        &self.rows
    }
}

/// Reads the header and the rows of a directory; a torn last line is left out.
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

/// Returns the first difference that forbids mixing the rows of two runs.
fn difference(found: &Header, wanted: &Header) -> Option<String> {
    let told = |what: &str, a: &dyn std::fmt::Debug, b: &dyn std::fmt::Debug| {
        (format!("{a:?}") != format!("{b:?}")).then(|| format!("{what} is {a:?} and not {b:?}"))
    };
    told("schema", &found.schema, &wanted.schema)
        .or_else(|| told("program", &found.program, &wanted.program))
        .or_else(|| told("commit", &found.commit, &wanted.commit))
        .or_else(|| told("list of arguments", &found.arguments, &wanted.arguments))
        .or_else(|| told("base case", &found.base, &wanted.base))
        .or_else(|| told("machine", &found.machine, &wanted.machine))
        .or_else(|| told("device", &found.device, &wanted.device))
        .or_else(|| told("scene plan", &found.plans, &wanted.plans))
}
