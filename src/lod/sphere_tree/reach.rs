//! Converts the error of a diamond to the radius of its sphere.
//!
//! Outside its sphere a diamond may stay unsplit for any direction of the view. All that it covers lies in the ball
//! about its middle, so its distance from the eye exceeds the radius minus the ball's.

use glam::DVec3;

use super::diamond_info::DiamondInfo;
use crate::view::{Lens, Metric, View};

/// Distances at which errors are tolerated, for one lens, image size and tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Reach {
    /// Distance, metres, at which an error of one metre is tolerated.
    per_error: f64,
    /// Error, metres, that is tolerated at any distance.
    harmless: f64,
}

impl Reach {
    /// Computes the reach of a view; it does not depend on the view's direction.
    ///
    /// Certified metric, with the terms of [`Allowance::error`](crate::view::Allowance::error): a visible point at
    /// distance d has a depth of at least max(near, d/k), and is at most k times its depth off the axis. An error up to
    /// τ·depth / (f·k + τ) moves it by at most τ pixels. The distance is therefore k·(f·k + τ)/τ times the error. The
    /// paper's metric uses f/τ times the error. In parallel projection an error is tolerated everywhere or nowhere;
    /// under an infinite tolerance, everywhere.
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

    /// Returns the part of a view's tolerance, pixels, that heights in single precision relative to the eye use up. The
    /// error is `rounding` times the distance, or times `range_m`, the terrain's height range in metres, in parallel
    /// projection.
    pub fn rounding_px(view: &View, rounding: f64, range_m: f64) -> f64 {
        match view.lens {
            Lens::Perspective { .. } => view.focal_px() * view.corner_ray().powi(2) * rounding,
            Lens::Orthographic { .. } => view.focal_px() * range_m * rounding,
        }
    }

    /// Returns true if a diamond of this error has a sphere; an infinite error always has one. Without one, its
    /// children have none.
    #[inline]
    pub fn has_sphere(&self, error: f32) -> bool {
        f64::from(error) > self.harmless.max(0.0) || error == f32::INFINITY
    }

    /// Returns the radius of a diamond's sphere, metres; negative if it has none, infinite if its error is.
    #[inline]
    pub fn radius(&self, diamond: &DiamondInfo) -> f64 {
        if diamond.error == f32::INFINITY {
            return f64::INFINITY;
        }
        if !self.has_sphere(diamond.error) {
            return -1.0;
        }
        f64::from(diamond.ball) + f64::from(diamond.error) * self.per_error
    }
}

/// Position of the eye, and the parameters of all spheres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// Eye relative to the field's first sample, metres.
    pub eye: DVec3,
    /// Distances at which errors are tolerated.
    pub reach: Reach,
    /// Multiple of the radius at which diamonds split: 1, or more if vertices fade in.
    pub band: f64,
    /// Multiple of that distance at which split diamonds merge.
    pub hold: f64,
}

impl Viewpoint {
    /// Returns the distance that the eye may move before a diamond splits, or merges if it has split, metres. Not above
    /// 0 if the change is due, infinite if it never happens.
    #[inline]
    pub fn slack(&self, diamond: &DiamondInfo, is_split: bool) -> f64 {
        let radius = self.radius(diamond, is_split);
        match is_split {
            _ if radius == f64::INFINITY => {
                if is_split {
                    radius
                } else {
                    -radius
                }
            }
            true => radius - diamond.centre.distance(self.eye),
            false if radius < 0.0 => f64::INFINITY,
            // A point on the sphere counts as outside.
            false => (diamond.centre.distance(self.eye) - radius).next_up(),
        }
    }

    /// Returns the radius of the sphere in which a diamond splits, or outside of which it merges if it has split,
    /// metres.
    #[inline]
    pub fn radius(&self, diamond: &DiamondInfo, is_split: bool) -> f64 {
        self.reach.radius(diamond) * self.band * if is_split { self.hold } else { 1.0 }
    }

    /// Returns the weight of a vertex, from 1 at its hypotenuse's middle to 0 fully faded in.
    #[inline]
    pub fn weight(&self, diamond: &DiamondInfo) -> f64 {
        let radius = self.reach.radius(diamond);
        if radius.is_finite() && self.band > 1.0 {
            ((diamond.centre.distance(self.eye) / radius.max(f64::MIN_POSITIVE) - 1.0) / (self.band - 1.0))
                .clamp(0.0, 1.0)
        } else {
            0.0
        }
    }
}
