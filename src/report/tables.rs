//! The tables of the page. Each cell carries the name of its column, which narrow windows show beside it.

use std::fmt::Write;

use super::html::{escape, number};
use super::published;
use crate::bench::results::{CaseResult, Results};
use crate::bench::rows::{Decision, Plan};
use crate::bench::statistics::Estimate;

/// Returns a table. Cells are HTML, column names plain text. `series` has the series of each row, if the page's
/// controls hide rows.
pub fn table(columns: &[String], rows: &[Vec<String>], series: &[Option<String>]) -> String {
    let mut html = String::from("<table><thead><tr>");
    columns.iter().for_each(|column| html += &format!("<th scope=\"col\">{}</th>", escape(column)));
    html += "</tr></thead><tbody>";
    for (k, row) in rows.iter().enumerate() {
        let of = series.get(k).and_then(Option::as_ref);
        let of = of.map_or(String::new(), |name| format!(" data-series=\"{}\"", escape(name)));
        let _ = write!(html, "<tr{of}>");
        for (cell, column) in row.iter().zip(columns) {
            let _ = write!(html, "<td data-label=\"{}\"><span>{cell}</span></td>", escape(column));
        }
        html += "</tr>";
    }
    html + "</tbody></table>"
}

/// Formats an estimate with its interval.
fn estimate(e: &Estimate) -> String {
    format!("{} <small>{}–{}</small>", number(e.value), number(e.low), number(e.high))
}

/// Text of a cell without a value.
const ABSENT: &str = "–";

/// A column: its name, and the function that formats the value of a case.
type Column = (&'static str, fn(&CaseResult) -> Option<String>);

/// Formats the fragment shader invocations per covered pixel, and the fragments per covered pixel that pass the depth
/// test.
fn overdraw(result: &CaseResult) -> Option<String> {
    let economy = result.errors.as_ref()?.economy.as_ref()?;
    let passed = economy.passed.map(|passed| format!(" <small>{} pass</small>", number(passed)));
    Some(number(economy.overdraw?) + &passed.unwrap_or_default())
}

/// Columns of times and costs.
const TIMES: &[Column] = &[
    ("frame, ms", |r| r.time.as_ref().map(|t| estimate(&t.frame_ms))),
    ("× base", |r| r.time.as_ref()?.over_base.as_ref().map(estimate)),
    ("× shading only", |r| r.time.as_ref()?.over_shading_only.as_ref().map(estimate)),
    ("CPU, ms", |r| r.time.as_ref().map(|t| estimate(&t.cpu_ms))),
    ("CPU × base", |r| r.time.as_ref()?.cpu_over_base.as_ref().map(estimate)),
    ("p95, ms", |r| r.time.as_ref().map(|t| number(t.frame_p95_ms))),
    ("p99, ms", |r| r.time.as_ref().map(|t| number(t.frame_p99_ms))),
    ("max, ms", |r| r.time.as_ref().map(|t| number(t.frame_max_ms))),
    ("hitches, %", |r| r.time.as_ref().map(|t| number(t.hitches_percent))),
    ("triangles", |r| r.time.as_ref().map(|t| number(t.triangles))),
    ("near-optimal ×", |r| r.errors.as_ref()?.reference?.multiple.map(number)),
    ("hidden, %", |r| Some(number(100.0 * r.errors.as_ref()?.economy.as_ref()?.hidden_share))),
    ("below 1 px², %", |r| Some(number(100.0 * r.errors.as_ref()?.economy.as_ref()?.subpixel_share))),
    ("overdraw", overdraw),
    ("goal met, %", |r| r.time.as_ref()?.budget.map(|h| number(100.0 * h.settled))),
    ("mean tolerance, px", |r| r.time.as_ref()?.budget.map(|h| number(h.tolerance_px.mean))),
    ("draws", |r| r.time.as_ref().map(|t| number(t.draws))),
    ("device bytes", |r| r.time.as_ref().map(|t| number(t.device_bytes as f64))),
];

/// Columns of errors.
const ERRORS: &[Column] = &[
    ("max, px", |r| r.errors.as_ref().map(|e| number(e.error_px.max))),
    ("p99.9, px", |r| r.errors.as_ref().map(|e| number(e.error_px.p999))),
    ("rms, px", |r| r.errors.as_ref().map(|e| number(e.error_px.rms))),
    ("max, m", |r| r.errors.as_ref().map(|e| number(e.error_m.max))),
    ("outline max, px", |r| r.errors.as_ref()?.silhouette_px.map(|s| number(s.max))),
    ("frames within, %", |r| r.errors.as_ref()?.within.map(|w| number(100.0 * w.frames))),
    ("samples within, %", |r| r.errors.as_ref()?.within.map(|w| number(100.0 * w.samples))),
    ("pop p99, px", |r| r.errors.as_ref()?.pop.as_ref().map(|p| number(p.p99_px))),
    ("pop p99.9, px", |r| r.errors.as_ref()?.pop.as_ref().map(|p| number(p.p999_px))),
    ("FLIP", |r| r.errors.as_ref()?.image.map(|i| number(i.flip))),
    ("SSIM", |r| r.errors.as_ref()?.image.map(|i| number(i.ssim))),
    ("hole pixels", |r| r.errors.as_ref()?.hole_pixels.map(|n| n.to_string())),
    ("skirt pixels", |r| r.errors.as_ref()?.skirt_pixels.map(|n| n.to_string())),
    ("frames pending", |r| r.errors.as_ref()?.pending.filter(|w| w.frames > 0).map(|w| w.frames.to_string())),
    ("pixels beyond", |r| r.errors.as_ref()?.pending.filter(|w| w.frames > 0).map(|w| w.pixels.to_string())),
    ("excess, px", |r| r.errors.as_ref()?.pending.filter(|w| w.frames > 0).map(|w| number(w.excess_px))),
    ("watertight", |r| r.errors.as_ref()?.watertight.map(|is| if is { "yes" } else { "<b>no</b>" }.to_string())),
];

/// Returns the tables of times and errors of all cases of a scene.
pub fn cases(results: &Results, scene: &str) -> String {
    let cases: Vec<&CaseResult> = results.cases.iter().filter(|result| result.case.scene() == scene).collect();
    let base = escape(&results.header.base);
    format!(
        "<h3>Times and costs</h3><p class=\"conditions\">× base: divided by the time of {base}, at the same tolerance \
         where it was measured. CPU: selection and recording. Small print: bootstrap 95 % intervals; for overdraw, the \
         fragments per covered pixel that pass the depth test.</p>{}\
         <h3>Errors</h3><p class=\"conditions\">Pending: frames with data that is not on the device yet; in these, the \
         pixels beyond the tolerance, and the largest excess.</p>{}",
        of_cases(&cases, TIMES),
        of_cases(&cases, ERRORS)
    )
}

/// Returns a table with one row per case. Columns without any value are left out.
fn of_cases(cases: &[&CaseResult], columns: &[Column]) -> String {
    let has = |column: &&Column| cases.iter().any(|case| column.1(case).is_some());
    let columns: Vec<&Column> = columns.iter().filter(has).collect();
    if columns.is_empty() {
        return "<p class=\"absent\">Not measured in this run.</p>".to_string();
    }
    let row = |case: &&CaseResult| {
        let name = format!("{}, {} px", escape(&case.case.series()), number(case.case.tolerance_px));
        let cells = columns.iter().map(|column| column.1(case).unwrap_or_else(|| ABSENT.to_string()));
        std::iter::once(name).chain(cells).collect()
    };
    let rows: Vec<Vec<String>> = cases.iter().map(row).collect();
    let names: Vec<String> = std::iter::once("case").chain(columns.iter().map(|c| c.0)).map(str::to_string).collect();
    let series: Vec<_> = cases.iter().map(|case| Some(case.case.series())).collect();
    table(&names, &rows, &series)
}

/// Returns the published tables with our results in an additional column.
pub fn published(results: &Results) -> String {
    let mut html = String::new();
    for published in published::tables() {
        let columns: Vec<String> = published.columns.iter().cloned().chain(["this run".to_string()]).collect();
        let row = |row: &published::PublishedRow| {
            let found: Vec<_> = row.ours.iter().filter_map(|rule| rule.ours(results)).collect();
            let ours = match found[..] {
                [] if row.ours.is_empty() => "<span class=\"absent\">no comparable case</span>".to_string(),
                [] => "<span class=\"absent\">not in this run</span>".to_string(),
                _ => format!("<strong>{}</strong>", escape(&found.join("\n")).replace('\n', "<br>")),
            };
            row.cells.iter().map(|cell| escape(cell)).chain([ours]).collect()
        };
        let rows: Vec<Vec<String>> = published.rows.iter().map(row).collect();
        let _ = write!(
            html,
            "<article><h3>{}</h3><p><b>{}</b>: {}. <span class=\"conditions\">{}.</span></p>{}</article>",
            escape(&published.source),
            escape(&published.table),
            escape(&published.about),
            escape(&published.conditions),
            table(&columns, &rows, &[])
        );
    }
    html
}

/// Returns the features that each terrain's scene keeps and leaves out, with their device memory.
pub fn plans(plans: &[Plan]) -> String {
    if plans.is_empty() {
        return "<p class=\"absent\">The rows have no scene plans.</p>".to_string();
    }
    let list = |decisions: &[Decision]| {
        let row = |d: &Decision| {
            let bytes = if d.bytes > 0 { format!("{} B", number(d.bytes as f64)) } else { ABSENT.to_string() };
            vec![escape(&d.feature), escape(&d.reason), bytes]
        };
        let columns = ["feature", "reason", "bytes"].map(str::to_string);
        table(&columns, &decisions.iter().map(row).collect::<Vec<_>>(), &[])
    };
    let plan = |plan: &Plan| {
        format!(
            "<details><summary>{}: {} kept, {} left out</summary><h4>Left out</h4>{}<h4>Kept</h4>{}</details>",
            escape(&plan.terrain),
            plan.kept.len(),
            plan.left_out.len(),
            list(&plan.left_out),
            list(&plan.kept)
        )
    };
    plans.iter().map(plan).collect()
}
