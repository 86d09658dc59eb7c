//! A diamond with its measurements.

use glam::DVec3;

use super::lattice::Place;

/// A diamond with what is known of it.
#[derive(Clone, Copy, Debug)]
pub struct Known {
    /// Its middle on the lattice.
    pub at: Place,
    /// Its index.
    pub index: usize,
    /// Its middle from the field's first sample on, at its height, metres.
    pub centre: DVec3,
    /// Metres.
    pub error: f32,
    /// Metres.
    pub ball: f32,
}
