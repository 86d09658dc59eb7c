//! Stacked bar charts as SVG. The report shows the parts of the frame time with them.

use std::fmt::Write;

use super::axis::{Range, Scale};
use super::chart::{WIDTH, style_of_files};
use super::html::{escape, number};

// Lengths are in SVG user units; a chart is `WIDTH` of them wide.

/// Margins of the plot area.
const LEFT: f64 = 10.0;
const RIGHT: f64 = 22.0;
/// Height of the legend above the plot area.
const HEAD: f64 = 22.0;
/// Height of the tick labels and the axis label below it.
const FOOT: f64 = 44.0;
/// Height of a row: the name of the bar, and the bar below it.
const ROW: f64 = 38.0;
/// Height of a bar.
const BAR: f64 = 14.0;
/// Height of the title of a file.
const TITLE: f64 = 26.0;

/// Colours of the parts, in order.
pub const COLOURS: [&str; 5] = ["#e69f00", "#cc79a7", "#009e73", "#0072b2", "#bbbbbb"];

/// A stacked bar chart with a linear axis.
#[derive(Clone, Debug)]
pub struct Bars {
    /// Title.
    pub title: String,
    /// Caption: how to read the chart.
    pub about: String,
    /// Label of the axis.
    pub label: String,
    /// Names of the parts.
    pub parts: Vec<&'static str>,
    /// The bars from top to bottom.
    pub rows: Vec<Bar>,
}

/// One bar.
#[derive(Clone, Debug)]
pub struct Bar {
    /// Name of the series that the bar belongs to. The page's controls hide a series.
    pub series: String,
    /// Name of the bar.
    pub name: String,
    /// One value per part.
    pub values: Vec<f64>,
    /// Value and name of a mark across the bar.
    pub mark: Option<(f64, &'static str)>,
}

impl Bars {
    /// Returns the chart as an SVG element of the page, whose style sheet applies.
    pub fn inline(&self) -> String {
        let title = escape(&self.title);
        format!(
            "<svg class=\"chart\" viewBox=\"0 0 {WIDTH} {:.0}\" role=\"group\" aria-label=\"{title}\">{}</svg>",
            self.height(),
            self.body()
        )
    }

    /// Returns the chart as an SVG file with its own title and styles.
    pub fn file(&self) -> String {
        let height = TITLE + self.height();
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\">\
             <style>{}{}</style><rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\
             <text class=\"title\" x=\"{LEFT}\" y=\"19\">{}</text><g transform=\"translate(0 {TITLE})\">{}</g></svg>\n",
            style_of_files(),
            style(),
            escape(&self.title),
            self.body()
        )
    }

    fn height(&self) -> f64 {
        HEAD + ROW * self.rows.len() as f64 + FOOT
    }

    fn body(&self) -> String {
        let ends = self.rows.iter().flat_map(|bar| [bar.values.iter().sum(), bar.mark.map_or(0.0, |(v, _)| v)]);
        let range = Range::around(Scale::Linear, ends);
        let x = |value: f64| LEFT + range.place(value) * (WIDTH - LEFT - RIGHT);
        let bottom = HEAD + ROW * self.rows.len() as f64;
        let mut svg = self.legend();
        for tick in range.ticks() {
            let _ = write!(
                svg,
                "<path class=\"grid\" d=\"M{0:.1} {HEAD}V{bottom:.1}\"/><text x=\"{0:.1}\" y=\"{1:.1}\" text-anchor=\"middle\">{2}</text>",
                x(tick),
                bottom + 16.0,
                number(tick)
            );
        }
        let _ = write!(
            svg,
            "<text class=\"name\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"middle\">{}</text>",
            WIDTH / 2.0,
            bottom + 36.0,
            escape(&self.label)
        );
        for (k, bar) in self.rows.iter().enumerate() {
            svg += &self.bar(bar, HEAD + ROW * k as f64, &x);
        }
        svg
    }

    fn legend(&self) -> String {
        let mut at = LEFT;
        let mut svg = String::new();
        for (k, part) in self.parts.iter().enumerate() {
            let _ = write!(
                svg,
                "<rect class=\"p{k}\" x=\"{at:.0}\" y=\"4\" width=\"11\" height=\"11\"/><text x=\"{:.0}\" y=\"14\">{part}</text>",
                at + 15.0
            );
            at += 28.0 + 7.4 * part.len() as f64;
        }
        svg
    }

    /// Draws one bar in the row at `top`. `x` maps values to positions.
    fn bar(&self, bar: &Bar, top: f64, x: &dyn Fn(f64) -> f64) -> String {
        let parts: Vec<_> =
            self.parts.iter().zip(&bar.values).map(|(part, v)| format!("{part} {}", number(*v))).collect();
        let mark = bar.mark.map_or(String::new(), |(value, name)| format!(", {name} {}", number(value)));
        let label = escape(&format!("{}: {}{mark}; {}", bar.name, parts.join(", "), self.label));
        let mut svg = format!(
            "<g class=\"bar\" data-series=\"{}\"><text x=\"{LEFT}\" y=\"{:.1}\">{}</text>\
             <g class=\"point\" tabindex=\"0\" role=\"img\" aria-label=\"{label}\" data-x=\"{}\">",
            escape(&bar.series),
            top + 15.0,
            escape(&bar.name),
            bar.values.iter().sum::<f64>()
        );
        let mut from = 0.0;
        for (k, value) in bar.values.iter().enumerate() {
            let (left, right) = (x(from), x(from + value));
            let _ = write!(
                svg,
                "<rect class=\"p{k}\" x=\"{left:.1}\" y=\"{:.1}\" width=\"{:.1}\" height=\"{BAR}\"/>",
                top + 19.0,
                right - left
            );
            from += value;
        }
        if let Some((value, _)) = bar.mark {
            let _ = write!(svg, "<path class=\"mark\" d=\"M{:.1} {:.1}v{}\"/>", x(value), top + 16.0, BAR + 6.0);
        }
        svg + "</g></g>"
    }
}

/// Returns the style sheet of parts and marks.
pub fn style() -> String {
    let fills = COLOURS.iter().enumerate().map(|(k, colour)| format!(".p{k}{{fill:{colour}}}"));
    fills.collect::<String>() + ".mark{stroke:#000;stroke-width:2}"
}
