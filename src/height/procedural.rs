//! Terrain that is evaluated, not stored.

use std::sync::Arc;

use super::bezier::{self, Bezier};
use super::holes::Holes;
use super::raster::Raster;
use super::samples::Samples;
use super::source::{Block, Coverage, HeightSource};

/// Samples along a side of the preview.
const PREVIEW: u32 = 257;

/// A lattice of [`bezier::LATTICE`] samples a side whose heights are evaluated on request.
///
/// Its raster is a coarse preview: memory and statistics are those of the preview.
#[derive(Clone, Debug)]
pub struct Procedural {
    terrain: Arc<Bezier>,
    preview: Raster,
}

impl Procedural {
    /// Evaluates the preview.
    pub fn new(terrain: Arc<Bezier>) -> Self {
        let last = bezier::LATTICE - 1;
        let block = Block { first: [0; 2], last: [last; 2], step: last / (PREVIEW - 1) };
        let heights = block.along(1).flat_map(|j| block.along(0).map(move |i| [i, j]));
        let samples = Samples::F32(heights.map(|at| height(&terrain, at)).collect());
        let preview = Raster::new(samples, [PREVIEW; 2], Holes::none((PREVIEW * PREVIEW) as usize));
        Self { terrain, preview }
    }
}

fn height(terrain: &Bezier, at: [u32; 2]) -> f32 {
    terrain.height(at.map(|n| f64::from(n) * bezier::SPACING_M)) as f32
}

impl HeightSource for Procedural {
    fn size(&self) -> [u32; 2] {
        [bezier::LATTICE; 2]
    }

    fn height(&self, i: u32, j: u32) -> f32 {
        height(&self.terrain, [i, j])
    }

    fn is_hole(&self, _: u32, _: u32) -> bool {
        false
    }

    fn raster(&self) -> &Raster {
        &self.preview
    }

    fn coverage(&self) -> Coverage {
        Coverage::Preview
    }

    fn with_raster(&self, preview: Raster) -> Arc<dyn HeightSource> {
        Arc::new(Self { terrain: Arc::clone(&self.terrain), preview })
    }

    fn procedural(&self) -> Option<&Arc<Bezier>> {
        Some(&self.terrain)
    }
}
