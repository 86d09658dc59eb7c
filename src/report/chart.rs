//! Scatter charts with lines as SVG: inline for the page, which styles them and makes them interactive, and as
//! stand-alone files with title, legend and colours.

use std::fmt::Write;

use super::axis::{Axis, Range, Scale};
use super::html::{escape, number};

// Lengths are in SVG user units.

/// Width of a chart. It keeps the text legible on a phone and in half a desktop window.
pub const WIDTH: f64 = 400.0;
/// Height of a chart.
const HEIGHT: f64 = 300.0;
/// Margins of the plot area.
const LEFT: f64 = 60.0;
const RIGHT: f64 = 14.0;
const TOP: f64 = 12.0;
const BOTTOM: f64 = 48.0;
/// Height of the title of a file.
const TITLE: f64 = 26.0;
/// Height of a line in the legend of a file.
const LEGEND: f64 = 18.0;

/// Colours of the series on a white background: the palette of Okabe and Ito (2008), which colour-blind readers can
/// distinguish. Yellow is left out because it is too light.
pub const COLOURS: [&str; 7] = ["#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#e69f00", "#555555"];
/// Markers of the series as SVG paths around (0, 0).
const MARKERS: [&str; 7] = [
    "M-4.5 0a4.5 4.5 0 1 0 9 0a4.5 4.5 0 1 0 -9 0z",
    "M-4 -4h8v8h-8z",
    "M0 -5.2l5 8.8h-10z",
    "M0 -5.6l5.2 5.6l-5.2 5.6l-5.2 -5.6z",
    "M0 5.2l5 -8.8h-10z",
    "M-1.6 -5h3.2v3.4h3.4v3.2h-3.4v3.4h-3.2v-3.4h-3.4v-3.2h3.4z",
    "M-2.5 -4.6h5l2.6 4.6l-2.6 4.6h-5l-2.6 -4.6z",
];

/// A chart.
#[derive(Clone, Debug)]
pub struct Chart {
    /// Title.
    pub title: String,
    /// Caption: how to read the chart.
    pub about: String,
    /// Horizontal axis.
    pub x: Axis,
    /// Vertical axis.
    pub y: Axis,
    /// The series of points.
    pub series: Vec<Series>,
    /// Additional dashed line.
    pub guide: Option<Guide>,
    /// Value and name of a horizontal dashed line.
    pub limit: Option<(f64, String)>,
}

/// Points of one series.
#[derive(Clone, Debug)]
pub struct Series {
    /// Name of the series.
    pub name: String,
    /// Number of the style, which determines colour and marker.
    pub style: usize,
    /// The points, joined by a line in this order.
    pub points: Vec<Point>,
}

/// One point.
#[derive(Clone, Debug, Default)]
pub struct Point {
    /// Value on the horizontal axis.
    pub x: f64,
    /// Value on the vertical axis.
    pub y: f64,
    /// Lower and upper end of a whisker on the vertical axis.
    pub interval: Option<[f64; 2]>,
    /// Text that describes the point, shown on hover.
    pub label: String,
    /// True if the point gets a ring.
    pub marked: bool,
}

/// A dashed line without markers.
#[derive(Clone, Debug)]
pub struct Guide {
    /// Name of the line.
    pub name: String,
    /// Points (x, y), joined in this order.
    pub points: Vec<[f64; 2]>,
}

/// Scales of a drawing's axes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Form {
    /// The default scale of each axis.
    Own,
    /// Linear axes.
    Linear,
}

/// Returns the marker of a style. When colours repeat, markers are shifted, so that the combination stays unique.
fn marker(style: usize) -> &'static str {
    MARKERS[(style + style / COLOURS.len()) % MARKERS.len()]
}

/// Returns the marker of a style as a small SVG element, for the page's controls.
pub fn swatch(style: usize) -> String {
    let k = style % COLOURS.len();
    format!(
        "<svg class=\"swatch s{k}\" viewBox=\"-7 -7 14 14\" aria-hidden=\"true\"><path d=\"{}\"/></svg>",
        marker(style)
    )
}

impl Chart {
    /// Returns true if no series has a point.
    pub fn is_empty(&self) -> bool {
        self.series.iter().all(|series| series.points.is_empty())
    }

    /// Returns true if an axis is logarithmic, so that linear axes give another drawing.
    pub fn has_logarithm(&self) -> bool {
        [&self.x, &self.y].iter().any(|axis| axis.scale == Scale::Logarithmic)
    }

    /// Returns the chart as an SVG element of the page, whose style sheet applies.
    pub fn inline(&self, form: Form) -> String {
        let class = if form == Form::Own { "own" } else { "linear" };
        format!(
            "<svg class=\"chart {class}\" viewBox=\"0 0 {WIDTH} {HEIGHT}\" role=\"group\" aria-label=\"{}\">{}</svg>",
            escape(&self.title),
            self.body(form)
        )
    }

    /// Returns the chart as an SVG file with its own title, legend and styles.
    pub fn file(&self) -> String {
        let names = self.series.iter().map(|s| (s.style, s.name.as_str()));
        let legend: String = names.enumerate().map(|(k, (style, name))| legend_line(k, style, name)).collect();
        let height = TITLE + HEIGHT + LEGEND * self.series.len() as f64 + 6.0;
        format!(
            "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" height=\"{height}\">\
             <style>{}</style><rect width=\"100%\" height=\"100%\" fill=\"#fff\"/>\
             <text class=\"title\" x=\"{LEFT}\" y=\"19\">{}</text>\
             <g transform=\"translate(0 {TITLE})\">{}</g><g transform=\"translate({LEFT} {})\">{legend}</g></svg>\n",
            style_of_files(),
            escape(&self.title),
            self.body(Form::Own),
            TITLE + HEIGHT + 8.0
        )
    }

    fn body(&self, form: Form) -> String {
        let frame = PlotArea::of(self, form);
        let mut svg = frame.grid(self);
        if let Some((value, name)) = &self.limit {
            let y = frame.y(*value);
            let _ = write!(
                svg,
                "<path class=\"limit\" d=\"M{LEFT} {y:.1}H{:.1}\"/><text class=\"note\" x=\"{:.1}\" y=\"{:.1}\" text-anchor=\"end\">{}</text>",
                WIDTH - RIGHT,
                WIDTH - RIGHT - 4.0,
                y - 5.0,
                escape(name)
            );
        }
        if let Some(guide) = &self.guide {
            let line = frame.line(guide.points.iter().map(|p| (p[0], p[1])));
            let _ = write!(svg, "<path class=\"guide\" d=\"{line}\"><title>{}</title></path>", escape(&guide.name));
        }
        self.series.iter().for_each(|series| svg += &frame.series(series));
        svg
    }

    fn values(&self, of: fn(&Point) -> f64) -> impl Iterator<Item = f64> {
        self.series.iter().flat_map(move |series| series.points.iter().map(of))
    }
}

/// The plot area of a drawing: maps values to positions and draws in it.
struct PlotArea {
    x: Range,
    y: Range,
}

impl PlotArea {
    /// Chooses ranges that contain all points, whiskers and lines of a chart.
    fn of(chart: &Chart, form: Form) -> Self {
        let scale = |axis: &Axis| if form == Form::Own { axis.scale } else { Scale::Linear };
        let guides = chart.guide.iter().flat_map(|guide| guide.points.iter());
        let limit = chart.limit.iter().map(|(value, _)| *value);
        let tops = chart.values(|p| p.interval.map_or(p.y, |i| i[1]));
        let x = Range::around(scale(&chart.x), chart.values(|p| p.x).chain(guides.clone().map(|p| p[0])));
        let y =
            Range::around(scale(&chart.y), chart.values(|p| p.y).chain(tops).chain(limit).chain(guides.map(|p| p[1])));
        Self { x, y }
    }

    fn x(&self, value: f64) -> f64 {
        LEFT + self.x.place(value) * (WIDTH - LEFT - RIGHT)
    }

    fn y(&self, value: f64) -> f64 {
        HEIGHT - BOTTOM - self.y.place(value) * (HEIGHT - TOP - BOTTOM)
    }

    /// Returns the SVG path through some points.
    fn line(&self, points: impl Iterator<Item = (f64, f64)>) -> String {
        let step = |(k, (x, y))| format!("{}{:.1} {:.1}", if k == 0 { 'M' } else { 'L' }, self.x(x), self.y(y));
        points.enumerate().map(step).collect()
    }

    /// Draws grid lines, tick labels, axes and their labels.
    fn grid(&self, chart: &Chart) -> String {
        let (bottom, right) = (HEIGHT - BOTTOM, WIDTH - RIGHT);
        let mut svg = String::new();
        for tick in self.x.ticks() {
            let x = self.x(tick);
            let text = escape(&number(tick));
            let _ = write!(
                svg,
                "<path class=\"grid\" d=\"M{x:.1} {TOP}V{bottom}\"/><text x=\"{x:.1}\" y=\"{}\" text-anchor=\"middle\">{text}</text>",
                bottom + 17.0
            );
        }
        for tick in self.y.ticks() {
            let y = self.y(tick);
            let text = escape(&number(tick));
            let _ = write!(
                svg,
                "<path class=\"grid\" d=\"M{LEFT} {y:.1}H{right}\"/><text x=\"{}\" y=\"{:.1}\" text-anchor=\"end\">{text}</text>",
                LEFT - 6.0,
                y + 4.0
            );
        }
        let (middle_x, middle_y) = ((LEFT + right) / 2.0, (TOP + bottom) / 2.0);
        let _ = write!(
            svg,
            "<path class=\"axis\" d=\"M{LEFT} {TOP}V{bottom}H{right}\"/>\
             <text class=\"name\" x=\"{middle_x}\" y=\"{}\" text-anchor=\"middle\">{}</text>\
             <text class=\"name\" transform=\"translate(13 {middle_y}) rotate(-90)\" text-anchor=\"middle\">{}</text>",
            HEIGHT - 8.0,
            escape(&chart.x.label),
            escape(&chart.y.label)
        );
        svg
    }

    fn series(&self, series: &Series) -> String {
        let k = series.style % COLOURS.len();
        let line = self.line(series.points.iter().map(|p| (p.x, p.y)));
        let mut svg = format!(
            "<g class=\"series s{k}\" data-series=\"{}\"><path class=\"line\" d=\"{line}\"/>",
            escape(&series.name)
        );
        for point in &series.points {
            svg += &self.point(point, marker(series.style));
        }
        svg + "</g>"
    }

    fn point(&self, point: &Point, marker: &str) -> String {
        let (x, y) = (self.x(point.x), self.y(point.y));
        let label = escape(&point.label);
        let whisker = point.interval.map_or(String::new(), |[low, high]| {
            let (low, high) = (self.y(low), self.y(high));
            format!(
                "<path class=\"whisker\" d=\"M{x:.1} {low:.1}V{high:.1}M{:.1} {low:.1}h6M{:.1} {high:.1}h6\"/>",
                x - 3.0,
                x - 3.0
            )
        });
        let ring = if point.marked { "<circle class=\"ring\" r=\"8\"/>" } else { "" };
        format!(
            "{whisker}<g class=\"point\" tabindex=\"0\" role=\"img\" aria-label=\"{label}\" data-x=\"{}\" data-y=\"{}\" \
             transform=\"translate({x:.1} {y:.1})\"><circle class=\"touch\" r=\"11\"/>{ring}<path d=\"{marker}\"/></g>",
            point.x, point.y
        )
    }
}

/// Draws a line of the legend of a file, counted from 0.
fn legend_line(line: usize, style: usize, name: &str) -> String {
    let k = style % COLOURS.len();
    format!(
        "<g class=\"series s{k}\" transform=\"translate(6 {})\"><path d=\"{}\"/><text x=\"12\" y=\"4\">{}</text></g>",
        LEGEND * line as f64,
        marker(style),
        escape(name)
    )
}

/// Returns the style sheet of chart files.
pub fn style_of_files() -> String {
    let colours = COLOURS.iter().enumerate().map(|(k, colour)| format!(".s{k}{{color:{colour}}}"));
    colours.collect::<String>()
        + "text{font:13px system-ui,sans-serif;fill:#333}.title{font-size:14px;font-weight:600}.series path{fill:currentColor}\
           .series .line,.whisker{fill:none!important;stroke:currentColor;stroke-width:1.5}.line{opacity:.55}\
           .grid{stroke:#e3e3e3}.axis{fill:none;stroke:#888}.touch{fill:none}.ring{fill:none;stroke:#333;stroke-width:1.5}\
           .guide,.limit{fill:none;stroke:#333;stroke-dasharray:4 4}"
}
