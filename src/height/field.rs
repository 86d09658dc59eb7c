//! Terrain in the world: a source of heights with spacing, origin and coordinate system.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use super::bezier::{self, Bezier};
use super::holes::Holes;
use super::procedural::Procedural;
use super::raster::Raster;
use super::samples::Samples;
use super::source::{Block, Coverage, HeightSource};
use super::statistics::Statistics;
use super::tiled::Tiled;

/// A rectangular field of heights, at least 2 × 2 samples.
///
/// Sample `(i, j)` lies at `origin + (i·dx, j·dz)`: x east, z south. A hole's sample holds a height interpolated from
/// the samples around it, so that meshes run smoothly to the hole's edge. Statistics leave it out. Clones share the
/// samples.
#[derive(Clone, Debug)]
pub struct Field {
    source: Arc<dyn HeightSource>,
    /// The source's own, held here so that reading a sample in memory makes no dynamic call.
    raster: Raster,
    coverage: Coverage,
    size: [u32; 2],
    /// The surface above the floor of a cave.
    ceiling: Option<Arc<Field>>,
    /// Distance of neighbouring samples (x, z), metres.
    pub spacing: [f64; 2],
    /// World position of sample (0, 0) (x, z), metres.
    pub origin: [f64; 2],
    /// Coordinate reference system, as the file names it.
    pub crs: Option<String>,
    /// The file that the heights come from, if derived data may be cached beside it.
    pub file: Option<PathBuf>,
}

impl Field {
    /// Makes a field of `x_count · z_count` samples; samples under holes may hold anything and are filled.
    ///
    /// # Panics
    /// If the number of samples is not `x_count · z_count`, a side is below 2, or a spacing is not positive.
    pub fn new(samples: Samples, size: [u32; 2], spacing: [f64; 2], holes: Holes) -> Self {
        Self::of(Arc::new(Raster::new(samples, size, holes)), spacing)
    }

    /// Makes a field of evaluated heights ([`Procedural`]).
    pub fn endless(terrain: Arc<Bezier>) -> Self {
        Self::of(Arc::new(Procedural::new(terrain)), [bezier::SPACING_M; 2])
    }

    /// Places a source with its first sample at the world's origin.
    ///
    /// # Panics
    /// If a spacing is not positive.
    pub fn of(source: Arc<dyn HeightSource>, spacing: [f64; 2]) -> Self {
        assert!(spacing.iter().all(|s| s.is_finite() && *s > 0.0));
        let (raster, coverage, size) = (source.raster().clone(), source.coverage(), source.size());
        Self { source, raster, coverage, size, ceiling: None, spacing, origin: [0.0, 0.0], crs: None, file: None }
    }

    /// Returns another source at the same place, without a ceiling.
    pub(super) fn with_source(&self, source: Arc<dyn HeightSource>) -> Self {
        Self { origin: self.origin, crs: self.crs.clone(), ..Self::of(source, self.spacing) }
    }

    /// Returns the same field as the floor of a cave.
    pub(super) fn under(self, ceiling: Arc<Field>) -> Self {
        Self { ceiling: Some(ceiling), ..self }
    }

    /// Repeats the samples in memory `tiles` times along (x, z); sample (0, 0) follows the last one.
    pub fn tiled(self, tiles: [u32; 2]) -> Self {
        let file = self.file.clone();
        let source: Arc<dyn HeightSource> = match tiles {
            [1, 1] => Arc::new(self.raster.clone()),
            _ => Arc::new(Tiled::new(self.raster.clone(), tiles)),
        };
        Self { file, ..self.with_source(source) }
    }

    /// Returns the source of the heights.
    pub(super) fn source(&self) -> &Arc<dyn HeightSource> {
        &self.source
    }

    /// Returns the function that heights are evaluated from, if they are not stored.
    pub fn procedural(&self) -> Option<&Arc<Bezier>> {
        self.source.procedural()
    }

    /// Returns the number of samples along (x, z), tiling included.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Returns the number of samples in memory along (x, z): fewer than [`Self::size`] where the field repeats or is
    /// evaluated.
    pub fn stored(&self) -> [u32; 2] {
        self.raster.size()
    }

    /// Returns the samples in memory, row by row.
    pub fn samples(&self) -> &Samples {
        self.raster.samples()
    }

    /// Returns the holes among the samples in memory.
    pub fn holes(&self) -> &Holes {
        self.raster.holes()
    }

    /// Returns the surface above, if this is the floor of a [cave](super::cave::Cave).
    pub fn ceiling(&self) -> Option<&Arc<Field>> {
        self.ceiling.as_ref()
    }

    /// Returns the lowest and highest height, metres, holes excepted and a ceiling included.
    pub fn range(&self) -> [f32; 2] {
        let ([low, high], ceiling) = (self.source.range(), self.ceiling.as_ref().map(|ceiling| ceiling.range()));
        ceiling.map_or([low, high], |[over_low, over_high]| [low.min(over_low), high.max(over_high)])
    }

    /// Returns the lowest and highest height, metres, of the samples between two lattice positions, both inclusive and
    /// holes included.
    pub fn range_of(&self, first: [u32; 2], last: [u32; 2]) -> [f32; 2] {
        self.source.range_of(first, last)
    }

    /// Appends the heights of a block, metres, row by row from the north.
    pub fn read(&self, block: &Block, heights: &mut Vec<f32>) {
        self.source.read(block, heights);
    }

    /// Returns true if the field repeats.
    pub fn is_tiled(&self) -> bool {
        self.coverage == Coverage::Periodic
    }

    /// Returns the height of sample `(i, j)`, metres; always finite.
    #[inline]
    pub fn height(&self, i: u32, j: u32) -> f32 {
        match self.coverage {
            Coverage::Whole => self.raster.height(i, j),
            Coverage::Periodic => self.raster.height(i % self.raster.size()[0], j % self.raster.size()[1]),
            Coverage::Preview => self.source.height(i, j),
        }
    }

    /// Returns true if sample `(i, j)` has no data.
    #[inline]
    pub fn is_hole(&self, i: u32, j: u32) -> bool {
        match self.coverage {
            Coverage::Whole => self.raster.is_hole(i, j),
            Coverage::Periodic => self.raster.is_hole(i % self.raster.size()[0], j % self.raster.size()[1]),
            Coverage::Preview => self.source.is_hole(i, j),
        }
    }

    /// Returns the world position of sample `(i, j)`, metres.
    pub fn world(&self, i: u32, j: u32) -> DVec3 {
        self.world_at(f64::from(i), f64::from(j), f64::from(self.height(i, j)))
    }

    /// Returns the world position of a lattice position and height, metres.
    pub fn world_at(&self, i: f64, j: f64, height: f64) -> DVec3 {
        DVec3::new(self.origin[0] + i * self.spacing[0], height, self.origin[1] + j * self.spacing[1])
    }

    /// Returns the unit normal at sample `(i, j)` by central differences; one-sided at the field's edge.
    pub fn normal(&self, i: u32, j: u32) -> Vec3 {
        let last = self.size().map(|n| n - 1);
        let around = |k: u32, axis: usize| [k.saturating_sub(1), (k + 1).min(last[axis])];
        let slope = |heights: [f32; 2], samples: [u32; 2], axis: usize| {
            let rise = f64::from(heights[0]) - f64::from(heights[1]);
            rise / (f64::from(samples[1] - samples[0]) * self.spacing[axis])
        };
        let (x, z) = (around(i, 0), around(j, 1));
        let east = slope(x.map(|i| self.height(i, j)), x, 0);
        let south = slope(z.map(|j| self.height(i, j)), z, 1);
        DVec3::new(east, 1.0, south).normalize_or(DVec3::Y).as_vec3()
    }

    /// Returns the bilinearly interpolated height at a world position, metres; `None` outside or over a hole.
    pub fn height_at(&self, x: f64, z: f64) -> Option<f64> {
        let [w, h] = self.size();
        let u = (x - self.origin[0]) / self.spacing[0];
        let v = (z - self.origin[1]) / self.spacing[1];
        if !(0.0..=f64::from(w - 1)).contains(&u) || !(0.0..=f64::from(h - 1)).contains(&v) {
            return None;
        }
        let (i, j) = ((u as u32).min(w - 2), (v as u32).min(h - 2));
        let (u, v) = (u - f64::from(i), v - f64::from(j));
        let corners = [(i, j), (i + 1, j), (i, j + 1), (i + 1, j + 1)];
        if corners.iter().any(|&(i, j)| self.is_hole(i, j)) {
            return None;
        }
        let [a, b, c, d] = corners.map(|(i, j)| f64::from(self.height(i, j)));
        Some((a * (1.0 - u) + b * u) * (1.0 - v) + (c * (1.0 - u) + d * u) * v)
    }

    /// Returns the statistics of the samples in memory that are no holes; zeros if all are holes.
    pub fn statistics(&self) -> Statistics {
        self.raster.statistics()
    }

    /// Returns the largest difference, metres, between the two ways to split a cell into triangles:
    /// |h00 + h11 − h10 − h01| / 2 over all cells without holes.
    pub fn cell_ambiguity(&self) -> f32 {
        let [w, h] = self.stored();
        let mut largest = 0.0f32;
        for j in 0..h - 1 {
            for i in 0..w - 1 {
                let corners = [(i, j), (i + 1, j + 1), (i + 1, j), (i, j + 1)];
                if self.holes().count() == 0 || !corners.iter().any(|&(i, j)| self.is_hole(i, j)) {
                    let [a, d, b, c] = corners.map(|(i, j)| self.height(i, j));
                    largest = largest.max((a + d - b - c).abs() / 2.0);
                }
            }
        }
        largest
    }

    /// Turns holes into data: they keep the heights filled in from around them.
    pub fn without_holes(self) -> Self {
        let (file, ceiling) = (self.file.clone(), self.ceiling.clone());
        Self { file, ceiling, ..self.with_source(self.source.with_raster(self.raster.without_holes())) }
    }

    /// Returns the same heights with data only at holes and at the samples next to them: everywhere that terrain may
    /// be missing.
    pub fn around_holes(&self) -> Field {
        let around = self.with_source(self.source.with_raster(self.raster.around_holes()));
        Self { ceiling: self.ceiling.clone(), ..around }
    }
}
