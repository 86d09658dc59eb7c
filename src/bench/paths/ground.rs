//! The terrain under a camera path: heights at any position, and lengths that scale with the field.

use crate::height::Field;

/// Altitude of an overview flight, metres above ground.
const ALTITUDE_M: f64 = 300.0;
/// Eye height of a person, metres above ground.
const EYE_M: f64 = 1.7;

/// A field with the heights and lengths that paths need.
pub struct Ground<'a> {
    /// The field.
    pub field: &'a Field,
    /// Lowest and highest height, metres.
    pub range: [f64; 2],
}

impl<'a> Ground<'a> {
    /// Wraps a field and takes its height range.
    pub fn of(field: &'a Field) -> Self {
        let statistics = field.statistics();
        Self { field, range: [statistics.min.into(), statistics.max.into()] }
    }

    /// Returns the height at a world position (x, z), metres. Interpolation is bilinear. Outside the field it is the
    /// height of the nearest border point, in holes that of their filling.
    pub fn height(&self, at: [f64; 2]) -> f64 {
        self.height_of_sample(self.sample(at))
    }

    /// Returns the free height above the ground at a world position (x, z), metres: up to the ceiling, or twice the
    /// eye height if the field has none.
    pub fn room(&self, at: [f64; 2]) -> f64 {
        match self.field.ceiling() {
            Some(ceiling) => bilinear(ceiling, self.sample(at)) - self.height(at),
            None => 2.0 * self.eye_height(),
        }
    }

    /// Returns a world position (x, z) in units of samples.
    fn sample(&self, at: [f64; 2]) -> [f64; 2] {
        [0, 1].map(|k| (at[k] - self.field.origin[k]) / self.field.spacing[k])
    }

    /// Returns the height at a position in units of samples, as [`Self::height`].
    pub fn height_of_sample(&self, at: [f64; 2]) -> f64 {
        bilinear(self.field, at)
    }

    /// Returns the world position (x, z) of a place given as shares of the field's extent, 0 to 1.
    pub fn place(&self, u: f64, v: f64) -> [f64; 2] {
        let size = self.field.size();
        let parts = [u, v];
        [0, 1].map(|k| self.field.origin[k] + parts[k] * f64::from(size[k] - 1) * self.field.spacing[k])
    }

    /// Returns the world position (x, z) of the highest sample on a grid of at most 256 × 256 samples.
    pub fn summit(&self) -> [f64; 2] {
        let [w, h] = self.field.size();
        let step = [w, h].map(|n| n.div_ceil(256) as usize);
        let places = (0..h).step_by(step[1]).flat_map(|j| (0..w).step_by(step[0]).map(move |i| [i, j]));
        let highest = places.max_by(|a, b| self.field.height(a[0], a[1]).total_cmp(&self.field.height(b[0], b[1])));
        let [i, j] = highest.unwrap_or([0, 0]);
        let at = self.field.world(i, j);
        [at.x, at.z]
    }

    /// Returns the length of the field's shorter side, metres.
    pub fn extent(&self) -> f64 {
        let (low, high) = (self.place(0.0, 0.0), self.place(1.0, 1.0));
        (high[0] - low[0]).min(high[1] - low[1])
    }

    /// Returns the altitude of an overview flight, metres above ground: 300 m, or a quarter of a small field's extent.
    pub fn altitude(&self) -> f64 {
        ALTITUDE_M.min(self.extent() / 4.0)
    }

    /// Returns the eye height of a walk, metres above ground: 1.7 m, or a fiftieth of a small field's extent.
    pub fn eye_height(&self) -> f64 {
        EYE_M.min(self.extent() / 50.0)
    }

    /// Returns the distance of the near plane, metres: 0.1 m, or a thousandth of a small field's extent.
    pub fn near(&self) -> f64 {
        0.1f64.min(self.extent() / 1000.0)
    }
}

/// Returns the height at a position in units of samples, clamped to the field.
fn bilinear(field: &Field, at: [f64; 2]) -> f64 {
    let last = field.size().map(|n| n - 1);
    let clamped = [0, 1].map(|k| at[k].clamp(0.0, f64::from(last[k])));
    let low = [0, 1].map(|k| (clamped[k] as u32).min(last[k] - 1));
    let [u, v] = [0, 1].map(|k| clamped[k] - f64::from(low[k]));
    let height = |i: u32, j: u32| f64::from(field.height(low[0] + i, low[1] + j));
    (height(0, 0) * (1.0 - u) + height(1, 0) * u) * (1.0 - v) + (height(0, 1) * (1.0 - u) + height(1, 1) * u) * v
}
