//! The budget controller: moves the tolerance τ so that frames cost what they may, in triangles or in milliseconds.
//!
//! Costs come late and noisy, but each comes with the τ it was drawn with, so the delay needs no model. Near the
//! present τ, ln cost = level + slope · ln τ; a Kalman filter follows both (R. E. Kalman, "A New Approach to Linear
//! Filtering and Prediction Problems", 1960), and the next τ is where its line meets the target. So
//!
//! - nothing is integrated: there is no wind-up where τ ends, and waiting for a late cost repeats no correction;
//! - what noise explains moves nothing: the dead band is what is unknown of the level;
//! - towards finer levels τ goes as far only as the steepest likely slope allows without costing a fifth too much;
//! - a cost that nothing explains is believed when the next one agrees: a single slow frame moves nothing;
//! - where cost is a staircase, the nearest tolerances known to be too dear and cheap enough close in on the stair,
//!   and the cheap one stays.

/// What is held.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Target {
    /// Triangles a frame.
    Triangles(f64),
    /// Milliseconds a frame.
    FrameMs(f64),
}

impl Target {
    /// The cost to be held, in its unit.
    pub fn cost(self) -> f64 {
        match self {
            Target::Triangles(cost) | Target::FrameMs(cost) => cost,
        }
    }

    /// Width of a stair that is not worth closing in on further, ln τ: what noise hides takes too many frames to find.
    fn finest(self) -> f64 {
        match self {
            Target::Triangles(_) => 1e-5,
            Target::FrameMs(_) => 1e-2,
        }
    }

    /// Standard deviation of ln cost from frame to frame when nothing changes, until it is known better.
    fn noise(self) -> f64 {
        match self {
            Target::Triangles(_) => 0.005,
            Target::FrameMs(_) => 0.2,
        }
    }
}

/// Tolerances that make sense on any screen, pixels.
pub const RANGE_PX: [f64; 2] = [1.0 / 64.0, 256.0];

/// How much more than the target a move to a finer level may cost, ln cost.
const OVERSHOOT: f64 = 0.18;
/// How far the level wanders from frame to frame, ln cost.
const WANDER: f64 = 0.03;
/// After so many steps from one side only, what holds them back on the other side is forgotten.
const DISTRUST: i32 = 5;
/// Tolerances closer than this are the same, ln τ.
const SAME: f64 = 1e-7;
/// Share of a new frame in the noise that is known.
const NOISE_SHARE: f64 = 0.05;
/// Times are never more exact than this, ln cost.
const MIN_NOISE: f64 = 0.02;
/// Deviations that a likely value is within.
const LIKELY: f64 = 3.0;
/// Deviations that the slope of a move to a finer level is within.
const STEEPEST: f64 = 2.0;
/// Slope of ln cost over ln τ while nothing is known: what is made of triangles of one size on the screen has −2,
/// where errors grow with the square of a triangle's side −1.
const SLOPE: f64 = -1.0;
/// Its standard deviation.
const SLOPE_DEVIATION: f64 = 3.0;
/// Slopes that are believed.
const SLOPES: [f64; 2] = [-2e4, -0.25];
/// The longest moves at once towards finer and coarser levels, ln τ.
const LONGEST: [f64; 2] = [-6.0, 1.4];
/// Costs below this are taken for it: their logarithms are finite.
const MIN_COST: f64 = 1e-3;

/// Moves a tolerance to hold a target.
#[derive(Clone, Debug)]
pub struct Controller {
    target: Target,
    /// Standard deviation of ln cost from frame to frame when nothing changes.
    noise: f64,
    /// ln τ, least and most.
    range: [f64; 2],
    /// ln τ of the next frame.
    next: f64,
    model: Option<Model>,
    /// How surprising the last cost was, if nothing explained it.
    suspect: Option<f64>,
    /// The largest ln τ that is too dear, and how much more it costs than the target, ln cost.
    dear: Option<[f64; 2]>,
    /// The smallest ln τ that is cheap enough, and the same (negative).
    cheap: Option<[f64; 2]>,
    /// How often in a row only what is cheap enough came closer (positive) or what is too dear (negative).
    one_sided: i32,
    /// Whether the last cost was off the line and left more than half of the way between them.
    is_slow: bool,
}

impl Controller {
    /// Holds a target from a first tolerance on, within a range of tolerances, pixels.
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
            dear: None,
            cheap: None,
            one_sided: 0,
            is_slow: false,
        }
    }

    /// What is held.
    pub fn target(&self) -> Target {
        self.target
    }

    /// The tolerance of the next frame, pixels.
    pub fn tolerance_px(&self) -> f64 {
        self.next.exp()
    }

    /// Takes the cost of a frame, triangles or milliseconds, and the tolerance that it was drawn with, pixels; any
    /// number of frames late, in the order in which they were drawn.
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
        let between = |[dear, cheap]: [[f64; 2]; 2]| at > dear[0] && at < cheap[0];
        let is_on_stair = self.dear.zip(self.cheap).is_some_and(|(dear, cheap)| between([dear, cheap]));
        let is_bent = surprise.abs() > LIKELY && model.is_elsewhere(at, noise, is_on_stair);
        if surprise.abs() <= LIKELY {
            let was_at = model.at;
            let off = excess - model.moved(at).level;
            let error = model.update(at, excess, noise);
            let is_same = at == was_at;
            self.age(if is_same { [error; 2] } else { [-WANDER, WANDER] });
            if is_same && matches!(self.target, Target::FrameMs(_)) {
                let variance = noise * noise + NOISE_SHARE * (off * off - noise * noise);
                self.noise = variance.sqrt().clamp(MIN_NOISE, self.target.noise());
            }
        } else if is_bent {
            model.bend(at, excess, noise);
        } else if self.suspect.is_some_and(|suspect| suspect * surprise > 0.0) {
            model.jump(at, excess, noise);
            (self.dear, self.cheap) = (None, None);
        } else {
            self.suspect = Some(surprise);
            return;
        }
        self.suspect = None;
        self.decide(is_bent);
    }

    /// What is known of other tolerances changes by so much, ln cost: with the load, if τ was the same, else towards
    /// nothing.
    fn age(&mut self, [dear, cheap]: [f64; 2]) {
        self.dear = self.dear.map(|[at, excess]| [at, excess + dear]).filter(|dear| dear[1] > 0.0);
        self.cheap = self.cheap.map(|[at, excess]| [at, excess + cheap]).filter(|cheap| cheap[1] < 0.0);
    }

    fn decide(&mut self, is_bent: bool) {
        let Some(model) = self.model else { return };
        self.narrow(&model, is_bent);
        // A tolerance that is likely right stays.
        let held = model.moved(self.next);
        if held.level.abs() <= model.dead_band() && self.within(self.next) == self.next {
            return;
        }
        let aim = self.within(model.at + model.step().clamp(LONGEST[0], LONGEST[1]));
        self.next = aim.clamp(self.range[0], self.range[1]);
    }

    /// Notes on which side of the target the last tolerance was.
    fn narrow(&mut self, model: &Model, is_bent: bool) {
        let &Model { at, level, .. } = model;
        let sure = LIKELY * model.dead_band();
        let width = self.width();
        if level > sure && self.dear.is_none_or(|dear| dear[0] <= at) {
            self.one_sided = closer(self.one_sided.min(0), self.dear, at, -1);
            self.dear = Some([at, level]);
            self.cheap = self.cheap.filter(|cheap| cheap[0] > at);
        } else if level < -sure && self.cheap.is_none_or(|cheap| cheap[0] >= at) {
            self.one_sided = closer(self.one_sided.max(0), self.cheap, at, 1);
            self.cheap = Some([at, level]);
            self.dear = self.dear.filter(|dear| dear[0] < at);
        }
        // What was seen long ago at the other side holds no more: the load has changed while τ moved.
        if self.one_sided >= DISTRUST {
            (self.dear, self.one_sided) = (None, 0);
        } else if self.one_sided <= -DISTRUST {
            (self.cheap, self.one_sided) = (None, 0);
        }
        let left = self.width();
        self.is_slow = is_bent && width.is_finite() && left > 0.5 * width;
    }

    /// From what is too dear to what is cheap enough, ln τ.
    fn width(&self) -> f64 {
        self.dear.zip(self.cheap).map_or(f64::INFINITY, |(dear, cheap)| cheap[0] - dear[0])
    }

    /// The tolerance nearest to one that is aimed at between those that are too dear and those that are cheap enough.
    fn within(&self, aim: f64) -> f64 {
        let (Some([dear, _]), Some([cheap, _])) = (self.dear, self.cheap) else {
            let (min, max) = (self.dear.map_or(aim, |dear| dear[0]), self.cheap.map_or(aim, |cheap| cheap[0]));
            return aim.max(min).min(max);
        };
        if cheap - dear <= self.target.finest() {
            return cheap;
        }
        // Where lines do not help, halves do.
        let [min, max] = if self.is_slow { [0.5, 0.5] } else { [0.02, 0.98] };
        aim.clamp(dear + min * (cheap - dear), dear + max * (cheap - dear))
    }
}

/// One more than `before` if a bound moves.
fn closer(before: i32, bound: Option<[f64; 2]>, at: f64, sign: i32) -> i32 {
    if bound.is_some_and(|bound| (bound[0] - at).abs() <= SAME) { before } else { before + sign }
}

/// ln cost over the target's, near a tolerance: a line, and how well it is known.
#[derive(Clone, Copy, Debug)]
struct Model {
    /// ln τ.
    at: f64,
    /// There.
    level: f64,
    /// Over ln τ.
    slope: f64,
    /// Variances of level and slope, and their covariance between them.
    variance: [f64; 3],
}

impl Model {
    fn new(at: f64, level: f64, noise: f64) -> Self {
        Self { at, level, slope: SLOPE, variance: [noise * noise, 0.0, SLOPE_DEVIATION * SLOPE_DEVIATION] }
    }

    /// The model a frame later, at another tolerance: the level wanders, and a line is a line for a while only.
    fn moved(&self, at: f64) -> Self {
        let step = at - self.at;
        let [level, both, slope] = self.variance;
        let bend = 0.3 * (self.slope * step).abs().min(1.0);
        let level = level + 2.0 * step * both + step * step * slope + WANDER * WANDER;
        let variance = [level, both + step * slope, slope + (bend * self.slope).powi(2)];
        Self { at, level: self.level + self.slope * step, slope: self.slope, variance }
    }

    /// How many standard deviations a cost is off what is expected.
    fn surprise(&self, at: f64, cost: f64, noise: f64) -> f64 {
        let expected = self.moved(at);
        (cost - expected.level) / (expected.variance[0] + noise * noise).sqrt()
    }

    /// Takes a cost in; by how much the level there was found to be off, ln cost.
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

    /// Whether a tolerance differs so much that the curve may be another one there, on a stair very little.
    fn is_elsewhere(&self, at: f64, noise: f64, is_on_stair: bool) -> bool {
        let step = (at - self.at).abs();
        step > 0.05 + noise || self.slope.abs() * step > 0.02 + 2.0 * noise || is_on_stair && step > SAME
    }

    /// Takes a cost at another tolerance that the line does not explain: the curve is bent.
    fn bend(&mut self, at: f64, cost: f64, noise: f64) {
        self.slope = ((cost - self.level) / (at - self.at)).clamp(SLOPES[0], SLOPES[1]);
        self.variance[2] = self.slope * self.slope;
        self.jump(at, cost, noise);
    }

    /// Takes a cost that is as it is because the load has changed.
    fn jump(&mut self, at: f64, cost: f64, noise: f64) {
        (self.at, self.level) = (at, cost);
        self.variance[0] = noise * noise;
        self.variance[1] = 0.0;
    }

    /// What is not worth a move.
    fn dead_band(&self) -> f64 {
        self.variance[0].sqrt().max(0.01)
    }

    /// From the present tolerance to the one that costs the target, ln τ; towards more triangles, no further than the
    /// steepest likely slope allows.
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
