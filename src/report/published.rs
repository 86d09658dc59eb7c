//! Figures that others published, and the best of ours to stand beside each: all of them facts of one data file.

use std::collections::BTreeMap;

use serde::Deserialize;

use super::html::number;
use crate::bench::results::{CaseResult, Results, TimeSummary, frame_ratio};
use crate::bench::statistics::Estimate;

/// One published table.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Published {
    /// Authors, year and title.
    pub source: String,
    /// Table or section.
    pub table: String,
    /// Meaning of its numbers.
    pub about: String,
    /// Machine, picture, data, path.
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
    /// As published.
    pub cells: Vec<String>,
    /// Cases compared with it.
    #[serde(default)]
    pub ours: Vec<Rule>,
}

/// Conditions on a case to be compared with a published row; of several, the fastest is.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Rule {
    /// With its variant; without one, its default form.
    technique: Option<String>,
    settings: BTreeMap<String, String>,
    tolerance_px: Option<f64>,
    terrain: Option<String>,
    side: Option<u32>,
    path: Option<String>,
    /// Most that the 99th percentile of the peers' metric may be, pixels.
    peers_p99_px: Option<f64>,
    /// Also show this statistic of the technique.
    figure: Option<String>,
    /// Compare the selection time alone, on the host; of several cases, that of the fastest selection.
    selection: bool,
    /// Compare the speed relative to a case of this rule, at the same tolerance in the same scene.
    over: Option<Box<Rule>>,
}

/// Every published table.
pub fn tables() -> Vec<Published> {
    serde_json::from_str(include_str!("published.json")).expect("the published figures are checked by a test")
}

impl Rule {
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

    /// Ours in words; `None` if no such case was run.
    pub fn ours(&self, results: &Results) -> Option<String> {
        match &self.over {
            Some(other) => self.speed_ups(other, results),
            None if self.selection => self.fastest_selection(results),
            None => self.fastest(results),
        }
    }

    /// Returns the speed of the cases relative to those of the other rule, one by one.
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

    /// The cases that were timed.
    fn timed<'a>(&self, results: &'a Results) -> impl Iterator<Item = (&'a CaseResult, &'a TimeSummary)> {
        results.cases.iter().filter(|result| self.allows(result)).filter_map(|r| Some((r, r.time.as_ref()?)))
    }

    fn fastest_selection(&self, results: &Results) -> Option<String> {
        let (result, time) = self.timed(results).min_by(|a, b| a.1.select_ms.total_cmp(&b.1.select_ms))?;
        let [series, px] = [result.case.series(), number(result.case.tolerance_px)];
        let [ms, triangles] = [number(time.select_ms), number(time.triangles)];
        let [often, rate] =
            [1000.0, time.triangles * 1000.0].map(|n| number(n / time.select_ms.max(f64::MIN_POSITIVE)));
        Some(format!(
            "{series} {px} px: {ms} ms of selection ({often} a second), {triangles} triangles ({rate} a second)"
        ))
    }

    fn fastest(&self, results: &Results) -> Option<String> {
        let timed = self.timed(results);
        let timed = timed.filter(|(_, time)| self.figure.as_ref().is_none_or(|name| time.stats.contains_key(name)));
        let (result, time) = timed.min_by(|a, b| a.1.frame_ms.value.total_cmp(&b.1.frame_ms.value))?;
        let figure =
            self.figure.as_ref().map_or(String::new(), |name| format!("; {name}: {}", number(time.stats[name])));
        let frame_ms = time.frame_ms.value;
        let peers = result.errors.as_ref().and_then(|errors| errors.peers_px);
        let error = peers
            .map_or(String::new(), |p| format!("; peers' metric mean {}, p99 {} px", number(p.mean), number(p.p99)));
        Some(format!(
            "{} {} px: {} ms ({} fps), {} triangles ({} a second), {} draws{error}{figure}",
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
    fn every_table_is_whole_and_says_where_it_is_from() {
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
