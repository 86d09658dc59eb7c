//! Blow 2000 again: wedges looked at and time for a frame's splits and merges, by made-up spheres, by ROAM's queues and
//! among all, at 10⁴ to 10⁶ wedges, along a slow, a fast and a leaping path; and the exponent rule against a logarithm.
//!
//! ROAM stands here twice: its priorities wait for the way that the viewpoint has really gone, which is the best that
//! they can, and for that at the largest speed it may have, as published: here the fast path's.
//! And what is selected and sent for a frame where triangles are streamed, and where blocks are kept on the device.
//! `cargo bench --no-default-features --features bench --bench spheres`, while nothing else runs; with `-- 100000 leaping` that alone.

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
use cuesta::internal::texture::resolution::{level_by_exponent, level_by_logarithm};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;

/// Samples along a side, and metres between them.
const SIDE: u32 = 2049;
const SPACING_M: f64 = 10.0;
/// Frames of a path that count, after as many that do not.
const FRAMES: usize = 200;
/// Metres a frame: a walk, and a flight at 300 m/s and 60 frames a second.
const SLOW_M: f64 = 0.05;
const FAST_M: f64 = 5.0;

/// Times that a path is walked: of each frame the shortest time counts, so that what else the machine does is no hitch.
const ROUNDS: usize = 3;

/// Medians and maxima of the counted frames.
struct Row {
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

/// The tolerance, pixels, at which an eye sees so many wedges.
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

/// A path of eyes, a curve at a speed or leaps.
fn path(measured: &Measured, step_m: Option<f64>) -> Vec<DVec3> {
    let extent = f64::from(SIDE - 1) * SPACING_M;
    let place = |k: usize| match step_m {
        Some(step) => DVec3::new(0.4, 0.0, 0.45) * extent + DVec3::new(0.8, 0.0, 0.6) * step * k as f64,
        None => DVec3::new((k as f64 * 0.618).fract(), 0.0, (k as f64 * 0.414).fract()) * extent,
    };
    let above = |at: DVec3| at + DVec3::Y * (measured.field.height_at(at.x, at.z).unwrap_or(0.0) + 30.0);
    (0..2 * FRAMES).map(|k| above(place(k))).collect()
}

fn row<F: FnMut(&Viewpoint) -> usize>(path: &[DVec3], reach: Reach, count: usize, mut begin: impl FnMut() -> F) -> Row {
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
    Row { visited: [visited[FRAMES / 2], visited[FRAMES - 1]], time_us: [times[FRAMES / 2], times[FRAMES - 1]] }
}

fn following<W: CrossingTracker>(
    begin: impl Fn() -> Follower<W>,
    measured: &Measured,
    path: &[DVec3],
    reach: Reach,
) -> Row {
    row(path, reach, ROUNDS, || {
        let mut follower = begin();
        move |from| {
            follower.follow(measured, from, usize::MAX);
            follower.visited()
        }
    })
}

fn plain(measured: &Measured, path: &[DVec3], reach: Reach) -> Row {
    // It does the same in every frame.
    row(path, reach, 1, || {
        let (mut splits, mut found) = (Splits::none(measured), Found::default());
        move |from| {
            splits.refill(measured, from, &mut found, usize::MAX);
            found.visited
        }
    })
}

fn print(name: &str, Row { visited, time_us }: &Row) {
    let ([visits, max], [us, longest]) = (visited, time_us);
    println!("    {name:22} {visits:8} wedges (most {max:8}) {us:9.1} µs (longest {longest:9.1})");
}

/// Selects along a path with a technique's own lists: medians and maxima of bytes sent and of time, after the frames that
/// do not count.
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
    let is_meant = |name: &str, others: &[&str]| {
        words.iter().any(|word| word == name) || !words.iter().any(|word| others.contains(&word.as_str()))
    };
    for wedges in [10_000, 100_000, 1_000_000] {
        if !is_meant(&wedges.to_string(), &["10000", "100000", "1000000"]) {
            continue;
        }
        let start = path(&measured, Some(FAST_M))[FRAMES];
        let px = tolerance(&measured, start, wedges);
        println!("{wedges} wedges, {px:.2} px");
        for (name, step) in [("slow", Some(SLOW_M)), ("fast", Some(FAST_M)), ("leaping", None)] {
            if !is_meant(name, &["slow", "fast", "leaping"]) {
                continue;
            }
            let (path, reach) = (path(&measured, step), reach(px));
            println!("  {name}");
            let bounded = || {
                let mut bounded = Follower::<Queues>::new(&measured);
                bounded.tracker().largest_speed = FAST_M;
                bounded
            };
            print("spheres", &following(|| Follower::<BoundingSpheres>::new(&measured), &measured, &path, reach));
            print("spheres with covers", &following(|| Follower::<Covers>::new(&measured), &measured, &path, reach));
            print("ROAM, way gone", &following(|| Follower::<Queues>::new(&measured), &measured, &path, reach));
            print("ROAM, largest speed", &following(bounded, &measured, &path, reach));
            print("plain", &plain(&measured, &path, reach));
            patches(&measured.field, "streamed", &path, px);
            patches(&measured.field, "resident", &path, px);
        }
    }
}
