//! The budget controller against simulated costs: loads that step, ramp, spike and oscillate; curves from nearly flat
//! to slopes of 10⁴, and staircases; late and noisy costs.

use cuesta::internal::lod::budget::{RANGE_PX, Target};
use cuesta::internal::stress::simulated_loads::{COST, EVENT, Load, constant, overshoot, power, settling, step};

/// Starts that are too coarse and too fine, and loads that step up and down: `(name, frame of the event, first px,
/// load)`.
type Event = (&'static str, usize, f64, Box<dyn Fn(usize) -> f64 + Sync>);

fn events() -> Vec<Event> {
    vec![
        ("from 4 px", 0, 4.0, Box::new(constant)),
        ("from 1/4 px", 0, 0.25, Box::new(constant)),
        ("three times as much", EVENT, 1.0, Box::new(step(3.0))),
        ("a third", EVENT, 1.0, Box::new(step(1.0 / 3.0))),
    ]
}

#[test]
fn settles_within_fifteen_frames_without_noise() {
    let mut worst = (0.0f64, 0);
    for (slope, delay) in [0.3, 0.5, 1.0, 2.0, 4.0].into_iter().flat_map(|slope| [1, 2, 3].map(|d| (slope, d))) {
        for (name, event, first_px, factor) in events() {
            let load = Load { curve: &power(slope), factor: &factor, delay, noise: 0.0, seed: 0 };
            let frames = &load.run(Target::Triangles(COST), first_px, 160)[event..];
            let (overshoot, settling) =
                (overshoot(&frames[if event > 0 { delay } else { 0 }..]), settling(frames, 0.05));
            assert!(overshoot <= 0.2 && settling <= 15, "slope {slope}, delay {delay}, {name}: {overshoot} {settling}");
            worst = (worst.0.max(overshoot), worst.1.max(settling));
        }
    }
    println!("overshoot {:.3}, settled in {} frames at most", worst.0, worst.1);
}

/// Returns the median and the 95th percentile.
fn spread(mut values: Vec<f64>) -> [f64; 2] {
    values.sort_by(f64::total_cmp);
    [values[values.len() / 2], values[values.len() * 95 / 100]]
}

#[test]
fn holds_the_expected_cost_with_noise() {
    for (slope, delay) in [0.5, 1.0, 2.0, 4.0].into_iter().flat_map(|slope| [1, 2, 3].map(|d| (slope, d))) {
        for (name, event, first_px, factor) in events() {
            let of_seed = |seed: u64| {
                let load = Load { curve: &power(slope), factor: &factor, delay, noise: 0.3, seed };
                let frames = &load.run(Target::FrameMs(COST), first_px, 120)[event..];
                // Frames drawn before the change could be known do not count as overshoot.
                let known = if event > 0 { delay + 1 } else { 0 };
                (overshoot(&frames[known..]), settling(frames, 0.2) as f64)
            };
            let (overshoots, settlings) = (0..200).map(of_seed).unzip();
            let (overshoots, settlings) = (spread(overshoots), spread(settlings));
            println!("slope {slope}, delay {delay}, {name}: overshoot {overshoots:.2?}, settled in {settlings:?}");
            let what = format!("slope {slope}, delay {delay}, {name}");
            assert!(overshoots[0] <= 0.2 && overshoots[1] <= 0.4, "{what}: overshoot {overshoots:?}");
            assert!(settlings[0] <= 15.0 && settlings[1] <= 25.0, "{what}: settled in {settlings:?}");
        }
    }
}

/// A controller that reacted to each cost would move τ by a third in every frame.
#[test]
fn noise_causes_no_limit_cycle() {
    for delay in [1, 2, 3] {
        let of_seed = |seed: u64| {
            let load = Load { curve: &power(1.0), factor: &constant, delay, noise: 0.3, seed };
            let frames = load.run(Target::FrameMs(COST), 1.0, 400);
            let moves = frames.windows(2).filter(|pair| pair[0].px != pair[1].px).count();
            let rms = (frames.iter().map(|frame| (frame.cost - 1.0).powi(2)).sum::<f64>() / 400.0).sqrt();
            (moves as f64 / 400.0, rms)
        };
        let (moves, rms) = (0..50).map(of_seed).unzip();
        let (moves, rms) = (spread(moves), spread(rms));
        println!("delay {delay}: τ moves in {moves:.3?} of the frames, the expected cost is off by {rms:.3?}");
        assert!(moves[1] < 0.2 && rms[1] < 0.1, "{moves:?} {rms:?}");
    }
}

/// Starts half a factor e beside the target, so that the controller measures the slope, which it first takes for a
/// common one.
#[test]
fn holds_slopes_up_to_ten_thousand() {
    for (slope, delay) in [10.0, 100.0, 1e3, 1e4].into_iter().flat_map(|slope| [1, 2, 3].map(|d| (slope, d))) {
        for factor in [1.5, 3.0, 1.0 / 1.5, 1.0 / 3.0] {
            let load = Load { curve: &power(slope), factor: &step(factor), delay, noise: 0.0, seed: 0 };
            let first_px = (-0.5 / slope).exp();
            let frames = load.run(Target::Triangles(COST), first_px, 160);
            let after = &frames[EVENT..];
            let (found, overshoot, settling) =
                (settling(&frames[..EVENT], 0.05), overshoot(&after[delay..]), settling(after, 0.05));
            println!(
                "slope {slope}, delay {delay}, load × {factor:.2}: found in {found} frames, then {overshoot:.2} {settling}"
            );
            assert!(
                found <= 15 * delay && overshoot <= 0.2 && settling <= 15,
                "slope {slope}, delay {delay}, × {factor}"
            );
        }
    }
}

/// With a target between two steps, the tolerance settles on the cheap side, close to the edge.
#[test]
fn settles_on_the_cheap_side_of_steps() {
    let stairs = |px: f64| 0.7 * COST * 4f64.powf(-(px.log2() / 2.0).floor());
    for (delay, noise, first_px) in [1, 2, 3].into_iter().flat_map(|d| [(d, 0.0, 7.0), (d, 0.0, 0.3), (d, 0.3, 7.0)]) {
        let load = Load { curve: &stairs, factor: &constant, delay, noise, seed: 5 };
        let target = if noise > 0.0 { Target::FrameMs(COST) } else { Target::Triangles(COST) };
        let frames = load.run(target, first_px, 400);
        let settled = frames.iter().rposition(|frame| frame.cost > 1.0).unwrap_or(0);
        let expensive = frames.iter().filter(|frame| frame.cost > 1.0).count();
        let last = frames[399];
        println!("delay {delay}, noise {noise}: {expensive} expensive frames, the last one {settled}; {last:?}");
        let limit = if noise > 0.0 { 300 } else { 120 };
        assert!(
            settled < limit && last.cost == 0.7 && last.px < 1.1,
            "delay {delay}, noise {noise}: {settled} {last:?}"
        );
    }
}

#[test]
fn single_slow_frame_is_ignored() {
    for (delay, spike) in [1, 2, 3].into_iter().flat_map(|d| [(d, 5.0), (d, 0.2)]) {
        let factor = |k: usize| if k == EVENT { spike } else { 1.0 };
        let load = Load { curve: &power(1.5), factor: &factor, delay, noise: 0.0, seed: 0 };
        let frames = load.run(Target::Triangles(COST), 1.0, 100);
        assert!(frames.iter().all(|frame| frame.px == frames[EVENT].px), "delay {delay}, × {spike}");
    }
}

/// At the ends of τ's range nothing accumulates: the tolerance returns as soon as the load does.
#[test]
fn no_windup_at_the_ends_of_the_range() {
    for (delay, factor) in [1, 2, 3].into_iter().flat_map(|d| [(d, 1e4), (d, 1e-4)]) {
        let load = |k: usize| if (EVENT..3 * EVENT).contains(&k) { factor } else { 1.0 };
        let load = Load { curve: &power(1.0), factor: &load, delay, noise: 0.0, seed: 0 };
        let frames = load.run(Target::Triangles(COST), 1.0, 300);
        let end = frames[3 * EVENT - 1].px;
        let expected = if factor > 1.0 { RANGE_PX[1] } else { RANGE_PX[0] };
        assert!((end / expected - 1.0).abs() < 1e-9, "delay {delay}, × {factor}: {end} px");
        let back = settling(&frames[3 * EVENT..], 0.05);
        assert!(back <= 15, "delay {delay}, × {factor}: back after {back} frames");
        assert!(frames.iter().all(|frame| (RANGE_PX[0] * 0.999_999..=RANGE_PX[1] * 1.000_001).contains(&frame.px)));
    }
}

#[test]
fn follows_slow_changes() {
    for delay in [1, 2, 3] {
        let ramp = |k: usize| 1.02f64.powi(k.clamp(EVENT, 2 * EVENT) as i32 - EVENT as i32);
        let swing = |k: usize| 1.0 + 0.3 * (k as f64 * std::f64::consts::TAU / 40.0).sin();
        for (name, factor) in [("ramp", &ramp as &(dyn Fn(usize) -> f64 + Sync)), ("swing", &swing)] {
            let load = Load { curve: &power(1.0), factor, delay, noise: 0.0, seed: 0 };
            let frames = load.run(Target::Triangles(COST), 1.0, 240);
            let worst = frames[EVENT..].iter().map(|frame| (frame.cost - 1.0).abs()).fold(0.0, f64::max);
            println!("delay {delay}, {name}: {worst:.3}");
            // Change of the load until it is known: 2 % a frame, and 0.3 · 2π / 40 = 4.7 %.
            let limit = if name == "ramp" { 0.03 } else { 0.055 } * (delay as f64 + 1.0);
            assert!(worst <= limit, "delay {delay}, {name}: {worst}");
        }
    }
}

/// If the load falls while τ moves, old bounds at finer levels must not hold τ back.
#[test]
fn recovers_from_slow_first_frames() {
    let curve = |px: f64| 0.36 * COST + 2.3 * COST / (1.0 + px);
    for delay in [1, 2, 3] {
        let factor = |k: usize| if k < 3 { 10.0 } else { 1.0 };
        let load = Load { curve: &curve, factor: &factor, delay, noise: 0.04, seed: 3 };
        let frames = load.run(Target::FrameMs(COST), 0.5, 120);
        let settled = settling(&frames[3..], 0.1);
        println!("delay {delay}: settled in {settled} frames");
        assert!(settled <= 60, "delay {delay}: {settled}");
    }
}
