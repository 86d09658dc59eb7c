//! Simulated loads: cost models of renderers that are hard to control, with the budget controller ([`Controller`])
//! and two simpler regulators for comparison.

use std::collections::VecDeque;

use crate::lod::budget::{Controller, RANGE_PX, Target};

/// Cost at a tolerance of 1 px, in the target's unit.
pub const COST: f64 = 1e5;
/// Frame at which loads change; all regulators have settled by then.
pub const EVENT: usize = 60;

/// Chooses the tolerance of each frame so that costs meet a target.
pub trait Regulator {
    /// Returns the tolerance of the next frame, pixels.
    fn tolerance_px(&self) -> f64;

    /// Records the cost of a frame and the tolerance it was drawn with, pixels.
    fn learn(&mut self, tolerance_px: f64, cost: f64);
}

impl Regulator for Controller {
    fn tolerance_px(&self) -> f64 {
        Controller::tolerance_px(self)
    }

    fn learn(&mut self, tolerance_px: f64, cost: f64) {
        Controller::learn(self, tolerance_px, cost);
    }
}

/// A regulator with fixed steps: 10 % coarser after a frame above the target, 10 % finer after a frame more than 5 %
/// below it.
pub struct FixedStep {
    target: f64,
    px: f64,
}

/// A regulator that scales the tolerance by cost / target after each frame, as if cost were inversely proportional to
/// tolerance.
pub struct Proportional {
    target: f64,
    px: f64,
}

impl FixedStep {
    /// Creates a regulator with a first tolerance, pixels.
    pub fn new(target: Target, first_px: f64) -> Self {
        Self { target: target.cost(), px: first_px }
    }
}

impl Proportional {
    /// Creates a regulator with a first tolerance, pixels.
    pub fn new(target: Target, first_px: f64) -> Self {
        Self { target: target.cost(), px: first_px }
    }
}

impl Regulator for FixedStep {
    fn tolerance_px(&self) -> f64 {
        self.px
    }

    fn learn(&mut self, _: f64, cost: f64) {
        let factor = match cost / self.target {
            share if share > 1.0 => 1.1,
            share if share < 0.95 => 1.0 / 1.1,
            _ => 1.0,
        };
        self.px = (self.px * factor).clamp(RANGE_PX[0], RANGE_PX[1]);
    }
}

impl Regulator for Proportional {
    fn tolerance_px(&self) -> f64 {
        self.px
    }

    fn learn(&mut self, _: f64, cost: f64) {
        self.px = (self.px * cost / self.target).clamp(RANGE_PX[0], RANGE_PX[1]);
    }
}

/// A simulated load.
pub struct Load<'a> {
    /// Cost as a function of the tolerance, pixels.
    pub curve: &'a (dyn Fn(f64) -> f64 + Sync),
    /// Factor of the cost as a function of the frame.
    pub factor: &'a (dyn Fn(usize) -> f64 + Sync),
    /// Frames until a cost is known; 1 is before the next frame.
    pub delay: usize,
    /// Largest relative error of a measured cost.
    pub noise: f64,
    /// Seed of the noise.
    pub seed: u64,
}

/// Tolerance and noise-free cost of a frame.
#[derive(Clone, Copy, Debug)]
pub struct SimulatedFrame {
    /// Tolerance, pixels.
    pub px: f64,
    /// Cost relative to the target.
    pub cost: f64,
}

impl Load<'_> {
    /// Simulates frames under the budget controller with a first tolerance, pixels.
    pub fn run(&self, target: Target, first_px: f64, frames: usize) -> Vec<SimulatedFrame> {
        self.run_with(&mut Controller::new(target, first_px, RANGE_PX), target, frames)
    }

    /// Simulates frames under any regulator.
    pub fn run_with(&self, regulator: &mut dyn Regulator, target: Target, frames: usize) -> Vec<SimulatedFrame> {
        let mut state = self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(1);
        let mut delayed = VecDeque::new();
        let mut frame = |k: usize| {
            let px = regulator.tolerance_px();
            let cost = (self.curve)(px) * (self.factor)(k);
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let share = (state >> 11) as f64 / (1u64 << 53) as f64;
            delayed.push_back((px, cost * (1.0 + self.noise * (2.0 * share - 1.0))));
            if delayed.len() >= self.delay {
                let (px, cost) = delayed.pop_front().expect("just pushed");
                regulator.learn(px, cost);
            }
            SimulatedFrame { px, cost: cost / target.cost() }
        };
        (0..frames).map(&mut frame).collect()
    }
}

/// Returns the largest cost above the target, relative to it, after the first frame that is at most 20 % above.
pub fn overshoot(frames: &[SimulatedFrame]) -> f64 {
    let reached = frames.iter().position(|frame| frame.cost <= 1.2).unwrap_or(0);
    frames[reached..].iter().map(|frame| frame.cost - 1.0).fold(0.0, f64::max)
}

/// Returns the number of frames until all further ones are within `share` of the target.
pub fn settling(frames: &[SimulatedFrame], share: f64) -> usize {
    frames.iter().rposition(|frame| (frame.cost - 1.0).abs() > share).map_or(0, |k| k + 1)
}

/// A constant load.
pub fn constant(_: usize) -> f64 {
    1.0
}

/// Cost [`COST`] at 1 px, falling with the given power of the tolerance.
pub fn power(slope: f64) -> impl Fn(f64) -> f64 {
    move |px: f64| (COST * px.powf(-slope)).clamp(10.0, 1e8)
}

/// A load that changes once, at [`EVENT`].
pub fn step(factor: f64) -> impl Fn(usize) -> f64 {
    move |k| if k < EVENT { 1.0 } else { factor }
}
