//! The page of a benchmark: one HTML file without external resources.
//!
//! Without JavaScript it shows everything. The script adds tooltips, and controls for techniques, scenes and linear
//! axes.

use std::fmt::Write;
use std::path::Path;

use super::bars;
use super::chart::{COLOURS, Chart, Form, swatch};
use super::figures::{Figures, SceneFigures};
use super::html::{escape, number, slug};
use super::{pictures, tables};
use crate::bench::results::{CaseResult, Results};

/// Colours of the series on a dark background.
const DARK: [&str; 7] = ["#4aa8e8", "#ff8a3d", "#2fc99a", "#e79bc6", "#8fd0f5", "#f0b93a", "#b5b5b5"];

/// Returns the page. `folder` is the benchmark's, for its pictures.
pub fn page(results: &Results, figures: &Figures, folder: &Path) -> String {
    let mut body = head(results);
    body += &controls(figures);
    for scene in &figures.scenes {
        body += &section(results, scene, folder);
    }
    let _ = write!(
        body,
        "<section><h2>Across scenes</h2><div class=\"figures\">{}{}</div></section>",
        figure(&figures.size, "Only one size of terrain was measured along each path."),
        figure(&figures.angle, "No error was measured by angle.")
    );
    let _ = write!(
        body,
        "<section><h2>Comparison with published results</h2><p>Machines and data differ, so that trends can be compared, \
         but not absolute numbers. Rows under this program's own protocol can be compared on the same kind of \
         machine.</p>{}</section><section><h2>Scene plans: features left out</h2>{}</section>",
        tables::published(results),
        tables::plans(&results.header.plans)
    );
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\">\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\
         <title>cuesta: error against run time</title><link rel=\"icon\" href=\"data:,\"><style>{}{}</style></head>\
         <body>{body}<div id=\"tip\" role=\"status\" hidden></div><script>{}</script></body></html>\n",
        include_str!("page.css"),
        colours(),
        include_str!("page.js")
    )
}

/// Returns the style sheet of series and parts, for light and dark backgrounds.
fn colours() -> String {
    let set = |colours: &[&str]| -> String {
        colours.iter().enumerate().map(|(k, colour)| format!(".s{k}{{color:{colour}}}")).collect()
    };
    format!("{}{}@media(prefers-color-scheme:dark){{{}}}", bars::style(), set(&COLOURS), set(&DARK))
}

/// Returns the header with facts about the run.
fn head(results: &Results) -> String {
    let header = &results.header;
    let (machine, device) = (&header.machine, &header.device);
    let software = if device.is_cpu { " (software)" } else { "" };
    let commit = header.commit.as_deref().unwrap_or("unknown");
    let facts = [
        ("Device", format!("{}{software}", device.name)),
        ("Driver", device.driver.clone()),
        ("Machine", format!("{}, {} threads, {}", machine.cpu, machine.cores, machine.system)),
        ("Program", format!("cuesta {}, commit {commit}", header.program)),
        ("Started", header.date.clone()),
        ("Arguments", header.arguments.join(" ")),
    ];
    let facts: String =
        facts.iter().map(|(name, value)| format!("<div><dt>{name}</dt><dd>{}</dd></div>", escape(value))).collect();
    format!("<header><h1>Error against run time</h1><dl>{facts}</dl></header>")
}

/// Returns the bar of controls: scene, techniques, axes.
fn controls(figures: &Figures) -> String {
    let series = |(k, name): (usize, &String)| {
        let name = escape(name);
        format!("<label><input type=\"checkbox\" checked data-toggle=\"{name}\">{}{name}</label>", swatch(k))
    };
    let series: String = figures.series.iter().enumerate().map(series).collect();
    let scenes: String = figures
        .scenes
        .iter()
        .map(|s| format!("<option value=\"{}\">{}</option>", slug(&s.name), escape(&s.name)))
        .collect();
    let scenes = if figures.scenes.len() > 1 {
        format!(
            "<label class=\"scene\">Scene <select id=\"scene\">{scenes}<option value=\"\">all</option></select></label>"
        )
    } else {
        String::new()
    };
    format!(
        "<nav aria-label=\"Filters\">{scenes}<fieldset><legend>Techniques</legend>{series}</fieldset>\
         <label><input type=\"checkbox\" id=\"logarithm\" checked>Logarithmic axes</label></nav>"
    )
}

/// Returns the charts, tables and pictures of a scene.
fn section(results: &Results, scene: &SceneFigures, folder: &Path) -> String {
    let absent = "Not measured in this run.";
    let bars = &scene.split;
    let split = if bars.rows.is_empty() {
        empty(&bars.title, absent)
    } else {
        framed("tall", &bars.title, &bars.about, &bars.inline())
    };
    let mut figures: Vec<String> = scene.charts.iter().map(|(_, chart)| figure(chart, absent)).collect();
    // The two most important charts come first; the tall one follows beside the remaining ones.
    figures.insert(figures.len().min(2), split);
    format!(
        "<section class=\"scene\" id=\"{}\"><h2>{}</h2><div class=\"figures\">{}</div>{}\
         <h3>Frames with the largest errors</h3>{}</section>",
        slug(&scene.name),
        escape(&scene.name),
        figures.concat(),
        tables::cases(results, &scene.name),
        worst(results, &scene.name, folder)
    )
}

/// Returns a chart in a frame, with its linear form if it has one; or the text `absent` if the chart is empty.
fn figure(chart: &Chart, absent: &str) -> String {
    if chart.is_empty() {
        return empty(&chart.title, absent);
    }
    let mut drawn = chart.inline(Form::Own);
    if chart.has_logarithm() {
        drawn += &chart.inline(Form::Linear);
    }
    let class = if chart.has_logarithm() { " class=\"two\"" } else { "" };
    framed("chart", &chart.title, &chart.about, &format!("<div{class}>{drawn}</div>"))
}

fn framed(class: &str, title: &str, about: &str, drawn: &str) -> String {
    let (title, about) = (escape(title), escape(about));
    format!("<figure class=\"is-{class}\"><h3>{title}</h3>{drawn}<figcaption>{about}</figcaption></figure>")
}

fn empty(title: &str, why: &str) -> String {
    format!("<figure class=\"empty\"><h3>{}</h3><p class=\"absent\">{}</p></figure>", escape(title), escape(why))
}

/// Smallest error for which a picture is shown, pixels.
const VISIBLE_PX: f64 = 0.01;

/// Returns the pictures of the worst frame of each series: that of the case whose error is largest relative to its
/// tolerance.
fn worst(results: &Results, scene: &str, folder: &Path) -> String {
    let excess = |result: &CaseResult| {
        let worst = result.errors.as_ref().and_then(|errors| errors.worst.as_ref())?;
        let is_shown = worst.picture.is_some() && worst.error_px >= VISIBLE_PX;
        is_shown.then_some(worst.error_px / result.case.tolerance_px)
    };
    let mut chosen: Vec<&CaseResult> = Vec::new();
    for result in results.cases.iter().filter(|result| result.case.scene() == scene && excess(result).is_some()) {
        match chosen.iter_mut().find(|other| other.case.series() == result.case.series()) {
            Some(other) if excess(result) > excess(other) => *other = result,
            Some(_) => {}
            None => chosen.push(result),
        }
    }
    let shown: String = chosen.iter().filter_map(|result| pair(result, folder)).collect();
    if shown.is_empty() { "<p class=\"absent\">No pictures of errors were kept.</p>".to_string() } else { shown }
}

/// Returns the picture of a case's worst frame, and its difference from the reference picture.
fn pair(result: &CaseResult, folder: &Path) -> Option<String> {
    let worst = result.errors.as_ref()?.worst.as_ref()?;
    let name = format!("{}, {} px", result.case.series(), number(result.case.tolerance_px));
    let image = |file: &String, what: &str| {
        let alt = escape(&format!("{name}: {what}"));
        pictures::data_uri(folder, file).map(|uri| format!("<img alt=\"{alt}\" src=\"{uri}\">"))
    };
    let picture = image(worst.picture.as_ref()?, "as drawn")?;
    let difference = worst.difference.as_ref().and_then(|file| image(file, "difference from the reference"));
    Some(format!(
        "<figure class=\"worst\" data-series=\"{}\"><div>{picture}{}</div><figcaption>{}: frame {}, largest error {} px. \
         Left or above: as drawn. Right or below: difference from the reference.</figcaption></figure>",
        escape(&result.case.series()),
        difference.unwrap_or_default(),
        escape(&name),
        worst.frame,
        number(worst.error_px)
    ))
}
