//! The tables of the page. Every cell says which column it is in, so that a narrow window can stack them.

use std::fmt::Write;

use super::html::{escape, number};
use super::published;
use crate::bench::results::{CaseResult, Results};
use crate::bench::rows::{Decision, Plan};
use crate::bench::statistics::Estimate;

/// A table whose cells are HTML already.
fn table(columns: &[String], rows: &[Vec<String>], series: &[Option<String>]) -> String {
    let mut html = String::from("<table><thead><tr>");
    columns.iter().for_each(|column| html += &format!("<th scope=\"col\">{}</th>", escape(column)));
    html += "</tr></thead><tbody>";
    for (k, row) in rows.iter().enumerate() {
        let of = series.get(k).and_then(Option::as_ref);
        let of = of.map_or(String::new(), |name| format!(" data-series=\"{}\"", escape(name)));
        let _ = write!(html, "<tr{of}>");
        for (cell, column) in row.iter().zip(columns) {
            let _ = write!(html, "<td data-label=\"{}\">{cell}</td>", escape(column));
        }
        html += "</tr>";
    }
    html + "</tbody></table>"
}

fn estimate(e: &Estimate) -> String {
    format!("{} <small>{}–{}</small>", number(e.value), number(e.low), number(e.high))
}

/// What a case gave that was not measured.
const ABSENT: &str = "–";

fn or_absent(value: Option<String>) -> String {
    value.unwrap_or_else(|| ABSENT.to_string())
}

/// The cases of one scene.
pub fn cases(results: &Results, scene: &str) -> String {
    let cases: Vec<&CaseResult> = results.cases.iter().filter(|result| result.case.scene() == scene).collect();
    let over = format!("over {}", results.header.base);
    let columns = [
        "technique",
        "tolerance, px",
        "frame, ms",
        &over,
        "over floor",
        "p95 / p99 / max, ms",
        "hitches, %",
        "triangles",
        "near-optimal ×",
        "error px, max",
        "99.9 %",
        "silhouette",
        "frames kept, %",
        "pop p99, px",
        "FLIP",
        "holes, px",
        "watertight",
    ]
    .map(str::to_string);
    let rows: Vec<Vec<String>> = cases.iter().map(|result| case(result)).collect();
    let series: Vec<_> = cases.iter().map(|result| Some(result.case.series())).collect();
    // A column in which no case has anything says nothing.
    let kept: Vec<usize> = (0..columns.len()).filter(|&k| rows.iter().any(|row| row[k] != ABSENT)).collect();
    let columns: Vec<String> = kept.iter().map(|&k| columns[k].clone()).collect();
    let rows: Vec<Vec<String>> = rows.iter().map(|row| kept.iter().map(|&k| row[k].clone()).collect()).collect();
    table(&columns, &rows, &series)
}

fn case(result: &CaseResult) -> Vec<String> {
    let (time, errors) = (result.time.as_ref(), result.errors.as_ref());
    let of_time =
        |value: &dyn Fn(&crate::bench::results::TimeSummary) -> Option<String>| or_absent(time.and_then(value));
    let of_errors = |value: &dyn Fn(&crate::bench::Errors) -> Option<String>| or_absent(errors.and_then(value));
    vec![
        escape(&result.case.series()),
        number(result.case.tolerance_px),
        of_time(&|t| Some(estimate(&t.frame_ms))),
        of_time(&|t| t.over_base.as_ref().map(estimate)),
        of_time(&|t| t.over_floor.as_ref().map(estimate)),
        of_time(&|t| Some([t.frame_p95_ms, t.frame_p99_ms, t.frame_max_ms].map(number).join(" / "))),
        of_time(&|t| Some(number(t.hitches_percent))),
        of_time(&|t| Some(number(t.triangles))),
        of_errors(&|e| e.reference.and_then(|r| r.multiple).map(number)),
        of_errors(&|e| Some(number(e.error_px.max))),
        of_errors(&|e| Some(number(e.error_px.p999))),
        of_errors(&|e| e.silhouette_px.map(|s| number(s.max))),
        of_errors(&|e| e.within.map(|w| number(100.0 * w.frames))),
        of_errors(&|e| e.pop.as_ref().map(|p| number(p.p99_px))),
        of_errors(&|e| e.image.map(|i| number(i.flip))),
        of_errors(&|e| e.hole_pixels.map(|n| n.to_string())),
        of_errors(&|e| e.watertight.map(|is| if is { "yes" } else { "<strong>no</strong>" }.to_string())),
    ]
}

/// Each published table with ours beside it.
pub fn published(results: &Results) -> String {
    let mut html = String::new();
    for published in published::tables() {
        let columns: Vec<String> = published.columns.iter().cloned().chain(["here".to_string()]).collect();
        let row = |row: &published::PublishedRow| {
            let ours = match &row.ours {
                None => "<span class=\"absent\">nothing of ours compares</span>".to_string(),
                Some(rule) => rule.ours(results).map_or_else(
                    || "<span class=\"absent\">not in this run</span>".to_string(),
                    |ours| format!("<strong>{}</strong>", escape(&ours)),
                ),
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

/// What each scene needed, and what was left out.
pub fn plans(plans: &[Plan]) -> String {
    if plans.is_empty() {
        return "<p class=\"absent\">These rows say nothing of it.</p>".to_string();
    }
    let list = |decisions: &[Decision]| {
        let row = |d: &Decision| {
            let bytes = if d.bytes > 0 { format!("{} B", number(d.bytes as f64)) } else { ABSENT.to_string() };
            vec![escape(&d.feature), escape(&d.reason), bytes]
        };
        let columns = ["feature", "because", "bytes"].map(str::to_string);
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
