//! The budget controller: adjusts the tolerance τ so that frames cost a target number of triangles or milliseconds.
//!
//! Costs arrive late and noisy, but each comes with the τ it was drawn with, so the delay needs no model. Near the
//! current τ, ln cost = level + slope · ln τ. A Kalman filter estimates both (R. E. Kalman, "A New Approach to Linear
//! Filtering and Prediction Problems", 1960). The next τ is where this line meets the target. Consequences:
//!
//! - Nothing is integrated. There is no wind-up at the ends of τ's range, and a late cost repeats no correction.
//! - Noise moves nothing: the dead band is the uncertainty of the level.
//! - Towards finer levels, τ moves only as far as the steepest likely slope allows without exceeding the target by a
//!   fifth.
//! - An unexplained cost is accepted only if the next one agrees, so a single slow frame moves nothing.
//! - If the cost is a staircase, the bounds known to be too expensive and cheap enough converge on the step. The cheap
//!   one is kept.

/// Target of the controller.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// Triangles per frame.
    Triangles(f64),
    /// Milliseconds per frame.
    FrameMs(f64),
}

impl Target {
    /// Returns the target cost, in its unit.
    pub fn cost(self) -> f64 {
        match self {
            Target::Triangles(cost) | Target::FrameMs(cost) => cost,
        }
    }

    /// Returns the width of a step at which the search ends, ln τ. Steps hidden by noise would take too many frames to
    /// find.
    fn min_width(self) -> f64 {
        match self {
            Target::Triangles(_) => 1e-5,
            Target::FrameMs(_) => 1e-2,
        }
    }

    /// Returns the initial standard deviation of ln cost between frames without changes.
    fn noise(self) -> f64 {
        match self {
            Target::Triangles(_) => 0.005,
            Target::FrameMs(_) => 0.2,
        }
    }
}

/// Range of useful tolerances on any screen, pixels.
pub const RANGE_PX: [f64; 2] = [1.0 / 64.0, 256.0];

/// Maximum cost over the target for a move to a finer level, ln cost.
const OVERSHOOT: f64 = 0.18;
/// Random walk of the level from frame to frame, ln cost.
const RANDOM_WALK: f64 = 0.03;
/// Number of consecutive updates on one side after which the bound on the other side is discarded.
const MAX_ONE_SIDED: i32 = 5;
/// Difference below which tolerances count as equal, ln τ.
const SAME: f64 = 1e-7;
/// Weight of a new frame in the noise estimate.
const NOISE_SHARE: f64 = 0.05;
/// Minimum noise of frame times, ln cost.
const MIN_NOISE: f64 = 0.02;
/// Number of standard deviations within which a value is likely.
const LIKELY: f64 = 3.0;
/// Number of standard deviations for the slope of a move to a finer level.
const STEEPEST: f64 = 2.0;
/// Initial slope of ln cost over ln τ. Triangles of constant size on the screen have −2; errors that grow with the
/// square of a triangle's side have −1.
const SLOPE: f64 = -1.0;
/// Its standard deviation.
const SLOPE_DEVIATION: f64 = 3.0;
/// Range of accepted slopes.
const SLOPES: [f64; 2] = [-2e4, -0.25];
/// Maximum move in one step towards finer and coarser levels, ln τ.
const MAX_MOVE: [f64; 2] = [-6.0, 1.4];
/// Minimum cost, so that logarithms are finite.
const MIN_COST: f64 = 1e-3;

/// Adjusts a tolerance to keep a target cost.
#[derive(Clone, Debug)]
pub struct Controller {
    target: Target,
    /// Standard deviation of ln cost between frames without changes.
    noise: f64,
    /// Minimum and maximum of ln τ.
    range: [f64; 2],
    /// ln τ of the next frame.
    next: f64,
    model: Option<Model>,
    /// Surprise of the last cost, in standard deviations, if nothing explained it.
    suspect: Option<f64>,
    /// Largest ln τ that is too expensive, and its cost over the target, ln cost.
    expensive: Option<[f64; 2]>,
    /// Smallest ln τ that is cheap enough, and its cost over the target (negative).
    cheap: Option<[f64; 2]>,
    /// Number of consecutive updates of only the cheap bound (positive) or only the expensive bound (negative).
    one_sided: i32,
    /// True if the last cost was off the line and left more than half of the interval between the bounds.
    is_slow: bool,
}

impl Controller {
    /// Creates a controller for a target, with a first tolerance and a range of tolerances, pixels.
    ///
    /// # Panics
    /// If the target or a tolerance is not positive and finite, or the range is empty.
    pub fn new(target: Target, first_px: f64, range_px: [f64; 2]) -> Self {
        let is_positive = |value: f64| value.is_finite() && value > 0.0;
        assert!([target.cost(), first_px, range_px[0], range_px[1]].into_iter().all(is_positive));
        assert!(range_px[0] <= range_px[1], "an empty range of tolerances");
        let range = range_px.map(f64::ln);
        let next = first_px.ln().clamp(range[0], range[1]);
        Self {
            target,
            noise: target.noise(),
            range,
            next,
            model: None,
            suspect: None,
            expensive: None,
            cheap: None,
            one_sided: 0,
            is_slow: false,
        }
    }

    /// Returns the target.
    pub fn target(&self) -> Target {
        self.target
    }

    /// Returns the tolerance of the next frame, pixels.
    pub fn tolerance_px(&self) -> f64 {
        self.next.exp()
    }

    /// Adds the cost of a frame, triangles or milliseconds, and the tolerance that it was drawn with, pixels. Costs may
    /// be any number of frames late, but must be in drawing order.
    pub fn learn(&mut self, tolerance_px: f64, cost: f64) {
        let (at, excess) = (tolerance_px.ln(), (cost.max(MIN_COST) / self.target.cost()).ln());
        if !at.is_finite() || !excess.is_finite() {
            return;
        }
        let noise = self.noise;
        let Some(model) = &mut self.model else {
            self.model = Some(Model::new(at, excess, noise));
            return self.decide(false);
        };
        let surprise = model.surprise(at, excess, noise);
        let between = |[expensive, cheap]: [[f64; 2]; 2]| at > expensive[0] && at < cheap[0];
        let is_on_stair = self.expensive.zip(self.cheap).is_some_and(|(expensive, cheap)| between([expensive, cheap]));
        let is_bent = surprise.abs() > LIKELY && model.is_elsewhere(at, noise, is_on_stair);
        if surprise.abs() <= LIKELY {
            let was_at = model.at;
            let off = excess - model.moved(at).level;
            let error = model.update(at, excess, noise);
            let is_same = at == was_at;
            self.age_bounds(if is_same { [error; 2] } else { [-RANDOM_WALK, RANDOM_WALK] });
            if is_same && matches!(self.target, Target::FrameMs(_)) {
                let variance = noise * noise + NOISE_SHARE * (off * off - noise * noise);
                self.noise = variance.sqrt().clamp(MIN_NOISE, self.target.noise());
            }
        } else if is_bent {
            model.bend(at, excess, noise);
        } else if self.suspect.is_some_and(|suspect| suspect * surprise > 0.0) {
            model.jump(at, excess, noise);
            (self.expensive, self.cheap) = (None, None);
        } else {
            self.suspect = Some(surprise);
            return;
        }
        self.suspect = None;
        self.decide(is_bent);
    }

    /// Changes the stored excess of both bounds by these amounts, ln cost: with the load if τ was the same, otherwise
    /// towards zero.
    fn age_bounds(&mut self, [expensive, cheap]: [f64; 2]) {
        self.expensive =
            self.expensive.map(|[at, excess]| [at, excess + expensive]).filter(|expensive| expensive[1] > 0.0);
        self.cheap = self.cheap.map(|[at, excess]| [at, excess + cheap]).filter(|cheap| cheap[1] < 0.0);
    }

    fn decide(&mut self, is_bent: bool) {
        let Some(model) = self.model else { return };
        self.update_bounds(&model, is_bent);
        // A tolerance that is probably right is kept.
        let current = model.moved(self.next);
        if current.level.abs() <= model.dead_band() && self.clamp_to_bounds(self.next) == self.next {
            return;
        }
        let aim = self.clamp_to_bounds(model.at + model.step().clamp(MAX_MOVE[0], MAX_MOVE[1]));
        self.next = aim.clamp(self.range[0], self.range[1]);
    }

    /// Updates the bound on the side of the target where the last tolerance was.
    fn update_bounds(&mut self, model: &Model, is_bent: bool) {
        let &Model { at, level, .. } = model;
        let sure = LIKELY * model.dead_band();
        let width = self.width();
        if level > sure && self.expensive.is_none_or(|expensive| expensive[0] <= at) {
            self.one_sided = count_updates(self.one_sided.min(0), self.expensive, at, -1);
            self.expensive = Some([at, level]);
            self.cheap = self.cheap.filter(|cheap| cheap[0] > at);
        } else if level < -sure && self.cheap.is_none_or(|cheap| cheap[0] >= at) {
            self.one_sided = count_updates(self.one_sided.max(0), self.cheap, at, 1);
            self.cheap = Some([at, level]);
            self.expensive = self.expensive.filter(|expensive| expensive[0] < at);
        }
        // An old bound on the other side is obsolete if the load has changed while τ moved.
        if self.one_sided >= MAX_ONE_SIDED {
            (self.expensive, self.one_sided) = (None, 0);
        } else if self.one_sided <= -MAX_ONE_SIDED {
            (self.cheap, self.one_sided) = (None, 0);
        }
        let left = self.width();
        self.is_slow = is_bent && width.is_finite() && left > 0.5 * width;
    }

    /// Returns the interval between the two bounds, ln τ; infinite if one is unknown.
    fn width(&self) -> f64 {
        self.expensive.zip(self.cheap).map_or(f64::INFINITY, |(expensive, cheap)| cheap[0] - expensive[0])
    }

    /// Returns the tolerance nearest to `aim` between the bounds, ln τ.
    fn clamp_to_bounds(&self, aim: f64) -> f64 {
        let (Some([expensive, _]), Some([cheap, _])) = (self.expensive, self.cheap) else {
            let (min, max) =
                (self.expensive.map_or(aim, |expensive| expensive[0]), self.cheap.map_or(aim, |cheap| cheap[0]));
            return aim.max(min).min(max);
        };
        if cheap - expensive <= self.target.min_width() {
            return cheap;
        }
        // Bisects if the line does not help.
        let [min, max] = if self.is_slow { [0.5, 0.5] } else { [0.02, 0.98] };
        aim.clamp(expensive + min * (cheap - expensive), expensive + max * (cheap - expensive))
    }
}

/// Returns `before` plus `sign` if a bound moves.
fn count_updates(before: i32, bound: Option<[f64; 2]>, at: f64, sign: i32) -> i32 {
    if bound.is_some_and(|bound| (bound[0] - at).abs() <= SAME) { before } else { before + sign }
}

/// Linear model of ln cost over the target's near a tolerance, with its uncertainty.
#[derive(Clone, Copy, Debug)]
struct Model {
    /// ln τ.
    at: f64,
    /// ln cost over the target's at `at`.
    level: f64,
    /// Derivative of the level by ln τ.
    slope: f64,
    /// Variance of the level, covariance, and variance of the slope.
    variance: [f64; 3],
}

impl Model {
    fn new(at: f64, level: f64, noise: f64) -> Self {
        Self { at, level, slope: SLOPE, variance: [noise * noise, 0.0, SLOPE_DEVIATION * SLOPE_DEVIATION] }
    }

    /// Returns the model one frame later at another tolerance. The level has a random walk, and the slope becomes
    /// uncertain with distance.
    fn moved(&self, at: f64) -> Self {
        let step = at - self.at;
        let [level, both, slope] = self.variance;
        let bend = 0.3 * (self.slope * step).abs().min(1.0);
        let level = level + 2.0 * step * both + step * step * slope + RANDOM_WALK * RANDOM_WALK;
        let variance = [level, both + step * slope, slope + (bend * self.slope).powi(2)];
        Self { at, level: self.level + self.slope * step, slope: self.slope, variance }
    }

    /// Returns the deviation of a cost from the expected one, in standard deviations.
    fn surprise(&self, at: f64, cost: f64, noise: f64) -> f64 {
        let expected = self.moved(at);
        (cost - expected.level) / (expected.variance[0] + noise * noise).sqrt()
    }

    /// Updates the model with a cost. Returns the correction of the level, ln cost.
    fn update(&mut self, at: f64, cost: f64, noise: f64) -> f64 {
        let mut new = self.moved(at);
        let [level, both, slope] = new.variance;
        let total = level + noise * noise;
        let [gain, slope_gain] = [level / total, both / total];
        let error = cost - new.level;
        new.level += gain * error;
        new.slope = (new.slope + slope_gain * error).clamp(SLOPES[0], SLOPES[1]);
        new.variance = [(1.0 - gain) * level, (1.0 - gain) * both, slope - slope_gain * both];
        *self = new;
        gain * error
    }

    /// Returns true if a tolerance differs so much that the curve may differ there; on a step, very little suffices.
    fn is_elsewhere(&self, at: f64, noise: f64, is_on_stair: bool) -> bool {
        let step = (at - self.at).abs();
        step > 0.05 + noise || self.slope.abs() * step > 0.02 + 2.0 * noise || is_on_stair && step > SAME
    }

    /// Updates the model with a cost at another tolerance that the line does not explain: the curve is bent.
    fn bend(&mut self, at: f64, cost: f64, noise: f64) {
        self.slope = ((cost - self.level) / (at - self.at)).clamp(SLOPES[0], SLOPES[1]);
        self.variance[2] = self.slope * self.slope;
        self.jump(at, cost, noise);
    }

    /// Updates the model with a cost that a change of load explains.
    fn jump(&mut self, at: f64, cost: f64, noise: f64) {
        (self.at, self.level) = (at, cost);
        self.variance[0] = noise * noise;
        self.variance[1] = 0.0;
    }

    /// Returns the deviation from the target that is not worth a move, ln cost.
    fn dead_band(&self) -> f64 {
        self.variance[0].sqrt().max(0.01)
    }

    /// Returns the step from the current tolerance to the one that costs the target, ln τ. Towards more triangles, it
    /// is limited by the steepest likely slope.
    fn step(&self) -> f64 {
        let whole = -self.level / self.slope;
        if self.level > 0.0 {
            return whole;
        }
        let steepest = self.slope.abs() + STEEPEST * self.variance[2].max(0.0).sqrt();
        let unsure = self.variance[0].sqrt();
        whole.max(((self.level + unsure).min(0.0) - OVERSHOOT) / steepest)
    }
}
