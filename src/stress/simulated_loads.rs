//! Made-up renderers whose cost is hard to hold, and ways to hold it: the controller ([`Controller`]) and two simpler ones
//! that it is held against.

use std::collections::VecDeque;

use crate::lod::budget::{Controller, RANGE_PX, Target};

/// What is held, in the target's unit.
pub const COST: f64 = 1e5;
/// The frame at which loads change: everything has settled.
pub const EVENT: usize = 60;

/// Moves a tolerance so that frames cost what they may.
pub trait Regulator {
    /// The tolerance of the next frame, pixels.
    fn tolerance_px(&self) -> f64;

    /// Takes the cost of a frame and the tolerance that it was drawn with, pixels.
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

/// A tenth coarser after each frame that is too dear, a tenth finer after each that is more than a twentieth too cheap.
pub struct FixedStep {
    target: f64,
    px: f64,
}

/// As far as a cost of slope −1 would need, after each frame.
pub struct Proportional {
    target: f64,
    px: f64,
}

impl FixedStep {
    /// From a first tolerance on, pixels.
    pub fn new(target: Target, first_px: f64) -> Self {
        Self { target: target.cost(), px: first_px }
    }
}

impl Proportional {
    /// From a first tolerance on, pixels.
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

/// A made-up renderer.
pub struct Load<'a> {
    /// Cost by tolerance, pixels.
    pub curve: &'a (dyn Fn(f64) -> f64 + Sync),
    /// What it is multiplied by, by frame.
    pub factor: &'a (dyn Fn(usize) -> f64 + Sync),
    /// How many frames after a frame its cost is known: 1 is before the next one.
    pub delay: usize,
    /// Costs are off by up to this share.
    pub noise: f64,
    /// Of the noise.
    pub seed: u64,
}

/// What a frame was drawn with, and what it cost over the target, noise left out.
#[derive(Clone, Copy, Debug)]
pub struct SimulatedFrame {
    /// Tolerance, pixels.
    pub px: f64,
    /// Cost over the target.
    pub cost: f64,
}

impl Load<'_> {
    /// Frames under the controller, from a first tolerance on, pixels.
    pub fn fly(&self, target: Target, first_px: f64, frames: usize) -> Vec<SimulatedFrame> {
        self.fly_with(&mut Controller::new(target, first_px, RANGE_PX), target, frames)
    }

    /// Frames under any regulator.
    pub fn fly_with(&self, regulator: &mut dyn Regulator, target: Target, frames: usize) -> Vec<SimulatedFrame> {
        let mut state = self.seed.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(1);
        let mut late = VecDeque::new();
        let mut fly = |k: usize| {
            let px = regulator.tolerance_px();
            let cost = (self.curve)(px) * (self.factor)(k);
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            let share = (state >> 11) as f64 / (1u64 << 53) as f64;
            late.push_back((px, cost * (1.0 + self.noise * (2.0 * share - 1.0))));
            if late.len() >= self.delay {
                let (px, cost) = late.pop_front().expect("one at least");
                regulator.learn(px, cost);
            }
            SimulatedFrame { px, cost: cost / target.cost() }
        };
        (0..frames).map(&mut fly).collect()
    }
}

/// How much more than the target anything cost once no more than a fifth was too much.
pub fn overshoot(frames: &[SimulatedFrame]) -> f64 {
    let reached = frames.iter().position(|frame| frame.cost <= 1.2).unwrap_or(0);
    frames[reached..].iter().map(|frame| frame.cost - 1.0).fold(0.0, f64::max)
}

/// Frames until all are within a share of the target.
pub fn settling(frames: &[SimulatedFrame], share: f64) -> usize {
    frames.iter().rposition(|frame| (frame.cost - 1.0).abs() > share).map_or(0, |k| k + 1)
}

/// A load that does not change.
pub fn constant(_: usize) -> f64 {
    1.0
}

/// Costs [`COST`] at 1 px, and everywhere a power of the tolerance.
pub fn power(slope: f64) -> impl Fn(f64) -> f64 {
    move |px: f64| (COST * px.powf(-slope)).clamp(10.0, 1e8)
}

/// A load that changes once, at [`EVENT`].
pub fn step(factor: f64) -> impl Fn(usize) -> f64 {
    move |k| if k < EVENT { 1.0 } else { factor }
}
