//! From the error of a diamond to the radius of its sphere.
//!
//! Outside its sphere a diamond may stay unsplit wherever the eye looks: all that it covers lies in the ball about its
//! middle, further from the eye than the radius less the ball's.

use glam::DVec3;

use super::known::Known;
use crate::view::{Lens, Metric, View};

/// How far errors reach in the views of one lens, picture and tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Distance, metres, at which an error of a metre is tolerated.
    per_error: f64,
    /// Errors up to this, metres, are tolerated everywhere.
    harmless: f64,
}

impl Reach {
    /// The reach of a view, whatever its direction.
    ///
    /// Certified: with [`Allowance::error`](crate::view::Allowance::error)'s terms, all that can be seen at a distance d
    /// lies at a depth of at least max(near, d/k), no further aside than k times its depth, so that an error up to
    /// τ·depth / (f·k + τ) moves it by τ pixels at most. The distance is thus k·(f·k + τ)/τ times the error.
    /// The paper's metric: f/τ times the error. In parallel projection an error is tolerated everywhere or nowhere; under an
    /// infinite tolerance everywhere.
    pub fn new(view: &View) -> Self {
        let (focal, px) = (view.focal_px(), view.tolerance.px);
        if px == f64::INFINITY {
            return Self { per_error: 0.0, harmless: px };
        }
        match (view.lens, view.tolerance.metric) {
            (Lens::Perspective { .. }, Metric::Certified) => {
                let corner = view.corner_ray();
                let depth_per_error = (focal * corner + px) / px;
                Self { per_error: corner * depth_per_error, harmless: view.near / depth_per_error }
            }
            (Lens::Perspective { .. }, Metric::Paper) => {
                Self { per_error: focal / px, harmless: view.near * px / focal }
            }
            (Lens::Orthographic { .. }, _) => {
                let nothing = crate::view::Aabb { min: view.eye, max: view.eye };
                Self { per_error: f64::INFINITY, harmless: view.allowed_error(&nothing) }
            }
        }
    }

    /// The part of a view's tolerance, pixels, that single precision takes of heights relative to the eye's: an error of
    /// `rounding` times the distance, in parallel projection of times `range_m`, the land's range of heights.
    pub fn rounding_px(view: &View, rounding: f64, range_m: f64) -> f64 {
        match view.lens {
            Lens::Perspective { .. } => view.focal_px() * view.corner_ray().powi(2) * rounding,
            Lens::Orthographic { .. } => view.focal_px() * range_m * rounding,
        }
    }

    /// Returns true if a diamond of this error has a sphere. If it has none, its children have none. An infinite error always has.
    #[inline]
    pub fn matters(&self, error: f32) -> bool {
        f64::from(error) > self.harmless.max(0.0) || error == f32::INFINITY
    }

    /// The radius of a diamond's sphere, metres; negative if it has none, infinite if its error is.
    #[inline]
    pub fn radius(&self, known: &Known) -> f64 {
        if known.error == f32::INFINITY {
            return f64::INFINITY;
        }
        if !self.matters(known.error) {
            return -1.0;
        }
        f64::from(known.ball) + f64::from(known.error) * self.per_error
    }
}

/// Where the eye is, and how far it must be from a diamond's middle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// From the field's first sample on, metres.
    pub eye: DVec3,
    /// How far errors reach.
    pub reach: Reach,
    /// Diamonds split this many times their radius away: 1, or what vertices need to fade in.
    pub band: f64,
    /// Diamonds that have split stay so up to this many times that distance.
    pub hold: f64,
}

impl Viewpoint {
    /// How far the eye may move before a diamond splits, or merges if it has split, metres; not above 0 if it should
    /// have, infinite if it never does.
    #[inline]
    pub fn slack(&self, known: &Known, is_split: bool) -> f64 {
        let radius = self.radius(known, is_split);
        match is_split {
            _ if radius == f64::INFINITY => {
                if is_split {
                    radius
                } else {
                    -radius
                }
            }
            true => radius - known.centre.distance(self.eye),
            false if radius < 0.0 => f64::INFINITY,
            // On a sphere is outside.
            false => (known.centre.distance(self.eye) - radius).next_up(),
        }
    }

    /// The radius of the sphere in which a diamond splits, or outside of which it merges if it has split, metres.
    #[inline]
    pub fn radius(&self, known: &Known, is_split: bool) -> f64 {
        self.reach.radius(known) * self.band * if is_split { self.hold } else { 1.0 }
    }

    /// How far a vertex still has to go from where its diamond's hypotenuse was, 1 to 0.
    #[inline]
    pub fn weight(&self, known: &Known) -> f64 {
        let radius = self.reach.radius(known);
        if radius.is_finite() && self.band > 1.0 {
            ((known.centre.distance(self.eye) / radius.max(f64::MIN_POSITIVE) - 1.0) / (self.band - 1.0))
                .clamp(0.0, 1.0)
        } else {
            0.0
        }
    }
}
