//! The page of the stress suite: numbers of passed checks, failures with the commands that repeat them, pictures, and
//! all values.

use std::collections::BTreeMap;
use std::path::Path;

use super::html::{escape, number};
use super::pictures;
use super::tables::table;
use crate::stress::{Row, Stress};

/// Returns the page. `folder` is the suite's, for its pictures.
pub fn page(stress: &Stress, folder: &Path) -> String {
    let [passed, failed] = stress.counts();
    let device = stress.device.as_deref().unwrap_or("none: no pictures were drawn");
    let ended = stress.ended.as_deref().map(|why| ("Incomplete", why));
    let facts = [("Program", stress.program.as_str()), ("Device", device)].into_iter().chain(ended);
    let facts: String =
        facts.map(|(name, value)| format!("<div><dt>{name}</dt><dd>{}</dd></div>", escape(value))).collect();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <title>cuesta: stress suite</title><link rel=\"icon\" href=\"data:,\"><style>{}</style></head><body>\
         <header><h1>Stress suite</h1><dl>{facts}</dl></header>\
         <section><h2>{passed} checks passed, {failed} failed</h2>{}</section>\
         <section><h2>Failures</h2>{}</section>{}{}</body></html>\n",
        include_str!("page.css"),
        summary(stress),
        failures(stress),
        measured(stress, folder),
        every_row(stress)
    )
}

/// Returns a table of passed checks by technique and family.
fn summary(stress: &Stress) -> String {
    let mut counts: BTreeMap<&str, BTreeMap<&str, [usize; 2]>> = BTreeMap::new();
    let mut families: Vec<&str> = Vec::new();
    for row in stress.cases.iter().filter(|row| row.limit.is_some()) {
        // A technique with settings counts for the technique.
        let technique = row.technique.split(' ').next().unwrap_or_default();
        let [passed, all] = counts.entry(technique).or_default().entry(&row.family).or_default();
        *passed += usize::from(row.pass);
        *all += 1;
        if !families.contains(&row.family.as_str()) {
            families.push(&row.family);
        }
    }
    let columns: Vec<_> = std::iter::once("technique").chain(families.iter().copied()).map(String::from).collect();
    let cell = |of: &BTreeMap<&str, [usize; 2]>, family: &str| {
        of.get(family).map_or("–".to_string(), |[passed, all]| format!("{passed} of {all}"))
    };
    let row = |(technique, of): (&&str, &BTreeMap<&str, [usize; 2]>)| {
        std::iter::once(escape(technique)).chain(families.iter().map(|family| cell(of, family))).collect()
    };
    let rows: Vec<Vec<String>> = counts.iter().map(row).collect();
    table(&columns, &rows, &[])
}

/// Returns a table of the failed checks with the commands that repeat them.
fn failures(stress: &Stress) -> String {
    let failed: Vec<_> = stress.cases.iter().filter(|row| !row.pass).collect();
    if failed.is_empty() {
        return "<p>None.</p>".to_string();
    }
    let columns = ["case", "technique", "check", "value", "limit", "reason", "command"].map(String::from);
    let cells = |row: &&Row| {
        let case = format!("{}: {}", escape(&row.family), escape(&row.name));
        let command = format!("<code>{}</code>", escape(&row.repeat));
        let reason = escape(row.why.as_deref().unwrap_or_default());
        vec![case, escape(&row.technique), escape(&row.check), value(row.value), value(row.limit), reason, command]
    };
    table(&columns, &failed.iter().map(cells).collect::<Vec<_>>(), &[])
}

fn value(number_of: Option<f64>) -> String {
    number_of.map_or("–".to_string(), number)
}

/// Returns the pictures of measurements; empty if there are none.
fn measured(stress: &Stress, folder: &Path) -> String {
    let figure = |picture: &crate::stress::Picture| {
        let caption = escape(&picture.caption);
        let uri = pictures::data_uri(folder, &picture.file)?;
        Some(format!("<figure><img src=\"{uri}\" alt=\"{caption}\"><figcaption>{caption}</figcaption></figure>"))
    };
    let figures: String = stress.pictures.iter().filter_map(figure).collect();
    if figures.is_empty() {
        return String::new();
    }
    format!("<section><h2>Measurements</h2><div class=\"figures\">{figures}</div></section>")
}

/// Returns all rows, in one collapsed table per family.
fn every_row(stress: &Stress) -> String {
    let columns = ["case", "technique", "check", "value", "limit", "result"].map(String::from);
    let mut families: Vec<&str> = stress.cases.iter().map(|row| row.family.as_str()).collect();
    families.dedup();
    let of_family = |family: &&str| {
        let cells = |row: &Row| {
            let verdict = match (row.limit, row.pass) {
                (None, true) => "info",
                (_, true) => "pass",
                (_, false) => "fail",
            };
            let (name, technique, check) = (escape(&row.name), escape(&row.technique), escape(&row.check));
            vec![name, technique, check, value(row.value), value(row.limit), verdict.to_string()]
        };
        let rows: Vec<_> = stress.cases.iter().filter(|row| row.family == **family).map(cells).collect();
        format!(
            "<details><summary>{}: {} values</summary>{}</details>",
            escape(family),
            rows.len(),
            table(&columns, &rows, &[])
        )
    };
    let tables: String = families.iter().map(of_family).collect();
    format!("<section><h2>All values</h2>{tables}</section>")
}
