//! Smooth tiles whatever the viewer and the clock do: one surface in every frame, and the bound wherever nothing waits.

use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

use cuesta::internal::bench::paths;
use cuesta::internal::draw::layout::Frame;
use cuesta::internal::draw::weights::{ONE, get, inside};
use cuesta::internal::draw::{DrawList, expand};
use cuesta::internal::height::{Field, Holes, Samples, synth};
use cuesta::internal::lod::Technique;
use cuesta::internal::measure::{geometric, watertight};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;
use rayon::prelude::*;

use super::{heights, technique};

/// Scripts of random views.
const SCRIPTS: u32 = 10_000;

/// Frames of a script.
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

/// Rough, smooth and a cliff; whole tiles and such that stick out.
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

/// A view of a script: near or far, with any tolerance.
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

/// The next view: a step on, a turn back, a teleport, another tolerance, or the same once more.
fn next(field: &Field, random: &mut Random, [before, last]: [&View; 2]) -> View {
    let dt = random.one_of(&[0.0, 1e-6, 0.1, 0.3, 10.0, 1e9, -5.0]);
    let time_s = last.time_s + dt;
    let way = DVec3::new(random.number() - 0.5, random.number() - 0.5, random.number() - 0.5);
    let step = View { eye: last.eye + way * random.one_of(&[1.0, 10.0]), time_s, ..*last };
    let other = random.one_of(&[0.5, 0.9, 1.1, 2.0]) * last.tolerance.px;
    match (random.number() * 6.0) as u32 {
        0 => View { time_s, ..*before },
        1 => view(field, random, time_s),
        2 => View { tolerance: Tolerance { px: other, ..last.tolerance }, ..step },
        3 => View { time_s, ..*last },
        _ => step,
    }
}

/// What all scripts together came across.
#[derive(Default)]
struct Seen {
    frames: AtomicU64,
    morphing: AtomicU64,
    pending: AtomicU64,
    stitched: AtomicU64,
}

impl Seen {
    fn count(&self, list: &DrawList) {
        self.frames.fetch_add(1, Relaxed);
        let is_between = |weight: u32| weight > 0 && weight < ONE;
        let morphing = list.instances.iter().any(|tile| is_between(get(tile, inside(0))));
        self.morphing.fetch_add(u64::from(morphing), Relaxed);
        self.pending.fetch_add(u64::from(list.pending > 0), Relaxed);
        self.stitched.fetch_add(u64::from(list.levels().iter().filter(|&&n| n > 0).count() > 1), Relaxed);
    }
}

/// Proves every frame of a flight, and measures all of them or those of every so many where nothing waits.
fn check(flight: &str, field: &Field, technique: &mut dyn Technique, views: &[View], measures: bool, seen: &Seen) {
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
fn every_frame_of_random_scripts_is_one_surface_within_the_tolerance() {
    let (fields, seen) = (fields(), Seen::default());
    (0..SCRIPTS).into_par_iter().for_each(|script| {
        let random = &mut Random(u64::from(script) << 20 | 0x5eed);
        (0..5).for_each(|_| _ = random.number());
        let field = &fields[script as usize % fields.len()];
        let clock = random.one_of(&["clock=speed", "clock=time", "clock=frames"]);
        let rebuild = random.one_of(&["rebuild=1", "rebuild=1", "rebuild=16", "rebuild=100000"]);
        let tile = random.one_of(&["tile=9", "tile=9", "tile=17"]);
        let mut technique = technique(field, "smooth-tiles", &[tile, clock, rebuild]);
        let mut views = vec![view(field, random, 0.0)];
        for _ in 1..FRAMES {
            let before = views[views.len().saturating_sub(2)];
            views.push(next(field, random, [&before, &views[views.len() - 1]]));
        }
        check(&format!("script {script}"), field, &mut *technique, &views, script.is_multiple_of(4), &seen);
    });
    let [frames, morphing, pending, stitched] =
        [seen.frames, seen.morphing, seen.pending, seen.stitched].map(AtomicU64::into_inner);
    println!(
        "{frames} frames, {morphing} in mid-morph, {stitched} of several levels, {pending} with something waiting"
    );
    assert!(morphing > frames / 20 && pending > frames / 20 && stitched > frames / 20, "all of it occurs");
}

#[test]
fn every_frame_of_every_path_is_one_surface_within_the_tolerance() {
    let fields = [(synth::Kind::Fractal, [97, 81]), (synth::Kind::Eroded, [97, 97]), (synth::Kind::Cliff, [81, 90])];
    let fields = fields.map(|(kind, size)| Arc::new(synth::synth(kind, size, 3)));
    let clocks = ["clock=speed", "clock=time", "clock=frames"];
    let flights = fields.iter().flat_map(|field| paths::PATHS.iter().map(move |path| (field, path)));
    let flights: Vec<_> = flights.flat_map(|(field, path)| clocks.map(|clock| (field, path, clock))).collect();
    let ways = [("rebuild=100000", "tile=9", 24, false), ("rebuild=1", "tile=17", 90, true)];
    for (rebuild, tile, frames, waits) in ways {
        let seen = Seen::default();
        flights.par_iter().for_each(|(field, path, clock)| {
            let tolerance = Tolerance { px: 2.0, metric: Metric::Certified };
            let views = path.views(field, frames, [320, 200], tolerance);
            let mut technique = technique(field, "smooth-tiles", &[tile, clock, rebuild]);
            check(&format!("{}, {clock}, {rebuild}", path.name), field, &mut *technique, &views, true, &seen);
        });
        let [frames, morphing, pending] = [&seen.frames, &seen.morphing, &seen.pending].map(|n| n.load(Relaxed));
        println!("{rebuild}: {frames} frames, {morphing} in mid-morph, {pending} with something waiting");
        assert!(morphing > frames / 20 && (pending > 0) == waits, "{rebuild}: {morphing}, {pending} of {frames}");
    }
}

/// Corners: lattice position, and height as bits.
type Triangle = [(i32, i32, u32); 3];

/// The triangles of a view once the technique has settled in it, in any order, and how many frames that took.
fn settled(field: &Field, technique: &mut dyn Technique, view: &View) -> (Vec<Triangle>, u32) {
    for frame in 1..5000 {
        let mut list = DrawList::default();
        technique.select(&View { time_s: view.time_s + f64::from(frame), ..*view }, &mut list);
        if technique.is_settled() {
            assert_eq!(list.pending, 0, "nothing waits any more");
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
fn one_chunk_a_frame_comes_to_the_same_terrain_as_all_at_once() {
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
    assert!(longest > 10, "something had to wait");
}

/// The list of a view once the technique has settled in it.
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

/// A view that the buffer cannot hold is drawn under a wider tolerance, which it keeps, and no tile waits for ever.
#[test]
fn a_full_buffer_widens_the_tolerance() {
    let field = Arc::new(synth::synth(synth::Kind::Eroded, [257, 257], 5));
    let (random, mut frames, mut select_within_limits) = (&mut Random(11), 0, 0);
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
            (frames, select_within_limits) =
                (frames + 1, select_within_limits + usize::from(list.tolerance_scale > 1.0));
        }
    }
    println!("{select_within_limits} of {frames} views under a wider tolerance");
    assert!(select_within_limits > frames / 20 && select_within_limits < frames - frames / 20);
}

/// Frames of a way along which tiles only coarsen: the bound never hurries them.
const COARSENING: u32 = 250;

/// The furthest that the surface moved from one frame to the next over any sample, as a part of the field's range of
/// heights, beyond what the clock says; and how far it moved at most. The clock's part counts twice, as a vertex goes
/// with the inside and with a side, and so do the steps of weights.
fn beyond_the_clock(field: &Field, technique: &mut dyn Technique, drive: &str) -> [f64; 2] {
    let range = field.statistics();
    let range_m = f64::from(range.max - range.min);
    let centre = field.world_at(20.0, 18.0, 10.0);
    let away = DVec3::new(0.6, 0.5, 0.62);
    let (mut last, mut found, mut time_s) = (Vec::new(), [f64::MIN, 0.0], 0.0);
    for k in 0..COARSENING {
        // By speed the viewer goes away; else the tolerance leaps, and nothing but the clock goes on.
        let [way_m, px] = if drive == "speed" { [f64::from(k), 8.0] } else { [0.0, if k == 0 { 0.3 } else { 40.0 }] };
        let eye = centre + away * (150.0 + way_m);
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
        // What waits for its first chunk moves as soon as that is there.
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
fn nothing_moves_further_in_a_frame_than_the_clock_says() {
    for drive in ["speed", "time", "frames"] {
        let (clock, mut max, mut leap) = (format!("clock={drive}"), 0.0f64, f64::MIN);
        // Tiles that stick out of a field do not morph inside: the last one has some.
        for field in &fields()[..3] {
            for rebuild in ["rebuild=1", "rebuild=100000"] {
                let mut morphing = technique(field, "smooth-tiles", &["tile=9", &clock, rebuild]);
                let [beyond, moved] = beyond_the_clock(field, &mut *morphing, drive);
                assert!(beyond <= 0.0, "{drive}, {rebuild}: {beyond} of the range beyond the clock");
                max = max.max(moved);
            }
            let mut at_once = technique(field, "smooth-tiles", &["tile=9", "morph=off"]);
            leap = leap.max(beyond_the_clock(field, &mut *at_once, drive)[0]);
        }
        println!("{drive}: {max:.4} of the range in a frame at most; at once {leap:.4} beyond the clock");
        assert!(max > 0.005 && leap > 0.05, "{drive}: it moves, and at once it leaps: {max}, {leap}");
    }
}
