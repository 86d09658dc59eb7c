//! Figure 5 of Finch & Bishop 1998 again: time to make a frame's triangles against their number, without rendering.
//!
//! Their scene: 8 × 8 pages of 64 × 64 cells tiled over the plane, a circle flown low above ground, one level scale a
//! series. `cargo bench --no-default-features --bench strips`, while nothing else runs.

use std::sync::Arc;
use std::time::Instant;

use cuesta::bench::paths;
use cuesta::draw::DrawList;
use cuesta::height::{Field, synth};
use cuesta::lod::{self, Settings};
use cuesta::view::{Metric, Tolerance, View};

/// Frames of the circle that are timed, and times that each is.
const FRAMES: usize = 50;
const REPEATS: usize = 5;

/// Lengths of a triangle's side, pixels: from a few hundred triangles to a million.
const EDGES: [f64; 14] = [6400.0, 1600.0, 400.0, 200.0, 100.0, 60.0, 40.0, 25.0, 15.0, 10.0, 6.0, 4.0, 2.5, 1.9];

/// Means over the frames of a series.
#[derive(Clone, Copy)]
struct Point {
    triangles: f64,
    /// The shortest time of each frame, everything from the view to the list included, seconds.
    seconds: f64,
    /// Pages in sight.
    pages: f64,
}

fn series(field: &Arc<Field>, name: &str, settings: &[(&str, String)], views: &[View]) -> Point {
    let (name, variant) = name.split_once(':').map_or((name, None), |(name, variant)| (name, Some(variant)));
    let entry = lod::find(name).expect("in the table");
    let settings: Vec<_> = settings.iter().map(|(key, value)| (key.to_string(), value.clone())).collect();
    let mut strips = (entry.build)(Arc::clone(field), &Settings::new(entry, variant, &settings).expect("its own keys"));
    let mut list = DrawList::default();
    let mut sum = [0.0; 3];
    for view in views {
        let times = (0..REPEATS).map(|_| {
            list.clear();
            let start = Instant::now();
            strips.select(view, &mut list);
            start.elapsed().as_secs_f64()
        });
        sum[1] += times.fold(f64::INFINITY, f64::min);
        sum[0] += list.triangles() as f64;
        sum[2] += strips.figures().iter().find(|figure| figure.0 == "pages in sight").map_or(0.0, |figure| figure.1);
    }
    let [triangles, seconds, pages] = sum.map(|sum| sum / views.len() as f64);
    Point { triangles, seconds, pages }
}

/// Slope, intercept and R² of the least squares line through points.
fn line(points: &[[f64; 2]]) -> [f64; 3] {
    let mean = |f: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(f).sum::<f64>() / points.len() as f64;
    let [x, y] = [mean(&|p| p[0]), mean(&|p| p[1])];
    let [xx, xy, yy] =
        [mean(&|p| (p[0] - x).powi(2)), mean(&|p| (p[0] - x) * (p[1] - y)), mean(&|p| (p[1] - y).powi(2))];
    [xy / xx, y - xy / xx * x, xy * xy / (xx * yy)]
}

fn report(title: &str, points: &[Point]) {
    println!("{title}");
    for Point { triangles, seconds, pages } in points {
        let speed = 1e-6 * triangles / seconds;
        println!("  {triangles:10.0} triangles {pages:5.0} pages {:9.3} ms {speed:6.1} M/s", 1e3 * seconds);
    }
    let points: Vec<_> = points.iter().map(|point| [point.triangles, point.seconds]).collect();
    let [slope, intercept, r2] = line(&points);
    println!("  {:.1} M/s + {:.3} ms a frame, R² {r2:.5}", 1e-6 / slope, 1e3 * intercept);
}

/// The same triangles from more and more pages: what a page costs.
fn cost_of_a_page(field: &Arc<Field>, views: &[View]) {
    let of_page = |page: u32| {
        let settings = [("level", "uniform"), ("edge", "15"), ("page", &page.to_string())];
        let settings = settings.map(|(key, value)| (key, value.to_string()));
        series(field, "sorted-strips:serial", &settings, views)
    };
    let [small, middle, large] = [16, 64, 256].map(of_page);
    for (few, many) in [(large, middle), (middle, small)] {
        let (pages, seconds) = (many.pages - few.pages, many.seconds - few.seconds);
        let triangles = many.triangles - few.triangles;
        println!("  {pages:.0} pages and {triangles:.0} triangles more: {:.3} µs a page", 1e6 * seconds / pages);
    }
}

fn main() {
    let mut field = synth::synth(synth::Kind::Eroded, [512, 512], 7).tiled([8, 8]);
    field.spacing = [10.0, 10.0];
    let field = Arc::new(field);
    let path = paths::find("circle").expect("a named path");
    let views = path.views(&field, FRAMES, [640, 480], Tolerance { px: 1.0, metric: Metric::Certified });
    let [serial, parallel] = ["sorted-strips:serial", "sorted-strips"].map(|name| {
        let of_edge = |edge: f64| {
            let settings = [("level", "uniform".to_string()), ("edge", edge.to_string())];
            series(&field, name, &settings, &views)
        };
        let points = EDGES.map(of_edge);
        report(&format!("{name}, uniform"), &points);
        points
    });
    println!("on all cores");
    for (one, all) in serial.iter().zip(&parallel) {
        println!("  {:10.0} triangles {:5.2} times as fast", one.triangles, one.seconds / all.seconds);
    }
    println!("serial, uniform, pages of 256, 64 and 16 cells");
    cost_of_a_page(&field, &views);
    let at = |px: f64| {
        let views: Vec<_> =
            views.iter().map(|view| View { tolerance: Tolerance { px, ..view.tolerance }, ..*view }).collect();
        series(&field, "sorted-strips:serial", &[], &views)
    };
    report("sorted-strips:serial, certified", &[32.0, 16.0, 8.0, 4.0, 2.0, 1.0].map(at));
}
