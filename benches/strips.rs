//! Figure 5 of Finch & Bishop 1998 again: time to make a frame's triangles against their number, without rendering.
//!
//! Their scene: 8 × 8 pages of 64 × 64 cells tiled over the plane, a circle flown low above ground, one level scale a
//! series. `cargo bench --no-default-features --features bench --bench strips`, while nothing else runs.

use std::sync::Arc;
use std::time::Instant;

use cuesta::internal::bench::paths;
use cuesta::internal::draw::DrawList;
use cuesta::internal::height::{Field, synth};
use cuesta::internal::lod::{self, Settings};
use cuesta::internal::view::{Metric, Tolerance, View};

/// Frames of the circle that are timed, and times that each is.
const FRAMES: usize = 50;
const REPEATS: usize = 5;

/// Lengths of triangles' sides: from a page in one quad to the field's own samples far away.
const EDGES_PX: [f64; 12] = [400.0, 200.0, 100.0, 60.0, 40.0, 25.0, 15.0, 10.0, 6.0, 4.0, 2.5, 1.9];

/// The same on land so small that the pages in sight are about as many as theirs, 35.
const FEW_EDGES_PX: [f64; 3] = [400.0, 100.0, 40.0];

/// A series: mean triangles, mean of the frames' shortest times, seconds, and mean pages in sight; the time of all
/// frames' lookups included.
fn series(field: &Arc<Field>, name: &str, settings: &[(&str, String)], views: &[View]) -> [f64; 3] {
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
        let pages = strips.stats().into_iter().find(|figure| figure.0 == "pages in sight");
        sum[2] += pages.map_or(0.0, |figure| figure.1);
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

/// Prints a series and returns what a triangle costs, seconds.
fn report(title: &str, points: &[[f64; 2]]) -> f64 {
    println!("{title}");
    for [triangles, seconds] in points {
        println!("  {triangles:10.0} triangles {:9.3} ms {:6.1} M/s", 1e3 * seconds, 1e-6 * triangles / seconds);
    }
    let [slope, intercept, r2] = line(points);
    println!("  {:.1} M/s + {:.3} ms a frame, R² {r2:.5}", 1e-6 / slope, 1e3 * intercept);
    slope
}

/// The circle over land that is tiled `tiles` times along both axes.
fn scene(tiles: u32) -> (Arc<Field>, Vec<View>) {
    let mut field = synth::synth(synth::Kind::Eroded, [512, 512], 7).tiled([tiles; 2]);
    field.spacing = [10.0, 10.0];
    let path = paths::find("circle").expect("a named path");
    let views = path.views(&field, FRAMES, [640, 480], Tolerance { px: 1.0, metric: Metric::Certified });
    (Arc::new(field), views)
}

/// The levels by distance, `page` cells along a side of a page.
fn uniform(edge_px: f64, page: u32) -> [(&'static str, String); 3] {
    [("level", "uniform".to_string()), ("edge", edge_px.to_string()), ("page", page.to_string())]
}

/// What a page costs beside its triangles, of which each costs `slope` seconds: the same land in pages of two sizes.
fn cost_of_a_page((field, views): &(Arc<Field>, Vec<View>), slope: f64) {
    let [small, large] = [16, 64].map(|page| series(field, "sorted-strips:serial", &uniform(400.0, page), views));
    let [triangles, seconds, pages] = [0, 1, 2].map(|k| small[k] - large[k]);
    println!(
        "{:.2} us a page ({:.0} and {:.0} pages)",
        1e6 * (seconds - slope * triangles) / pages,
        small[2],
        large[2]
    );
}

/// How much faster two cores are here at best: two walks that know nothing of each other, side by side, against one.
fn two_at_once((field, views): &(Arc<Field>, Vec<View>)) {
    for edge_px in [25.0, 6.0, 2.5] {
        let walk = || series(field, "sorted-strips:serial", &uniform(edge_px, 64), views);
        let [triangles, alone, _] = walk();
        let both = std::thread::scope(|scope| {
            let other = scope.spawn(walk);
            let own = walk()[1];
            own.max(other.join().expect("a walk")[1])
        });
        println!("{triangles:10.0} triangles: two walks side by side {:.2} times as fast as one", 2.0 * alone / both);
    }
}

fn main() {
    let (near, wide) = (scene(2), scene(8));
    let figure_5 = ["sorted-strips:serial", "sorted-strips"].map(|name| {
        let few = FEW_EDGES_PX.map(|edge_px| series(&near.0, name, &uniform(edge_px, 64), &near.1));
        let many = EDGES_PX.map(|edge_px| series(&wide.0, name, &uniform(edge_px, 64), &wide.1));
        let points: Vec<_> = few.into_iter().chain(many).map(|[triangles, seconds, _]| [triangles, seconds]).collect();
        (report(&format!("{name}, uniform"), &points), points)
    });
    let [(slope, serial), (_, parallel)] = &figure_5;
    for (serial, parallel) in serial.iter().zip(parallel) {
        println!("{:10.0} triangles: parallel {:.2} times as fast", serial[0], serial[1] / parallel[1]);
    }
    two_at_once(&wide);
    cost_of_a_page(&wide, *slope);
    let at = |px: f64| {
        let of_px = |view: &View| View { tolerance: Tolerance { px, ..view.tolerance }, ..*view };
        let views: Vec<_> = wide.1.iter().map(of_px).collect();
        let [triangles, seconds, _] = series(&wide.0, "sorted-strips:serial", &[], &views);
        [triangles, seconds]
    };
    report("sorted-strips:serial, certified", &[32.0, 16.0, 8.0, 4.0, 2.0].map(at));
}
