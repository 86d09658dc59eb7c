//! Smooth tiles: checks that the surface is watertight in every frame, for any movement and clock, and that the error
//! bound holds whenever nothing is pending.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use cuesta::internal::bench::paths;
use cuesta::internal::draw::layout::Frame;
use cuesta::internal::draw::weights::{ONE, Slot, SlotWeights};
use cuesta::internal::draw::{DrawList, expand};
use cuesta::internal::height::{Field, Holes, Samples, synth};
use cuesta::internal::lod::Technique;
use cuesta::internal::measure::{geometric, watertight};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;
use rayon::prelude::*;

use super::{heights, technique};

/// Number of random flights.
const FLIGHTS: u32 = 10_000;

/// Frames per flight.
const FRAMES: u32 = 7;

struct Random(u64);

impl Random {
    fn number(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn one_of<T: Copy>(&mut self, of: &[T]) -> T {
        of[(self.number() * of.len() as f64) as usize]
    }
}

/// Returns rough, smooth and cliff fields, of whole tiles and of partial ones.
fn fields() -> Vec<Arc<Field>> {
    let field = |size: [u32; 2], height: &dyn Fn(u32, u32) -> f32| {
        let heights = (0..size[0] * size[1]).map(|k| height(k % size[0], k / size[0])).collect();
        let holes = Holes::none((size[0] * size[1]) as usize);
        Arc::new(Field::new(Samples::F32(heights), size, [2.0, 2.0], holes))
    };
    let rough = |i: u32, j: u32| ((i * 7919 + j * 104_729) % 101) as f32 / 5.0;
    let smooth = |i: u32, j: u32| 30.0 * ((i as f32 / 11.0).sin() + (j as f32 / 7.0).cos());
    let cliff = |i: u32, j: u32| if i + j / 3 > 20 { 60.0 } else { rough(i, j) / 8.0 };
    vec![field([33, 33], &rough), field([41, 33], &smooth), field([33, 41], &cliff), field([30, 37], &rough)]
}

/// Returns a random view, near or far, with any tolerance.
fn view(field: &Field, random: &mut Random, time_s: f64) -> View {
    let [w, h] = field.size().map(f64::from);
    let at = |random: &mut Random| field.world_at(w * random.number(), h * random.number(), 80.0 * random.number());
    let eye = at(random) + DVec3::Y * random.one_of(&[1.0, 60.0, 2000.0]) * random.number();
    let target = at(random);
    View {
        eye,
        world_from_eye: View::looking_along(target - eye),
        lens: Lens::Perspective { fov_x: 0.3 + 1.8 * random.number() },
        size: [320, 200],
        near: 0.1,
        tolerance: Tolerance { px: random.one_of(&[0.3, 1.0, 3.0, 10.0, 40.0]), metric: Metric::Certified },
        time_s,
    }
}

/// Returns the next view: a step, the view before, a teleport, another tolerance, or the same view.
fn next(field: &Field, random: &mut Random, [before, last]: [&View; 2]) -> View {
    let dt = random.one_of(&[0.0, 1e-6, 0.1, 0.3, 10.0, 1e9, -5.0]);
    let time_s = last.time_s + dt;
    let direction = DVec3::new(random.number() - 0.5, random.number() - 0.5, random.number() - 0.5);
    let step = View { eye: last.eye + direction * random.one_of(&[1.0, 10.0]), time_s, ..*last };
    let other = random.one_of(&[0.5, 0.9, 1.1, 2.0]) * last.tolerance.px;
    match (random.number() * 6.0) as u32 {
        0 => View { time_s, ..*before },
        1 => view(field, random, time_s),
        2 => View { tolerance: Tolerance { px: other, ..last.tolerance }, ..step },
        3 => View { time_s, ..*last },
        _ => step,
    }
}

/// Counters over all flights.
#[derive(Default)]
struct Counters {
    frames: AtomicU64,
    morphing: AtomicU64,
    pending: AtomicU64,
    stitched: AtomicU64,
}

impl Counters {
    fn count(&self, list: &DrawList) {
        self.frames.fetch_add(1, Relaxed);
        let is_between = |weight: u32| weight > 0 && weight < ONE;
        let morphing = list.instances.iter().any(|tile| is_between(SlotWeights::of(tile).get(Slot::inside(0))));
        self.morphing.fetch_add(u64::from(morphing), Relaxed);
        self.pending.fetch_add(u64::from(list.pending > 0), Relaxed);
        self.stitched.fetch_add(u64::from(list.levels().iter().filter(|&&n| n > 0).count() > 1), Relaxed);
    }
}

/// Checks every frame of a flight for watertightness. With `measures`, also measures the error of frames in which
/// nothing is pending.
fn check(flight: &str, field: &Field, technique: &mut dyn Technique, views: &[View], measures: bool, seen: &Counters) {
    for (frame, view) in views.iter().enumerate() {
        let mut list = DrawList::default();
        technique.select(view, &mut list);
        let proof =
            watertight::prove_list(field, view, technique.pipeline_requirements().seams, technique.resident(), &list);
        proof.unwrap_or_else(|why| panic!("{flight}, frame {frame}: {why}"));
        if list.pending == 0 && measures {
            let max_px = geometric::errors(field, view, technique.resident(), &list).screen_px.max;
            let px = view.tolerance.px;
            assert!(max_px <= px * (1.0 + 1e-9), "{flight}, frame {frame}: {max_px} px of {px}");
        }
        seen.count(&list);
    }
}

#[test]
fn random_flights_are_watertight_and_within_the_tolerance() {
    let (fields, seen) = (fields(), Counters::default());
    (0..FLIGHTS).into_par_iter().for_each(|flight| {
        let random = &mut Random(u64::from(flight) << 20 | 0x5eed);
        (0..5).for_each(|_| _ = random.number());
        let field = &fields[flight as usize % fields.len()];
        let clock = random.one_of(&["clock=speed", "clock=time", "clock=frames"]);
        let rebuild = random.one_of(&["rebuild=1", "rebuild=1", "rebuild=16", "rebuild=100000"]);
        let tile = random.one_of(&["tile=9", "tile=9", "tile=17"]);
        let mut technique = technique(field, "smooth-tiles", &[tile, clock, rebuild]);
        let mut views = vec![view(field, random, 0.0)];
        for _ in 1..FRAMES {
            let before = views[views.len().saturating_sub(2)];
            views.push(next(field, random, [&before, &views[views.len() - 1]]));
        }
        check(&format!("flight {flight}"), field, &mut *technique, &views, flight.is_multiple_of(4), &seen);
    });
    let [frames, morphing, pending, stitched] =
        [seen.frames, seen.morphing, seen.pending, seen.stitched].map(AtomicU64::into_inner);
    println!("{frames} frames, {morphing} morphing, {stitched} of several levels, {pending} with something pending");
    assert!(morphing > frames / 20 && pending > frames / 20 && stitched > frames / 20, "all of it occurs");
}

#[test]
fn all_paths_are_watertight_and_within_the_tolerance() {
    let fields = [(synth::Kind::Fractal, [97, 81]), (synth::Kind::Eroded, [97, 97]), (synth::Kind::Cliff, [81, 90])];
    let fields = fields.map(|(kind, size)| Arc::new(synth::synth(kind, size, 3)));
    let clocks = ["clock=speed", "clock=time", "clock=frames"];
    let flights = fields.iter().flat_map(|field| paths::PATHS.iter().map(move |path| (field, path)));
    let flights: Vec<_> = flights.flat_map(|(field, path)| clocks.map(|clock| (field, path, clock))).collect();
    let cases = [("rebuild=100000", "tile=9", 24, false), ("rebuild=1", "tile=17", 90, true)];
    for (rebuild, tile, frames, has_pending) in cases {
        let seen = Counters::default();
        flights.par_iter().for_each(|(field, path, clock)| {
            let tolerance = Tolerance { px: 2.0, metric: Metric::Certified };
            let views = path.views(field, frames, [320, 200], tolerance);
            let mut technique = technique(field, "smooth-tiles", &[tile, clock, rebuild]);
            check(&format!("{}, {clock}, {rebuild}", path.name), field, &mut *technique, &views, true, &seen);
        });
        let [frames, morphing, pending] = [&seen.frames, &seen.morphing, &seen.pending].map(|n| n.load(Relaxed));
        println!("{rebuild}: {frames} frames, {morphing} morphing, {pending} with something pending");
        assert!(morphing > frames / 20 && (pending > 0) == has_pending, "{rebuild}: {morphing}, {pending} of {frames}");
    }
}

/// Corners: lattice position, and height as bits.
type Triangle = [(i32, i32, u32); 3];

/// Returns the triangles of a view after the technique has settled, sorted, and the number of frames until then.
fn settled(field: &Field, technique: &mut dyn Technique, view: &View) -> (Vec<Triangle>, u32) {
    for frame in 1..5000 {
        let mut list = DrawList::default();
        technique.select(&View { time_s: view.time_s + f64::from(frame), ..*view }, &mut list);
        if technique.is_settled() {
            assert_eq!(list.pending, 0, "nothing has_pending any more");
            let frame_data = Frame::placing(field, view);
            let drawn = expand::triangles(field, &frame_data, technique.resident(), &list);
            let mut triangles: Vec<Triangle> =
                drawn.iter().map(|t| t.corners.map(|c| (c.x, c.z, c.y.to_bits()))).collect();
            triangles.sort_unstable();
            return (triangles, frame);
        }
    }
    panic!("it never settles");
}

#[test]
fn rebuild_limit_does_not_change_the_settled_triangles() {
    let random = &mut Random(7);
    let mut longest = 0;
    for field in fields() {
        for clock in ["clock=time", "clock=frames"] {
            let [mut one, mut all] = ["rebuild=1", "rebuild=100000"]
                .map(|rebuild| technique(&field, "smooth-tiles", &["tile=9", clock, rebuild]));
            for k in 0..12 {
                let view = view(&field, random, 1e6 * f64::from(k));
                let (slow, frames) = settled(&field, &mut *one, &view);
                assert_eq!(slow, settled(&field, &mut *all, &view).0, "{clock}, view {k}");
                longest = longest.max(frames);
            }
        }
    }
    assert!(longest > 10, "something was pending");
}

/// Returns the list of a view after the technique has settled.
fn settled_list(technique: &mut dyn Technique, view: &View) -> DrawList {
    for frame in 1..5000 {
        let mut list = DrawList::default();
        technique.select(&View { time_s: view.time_s + f64::from(frame), ..*view }, &mut list);
        if technique.is_settled() {
            return list;
        }
    }
    panic!("it never settles");
}

/// A view that the buffer cannot hold is drawn under a greater tolerance, which is kept, and no tile stays pending.
#[test]
fn full_buffer_scales_the_tolerance() {
    let field = Arc::new(synth::synth(synth::Kind::Eroded, [257, 257], 5));
    let (random, mut frames, mut scaled) = (&mut Random(11), 0, 0);
    for settings in [
        ["morph=on", "clock=speed"],
        ["morph=on", "clock=time"],
        ["morph=on", "clock=frames"],
        ["morph=off", "clock=speed"],
    ] {
        let settings = [&["tile=17", "memory=1"][..], &settings].concat();
        let mut technique = technique(&field, "smooth-tiles", &settings);
        for k in 0..100 {
            let view = view(&field, random, 1e6 * f64::from(k));
            let list = settled_list(&mut *technique, &view);
            assert_eq!(list.pending, 0, "{settings:?}, view {k}");
            watertight::prove_list(&field, &view, technique.pipeline_requirements().seams, technique.resident(), &list)
                .unwrap();
            let max_px = geometric::errors(&field, &view, technique.resident(), &list).screen_px.max;
            let px = view.tolerance.px * list.tolerance_scale;
            assert!(max_px <= px * (1.0 + 1e-9), "{settings:?}, view {k}: {max_px} px of {px}");
            (frames, scaled) = (frames + 1, scaled + usize::from(list.tolerance_scale > 1.0));
        }
    }
    println!("{scaled} of {frames} views under a greater tolerance");
    assert!(scaled > frames / 20 && scaled < frames - frames / 20);
}

/// Frames of a flight in which tiles only coarsen, so that the error bound never speeds them up.
const COARSENING: u32 = 250;

/// Returns the largest movement of the surface in one frame at any sample, minus the movement that the clock allows, as
/// a part of the field's height range; and the largest movement itself. The clock's part counts twice, because a vertex
/// may move with the inside and with a side, and so do the steps of weights.
fn movement_beyond_the_clock(field: &Field, technique: &mut dyn Technique, drive: &str) -> [f64; 2] {
    let range = field.statistics();
    let range_m = f64::from(range.max - range.min);
    let centre = field.world_at(20.0, 18.0, 10.0);
    let away = DVec3::new(0.6, 0.5, 0.62);
    let (mut last, mut found, mut time_s) = (Vec::new(), [f64::MIN, 0.0], 0.0);
    for k in 0..COARSENING {
        // With `clock=speed` the viewer recedes. Otherwise the tolerance jumps once, and only the clock advances.
        let [moved_m, px] = if drive == "speed" { [f64::from(k), 8.0] } else { [0.0, if k == 0 { 0.3 } else { 40.0 }] };
        let eye = centre + away * (150.0 + moved_m);
        let dt_s = [0.0, 0.01, 0.03][k as usize % 3];
        time_s += dt_s;
        let view = View {
            eye,
            world_from_eye: View::looking_along(-away),
            lens: Lens::Perspective { fov_x: 1.5 },
            size: [320, 320],
            near: 0.1,
            tolerance: Tolerance { px, metric: Metric::Certified },
            time_s,
        };
        let mut list = DrawList::default();
        technique.select(&view, &mut list);
        // Tiles pending on their first chunk move as soon as it arrives.
        while k == 0 && !technique.is_settled() {
            list.clear();
            time_s += 1.0;
            technique.select(&View { time_s, ..view }, &mut list);
        }
        let now = heights(field, &view, technique.resident(), &list);
        let nearest_m = eye.distance(centre) - 70.0;
        let levels = match drive {
            "speed" => 1.0 / (0.25 * nearest_m),
            "time" => dt_s,
            _ => 1.0 / 30.0,
        };
        let moved = last.iter().zip(&now).map(|(a, b): (&f64, &f64)| (a - b).abs() / range_m).fold(0.0, f64::max);
        if k > 0 {
            found = [found[0].max(moved - 2.0 * levels - 2.0 / f64::from(ONE)), found[1].max(moved)];
        }
        last = now;
    }
    found
}

#[test]
fn movement_per_frame_is_limited_by_the_clock() {
    for drive in ["speed", "time", "frames"] {
        let (clock, mut max, mut jump) = (format!("clock={drive}"), 0.0f64, f64::MIN);
        // Partial tiles do not morph inside; the last field has some.
        for field in &fields()[..3] {
            for rebuild in ["rebuild=1", "rebuild=100000"] {
                let mut morphing = technique(field, "smooth-tiles", &["tile=9", &clock, rebuild]);
                let [beyond, moved] = movement_beyond_the_clock(field, &mut *morphing, drive);
                assert!(beyond <= 0.0, "{drive}, {rebuild}: {beyond} of the range beyond the clock");
                max = max.max(moved);
            }
            let mut at_once = technique(field, "smooth-tiles", &["tile=9", "morph=off"]);
            jump = jump.max(movement_beyond_the_clock(field, &mut *at_once, drive)[0]);
        }
        println!("{drive}: {max:.4} of the range in a frame at most; at once {jump:.4} beyond the clock");
        assert!(max > 0.005 && jump > 0.05, "{drive}: it moves, and at once it jumps: {max}, {jump}");
    }
}
