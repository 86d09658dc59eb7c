//! The files `results.json` and `results.csv`: a summary of each case's rows.

use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};

use anyhow::{Context, Result};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::goal::BudgetStats;
use super::journal;
use super::rows::{Case, Errors, Header, Row, SCHEMA, Times, unscaled};
use super::statistics::{Estimate, middle};
use crate::height::save::replace;
use crate::measure::extended::{self, Extended};
use crate::renamed;

/// Name of the file with all results.
pub const RESULTS: &str = "results.json";
/// Name of the table with one line per case.
pub const TABLE: &str = "results.csv";

/// Results of a benchmark run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Results {
    /// Version of the format.
    #[schemars(extend("const" = SCHEMA))]
    pub schema: u32,
    /// Properties that all cases share.
    pub header: Header,
    /// The cases in the order of their first rows.
    pub cases: Vec<CaseResult>,
}

/// Times and errors of one case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct CaseResult {
    /// The case.
    pub case: Case,
    /// Summary of all rounds; `null` if the case was not timed.
    pub time: Option<TimeSummary>,
    /// Errors; `null` if not measured.
    pub errors: Option<Errors>,
    /// Times of each round.
    pub rounds: Vec<Times>,
}

/// Summary of the rounds of one case. Values are medians over the rounds unless stated otherwise.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = extended::non_negative)]
pub struct TimeSummary {
    /// Median frame time, milliseconds, with its bootstrap 95 % interval.
    pub frame_ms: Estimate,
    /// 95th percentile of the frame times, milliseconds.
    pub frame_p95_ms: f64,
    /// 99th percentile of the frame times, milliseconds.
    pub frame_p99_ms: f64,
    /// Longest frame time of a round, milliseconds.
    pub frame_max_ms: f64,
    /// Median selection time, milliseconds.
    pub select_ms: f64,
    /// Median recording time, milliseconds.
    pub record_ms: f64,
    /// Median device time, milliseconds.
    pub gpu_ms: Option<f64>,
    /// Median time of writing data for the device and recording its uploads, milliseconds.
    pub upload_ms: Option<f64>,
    /// Median frame time of the shading-only baseline, milliseconds.
    pub shading_only_ms: Option<f64>,
    /// Median frame time divided by that of the shading-only baseline, round by round.
    pub over_shading_only: Option<Estimate>,
    /// Median frame time divided by that of the base technique in the same scene, round by round. The base case has the
    /// same tolerance, metric and settings where one exists.
    pub over_base: Option<Estimate>,
    /// Median selection time plus median recording time, milliseconds.
    pub cpu_ms: Estimate,
    /// `cpu_ms` divided by that of the base case, round by round.
    pub cpu_over_base: Option<Estimate>,
    /// Share of frames longer than twice their round's median, all rounds together, percent.
    pub hitches_percent: f64,
    /// Mean triangles per frame.
    pub triangles: f64,
    /// Mean draws per frame.
    pub draws: f64,
    /// Mean draw commands per frame.
    pub commands: f64,
    /// Largest factor in any round by which a frame's tolerance was scaled so that its list fits the buffers. 1 if all
    /// lists fitted.
    #[serde(with = "extended", default = "unscaled")]
    #[schemars(with = "Extended", extend("minimum" = 1))]
    pub tolerance_scale: f64,
    /// Deviation of the frames from the case's goal; `null` without a goal.
    #[serde(default)]
    pub budget: Option<BudgetStats>,
    /// Device memory in use, all purposes together, bytes: the largest of any round.
    pub device_bytes: u64,
    /// Statistics of the technique after the last round, by name.
    #[serde(default)]
    pub stats: BTreeMap<String, f64>,
}

impl Results {
    /// Summarises rows. Of several rows for one case and round only the first counts.
    pub fn of(header: Header, rows: &[Row]) -> Self {
        let mut cases: Vec<CaseResult> = Vec::new();
        for row in rows {
            match row {
                Row::Header(_) => {}
                Row::Time(row) => {
                    let result = entry(&mut cases, &row.case);
                    if result.rounds.iter().all(|round| round.round != row.times.round) {
                        result.rounds.push(row.times.clone());
                    }
                }
                Row::Error(row) => {
                    entry(&mut cases, &row.case).errors.get_or_insert_with(|| row.errors.clone());
                }
            }
        }
        let summaries: Vec<_> = cases.iter().map(|case| summary(case, base_of(case, &cases, &header.base))).collect();
        for (case, summary) in cases.iter_mut().zip(summaries) {
            case.time = summary;
        }
        Self { schema: SCHEMA, header, cases }
    }

    /// Reads and summarises the rows of a benchmark's folder.
    ///
    /// # Errors
    /// As [`journal::read`].
    pub fn read(folder: &Path) -> Result<Self> {
        let (header, rows) = journal::read(folder)?;
        Ok(Self::of(header, &rows))
    }
}

impl CaseResult {
    /// Returns true if the proof of watertightness failed in a frame, or the sky showed through terrain.
    pub fn is_torn(&self) -> bool {
        self.errors.as_ref().is_some_and(|e| e.watertight == Some(false) || e.hole_pixels.is_some_and(|n| n > 0))
    }
}

/// Returns the result of a case, which is added if it is new.
fn entry<'a>(cases: &'a mut Vec<CaseResult>, case: &Case) -> &'a mut CaseResult {
    let at = cases.iter().position(|result| result.case == *case).unwrap_or_else(|| {
        cases.push(CaseResult { case: case.clone(), time: None, errors: None, rounds: Vec::new() });
        cases.len() - 1
    });
    &mut cases[at]
}

/// Returns the case of the base technique that is most like a case of the same scene. Equal goals count most, then
/// tolerance, metric and settings.
fn base_of<'a>(of: &CaseResult, cases: &'a [CaseResult], base: &str) -> Option<&'a CaseResult> {
    let of = &of.case;
    let unlike = |case: &Case| {
        let is_other = (case.tolerance_px != of.tolerance_px, case.metric != of.metric, case.settings != of.settings);
        (case.goal != of.goal, is_other)
    };
    let all = cases.iter().filter(|result| result.case.technique == base && result.case.scene() == of.scene());
    all.min_by_key(|result| unlike(&result.case))
}

/// Summarises the rounds of a case; `None` without rounds.
fn summary(result: &CaseResult, base: Option<&CaseResult>) -> Option<TimeSummary> {
    let rounds = &result.rounds;
    if rounds.is_empty() {
        return None;
    }
    let over = |of: fn(&Times) -> f64| middle(rounds.iter().map(of));
    let measured = |of: fn(&Times) -> Option<f64>| -> Option<f64> {
        rounds.iter().map(of).collect::<Option<Vec<_>>>().map(middle)
    };
    let over_base = |cost: Cost| {
        let ratios = base.map(|base| pairs(rounds, &base.rounds, cost)).unwrap_or_default();
        (!ratios.is_empty()).then(|| Estimate::median(&ratios))
    };
    let median = |cost: Cost| Estimate::median(&rounds.iter().map(cost).collect::<Vec<_>>());
    let shading_only: Option<Vec<f64>> =
        rounds.iter().map(|r| r.shading_only_ms.map(|shading_only| r.frame_ms.p50 / shading_only.p50)).collect();
    // Files may be edited by hand: absurd numbers must not overflow.
    let frames = rounds.len().saturating_mul(result.case.frames).max(1);
    Some(TimeSummary {
        frame_ms: median(frame_ms),
        frame_p95_ms: over(|r| r.frame_ms.p95),
        frame_p99_ms: over(|r| r.frame_ms.p99),
        frame_max_ms: over(|r| r.frame_ms.max),
        select_ms: over(|r| r.select_ms.p50),
        record_ms: over(|r| r.record_ms.p50),
        gpu_ms: measured(|r| r.gpu_ms.map(|p| p.p50)),
        upload_ms: measured(|r| r.upload_ms.map(|p| p.p50)),
        shading_only_ms: measured(|r| r.shading_only_ms.map(|p| p.p50)),
        over_shading_only: shading_only.map(|ratios| Estimate::median(&ratios)),
        over_base: over_base(frame_ms),
        cpu_ms: median(cpu_ms),
        cpu_over_base: over_base(cpu_ms),
        hitches_percent: 100.0 * rounds.iter().map(|r| r.hitches as f64).sum::<f64>() / frames as f64,
        triangles: over(|r| r.triangles.mean),
        draws: over(|r| r.draws.mean),
        commands: over(|r| r.commands.mean),
        tolerance_scale: rounds.iter().map(|r| r.tolerance_scale).fold(1.0, f64::max),
        budget: BudgetStats::median(&rounds.iter().filter_map(|r| r.budget).collect::<Vec<_>>()),
        device_bytes: rounds.iter().map(device_bytes).max().unwrap_or(0),
        stats: rounds.last().map(|r| r.stats.clone()).unwrap_or_default(),
    })
}

/// Returns the device memory of a round, bytes, without overflow.
fn device_bytes(round: &Times) -> u64 {
    round.device_bytes.values().fold(0, |all, bytes| all.saturating_add(*bytes))
}

/// Accessor of a round's time, milliseconds.
type Cost = fn(&Times) -> f64;

fn frame_ms(round: &Times) -> f64 {
    round.frame_ms.p50
}

fn cpu_ms(round: &Times) -> f64 {
    round.select_ms.p50 + round.record_ms.p50
}

/// Returns a time divided by that of `base`, for each round that both have.
fn pairs(rounds: &[Times], base: &[Times], cost: Cost) -> Vec<f64> {
    let partner = |round: usize| base.iter().find(|other| other.round == round);
    rounds.iter().filter_map(|r| partner(r.round).map(|other| cost(r) / cost(other))).collect()
}

/// Returns the median frame time of one case divided by that of another, round by round; `None` if they have no round
/// in common.
pub fn frame_ratio(of: &CaseResult, over: &CaseResult) -> Option<Estimate> {
    let ratios = pairs(&of.rounds, &over.rounds, frame_ms);
    (!ratios.is_empty()).then(|| Estimate::median(&ratios))
}

/// Writes both files from the rows of a benchmark's folder. Returns the path of `results.json`.
///
/// # Errors
/// If the rows cannot be read or a file cannot be written.
pub fn write(folder: &Path) -> Result<PathBuf> {
    let results = Results::read(folder)?;
    let path = folder.join(RESULTS);
    let mut value = serde_json::to_value(&results)?;
    renamed::add_former_names(&mut value);
    let text = serde_json::to_string_pretty(&value)? + "\n";
    save(&path, text.as_bytes())?;
    save(&folder.join(TABLE), &table(&results)?)?;
    Ok(path)
}

/// Writes a file. If that fails, an existing file of this name is unchanged.
///
/// # Errors
/// If the file cannot be written.
pub fn save(path: &Path, bytes: &[u8]) -> Result<()> {
    replace(path, |out| out.write_all(bytes)).with_context(|| path.display().to_string())
}

/// Returns the table as CSV: one line per case, one column per value, named by its path in `results.json`.
fn table(results: &Results) -> Result<Vec<u8>> {
    let mut lines: Vec<Vec<(String, String)>> = Vec::new();
    let mut columns: Vec<String> = Vec::new();
    for result in &results.cases {
        let mut cells = Vec::new();
        flatten("", &serde_json::to_value(CaseResult { rounds: Vec::new(), ..result.clone() })?, &mut cells);
        for (name, _) in &cells {
            if !columns.contains(name) {
                columns.push(name.clone());
            }
        }
        lines.push(cells);
    }
    let mut writer = csv::Writer::from_writer(Vec::new());
    writer.write_record(&columns)?;
    for cells in lines {
        let cell = |column: &String| cells.iter().find(|(name, _)| name == column).map_or("", |(_, value)| value);
        writer.write_record(columns.iter().map(cell))?;
    }
    Ok(writer.into_inner()?)
}

/// Collects the values of a JSON document by their path. Lists of anything but numbers are left out.
fn flatten(path: &str, value: &Value, cells: &mut Vec<(String, String)>) {
    let below = |name: &str| if path.is_empty() { name.to_string() } else { format!("{path}.{name}") };
    match value {
        Value::Object(fields) => fields.iter().for_each(|(name, value)| flatten(&below(name), value, cells)),
        Value::Array(items) if items.iter().all(Value::is_number) => {
            items.iter().enumerate().for_each(|(k, item)| flatten(&below(&k.to_string()), item, cells));
        }
        Value::Array(_) | Value::Null => {}
        Value::String(text) => cells.push((path.to_string(), text.clone())),
        other => cells.push((path.to_string(), other.to_string())),
    }
}
