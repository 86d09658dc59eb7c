//! Rectangles of the plane.

/// A rectangle of the plane, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Area {
    /// Smallest corner.
    pub min: [f64; 2],
    /// Largest corner.
    pub max: [f64; 2],
}

impl Area {
    /// Returns the square around a position that reaches `reach_m` along the axes, metres.
    pub fn about(at: [f64; 2], reach_m: f64) -> Self {
        Self { min: at.map(|n| n - reach_m), max: at.map(|n| n + reach_m) }
    }
}
