//! Benchmark of figure 5 of Finch & Bishop 1998: time to generate a frame's triangles against their number, without
//! rendering.
//!
//! Their scene: 8 × 8 pages of 64 × 64 cells tiled over the plane, and a circle flown low above ground; one level
//! scale per series. `cargo bench --no-default-features --features bench --bench strips` on an idle machine.

use std::sync::Arc;
use std::time::Instant;

use cuesta::internal::bench::paths;
use cuesta::internal::draw::DrawList;
use cuesta::internal::height::{Field, synth};
use cuesta::internal::lod::{self, Settings};
use cuesta::internal::view::{Metric, Tolerance, View};

/// Timed frames of the circle, and repetitions of each.
const FRAMES: usize = 50;
const REPEATS: usize = 5;

/// Triangle edge lengths, pixels: from one quad per page to the field's full resolution.
const EDGES_PX: [f64; 12] = [400.0, 200.0, 100.0, 60.0, 40.0, 25.0, 15.0, 10.0, 6.0, 4.0, 2.5, 1.9];

/// Edge lengths for a field so small that about as many pages are in view as in the paper, 35.
const FEW_EDGES_PX: [f64; 3] = [400.0, 100.0, 40.0];

/// Returns mean triangles, mean of the frames' shortest times in seconds, and mean pages in view. Times include the
/// lookups of all frames.
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
        let pages = strips.stats().into_iter().find(|stat| stat.0 == "visible pages");
        sum[2] += pages.map_or(0.0, |stat| stat.1);
    }
    sum.map(|sum| sum / views.len() as f64)
}

/// Returns slope, intercept and R² of the least-squares line through points.
fn line(points: &[[f64; 2]]) -> [f64; 3] {
    let mean = |f: &dyn Fn(&[f64; 2]) -> f64| points.iter().map(f).sum::<f64>() / points.len() as f64;
    let [x, y] = [mean(&|p| p[0]), mean(&|p| p[1])];
    let [xx, xy, yy] =
        [mean(&|p| (p[0] - x).powi(2)), mean(&|p| (p[0] - x) * (p[1] - y)), mean(&|p| (p[1] - y).powi(2))];
    [xy / xx, y - xy / xx * x, xy * xy / (xx * yy)]
}

/// Prints a series and returns the time per triangle, seconds.
fn report(title: &str, points: &[[f64; 2]]) -> f64 {
    println!("{title}");
    for [triangles, seconds] in points {
        println!("  {triangles:10.0} triangles {:9.3} ms {:6.1} M/s", 1e3 * seconds, 1e-6 * triangles / seconds);
    }
    let [slope, intercept, r2] = line(points);
    println!("  {:.1} M/s + {:.3} ms a frame, R² {r2:.5}", 1e-6 / slope, 1e3 * intercept);
    slope
}

/// Returns a field tiled `tiles` times along both axes, and the circle over it.
fn scene(tiles: u32) -> (Arc<Field>, Vec<View>) {
    let mut field = synth::synth(synth::Kind::Eroded, [512, 512], 7).tiled([tiles; 2]);
    field.spacing = [10.0, 10.0];
    let path = paths::find("circle").expect("a named path");
    let views = path.views(&field, FRAMES, [640, 480], Tolerance { px: 1.0, metric: Metric::Certified });
    (Arc::new(field), views)
}

/// Settings for levels by distance, with pages of `page` cells along a side.
fn uniform(edge_px: f64, page: u32) -> [(&'static str, String); 3] {
    [("level", "uniform".to_string()), ("edge", edge_px.to_string()), ("page", page.to_string())]
}

/// Prints the cost of a page beyond its triangles (`slope` seconds each), from the same terrain in pages of two
/// sizes.
fn page_cost((field, views): &(Arc<Field>, Vec<View>), slope: f64) {
    let [small, large] = [16, 64].map(|page| series(field, "sorted-strips:serial", &uniform(400.0, page), views));
    let [triangles, seconds, pages] = [0, 1, 2].map(|k| small[k] - large[k]);
    println!(
        "{:.2} us a page ({:.0} and {:.0} pages)",
        1e6 * (seconds - slope * triangles) / pages,
        small[2],
        large[2]
    );
}

/// Prints the speed-up of two independent walks on two threads against one: an upper bound for parallel walks.
fn two_walks_in_parallel((field, views): &(Arc<Field>, Vec<View>)) {
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
    two_walks_in_parallel(&wide);
    page_cost(&wide, *slope);
    let at = |px: f64| {
        let of_px = |view: &View| View { tolerance: Tolerance { px, ..view.tolerance }, ..*view };
        let views: Vec<_> = wide.1.iter().map(of_px).collect();
        let [triangles, seconds, _] = series(&wide.0, "sorted-strips:serial", &[], &views);
        [triangles, seconds]
    };
    report("sorted-strips:serial, certified", &[32.0, 16.0, 8.0, 4.0, 2.0].map(at));
}
