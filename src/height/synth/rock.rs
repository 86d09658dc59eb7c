//! Rock under an eroded landscape, by noise.

use super::flow::Grid;
use super::noise;

/// The rock: uplift, firmness and repose at each position.
pub struct Rock {
    /// Seed of all noise.
    pub seed: u64,
    /// World position of the first cell, metres.
    origin: [f64; 2],
}

impl Rock {
    /// The rock of a seed under a grid whose first cell lies at `origin`, metres.
    pub fn new(seed: u64, origin: [f64; 2]) -> Self {
        Self { seed, origin }
    }

    /// World position of a cell in units of `wavelength` metres.
    pub fn place(&self, grid: Grid, k: usize, wavelength: f64) -> [f64; 2] {
        let [i, j] = [k % grid.size[0], k / grid.size[0]].map(|n| n as f64 * grid.spacing);
        [(self.origin[0] + i) / wavelength, (self.origin[1] + j) / wavelength]
    }

    /// Returns the height of massifs: the ridged noise at a warped position.
    pub fn massif(&self, grid: Grid, k: usize, octaves: u32) -> f64 {
        let p = noise::warped(self.place(grid, k, 15_000.0), 0.4, self.seed ^ 0x10);
        noise::ridged(p, octaves, self.seed ^ 0x20)
    }

    /// Uplift over erodibility U / K, metres: steep in the massifs, low between, uneven as rock is.
    pub fn uplift(&self, grid: Grid, k: usize) -> f64 {
        let crest = (0.5 + 0.5 * self.massif(grid, k, 2)).clamp(0.0, 1.0);
        let hardness = 1.0 + 0.5 * noise::fractal(self.place(grid, k, 900.0), 4, self.seed ^ 0x22);
        (14.0 + 480.0 * crest * crest * crest) * hardness
    }

    /// Returns the firmness of the rock, about −1 to 1.
    pub fn firmness(&self, grid: Grid, k: usize) -> f64 {
        noise::fractal(self.place(grid, k, 1_500.0), 3, self.seed ^ 0x40)
    }

    /// Steepest slope that stands: from rubble at 29° to walls at 60°, in tilted beds.
    pub fn repose(&self, grid: Grid, k: usize, height: f64, firmness: f64) -> f64 {
        let [x, z] = self.place(grid, k, 1_500.0);
        let bed = noise::gradient(height / 170.0 + x * 0.8, z * 0.5, self.seed ^ 0x30);
        (1.05 + 0.25 * bed + 0.4 * firmness).clamp(0.55, 1.7)
    }
}
