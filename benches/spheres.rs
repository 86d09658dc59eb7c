//! Benchmark of Blow 2000: wedges visited and time for a frame's splits and merges, at 10⁴ to 10⁶ wedges along slow,
//! fast and leaping paths; and the exponent rule against a logarithm.
//!
//! Compared are bounding spheres, bounding spheres with covers, ROAM's queues, and a test of all wedges. ROAM runs
//! twice: with priorities delayed by the distance really travelled, its best case, and by the maximum speed (the fast
//! path's), as published. Also measured: selection time and bytes sent per frame with streamed triangles and with
//! resident blocks.
//!
//! `cargo bench --no-default-features --features bench --bench spheres` on an idle machine; `-- 100000 leaping` runs that case alone.

use std::hint::black_box;
use std::sync::Arc;
use std::time::Instant;

use cuesta::internal::draw::{DrawList, ExplicitVertex};
use cuesta::internal::height::progress::Progress;
use cuesta::internal::height::{Field, synth};
use cuesta::internal::lod::sphere_tree::bounding_spheres::BoundingSpheres;
use cuesta::internal::lod::sphere_tree::covers::Covers;
use cuesta::internal::lod::sphere_tree::front::{CrossingTracker, Follower};
use cuesta::internal::lod::sphere_tree::measure::Measured;
use cuesta::internal::lod::sphere_tree::reach::{Reach, Viewpoint};
use cuesta::internal::lod::sphere_tree::roam::Queues;
use cuesta::internal::lod::sphere_tree::splits::{Found, Splits};
use cuesta::internal::lod::{self, Settings};
use cuesta::internal::texture::resolution::level_by_exponent;
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;

/// Samples along a side, and metres between them.
const SIDE: u32 = 2049;
const SPACING_M: f64 = 10.0;
/// Timed frames of a path, after as many warm-up frames.
const FRAMES: usize = 200;
/// Metres per frame: a walk, and a flight at 300 m/s and 60 frames per second.
const SLOW_M: f64 = 0.05;
const FAST_M: f64 = 5.0;

/// Repetitions of a path. The shortest time of each frame is used, to exclude other load.
const ROUNDS: usize = 3;

/// Median and maximum over the timed frames.
struct Measurement {
    visited: [usize; 2],
    time_us: [f64; 2],
}

fn view(eye: DVec3, px: f64) -> View {
    View {
        eye,
        world_from_eye: View::turned(37.0, -15.0, 0.0),
        lens: Lens::Perspective { fov_x: 1.2 },
        size: [1280, 720],
        near: 0.1,
        tolerance: Tolerance { px, metric: Metric::Certified },
        time_s: 0.0,
    }
}

fn reach(px: f64) -> Reach {
    Reach::new(&view(DVec3::ZERO, px))
}

/// Returns the tolerance, pixels, at which `wedges` wedges are drawn from an eye.
fn tolerance(measured: &Measured, eye: DVec3, wedges: usize) -> f64 {
    let (mut splits, mut found) = (Splits::none(measured), Found::default());
    let [mut low, mut high] = [1e-3f64, 1e3];
    for _ in 0..25 {
        let px = (low * high).sqrt();
        let from = Viewpoint { eye, reach: reach(px), band: 1.0, hold: 1.0 };
        let fits = splits.refill(measured, &from, &mut found, wedges / 2);
        *(if fits { &mut high } else { &mut low }) = px;
    }
    high
}

/// Returns eye positions along a curve with `step_m` metres per frame, or random jumps for `None`.
fn path(measured: &Measured, step_m: Option<f64>) -> Vec<DVec3> {
    let extent = f64::from(SIDE - 1) * SPACING_M;
    let position = |k: usize| match step_m {
        Some(step) => DVec3::new(0.4, 0.0, 0.45) * extent + DVec3::new(0.8, 0.0, 0.6) * step * k as f64,
        None => DVec3::new((k as f64 * 0.618).fract(), 0.0, (k as f64 * 0.414).fract()) * extent,
    };
    let above = |at: DVec3| at + DVec3::Y * (measured.field.height_at(at.x, at.z).unwrap_or(0.0) + 30.0);
    (0..2 * FRAMES).map(|k| above(position(k))).collect()
}

/// Measures a function of the viewpoint along a path: wedges visited and time.
fn measure<F: FnMut(&Viewpoint) -> usize>(
    path: &[DVec3],
    reach: Reach,
    count: usize,
    mut begin: impl FnMut() -> F,
) -> Measurement {
    let mut round = || -> Vec<_> {
        let mut follow = begin();
        let measured = path.iter().map(|&eye| {
            let from = Viewpoint { eye, reach, band: 1.0, hold: 1.0 };
            let start = Instant::now();
            let visited = follow(&from);
            (2 * visited, 1e6 * start.elapsed().as_secs_f64())
        });
        measured.collect()
    };
    let rounds: Vec<_> = (0..count).map(|_| round()).collect();
    let shortest = |k: usize| rounds.iter().map(|frames| frames[k].1).fold(f64::INFINITY, f64::min);
    let (mut visited, mut times): (Vec<_>, Vec<_>) =
        (FRAMES..path.len()).map(|k| (rounds[0][k].0, shortest(k))).unzip();
    visited.sort_unstable();
    times.sort_unstable_by(f64::total_cmp);
    Measurement { visited: [visited[FRAMES / 2], visited[FRAMES - 1]], time_us: [times[FRAMES / 2], times[FRAMES - 1]] }
}

fn measure_follower<W: CrossingTracker>(
    begin: impl Fn() -> Follower<W>,
    measured: &Measured,
    path: &[DVec3],
    reach: Reach,
) -> Measurement {
    measure(path, reach, ROUNDS, || {
        let mut follower = begin();
        move |from| {
            follower.follow(measured, from, usize::MAX);
            follower.visited()
        }
    })
}

fn measure_all(measured: &Measured, path: &[DVec3], reach: Reach) -> Measurement {
    // Every frame does the same work, so one round suffices.
    measure(path, reach, 1, || {
        let (mut splits, mut found) = (Splits::none(measured), Found::default());
        move |from| {
            splits.refill(measured, from, &mut found, usize::MAX);
            found.visited
        }
    })
}

fn print(name: &str, Measurement { visited, time_us }: &Measurement) {
    let ([visits, max], [us, longest]) = (visited, time_us);
    println!("    {name:22} {visits:8} wedges (most {max:8}) {us:9.1} µs (longest {longest:9.1})");
}

/// Measures selection time and bytes sent along a path with the technique's own lists.
fn patches(field: &Arc<Field>, patches: &str, path: &[DVec3], px: f64) {
    let entry = lod::find("sphere-tree").expect("in the table");
    let settings = [("patches".to_string(), patches.to_string())];
    let mut technique = (entry.build)(Arc::clone(field), &Settings::new(entry, None, &settings).expect("a setting"));
    let (mut list, mut bytes, mut times) = (DrawList::default(), Vec::new(), Vec::new());
    for (k, &eye) in path.iter().enumerate() {
        list.clear();
        let start = Instant::now();
        technique.select(&view(eye, px), &mut list);
        let time_ms = 1e3 * start.elapsed().as_secs_f64();
        if k >= FRAMES {
            let size = list.size();
            let streamed = size.vertices * size_of::<ExplicitVertex>() + size.indices * size_of::<u32>();
            bytes.push(streamed + size.upload_bytes);
            times.push(time_ms);
        }
    }
    bytes.sort_unstable();
    times.sort_unstable_by(f64::total_cmp);
    let [median, last] = [FRAMES / 2, FRAMES - 1];
    println!(
        "    {patches:9} {:9} triangles in the last frame, {:9} B sent (most {:9}), {:7.2} ms (longest {:7.2})",
        list.triangles(),
        bytes[median],
        bytes[last],
        times[median],
        times[last]
    );
}

/// The texture level by its definition: J. Blow, "Terrain Rendering at High Levels of Detail" (2000), §4.3.
fn level_by_logarithm(texels: f32, triangle_level: u32) -> i32 {
    (0.5 * (f64::from(texels).log2() + f64::from(triangle_level + 1))).ceil() as i32
}

fn logarithm_against_exponent() {
    let areas: Vec<f32> = (0..1u32 << 16).map(|k| f32::from_bits(0x3f80_0000 + k * 1021)).collect();
    let time = |level: &dyn Fn(f32, u32) -> i32| {
        let once = |_| {
            let start = Instant::now();
            for (k, &area) in areas.iter().enumerate() {
                black_box(level(black_box(area), k as u32 & 31));
            }
            start.elapsed().as_secs_f64() * 1e9 / areas.len() as f64
        };
        (0..50).map(once).fold(f64::INFINITY, f64::min)
    };
    let [slow, quick] = [time(&level_by_logarithm), time(&level_by_exponent)];
    println!("texture level: {slow:.2} ns by logarithm, {quick:.2} ns by exponent, {:.1} times", slow / quick);
}

fn main() {
    logarithm_against_exponent();
    let mut field = synth::synth(synth::Kind::Fractal, [SIDE; 2], 7);
    field.spacing = [SPACING_M; 2];
    let measured = Measured::new(Arc::new(field), 1.0, &Progress::default());
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let is_selected = |name: &str, others: &[&str]| {
        words.iter().any(|word| word == name) || !words.iter().any(|word| others.contains(&word.as_str()))
    };
    for wedges in [10_000, 100_000, 1_000_000] {
        if !is_selected(&wedges.to_string(), &["10000", "100000", "1000000"]) {
            continue;
        }
        let start = path(&measured, Some(FAST_M))[FRAMES];
        let px = tolerance(&measured, start, wedges);
        println!("{wedges} wedges, {px:.2} px");
        for (name, step) in [("slow", Some(SLOW_M)), ("fast", Some(FAST_M)), ("leaping", None)] {
            if !is_selected(name, &["slow", "fast", "leaping"]) {
                continue;
            }
            let (path, reach) = (path(&measured, step), reach(px));
            println!("  {name}");
            let bounded = || {
                let mut bounded = Follower::<Queues>::new(&measured);
                bounded.tracker().largest_speed = FAST_M;
                bounded
            };
            print(
                "spheres",
                &measure_follower(|| Follower::<BoundingSpheres>::new(&measured), &measured, &path, reach),
            );
            print(
                "spheres with covers",
                &measure_follower(|| Follower::<Covers>::new(&measured), &measured, &path, reach),
            );
            print(
                "ROAM, distance gone",
                &measure_follower(|| Follower::<Queues>::new(&measured), &measured, &path, reach),
            );
            print("ROAM, largest speed", &measure_follower(bounded, &measured, &path, reach));
            print("all wedges", &measure_all(&measured, &path, reach));
            patches(&measured.field, "streamed", &path, px);
            patches(&measured.field, "resident", &path, px);
        }
    }
}
