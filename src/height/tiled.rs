//! A raster repeated along both axes.

use std::sync::Arc;

use super::raster::Raster;
use super::source::{Coverage, HeightSource};

/// A raster repeated `tiles` times along (x, z); sample (0, 0) follows the last one.
#[derive(Clone, Debug)]
pub struct Tiled {
    raster: Raster,
    tiles: [u32; 2],
}

impl Tiled {
    /// Repeats a raster.
    pub fn new(raster: Raster, tiles: [u32; 2]) -> Self {
        Self { raster, tiles }
    }
}

impl HeightSource for Tiled {
    fn size(&self) -> [u32; 2] {
        [0, 1].map(|k| self.raster.size()[k] * self.tiles[k])
    }

    fn height(&self, i: u32, j: u32) -> f32 {
        let [w, h] = self.raster.size();
        self.raster.height(i % w, j % h)
    }

    fn is_hole(&self, i: u32, j: u32) -> bool {
        let [w, h] = self.raster.size();
        self.raster.is_hole(i % w, j % h)
    }

    fn raster(&self) -> &Raster {
        &self.raster
    }

    fn coverage(&self) -> Coverage {
        Coverage::Periodic
    }

    fn with_raster(&self, raster: Raster) -> Arc<dyn HeightSource> {
        Arc::new(Self { raster, tiles: self.tiles })
    }
}
