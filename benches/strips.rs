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

/// Lengths of triangles' sides: from a page in one quad to the field's own samples far away.
const EDGES_PX: [f64; 12] = [400.0, 200.0, 100.0, 60.0, 40.0, 25.0, 15.0, 10.0, 6.0, 4.0, 2.5, 1.9];

/// A series: mean triangles and mean of the frames' shortest times, seconds; the time of all frames' lookups included.
fn series(field: &Arc<Field>, name: &str, settings: &[(&str, String)], views: &[View]) -> [f64; 2] {
    let (name, variant) = name.split_once(':').map_or((name, None), |(name, variant)| (name, Some(variant)));
    let entry = lod::find(name).expect("in the table");
    let settings: Vec<_> = settings.iter().map(|(key, value)| (key.to_string(), value.clone())).collect();
    let mut strips = (entry.build)(Arc::clone(field), &Settings::new(entry, variant, &settings).expect("its own keys"));
    let mut list = DrawList::default();
    let mut sum = [0.0; 2];
    for view in views {
        let times = (0..REPEATS).map(|_| {
            list.clear();
            let start = Instant::now();
            strips.select(view, &mut list);
            start.elapsed().as_secs_f64()
        });
        sum[1] += times.fold(f64::INFINITY, f64::min);
        sum[0] += list.triangles() as f64;
    }
    sum.map(|sum| sum / views.len() as f64)
}

/// Slope, intercept and R² of the least squares line through points.
fn line(points: &[[f64; 2]]) -> [f64; 3] {
    let mean = |f: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(f).sum::<f64>() / points.len() as f64;
    let [x, y] = [mean(&|p| p[0]), mean(&|p| p[1])];
    let [xx, xy, yy] =
        [mean(&|p| (p[0] - x).powi(2)), mean(&|p| (p[0] - x) * (p[1] - y)), mean(&|p| (p[1] - y).powi(2))];
    [xy / xx, y - xy / xx * x, xy * xy / (xx * yy)]
}

fn report(title: &str, points: &[[f64; 2]]) {
    println!("{title}");
    for [triangles, seconds] in points {
        println!("  {triangles:10.0} triangles {:9.3} ms {:6.1} M/s", 1e3 * seconds, 1e-6 * triangles / seconds);
    }
    let [slope, intercept, r2] = line(points);
    println!("  {:.1} M/s + {:.3} ms a frame, R² {r2:.5}", 1e-6 / slope, 1e3 * intercept);
}

fn main() {
    let mut field = synth::synth(synth::Kind::Eroded, [512, 512], 7).tiled([8, 8]);
    field.spacing = [10.0, 10.0];
    let field = Arc::new(field);
    let path = paths::find("circle").expect("a named path");
    let views = path.views(&field, FRAMES, [640, 480], Tolerance { px: 1.0, metric: Metric::Certified });
    for name in ["sorted-strips:serial", "sorted-strips"] {
        let of_edge = |edge: f64| {
            let settings = [("level", "uniform".to_string()), ("edge", edge.to_string())];
            series(&field, name, &settings, &views)
        };
        let points = EDGES_PX.map(of_edge);
        report(&format!("{name}, uniform"), &points);
    }
    let at = |px: f64| {
        let views: Vec<_> =
            views.iter().map(|view| View { tolerance: Tolerance { px, ..view.tolerance }, ..*view }).collect();
        series(&field, "sorted-strips:serial", &[], &views)
    };
    report("sorted-strips:serial, certified", &[32.0, 16.0, 8.0, 4.0, 2.0, 1.0].map(at));
}
