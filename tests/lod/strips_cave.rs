//! Sorted strips over a floor and a ceiling: watertight, in front-to-back order, and within the tolerance.

use std::sync::Arc;

use cuesta::internal::draw::DrawList;
use cuesta::internal::draw::expand::{self, Drawn};
use cuesta::internal::draw::layout::Frame;
use cuesta::internal::height::cave::Cave;
use cuesta::internal::height::{Field, Holes, Samples, rtin, surface};
use cuesta::internal::lod::sorted_strips::cave::CaveStrips;
use cuesta::internal::lod::{self, Settings, Technique};
use cuesta::internal::measure::watertight::cave::{CaveProof, prove_cave};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;
use rayon::prelude::*;

use super::strips_order::{SIZE, follow};

const SPACING: [f64; 2] = [2.0, 3.0];

/// Returns a cave of smooth passages between rough pillars, with some rock of one sample.
fn cave(size: [u32; 2], seed: u64) -> Cave {
    let wave = |i: u32, j: u32, k: u64| {
        let phase = seed as f64 * 0.7 + k as f64 * 2.1;
        (f64::from(i) * 0.11 + phase).sin() * (f64::from(j) * 0.13 - phase).cos() * 9.0
            + (f64::from(i + 2 * j) * 0.41 + phase).sin()
    };
    let rough = |i: u32, j: u32| {
        let mixed = (u64::from(i) << 20 ^ u64::from(j)).wrapping_add(seed).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40;
        mixed as f64 / (1u64 << 24) as f64
    };
    let field = |k: u64, up: f64| {
        let height = |n: u32| {
            let (i, j) = (n % size[0], n / size[0]);
            let single = if k == 1 && rough(i, j) > 0.995 { -40.0 } else { 0.0 };
            (wave(i, j, k) + up + 0.5 * rough(i + 7 * k as u32, j) + single) as f32
        };
        let samples = Samples::F32((0..size[0] * size[1]).map(height).collect());
        let mut field = Field::new(samples, size, SPACING, Holes::none((size[0] * size[1]) as usize));
        field.origin = [1000.0, -500.0];
        field
    };
    Cave::new(&field(0, 0.0), &field(1, 5.0), "ceiling").expect("two fields of one size")
}

fn strips(cave: &Arc<Cave>, settings: &[(&str, &str)]) -> CaveStrips {
    let entry = lod::find("sorted-strips").expect("in the table");
    let settings: Vec<_> = settings.iter().map(|(k, v)| (k.to_string(), v.to_string())).collect();
    CaveStrips::new(Arc::clone(cave), &Settings::new(entry, None, &settings).expect("the table's own values"))
}

fn drawn(cave: &Cave, strips: &mut CaveStrips, view: &View) -> Vec<Drawn> {
    let mut list = DrawList::default();
    strips.select(view, &mut list);
    assert!(strips.limits().hold(&list.size()) && list.tolerance_scale == 1.0);
    expand::triangles(cave.floor(), &Frame::placing(cave.floor(), view), strips.resident(), &list)
}

/// Returns a view from inside the cave if it has space there, otherwise from above or below.
fn view(cave: &Cave, k: u64) -> View {
    let share =
        |n: u64| (k.wrapping_mul(6 * n + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 40) as f64 / (1u64 << 24) as f64;
    let size = cave.floor().size();
    let at = [0, 1].map(|n| (share(n as u64 + 1) * f64::from(size[n])) as u32);
    let [low, high] = [cave.floor(), cave.ceiling()].map(|field| f64::from(field.height(at[0], at[1])));
    let aside = [0.0, 40.0, -40.0][if k.is_multiple_of(3) { 1 + (k / 3 % 2) as usize } else { 0 }];
    let eye = cave.floor().world_at(f64::from(at[0]) + 0.3, f64::from(at[1]) + 0.4, low * 0.6 + high * 0.4 + aside);
    let lens = match k % 7 {
        6 => Lens::Orthographic { width: 60.0, far: 1e4 },
        _ => Lens::Perspective { fov_x: 0.4 + 1.6 * share(3) },
    };
    let pitch = if k.is_multiple_of(3) { -aside } else { 60.0 * share(4) - 30.0 };
    let world_from_eye = View::turned(360.0 * share(5), pitch, 20.0 * share(6));
    let tolerance = Tolerance { px: 0.2 + 3.0 * share(7), metric: Metric::Certified };
    View { eye, world_from_eye, lens, size: SIZE, near: 0.05, tolerance, time_s: 0.0 }
}

/// Returns a view of the whole cave from above, at a tolerance.
fn whole(cave: &Cave, px: f64) -> View {
    let [w, h] = cave.floor().size().map(f64::from);
    let eye = cave.floor().world_at(w / 2.0, h / 2.0, 0.0) + DVec3::Y * 5000.0;
    let tolerance = Tolerance { px, metric: Metric::Certified };
    let lens = Lens::Perspective { fov_x: 1.0 };
    View {
        eye,
        world_from_eye: View::turned(10.0, -85.0, 0.0),
        lens,
        size: [320, 200],
        near: 1.0,
        tolerance,
        time_s: 0.0,
    }
}

fn proven(cave: &Cave, strips: &mut CaveStrips, view: &View) -> CaveProof {
    let triangles = drawn(cave, strips, view);
    prove_cave(cave.floor(), &view.frustum(), &triangles).unwrap_or_else(|why| panic!("{why}"))
}

/// Most of these views include places where floor and ceiling meet.
#[test]
fn caves_are_watertight() {
    let proofs = (0..40u64).into_par_iter().map(|seed| {
        let size = [[90, 71], [129, 65], [33, 97], [64, 64], [2, 50]][seed as usize % 5];
        let cave = Arc::new(cave(size, seed));
        let mut strips = strips(&cave, &[("page", ["16", "64"][seed as usize % 2])]);
        (0..30).map(|k| proven(&cave, &mut strips, &view(&cave, 30 * seed + k))).collect::<Vec<_>>()
    });
    let proofs: Vec<_> = proofs.flatten_iter().collect();
    let [pairs, seams, opens] = [|p: &CaveProof| p.pairs, |p: &CaveProof| p.seam_edges, |p: &CaveProof| p.open_edges]
        .map(|of| proofs.iter().map(of).sum::<usize>());
    println!("{} caves proven: {pairs} pairs of triangles, {seams} edges in common, {opens} open ones", proofs.len());
    assert!(proofs.iter().filter(|proof| proof.seam_edges > 10).count() > proofs.len() / 2);
}

/// At a tolerance of almost 0, every triangle of the samples that is not all rock is drawn.
#[test]
fn full_resolution_caves_are_complete() {
    for seed in 0..6 {
        let cave = Arc::new(cave([70, 45], seed));
        let is_rock = |at: &[i32; 2]| cave.is_rock(at[0] as u32, at[1] as u32);
        let cells = (0..44).flat_map(|j| (0..69).flat_map(move |i| rtin::cell(i, j)));
        let open = cells.filter(|triangle| !triangle.iter().all(is_rock)).count() as i64;
        let view = whole(&cave, 1e-9);
        let proof = proven(&cave, &mut strips(&cave, &[]), &view);
        assert_eq!(proof.doubled_area, open, "seed {seed}");
        let coarse = proven(
            &cave,
            &mut strips(&cave, &[]),
            &View { tolerance: Tolerance { px: 2.0, ..view.tolerance }, ..view },
        );
        assert!(coarse.pairs < proof.pairs / 2, "{} of {} pairs at 2 px", coarse.pairs, proof.pairs);
    }
}

/// Returns a view from beyond a corner of the cave into it, from above, below or between; every other one is
/// orthographic.
fn from_outside(cave: &Cave, k: u64) -> View {
    let [w, h] = cave.floor().size().map(|n| f64::from(n - 1));
    let middle = cave.floor().world_at(w / 2.0, h / 2.0, 2.0);
    let (sin, cos) = f64::from(90 * (k as u32 % 4) + 40).to_radians().sin_cos();
    let extent = (w * SPACING[0]).hypot(h * SPACING[1]);
    let eye = middle + DVec3::new(cos, [0.0, 0.7, -0.7][k as usize % 3], sin) * extent * 0.62;
    let lens = match k % 2 {
        0 => Lens::Perspective { fov_x: 1.1 },
        _ => Lens::Orthographic { width: extent * 0.7, far: 1e4 },
    };
    let world_from_eye = View::looking_along(middle - eye);
    let tolerance = Tolerance { px: 0.5, metric: Metric::Certified };
    View { eye, world_from_eye, lens, size: SIZE, near: 0.05, tolerance, time_s: 0.0 }
}

/// Returns the number of rays of all views that meet several triangles, and of those that meet them out of order.
/// Checks both orders.
fn followed(view: impl Fn(&Cave, u64) -> View + Sync) -> [usize; 2] {
    let met = (0..48u64).into_par_iter().map(|seed| {
        let cave = Arc::new(cave([60, 45], seed / 6));
        let view = view(&cave, seed);
        let front = drawn(&cave, &mut strips(&cave, &[("page", "16")]), &view);
        let mut back = drawn(&cave, &mut strips(&cave, &[("page", "16"), ("order", "back")]), &view);
        back.reverse();
        assert_eq!(front.len(), back.len());
        let [met, behind] = [front, back].map(|triangles| follow(cave.floor(), &view, &triangles));
        assert_eq!((met.unsorted, met.several), (behind.unsorted, behind.several), "view {seed}");
        [met.several, met.unsorted]
    });
    met.reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]])
}

/// Rays meet triangles in order from outside and from inside, including the eye's own row and column of pages.
#[test]
fn rays_meet_floor_and_ceiling_in_order() {
    let [[outside, wrong], [inside, unsorted]] = [followed(from_outside), followed(view)];
    println!("from outside {wrong} of {outside} rays out of order, from inside {unsorted} of {inside}");
    assert!(outside > 5000 && wrong == 0, "{wrong} of {outside}");
    assert!(inside > 5000 && unsorted == 0, "{unsorted} of {inside}");
}

/// Measures every visible sample of the floor and of the ceiling.
#[test]
fn both_surfaces_are_within_the_tolerance() {
    let largest = (0..40u64).into_par_iter().map(|seed| {
        let cave = Arc::new(cave([130, 97], seed / 8));
        let view = View { size: [320, 200], ..view(&cave, seed) };
        let mut largest = 0.0f64;
        for t in drawn(&cave, &mut strips(&cave, &[]), &view) {
            let is_floor = surface::doubled_area(&t.corners) > 0;
            let field = if is_floor { cave.floor() } else { cave.ceiling() };
            let [a, b, c] = t.corners;
            surface::visit_samples(&if is_floor { [a, b, c] } else { [a, c, b] }, |x, z, y| {
                let [drawn, truth] = [field.world_at(x.into(), z.into(), y), field.world(x, z)];
                if view.project(drawn).is_some_and(|at| view.in_picture(&at)) {
                    largest = largest.max(view.displacement_px(drawn, truth) / view.tolerance.px);
                }
            });
        }
        largest
    });
    let largest = largest.reduce(|| 0.0, f64::max);
    println!("at most {largest:.3} of the tolerance");
    assert!(largest <= 1.0 && largest > 0.3, "{largest} of the tolerance");
}

/// Checks that the watertightness test detects defects.
#[test]
fn defects_of_caves_are_detected() {
    let cave = Arc::new(cave([64, 49], 3));
    let view = whole(&cave, 1e-3);
    let (field, frustum) = (cave.floor(), view.frustum());
    let whole = drawn(&cave, &mut strips(&cave, &[]), &view);
    assert!(prove_cave(field, &frustum, &whole).is_ok());
    let is_detected = |triangles: &[Drawn]| prove_cave(field, &frustum, triangles).is_err();
    let is_inside = |t: &Drawn| t.corners.iter().all(|c| c.x > 0 && c.z > 0 && c.x < 63 && c.z < 48);
    let is_open = |t: &Drawn| t.corners.iter().all(|c| !cave.is_rock(c.x as u32, c.z as u32));
    let inner = whole.iter().position(|t| is_inside(t) && is_open(t)).expect("a triangle inside");
    // A single triangle removed, a pair removed, and a triangle duplicated.
    let without = |gone: &dyn Fn(&Drawn) -> bool| whole.iter().filter(|t| !gone(t)).copied().collect::<Vec<_>>();
    assert!(is_detected(&without(&|t| *t == whole[inner])));
    let in_plan = |t: &Drawn| {
        let mut corners = t.corners.map(|c| (c.x, c.z));
        corners.sort_unstable();
        corners
    };
    assert!(is_detected(&without(&|t| in_plan(t) == in_plan(&whole[inner]))));
    assert!(is_detected(&[&whole[..], &whole[inner..=inner]].concat()));
    // The ceiling above or below the floor where they should meet.
    for up in [0.5, -0.5] {
        let lifted = whole.iter().map(|t| {
            let up = if surface::doubled_area(&t.corners) > 0 { 0.0 } else { up };
            let lift = |c: surface::Corner| surface::Corner { y: c.y + up, ..c };
            Drawn { corners: t.corners.map(lift), ..*t }
        });
        assert!(is_detected(&lifted.collect::<Vec<_>>()));
    }
}
