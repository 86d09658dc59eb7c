//! The error and ball of a diamond.

use glam::DVec3;

/// Relative margin of a ball's radius for rounding, far above that of a distance in f64.
pub const SPARE: f64 = 1e-6;

/// A diamond with its error and ball.
#[derive(Clone, Copy, Debug)]
pub struct DiamondInfo {
    /// Index.
    pub index: usize,
    /// Middle relative to the field's first sample, at its height, metres.
    pub centre: DVec3,
    /// Largest distance from the terrain, metres.
    pub error: f32,
    /// Radius of the ball about the middle, metres.
    pub ball: f32,
}
