//! Synthetic terrain of a sweep case: kind, size, spacing, holes, tiles and origin.

use serde::{Deserialize, Serialize};

use crate::height::synth::{self, noise};
use crate::height::{Field, Holes, Samples};

/// Distribution of samples without data.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub enum Voids {
    /// No voids.
    #[default]
    None,
    /// A disc around the middle.
    Lake,
    /// About one sample in twenty, at random.
    Scattered,
    /// Everything east of a slanted line.
    East,
    /// Everything but a small disc.
    Most,
}

impl Voids {
    /// All distributions.
    pub const ALL: [Self; 5] = [Self::None, Self::Lake, Self::Scattered, Self::East, Self::Most];

    fn has(self, at: [u32; 2], size: [u32; 2], seed: u64) -> bool {
        let [u, v] = [0, 1].map(|k| f64::from(at[k]) / f64::from(size[k] - 1));
        let random = noise::white(i64::from(at[0]), i64::from(at[1]), seed);
        match self {
            Self::None => false,
            Self::Lake => (u - 0.45).hypot(v - 0.55) < 0.3,
            Self::Scattered => random > 0.9,
            Self::East => u > 0.6 + 0.1 * v,
            Self::Most => (u - 0.7).hypot(v - 0.3) > 0.15,
        }
    }
}

/// Synthetic terrain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Terrain {
    /// Name of a kind of synthetic field.
    pub kind: String,
    /// Samples along (x, z).
    pub size: [u32; 2],
    /// Seed of the kind.
    pub seed: u64,
    /// Metres between samples along (x, z).
    pub spacing: [f64; 2],
    /// Samples without data.
    #[serde(default)]
    pub voids: Voids,
    /// Repetitions along (x, z).
    #[serde(default = "once")]
    pub tiles: [u32; 2],
    /// Position of the first sample along (x, z), metres.
    #[serde(default)]
    pub origin: [f64; 2],
}

fn once() -> [u32; 2] {
    [1, 1]
}

impl Terrain {
    /// Creates the field.
    ///
    /// # Panics
    /// If there is no such kind.
    pub fn field(&self) -> Field {
        let kind = self.kind.parse().expect("a kind of synthetic field");
        let generated = synth::synth(kind, self.size, self.seed);
        let [w, h] = self.size;
        let heights = (0..(w * h) as usize).map(|k| generated.samples().height(k)).collect();
        let mut holes = Holes::none((w * h) as usize);
        let is_void = |k: &u32| self.voids.has([k % w, k / w], self.size, self.seed);
        (0..w * h).filter(is_void).for_each(|k| holes.insert(k as usize));
        let mut field = Field::new(Samples::F32(heights), self.size, self.spacing, holes);
        field.origin = self.origin;
        if self.tiles == once() { field } else { field.tiled(self.tiles) }
    }

    /// Returns the number of samples, repetitions included.
    pub fn samples(&self) -> u64 {
        [0, 1].into_iter().map(|k| u64::from(self.size[k]) * u64::from(self.tiles[k])).product()
    }
}
