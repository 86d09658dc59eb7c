//! Chooses the charts of a benchmark's report and fills them with its results.

use crate::bench::Errors;
use crate::bench::results::{CaseResult, Results};
use crate::measure::histogram::Bin;

use super::axis::{Axis, Scale};
use super::bars::{Bar, Bars};
use super::chart::{Chart, Guide, Point, Series};
use super::html::{number, slug};

/// All charts of a report.
pub struct Figures {
    /// Names of the series. Their index is the number of their style.
    pub series: Vec<String>,
    /// Charts of each scene.
    pub scenes: Vec<SceneFigures>,
    /// Frame time against terrain size.
    pub size: Chart,
    /// Error against the angle off the view axis.
    pub angle: Chart,
}

/// The charts of one scene.
pub struct SceneFigures {
    /// Name of the scene.
    pub name: String,
    /// Charts, each with a short name for its file.
    pub charts: Vec<(&'static str, Chart)>,
    /// Parts of the frame time of each case.
    pub split: Bars,
}

impl Figures {
    /// Makes the charts of these results.
    pub fn of(results: &Results) -> Self {
        let mut series = Vec::new();
        let mut scenes: Vec<String> = Vec::new();
        for result in &results.cases {
            let (name, scene) = (result.case.series(), result.case.scene());
            if !series.contains(&name) {
                series.push(name);
            }
            if !scenes.contains(&scene) {
                scenes.push(scene);
            }
        }
        let of_scene = |name: String| {
            let cases: Vec<_> = results.cases.iter().filter(|result| result.case.scene() == name).collect();
            SceneFigures::of(name, &cases, &series)
        };
        let scenes = scenes.into_iter().map(of_scene).collect();
        let (size, angle) = (size(results, &series), angle(results, &series));
        Self { series, scenes, size, angle }
    }

    /// Returns all charts with contents as SVG files: name without extension, and text.
    pub fn files(&self) -> Vec<(String, String)> {
        let mut files = Vec::new();
        let mut add = |name: String, chart: &Chart| {
            if !chart.is_empty() {
                files.push((name, chart.file()));
            }
        };
        for scene in &self.scenes {
            scene.charts.iter().for_each(|(name, chart)| add(format!("{}-{name}", slug(&scene.name)), chart));
        }
        add("cost-against-size".to_string(), &self.size);
        add("error-off-the-axis".to_string(), &self.angle);
        let splits = self.scenes.iter().filter(|scene| !scene.split.rows.is_empty());
        files.extend(splits.map(|scene| (format!("{}-split", slug(&scene.name)), scene.split.file())));
        files
    }
}

fn axis(label: &str, scale: Scale) -> Axis {
    Axis { label: label.to_string(), scale }
}

/// Groups the points of cases into series, in the order of `names`. Series without points are left out.
fn grouped<'a>(
    cases: impl Iterator<Item = &'a CaseResult> + Clone,
    names: &[String],
    point: impl Fn(&CaseResult) -> Option<Point>,
) -> Vec<Series> {
    let series = |(style, name): (usize, &String)| {
        let own = cases.clone().filter(|result| result.case.series() == *name);
        let mut points: Vec<Point> = own.filter_map(&point).collect();
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        Series { name: name.clone(), style, points }
    };
    names.iter().enumerate().map(series).filter(|series| !series.points.is_empty()).collect()
}

/// Marks the points of the Pareto front, those for which no other point is better in one value and not worse in the
/// other. Returns the line that joins them. Smaller values are better.
fn pareto(series: &mut [Series]) -> Guide {
    let all: Vec<[f64; 2]> = series.iter().flat_map(|s| s.points.iter().map(|p| [p.x, p.y])).collect();
    let beaten = |p: &Point| all.iter().any(|q| q[0] <= p.x && q[1] <= p.y && (q[0] < p.x || q[1] < p.y));
    let points = series.iter_mut().flat_map(|s| s.points.iter_mut());
    let mut front: Vec<[f64; 2]> = Vec::new();
    for point in points {
        point.marked = !beaten(point);
        if point.marked {
            front.push([point.x, point.y]);
        }
    }
    front.sort_by(|a, b| a[0].total_cmp(&b[0]));
    Guide { name: "Pareto front".to_string(), points: front }
}

/// Describes a case and its results in one line.
fn describe(result: &CaseResult) -> String {
    let mut parts = vec![format!("{}, {} px", result.case.series(), number(result.case.tolerance_px))];
    if let Some(errors) = &result.errors {
        let e = errors.error_px;
        parts.push(format!("error {} px (99.9 %: {}, rms {})", number(e.max), number(e.p999), number(e.rms)));
    }
    if let Some(time) = &result.time {
        let frame = time.frame_ms;
        parts.push(format!("{} ms ({} to {})", number(frame.value), number(frame.low), number(frame.high)));
        parts.push(format!("{} triangles", number(time.triangles)));
    }
    if let Some(multiple) = result.errors.as_ref().and_then(|e| e.reference?.multiple) {
        parts.push(format!("{} times the near-optimal mesh", number(multiple)));
    }
    parts.join("; ")
}

impl SceneFigures {
    fn of(name: String, cases: &[&CaseResult], names: &[String]) -> Self {
        let all = cases.iter().copied();
        let typical = typical(cases);
        let charts = vec![
            ("error-time", error_time(all.clone(), names)),
            ("triangles-error", triangles_error(all.clone(), names)),
            (
                "pop",
                histogram(&typical, names, "Popping", "displacement when the level of detail changes, px", |e| {
                    e.pop.as_ref().map(|pop| pop.histogram.bins.as_slice())
                }),
            ),
            (
                "triangle-size",
                histogram(&typical, names, "Size of triangles", "pixels per triangle", |e| {
                    e.economy.as_ref().map(|economy| economy.pixels_per_triangle.bins.as_slice())
                }),
            ),
            ("tolerance-time", tolerance_time(all.clone(), names)),
        ];
        let split = split(all);
        Self { name, charts, split }
    }
}

/// Chart of frame time against the largest screen error, with the Pareto front.
fn error_time<'a>(cases: impl Iterator<Item = &'a CaseResult> + Clone, names: &[String]) -> Chart {
    let point = |result: &CaseResult| {
        let (time, errors) = (result.time.as_ref()?, result.errors.as_ref()?);
        let frame = time.frame_ms;
        let interval = Some([frame.low, frame.high]);
        Some(Point { x: errors.error_px.max, y: frame.value, interval, label: describe(result), marked: false })
    };
    let mut series = grouped(cases, names, point);
    let guide = Some(pareto(&mut series));
    Chart {
        title: "Error against frame time".to_string(),
        about: "Lower left is better. Rings and the dashed line mark the Pareto front. Whiskers are bootstrap 95 % \
                intervals. Errors below the axis are drawn at its edge."
            .to_string(),
        x: axis("largest screen error, px", Scale::Logarithmic),
        y: axis("median frame time, ms", Scale::Logarithmic),
        series,
        guide,
        limit: None,
    }
}

/// Chart of frame time against the tolerance.
fn tolerance_time<'a>(cases: impl Iterator<Item = &'a CaseResult> + Clone, names: &[String]) -> Chart {
    let point = |result: &CaseResult| {
        let frame = result.time.as_ref()?.frame_ms;
        let (x, interval) = (result.case.tolerance_px, Some([frame.low, frame.high]));
        Some(Point { x, y: frame.value, interval, label: describe(result), marked: false })
    };
    Chart {
        title: "Frame time against tolerance".to_string(),
        about: "Cost of a tolerance; the error may be smaller. Whiskers are bootstrap 95 % intervals.".to_string(),
        x: axis("tolerance, px", Scale::Logarithmic),
        y: axis("median frame time, ms", Scale::Logarithmic),
        series: grouped(cases, names, point),
        guide: None,
        limit: None,
    }
}

/// Chart of triangles against the largest screen error.
fn triangles_error<'a>(cases: impl Iterator<Item = &'a CaseResult> + Clone, names: &[String]) -> Chart {
    let point = |result: &CaseResult| {
        let (time, errors) = (result.time.as_ref()?, result.errors.as_ref()?);
        let (x, y) = (errors.error_px.max, time.triangles);
        Some(Point { x, y, interval: None, label: describe(result), marked: false })
    };
    Chart {
        title: "Triangles against error".to_string(),
        about: "Mean triangles per frame. The label of a point compares them with a near-optimal mesh.".to_string(),
        x: axis("largest screen error, px", Scale::Logarithmic),
        y: axis("triangles per frame", Scale::Logarithmic),
        series: grouped(cases, names, point),
        guide: None,
        limit: None,
    }
}

/// Returns the case of each series whose tolerance is nearest to 1 px by ratio.
fn typical<'a>(cases: &[&'a CaseResult]) -> Vec<&'a CaseResult> {
    let mut chosen: Vec<&CaseResult> = Vec::new();
    let far = |result: &CaseResult| result.case.tolerance_px.ln().abs();
    for &case in cases {
        match chosen.iter_mut().find(|other| other.case.series() == case.case.series()) {
            Some(other) if far(case) < far(other) => *other = case,
            Some(_) => {}
            None => chosen.push(case),
        }
    }
    chosen
}

/// Chart of the share of values in each bin of a histogram, one series per case.
fn histogram(
    cases: &[&CaseResult],
    names: &[String],
    title: &str,
    label: &str,
    of: fn(&Errors) -> Option<&[Bin]>,
) -> Chart {
    let series = |result: &&CaseResult| {
        let bins = of(result.errors.as_ref()?)?;
        let all = bins.iter().fold(0u64, |all, bin| all.saturating_add(bin.count));
        let name = format!("{}, {} px", result.case.series(), number(result.case.tolerance_px));
        let point = |bin: &Bin| {
            let y = 100.0 * bin.count as f64 / all as f64;
            let label = format!("{name}: {} % from {} to {} px", number(y), number(bin.from), number(bin.to));
            Point { x: middle(bin), y, interval: None, label, marked: false }
        };
        let points: Vec<Point> = bins.iter().filter(|bin| bin.count > 0).map(point).collect();
        let name = result.case.series();
        let style = names.iter().position(|other| *other == name)?;
        (!points.is_empty()).then_some(Series { name, style, points })
    };
    Chart {
        title: title.to_string(),
        about: "Share of the values in each bin, for the tolerance nearest to 1 px.".to_string(),
        x: axis(label, Scale::Logarithmic),
        y: axis("share, %", Scale::Logarithmic),
        series: cases.iter().filter_map(series).collect(),
        guide: None,
        limit: None,
    }
}

/// Returns the position of a bin on the axis: the geometric mean of its ends, its lower end if it has no upper one, or
/// half the upper end if it starts at 0.
fn middle(bin: &Bin) -> f64 {
    match (bin.from > 0.0, bin.to.is_finite()) {
        (true, true) => (bin.from * bin.to).sqrt(),
        (true, false) => bin.from,
        (false, _) => bin.to / 2.0,
    }
}

/// Chart of the parts of each case's frame time.
fn split<'a>(cases: impl Iterator<Item = &'a CaseResult>) -> Bars {
    let bar = |result: &CaseResult| {
        let time = result.time.as_ref()?;
        let (upload, gpu) = (time.upload_ms.unwrap_or(0.0), time.gpu_ms.unwrap_or(0.0));
        let known = [time.select_ms, time.record_ms, upload, gpu];
        let rest = (time.frame_ms.value - known.iter().sum::<f64>()).max(0.0);
        Some(Bar {
            series: result.case.series(),
            name: format!("{}, {} px", result.case.series(), number(result.case.tolerance_px)),
            values: known.into_iter().chain([rest]).collect(),
            mark: time.shading_only_ms.map(|shading_only| (shading_only, "shading only")),
        })
    };
    Bars {
        title: "Parts of the frame time".to_string(),
        about: "Medians. The mark is the frame time of the shading-only baseline: one full-screen pass that does the \
                same fragment work without triangles."
            .to_string(),
        label: "milliseconds".to_string(),
        parts: vec!["select", "record", "upload", "GPU", "rest"],
        rows: cases.filter_map(bar).collect(),
    }
}

/// Chart of frame time against terrain size, along the path that was measured over the most sizes.
fn size(results: &Results, names: &[String]) -> Chart {
    let samples = |result: &CaseResult| result.case.terrain.size.map(f64::from).iter().product::<f64>();
    let sizes = |path: &str| {
        let own = results.cases.iter().filter(|result| result.case.path == path && result.time.is_some());
        own.map(|result| result.case.terrain.size).collect::<std::collections::BTreeSet<_>>().len()
    };
    let path = results.cases.iter().map(|result| result.case.path.as_str()).max_by_key(|path| sizes(path));
    let path = path.filter(|path| sizes(path) > 1);
    let mut scenes: Vec<String> = Vec::new();
    for result in results.cases.iter().filter(|result| Some(result.case.path.as_str()) == path) {
        if !scenes.contains(&result.case.scene()) {
            scenes.push(result.case.scene());
        }
    }
    let of_scene = |scene: &String| {
        typical(&results.cases.iter().filter(|result| result.case.scene() == *scene).collect::<Vec<_>>())
    };
    let cases: Vec<&CaseResult> = scenes.iter().flat_map(of_scene).collect();
    let point = |result: &CaseResult| {
        let label = format!("{}: {}", result.case.terrain, describe(result));
        let frame = result.time.as_ref()?.frame_ms;
        Some(Point {
            x: samples(result),
            y: frame.value,
            interval: Some([frame.low, frame.high]),
            label,
            marked: false,
        })
    };
    Chart {
        title: "Frame time against terrain size".to_string(),
        about: format!("Path {}, at the tolerance nearest to 1 px.", path.unwrap_or("of any kind")),
        x: axis("samples of the terrain", Scale::Logarithmic),
        y: axis("median frame time, ms", Scale::Logarithmic),
        series: grouped(cases.into_iter(), names, point),
        guide: None,
        limit: None,
    }
}

/// Chart of the largest error divided by the tolerance against the angle off the view axis, over all cases of a series.
///
/// The guide is 1/cos²θ: the largest factor by which eq. 1 of Judnich and Ling 2012 underestimates a displacement on the
/// screen at an angle θ off the axis.
fn angle(results: &Results, names: &[String]) -> Chart {
    let series = |(style, name): (usize, &String)| {
        let own = results.cases.iter().filter(|result| result.case.series() == *name);
        let bins = own.filter_map(|result| result.errors.as_ref()).flat_map(|errors| &errors.by_angle);
        let mut points: Vec<Point> = Vec::new();
        for bin in bins {
            let x = (bin.from_deg + bin.to_deg) / 2.0;
            match points.iter_mut().find(|point| point.x == x) {
                Some(point) => point.y = point.y.max(bin.max),
                None => points.push(Point { x, y: bin.max, ..Point::default() }),
            }
        }
        points.sort_by(|a, b| a.x.total_cmp(&b.x));
        for point in &mut points {
            point.label = format!("{name}, about {}° off the axis: {} of the tolerance", point.x, number(point.y));
        }
        Series { name: name.clone(), style, points }
    };
    let series: Vec<Series> = names.iter().enumerate().map(series).filter(|s| !s.points.is_empty()).collect();
    let widest = series.iter().flat_map(|s| s.points.iter().map(|p| p.x)).fold(0.0, f64::max).min(65.0);
    let guide = (0..=40).map(|k| widest * f64::from(k) / 40.0).map(|a| [a, a.to_radians().cos().powi(-2)]).collect();
    Chart {
        title: "Error off the view axis".to_string(),
        about: "Largest error divided by the tolerance, all cases. Above the horizontal line the tolerance is \
                exceeded. The dashed curve, 1/cos² of the angle, is the factor by which the published metric may \
                underestimate errors."
            .to_string(),
        x: axis("degrees off the view axis", Scale::Linear),
        y: axis("largest error / tolerance", Scale::Linear),
        series,
        guide: Some(Guide { name: "1/cos² of the angle".to_string(), points: guide }),
        limit: Some((1.0, "tolerance".to_string())),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn series(points: &[[f64; 2]]) -> Series {
        let points = points.iter().map(|&[x, y]| Point { x, y, ..Point::default() }).collect();
        Series { name: String::new(), style: 0, points }
    }

    #[test]
    fn the_front_is_what_nothing_beats() {
        let mut all = [series(&[[1.0, 9.0], [2.0, 5.0], [4.0, 5.0]]), series(&[[2.0, 6.0], [3.0, 2.0], [3.0, 2.0]])];
        let front = pareto(&mut all).points;
        assert_eq!(front, [[1.0, 9.0], [2.0, 5.0], [3.0, 2.0], [3.0, 2.0]]);
        let marked: Vec<Vec<bool>> = all.iter().map(|s| s.points.iter().map(|p| p.marked).collect()).collect();
        assert_eq!(marked, [[true, true, false], [false, true, true]]);
    }
}
