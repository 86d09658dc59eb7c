//! Published results of other terrain renderers, and the results of a benchmark to show beside them. Both the numbers
//! and the rules that select our cases come from `published.json`.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::html::number;
use crate::bench::results::{CaseResult, Results, TimeSummary, frame_ratio};
use crate::bench::statistics::Estimate;

/// One published table with rules for comparison.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    /// Authors, year and title.
    pub source: String,
    /// Table or section of the source.
    pub table: String,
    /// Meaning of the numbers.
    pub about: String,
    /// Machine, picture size, data and path of the measurement.
    pub conditions: String,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// Rows.
    pub rows: Vec<PublishedRow>,
}

/// One row of a published table.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PublishedRow {
    /// One cell per column, as published.
    pub cells: Vec<String>,
    /// Rules that select our cases to show beside the row. Each selects one case at most, unless it has `over`.
    #[serde(default)]
    pub ours: Vec<Rule>,
}

/// Conditions on a case to show beside a published row, and what to show of it. Conditions that are absent always hold.
/// Of several cases that meet all conditions, the fastest is shown.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Rule {
    /// `technique` or `technique:variant`. Without a variant, only the default form matches.
    technique: Option<String>,
    /// Settings that the case must have.
    settings: BTreeMap<String, String>,
    /// Tolerance, pixels.
    tolerance_px: Option<f64>,
    /// Name of the terrain.
    terrain: Option<String>,
    /// Samples along each side of the terrain.
    side: Option<u32>,
    /// Name of the camera path.
    path: Option<String>,
    /// Largest 99th percentile of the other renderers' error metric, pixels.
    peers_p99_px: Option<f64>,
    /// Name of a statistic of the technique to show too.
    figure: Option<String>,
    /// Show only the selection time on the host, of the case with the fastest selection.
    selection: bool,
    /// Show the speed of all matching cases relative to cases of this rule, at the same tolerance in the same scene.
    over: Option<Box<Rule>>,
}

/// Returns all published tables.
pub fn tables() -> Vec<Published> {
    serde_json::from_str(include_str!("published.json")).expect("the published figures are checked by a test")
}

impl Rule {
    /// Returns true if a case meets all conditions.
    fn allows(&self, result: &CaseResult) -> bool {
        let case = &result.case;
        let peers = result.errors.as_ref().and_then(|errors| errors.peers_px);
        self.technique.as_deref().is_none_or(|name| name == case.technique)
            && self.settings.iter().all(|(key, value)| case.settings.get(key) == Some(value))
            && case.goal.is_none()
            && self.tolerance_px.is_none_or(|px| px == case.tolerance_px)
            && self.terrain.as_deref().is_none_or(|name| name == case.terrain.name)
            && self.side.is_none_or(|side| case.terrain.size == [side; 2])
            && self.path.as_deref().is_none_or(|path| path == case.path)
            && self.peers_p99_px.is_none_or(|px| peers.is_some_and(|peers| peers.p99 <= px))
    }

    /// Describes the selected cases; `None` if no case was timed that meets the conditions.
    pub fn ours(&self, results: &Results) -> Option<String> {
        match &self.over {
            Some(other) => self.speed_ups(other, results),
            None if self.selection => self.fastest_selection(results),
            None => self.fastest(results),
        }
    }

    /// Describes the speed of each case relative to the case of `other` with the same tolerance, metric and scene.
    fn speed_ups(&self, other: &Rule, results: &Results) -> Option<String> {
        let speed_up = |result: &CaseResult| {
            let same = |slow: &&CaseResult| {
                let (a, b) = (&slow.case, &result.case);
                a.tolerance_px == b.tolerance_px && a.metric == b.metric && a.scene() == b.scene()
            };
            let slow = results.cases.iter().filter(|slow| other.allows(slow)).find(same)?;
            let Estimate { value, low, high } = frame_ratio(slow, result)?;
            let [value, low, high] = [value, low, high].map(number);
            let (tolerance, fast, slow) = (number(result.case.tolerance_px), result.case.series(), slow.case.series());
            Some(format!("{fast} against {slow}, {tolerance} px: {value} times as fast ({low}–{high})"))
        };
        let found: Vec<_> = results.cases.iter().filter(|result| self.allows(result)).filter_map(speed_up).collect();
        (!found.is_empty()).then(|| found.join("\n"))
    }

    /// Returns the timed cases that meet the conditions.
    fn timed<'a>(&self, results: &'a Results) -> impl Iterator<Item = (&'a CaseResult, &'a TimeSummary)> {
        results.cases.iter().filter(|result| self.allows(result)).filter_map(|r| Some((r, r.time.as_ref()?)))
    }

    /// Describes the case with the shortest selection time.
    fn fastest_selection(&self, results: &Results) -> Option<String> {
        let (result, time) = self.timed(results).min_by(|a, b| a.1.select_ms.total_cmp(&b.1.select_ms))?;
        let [series, px] = [result.case.series(), number(result.case.tolerance_px)];
        let [ms, triangles] = [number(time.select_ms), number(time.triangles)];
        let [often, rate] =
            [1000.0, time.triangles * 1000.0].map(|n| number(n / time.select_ms.max(f64::MIN_POSITIVE)));
        Some(format!(
            "{series} {px} px: {ms} ms of selection ({often} per second), {triangles} triangles ({rate} per second)"
        ))
    }

    /// Describes the case with the shortest frame time.
    fn fastest(&self, results: &Results) -> Option<String> {
        let timed = self.timed(results);
        let timed = timed.filter(|(_, time)| self.figure.as_ref().is_none_or(|name| time.stats.contains_key(name)));
        let (result, time) = timed.min_by(|a, b| a.1.frame_ms.value.total_cmp(&b.1.frame_ms.value))?;
        let figure =
            self.figure.as_ref().map_or(String::new(), |name| format!("; {name}: {}", number(time.stats[name])));
        let frame_ms = time.frame_ms.value;
        let peers = result.errors.as_ref().and_then(|errors| errors.peers_px);
        let error = peers.map_or(String::new(), |p| {
            format!("; their error metric: mean {}, p99 {} px", number(p.mean), number(p.p99))
        });
        Some(format!(
            "{} {} px: {} ms ({} fps), {} triangles ({} per second), {} draws{error}{figure}",
            result.case.series(),
            number(result.case.tolerance_px),
            number(frame_ms),
            number(1000.0 / frame_ms),
            number(time.triangles),
            number(time.triangles * 1000.0 / frame_ms),
            number(time.draws)
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_table_is_complete_and_names_its_source() {
        let tables = tables();
        assert!(tables.len() >= 8);
        for table in &tables {
            for text in [&table.source, &table.table, &table.about, &table.conditions] {
                assert!(!text.is_empty(), "{table:?}");
            }
            assert!(table.rows.iter().all(|row| row.cells.len() == table.columns.len()), "{}", table.table);
        }
    }
}
