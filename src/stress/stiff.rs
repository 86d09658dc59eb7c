//! Stiff loads: the budget controller on simulated loads that are hard to control.
//!
//! Also computes its stability region over cost slope and cost delay, compared with a fixed step and a proportional
//! regulator.

use std::io;
use std::path::Path;
use std::sync::Arc;

use anyhow::{Context, Result};
use image::{ImageFormat, Rgb, RgbImage};
use rayon::prelude::*;

use super::case::{Case, Kind};
use super::finding::Finding;
use super::forms::TechniqueConfig;
use super::rows::Picture;
use super::simulated_loads::{
    COST, EVENT, FixedStep, Load, Proportional, Regulator, SimulatedFrame, constant, overshoot, power, settling, step,
};
use crate::bench::paths;
use crate::draw::DrawList;
use crate::height::save::replace;
use crate::height::{Field, synth};
use crate::lod::budget::{Controller, RANGE_PX, Target};
use crate::view::{Metric, Tolerance};

const fn case(name: &'static str, examine: fn() -> Vec<Finding>) -> Case {
    Case { family: "stiff", name, kind: Kind::Standalone("controller", examine) }
}

/// The family `stiff`.
pub const CASES: &[Case] = &[
    case("a step of the load", || step_response(&[0.3, 0.5, 1.0, 2.0, 4.0], &[3.0, 1.0 / 3.0], 0.0)),
    case("a step at slopes up to 1e4, once known", || step_response(&[10.0, 100.0, 1e3, 1e4], &[3.0, 1.0 / 3.0], 0.0)),
    case("a start at slopes up to 1e4, not known", unknown_slopes),
    case("a step under 30 % noise", || step_response(&[0.5, 1.0, 2.0, 4.0], &[3.0, 1.0 / 3.0], 0.3)),
    case("a ramp and a swing", slow_changes),
    case("a single slow frame", impulse),
    case("a cliff in the cost", stairs),
    case("controller saturated for a while", saturation),
    case("1000 simulated loads", random_loads),
    Case { family: "stiff", name: "a circle over three fields", kind: Kind::PerTechnique(real_terrain) },
];

/// Limits: overshoot relative to the target, and settling time in frames.
const OVERSHOOT: f64 = 0.2;
const SETTLING: f64 = 15.0;
const DELAYS: [usize; 3] = [1, 2, 3];
/// Noise seeds per load.
const SEEDS: u64 = 100;

/// Returns a target of triangles (counted exactly), or of frame time if the load is noisy.
fn target(noise: f64) -> Target {
    if noise > 0.0 { Target::FrameMs(COST) } else { Target::Triangles(COST) }
}

/// Returns the overshoot of the frames after the load's change became known.
fn overshoot_after(frames: &[SimulatedFrame], delay: usize) -> f64 {
    overshoot(&frames[EVENT + delay + 1..])
}

/// Checks overshoot and settling after a step of the load, for all slopes, step factors and delays.
fn step_response(slopes: &[f64], factors: &[f64], noise: f64) -> Vec<Finding> {
    let (share, seeds) = if noise > 0.0 { (0.2, SEEDS) } else { (0.05, 1) };
    let loads = slopes.iter().flat_map(|s| factors.iter().flat_map(move |f| DELAYS.map(|delay| (*s, *f, delay))));
    let mut worst = [[0.0f64; 2]; 2];
    for (slope, factor, delay) in loads {
        let of_seed = |seed: u64| {
            let load = Load { curve: &power(slope), factor: &step(factor), delay, noise, seed };
            // Starts off target, so that the controller learns the slope before the load changes.
            let frames = load.run(target(noise), (-0.5 / slope).exp(), 2 * EVENT + 40);
            [overshoot_after(&frames, delay), settling(&frames[EVENT..], share) as f64]
        };
        let (overshoots, settlings): (Vec<_>, Vec<_>) =
            (0..seeds).into_par_iter().map(of_seed).map(|[overshoot, settling]| (overshoot, settling)).unzip();
        let [overshoots, settlings] = [overshoots, settlings].map(quantiles);
        (0..2).for_each(|k| {
            worst[k][0] = worst[k][0].max(overshoots[k]);
            worst[k][1] = worst[k][1].max(settlings[k]);
        });
    }
    let [[overshoot, settling], [overshoot_95, settling_95]] = worst;
    let mut findings = vec![
        Finding::within("overshoot, share of the target", overshoot, OVERSHOOT),
        Finding::within("settled after, frames", settling, SETTLING),
    ];
    if seeds > 1 {
        findings.push(Finding::reported("overshoot, 95 % of the seeds", overshoot_95));
        findings.push(Finding::reported("settled after, 95 % of the seeds", settling_95));
    }
    findings
}

/// Returns the median and the 95 % quantile.
fn quantiles(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    [values[values.len() / 2], values[values.len() * 95 / 100]]
}

/// Checks settling from a start with an unknown, steep slope; the controller assumes a common slope at first.
fn unknown_slopes() -> Vec<Finding> {
    let found = |delay: usize| {
        let of_slope = |slope: f64| {
            let load = Load { curve: &power(slope), factor: &constant, delay, noise: 0.0, seed: 0 };
            settling(&load.run(target(0.0), (-0.5 / slope).exp(), 160), 0.05)
        };
        [10.0, 100.0, 1e3, 1e4].map(of_slope).into_iter().max().unwrap_or(0) as f64
    };
    vec![
        Finding::within("settled after, costs a frame late", found(1), SETTLING),
        Finding::within("settled after, costs 2 frames late", found(2), SETTLING),
        Finding::reported("settled after, costs 3 frames late", found(3)),
    ]
}

/// Checks a ramp of 2 % per frame and an oscillation of 30 % in 40 frames. The error must stay within the change
/// during the delay.
fn slow_changes() -> Vec<Finding> {
    let ramp = |k: usize| 1.02f64.powi(k.clamp(EVENT, 2 * EVENT) as i32 - EVENT as i32);
    let swing = |k: usize| 1.0 + 0.3 * (k as f64 * std::f64::consts::TAU / 40.0).sin();
    let worst = |factor: &(dyn Fn(usize) -> f64 + Sync)| {
        let off = |delay: usize| {
            let frames = Load { curve: &power(1.0), factor, delay, noise: 0.0, seed: 0 }.run(target(0.0), 1.0, 240);
            frames[EVENT..].iter().map(|frame| (frame.cost - 1.0).abs()).fold(0.0, f64::max)
        };
        DELAYS.map(off).into_iter().fold(0.0, f64::max)
    };
    vec![
        Finding::within("ramp, off by a share of", worst(&ramp), OVERSHOOT),
        Finding::within("swing, off by a share of", worst(&swing), OVERSHOOT + 0.02),
    ]
}

/// Checks that a single slow or fast frame does not change the tolerance.
fn impulse() -> Vec<Finding> {
    let moves = |(delay, spike): (usize, f64)| {
        let factor = move |k: usize| if k == EVENT { spike } else { 1.0 };
        let load = Load { curve: &power(1.5), factor: &factor, delay, noise: 0.0, seed: 0 };
        let frames = load.run(target(0.0), 1.0, 100);
        frames.iter().filter(|frame| frame.px != frames[EVENT].px).count()
    };
    let all = DELAYS.into_iter().flat_map(|delay| [(delay, 5.0), (delay, 0.2)]);
    vec![Finding::within("frames with another tolerance", all.map(moves).sum::<usize>() as f64, 0.0)]
}

/// Checks a target between two steps of the cost: the controller must rest on the cheaper step, close to the edge.
fn stairs() -> Vec<Finding> {
    let stairs = |px: f64| 0.7 * COST * 4f64.powf(-(px.log2() / 2.0).floor());
    let last = |delay: usize| {
        let frames = Load { curve: &stairs, factor: &constant, delay, noise: 0.0, seed: 5 }.run(target(0.0), 7.0, 400);
        let tail = &frames[200..];
        let changes = tail.windows(2).filter(|pair| pair[0].cost != pair[1].cost).count();
        [changes as f64, tail.iter().map(|frame| frame.cost).fold(0.0, f64::max)]
    };
    let [changes, cost] =
        DELAYS.map(last).into_iter().reduce(|a, b| [a[0].max(b[0]), a[1].max(b[1])]).unwrap_or_default();
    vec![
        Finding::within("limit cycle, changes of the stair in 200 frames", changes, 0.0),
        Finding::within("cost over the target", cost, 1.0),
    ]
}

/// Checks a load out of range for 120 frames. The tolerance must stay in its range and return soon after.
fn saturation() -> Vec<Finding> {
    let mut outside = 0;
    let mut back = 0;
    for (delay, factor) in DELAYS.into_iter().flat_map(|delay| [(delay, 1e4), (delay, 1e-4)]) {
        let factor = move |k: usize| if (EVENT..3 * EVENT).contains(&k) { factor } else { 1.0 };
        let frames =
            Load { curve: &power(1.0), factor: &factor, delay, noise: 0.0, seed: 0 }.run(target(0.0), 1.0, 300);
        let range = RANGE_PX[0] * 0.999_999..=RANGE_PX[1] * 1.000_001;
        outside += frames.iter().filter(|frame| !range.contains(&frame.px)).count();
        back = back.max(settling(&frames[3 * EVENT..], 0.05));
    }
    vec![
        Finding::within("frames outside the range of tolerances", outside as f64, 0.0),
        Finding::within("back after, frames", back as f64, SETTLING),
    ]
}

/// Checks random slopes, starts, steps, delays and noise: shares of loads that overshoot or settle late, also for the
/// two simpler regulators.
fn random_loads() -> Vec<Finding> {
    const LOADS: u64 = 1000;
    let share = |make: &(dyn Fn(Target, f64) -> Box<dyn Regulator> + Sync)| {
        let of_load = |seed: u64| {
            let random = |k: u64| f64::from(synth::noise::hash(seed as i64, k as i64, 11)) / f64::from(u32::MAX);
            let slope = 10f64.powf(-0.5 + 1.2 * random(0));
            let (factor, delay) = (10f64.powf(random(1) - 0.5), 1 + (2.999 * random(2)) as usize);
            let noise = if seed.is_multiple_of(2) { 0.0 } else { 0.3 * random(3) };
            let load = Load { curve: &power(slope), factor: &step(factor), delay, noise, seed };
            let mut regulator = make(target(noise), 1.0);
            let frames = load.run_with(regulator.as_mut(), target(noise), 2 * EVENT + 40);
            let settled = settling(&frames[EVENT..], if noise > 0.0 { 0.2 } else { 0.05 }) as f64;
            [overshoot_after(&frames, delay) <= OVERSHOOT, settled <= SETTLING].map(u64::from)
        };
        let [held, settled] =
            (0..LOADS).into_par_iter().map(of_load).reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        [held, settled].map(|n| 1.0 - n as f64 / LOADS as f64)
    };
    let controller = share(&|target, px| Box::new(Controller::new(target, px, RANGE_PX)));
    let fixed = share(&|target, px| Box::new(FixedStep::new(target, px)));
    let proportional = share(&|target, px| Box::new(Proportional::new(target, px)));
    vec![
        Finding::within("share that overshoots", controller[0], 0.05),
        Finding::within("share that settles late", controller[1], 0.2),
        Finding::reported("share that overshoots, fixed step", fixed[0]),
        Finding::reported("share that settles late, fixed step", fixed[1]),
        Finding::reported("share that overshoots, pure proportion", proportional[0]),
        Finding::reported("share that settles late, pure proportion", proportional[1]),
    ]
}

/// Frames of the circle.
const CIRCLE: usize = 1000;

/// Controls half of a technique's triangles along a circle over three fields.
fn real_terrain(config: &TechniqueConfig) -> Vec<Finding> {
    // Variants submit the same triangles in another way.
    if config.variant.is_some() {
        return Vec::new();
    }
    let fields = [
        (synth::Kind::Fractal, "ridges: frames within 5 %", "ridges: overshoot"),
        (synth::Kind::Eroded, "mountains: frames within 5 %", "mountains: overshoot"),
        (synth::Kind::Peers, "noise: frames within 5 %", "noise: overshoot"),
    ];
    let of_field = |(kind, within, overshoot): (synth::Kind, &'static str, &'static str)| {
        let Some([share, max]) = circle_at_half_budget(config, Arc::new(synth::synth(kind, [513, 513], 3))) else {
            return Vec::new();
        };
        vec![Finding::reported(within, share), Finding::reported(overshoot, max)]
    };
    fields.into_par_iter().flat_map_iter(of_field).collect()
}

/// Returns the share of frames within 5 % of the target after settling, and the largest overshoot; `None` if the
/// tolerance has no effect.
fn circle_at_half_budget(config: &TechniqueConfig, field: Arc<Field>) -> Option<[f64; 2]> {
    let mut technique = (config.entry.build)(Arc::clone(&field), &config.settings);
    let view = |px: f64| Tolerance { px, metric: Metric::Certified };
    let views = paths::find("circle").expect("a named path").views(&field, CIRCLE, [640, 360], view(1.0));
    let mut triangles = |frame: usize, px: f64| {
        let mut list = DrawList::default();
        technique.select(&crate::view::View { tolerance: view(px), ..views[frame] }, &mut list);
        list.triangles() as f64
    };
    let aim = 0.5 * triangles(0, 1.0);
    if triangles(0, RANGE_PX[1]) > aim {
        return None;
    }
    let mut controller = Controller::new(Target::Triangles(aim), 1.0, RANGE_PX);
    let mut costs = Vec::new();
    for frame in 0..CIRCLE {
        let px = controller.tolerance_px();
        let cost = triangles(frame, px);
        controller.learn(px, cost);
        costs.push(cost / aim);
    }
    let settled = &costs[SETTLING as usize..];
    let within = settled.iter().filter(|cost| (**cost - 1.0).abs() <= 0.05).count();
    let overshoot = settled.iter().fold(0.0, |max, cost| f64::max(max, cost - 1.0));
    Some([within as f64 / settled.len() as f64, overshoot])
}

/// Saves a stability map for each regulator, over slopes from 1/4 to 1e4 and delays of 1 to 12 frames: the settling
/// time after a step of the load. White: within 15 frames; yellow to red: later; black: never.
pub fn save_regions(folder: &Path) -> Result<Vec<Picture>> {
    const COLUMNS: u32 = 24;
    const ROWS: u32 = 12;
    const CELL: u32 = 12;
    type MakeRegulator = fn(Target, f64) -> Box<dyn Regulator>;
    let regulators: [(&str, MakeRegulator); 3] = [
        ("controller", |target, px| Box::new(Controller::new(target, px, RANGE_PX))),
        ("fixed-step", |target, px| Box::new(FixedStep::new(target, px))),
        ("proportional", |target, px| Box::new(Proportional::new(target, px))),
    ];
    let slope = |column: u32| 0.25 * 4e4f64.powf(f64::from(column) / f64::from(COLUMNS - 1));
    let mut pictures = Vec::new();
    for (name, make) in regulators {
        let cells: Vec<_> = (0..COLUMNS * ROWS)
            .into_par_iter()
            .map(|cell| settling_time(slope(cell % COLUMNS), cell / COLUMNS, make))
            .collect();
        let colour = |x: u32, y: u32| shade(cells[((ROWS - 1 - y / CELL) * COLUMNS + x / CELL) as usize]);
        let file = format!("stability-{name}.png");
        let path = folder.join(&file);
        let picture = RgbImage::from_fn(COLUMNS * CELL, ROWS * CELL, colour);
        replace(&path, |out| picture.write_to(out, ImageFormat::Png).map_err(io::Error::other))
            .with_context(|| path.display().to_string())?;
        let stable = cells.iter().filter(|settled| settled.is_some()).count();
        let caption = format!(
            "Stability of the {name}: slope of the cost from 1/4 (left) to 10 000 (right), delay from 1 frame (below) to \
             {ROWS} (above); white: settled in 15 frames, yellow to red: later, black: never. {stable} of {} settle",
            cells.len()
        );
        pictures.push(Picture { file, caption });
    }
    Ok(pictures)
}

/// Returns the frames until a threefold load is within 5 % of the target; `None` if it never is.
fn settling_time(slope: f64, delay: u32, make: fn(Target, f64) -> Box<dyn Regulator>) -> Option<usize> {
    const FRAMES: usize = 300;
    let load = Load { curve: &power(slope), factor: &step(3.0), delay: delay as usize + 1, noise: 0.0, seed: 0 };
    let frames = load.run_with(make(target(0.0), (-0.5 / slope).exp()).as_mut(), target(0.0), EVENT + FRAMES);
    Some(settling(&frames[EVENT..], 0.05)).filter(|&settled| settled < FRAMES - 20)
}

/// Returns the colour of a settling time.
fn shade(settled: Option<usize>) -> Rgb<u8> {
    match settled {
        None => Rgb([0, 0, 0]),
        Some(frames) if frames <= SETTLING as usize => Rgb([255, 255, 255]),
        Some(frames) => Rgb([255, (255.0 - 0.9 * frames as f64).max(0.0) as u8, 60]),
    }
}
