//! Height data: a rectangular field of samples, where it lies, and where it has none.

mod affine;
mod archive;
mod asc;
pub mod bezier;
mod bil;
pub mod bounds;
pub mod cave;
mod crs;
mod cuts;
pub mod demo;
pub(crate) mod disk_cache;
mod envi;
mod folder;
mod geokeys;
mod georef;
mod geotiff;
mod hgt;
mod holes;
mod known_formats;
pub mod level_errors;
pub mod levels;
mod load;
mod located;
mod metadata;
mod mosaic;
mod nodata;
mod png;
pub mod progress;
mod raster;
mod raw;
mod replace;
mod rounding;
pub mod rtin;
mod sample;
pub mod save;
mod sidecar;
pub mod surface;
pub mod synth;
mod terrain_rgb;
mod text;
mod tiff_bands;
mod tiff_codec;
mod tiff_directory;
mod tiff_layout;
mod tiff_mask;
mod tiff_sample;
mod tile_grid;
mod tiles;
mod units;
mod unplaced;
mod usgs_dem;
mod wkt;
mod world_file;

pub use georef::{Place, Unit, metres_per_degree};
pub use holes::Holes;
pub use load::{
    Encoding, HoleFill, Loaded, Options, RawLayout, SourceFile, load, load_all, load_bytes, load_bytes_with,
};
pub use located::{Footprint, Located, place_of};
pub use nodata::number;
pub use raster::MAX_SIDE;
pub use sample::{Order, SampleType};

use std::ops::Range;
use std::path::PathBuf;
use std::sync::Arc;

use glam::{DVec3, Vec3};

use self::bezier::Bezier;

/// What is wrong with a file or a wish about it: the file, the field or position in it, and what was found.
#[derive(Debug, thiserror::Error)]
#[error("{file}: {place}: {what}")]
pub struct Error {
    /// The file's name as given.
    pub file: String,
    /// The header field, line, row or byte position at fault.
    pub place: String,
    /// What was expected and what was found.
    pub what: String,
}

impl Error {
    /// An error at a place of a file.
    pub fn new(file: impl Into<String>, place: impl Into<String>, what: impl ToString) -> Self {
        Self { file: file.into(), place: place.into(), what: one_line(what.to_string()) }
    }
}

/// The text with spaces in place of line breaks and other control characters: decoders quote bytes of broken files.
fn one_line(text: String) -> String {
    if text.contains(char::is_control) { text.replace(char::is_control, " ") } else { text }
}

/// Heights as they are kept, row by row from the north-west corner.
#[derive(Clone, Debug, PartialEq)]
pub enum Samples {
    /// Metres.
    F32(Vec<f32>),
    /// 16-bit codes: height = (code − zero) · scale, computed in f32 in that order.
    Coded {
        /// One code a sample.
        codes: Vec<u16>,
        /// The code of height 0, an integer within ±2^24.
        zero: f32,
        /// Metres per code.
        scale: f32,
    },
}

impl Samples {
    /// Codes for signed 16-bit metres.
    pub fn from_i16(values: impl IntoIterator<Item = i16>) -> Self {
        let codes = values.into_iter().map(|v| (v as u16) ^ 0x8000).collect();
        Samples::Coded { codes, zero: 32768.0, scale: 1.0 }
    }

    /// Number of samples.
    pub fn len(&self) -> usize {
        match self {
            Samples::F32(heights) => heights.len(),
            Samples::Coded { codes, .. } => codes.len(),
        }
    }

    /// Whether there is no sample.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Height of sample `k`, metres.
    #[inline]
    pub fn height(&self, k: usize) -> f32 {
        match self {
            Samples::F32(heights) => heights[k],
            Samples::Coded { codes, zero, scale } => (f32::from(codes[k]) - zero) * scale,
        }
    }

    /// Appends the heights of a range of samples, metres.
    pub fn append(&self, range: Range<usize>, heights: &mut Vec<f64>) {
        match self {
            Samples::F32(samples) => heights.extend(samples[range].iter().map(|&h| f64::from(h))),
            Samples::Coded { codes, zero, scale } => {
                heights.extend(codes[range].iter().map(|&code| f64::from((f32::from(code) - zero) * scale)))
            }
        }
    }

    /// Sets sample `k` to `height` metres, or to the nearest code.
    pub fn set(&mut self, k: usize, height: f32) {
        match self {
            Samples::F32(heights) => heights[k] = height,
            Samples::Coded { codes, zero, scale } => codes[k] = (height / *scale + *zero).round() as u16,
        }
    }

    /// Multiplies every height.
    pub fn multiply(&mut self, factor: f32) {
        match self {
            Samples::F32(heights) => heights.iter_mut().for_each(|h| *h *= factor),
            // Codes stay in the order of the heights.
            Samples::Coded { codes, zero, scale } if factor < 0.0 => {
                codes.iter_mut().for_each(|code| *code = u16::MAX - *code);
                (*zero, *scale) = (f32::from(u16::MAX) - *zero, *scale * -factor);
            }
            Samples::Coded { scale, .. } => *scale *= factor,
        }
    }

    /// Multiplies every height, and adds an offset. Codes stay codes where the offset is whole steps of them.
    pub fn scale_and_shift(&mut self, factor: f64, offset: f64) {
        if let Samples::Coded { zero, scale, .. } = self {
            let step = (f64::from(*scale) * factor) as f32;
            let moved = f64::from(*zero) - offset / f64::from(step);
            if moved.fract() == 0.0 && moved.abs() <= f64::from(1 << 24) {
                (*zero, *scale) = (moved as f32, step);
                return;
            }
        }
        let heights = (0..self.len()).map(|k| (f64::from(self.height(k)) * factor + offset) as f32).collect();
        *self = Samples::F32(heights).compacted();
    }
}

/// A rectangular field of heights, `x_count` × `z_count` samples (at least 2 × 2), possibly repeated.
///
/// Sample `(i, j)` lies at `origin + (i·dx, j·dz)`: x east, z south. A hole's sample holds a height
/// interpolated from around it, so that meshes run smoothly to the hole's edge; it counts in no statistic.
#[derive(Clone, Debug)]
pub struct Field {
    samples: Samples,
    holes: Holes,
    stored: [u32; 2],
    tiles: [u32; 2],
    /// Distance of neighbouring samples (x, z), metres.
    pub spacing: [f64; 2],
    /// World position of sample (0, 0) (x, z), metres.
    pub origin: [f64; 2],
    /// Coordinate reference system, as the file names it.
    pub crs: Option<String>,
    /// The file that it was read from, if what takes long to work out of it may be kept beside that.
    pub source: Option<PathBuf>,
    terrain: Option<Arc<Bezier>>,
    ceiling: Option<Arc<Field>>,
}

/// Lowest, highest and mean height of the samples that are no holes, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Statistics {
    /// Lowest.
    pub min: f32,
    /// Highest.
    pub max: f32,
    /// Mean.
    pub mean: f64,
}

impl Field {
    /// A field of `x_count · z_count` samples; samples under holes may hold anything and are filled.
    ///
    /// # Panics
    /// If the number of samples is not `x_count · z_count`, a side is below 2, or a spacing is not positive.
    pub fn new(samples: Samples, [x_count, z_count]: [u32; 2], spacing: [f64; 2], holes: Holes) -> Self {
        assert!(x_count >= 2 && z_count >= 2, "a field has at least 2 × 2 samples");
        assert_eq!(samples.len(), x_count as usize * z_count as usize);
        assert!(spacing.iter().all(|s| s.is_finite() && *s > 0.0));
        let (stored, tiles, origin) = ([x_count, z_count], [1, 1], [0.0, 0.0]);
        let (crs, source, terrain, ceiling) = (None, None, None, None);
        let mut field = Self { samples, holes, stored, tiles, spacing, origin, crs, source, terrain, ceiling };
        field.fill_holes();
        field
    }

    /// A land that no samples are kept of: heights are worked out when they are asked for, on a lattice of
    /// [`bezier::LATTICE`] places a side. What is held in memory, and so its statistics, are of a raster of it.
    pub fn endless(terrain: Arc<Bezier>) -> Self {
        const SIDE: u32 = 257;
        let place = |k: u32| f64::from(k) * bezier::SIDE_M / f64::from(SIDE - 1);
        let heights = (0..SIDE * SIDE).map(|k| terrain.height([place(k % SIDE), place(k / SIDE)]) as f32);
        let (samples, holes) = (Samples::F32(heights.collect()), Holes::none((SIDE * SIDE) as usize));
        Self { terrain: Some(terrain), ..Self::new(samples, [SIDE; 2], [bezier::SPACING_M; 2], holes) }
    }

    /// What heights are worked out from, where no samples are kept of them.
    pub fn procedural(&self) -> Option<&Arc<Bezier>> {
        self.terrain.as_ref()
    }

    /// The field repeated `tiles` times along (x, z); sample (0, 0) follows the last one.
    pub fn tiled(mut self, tiles: [u32; 2]) -> Self {
        self.tiles = tiles;
        self
    }

    /// Samples along (x, z), tiling included.
    pub fn size(&self) -> [u32; 2] {
        if self.terrain.is_some() {
            return [bezier::LATTICE; 2];
        }
        [self.stored[0] * self.tiles[0], self.stored[1] * self.tiles[1]]
    }

    /// Samples held in memory along (x, z): fewer than [`Self::size`] where the field repeats or is endless.
    pub fn stored(&self) -> [u32; 2] {
        self.stored
    }

    /// The samples held in memory, row by row.
    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    /// The holes among the samples held in memory.
    pub fn holes(&self) -> &Holes {
        &self.holes
    }

    /// What lies over it, where it is the floor of a [cave](cave::Cave).
    pub fn ceiling(&self) -> Option<&Arc<Field>> {
        self.ceiling.as_ref()
    }

    /// Lowest and highest height of what is there, a ceiling included, metres.
    pub fn range(&self) -> [f32; 2] {
        let own = |field: &Field| field.statistics();
        let (floor, ceiling) = (own(self), self.ceiling().map(|ceiling| own(ceiling)));
        ceiling.map_or([floor.min, floor.max], |over| [floor.min.min(over.min), floor.max.max(over.max)])
    }

    /// Whether the field repeats.
    pub fn is_tiled(&self) -> bool {
        self.tiles != [1, 1]
    }

    #[inline]
    fn index(&self, mut i: u32, mut j: u32) -> usize {
        if self.is_tiled() {
            i %= self.stored[0];
            j %= self.stored[1];
        }
        j as usize * self.stored[0] as usize + i as usize
    }

    /// Height of sample `(i, j)`, metres; always finite.
    #[inline]
    pub fn height(&self, i: u32, j: u32) -> f32 {
        if let Some(terrain) = &self.terrain {
            return terrain.height([i, j].map(|n| f64::from(n) * bezier::SPACING_M)) as f32;
        }
        self.samples.height(self.index(i, j))
    }

    /// Whether sample `(i, j)` has no data.
    #[inline]
    pub fn is_hole(&self, i: u32, j: u32) -> bool {
        self.holes.count() > 0 && self.holes.contains(self.index(i, j))
    }

    /// World position of sample `(i, j)`.
    pub fn world(&self, i: u32, j: u32) -> DVec3 {
        self.world_at(f64::from(i), f64::from(j), f64::from(self.height(i, j)))
    }

    /// World position of a lattice position and height.
    pub fn world_at(&self, i: f64, j: f64, height: f64) -> DVec3 {
        DVec3::new(self.origin[0] + i * self.spacing[0], height, self.origin[1] + j * self.spacing[1])
    }

    /// Unit normal at sample `(i, j)`, from the heights on both sides of it; at the field's edge from those that are
    /// there.
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

    /// Height bilinearly interpolated at a world position, or `None` outside or over a hole.
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

    /// Statistics of the samples that are no holes; zeros if all are holes.
    pub fn statistics(&self) -> Statistics {
        let (mut min, mut max, mut sum, mut count) = (f32::INFINITY, f32::NEG_INFINITY, 0.0, 0u64);
        for k in 0..self.samples.len() {
            if self.holes.count() == 0 || !self.holes.contains(k) {
                let h = self.samples.height(k);
                (min, max, sum, count) = (min.min(h), max.max(h), sum + f64::from(h), count + 1);
            }
        }
        match count {
            0 => Statistics { min: 0.0, max: 0.0, mean: 0.0 },
            _ => Statistics { min, max, mean: sum / count as f64 },
        }
    }

    /// The largest difference, metres, between the two ways to split a cell into triangles:
    /// |h00 + h11 − h10 − h01| / 2 over all cells without holes. A property of the data.
    pub fn cell_ambiguity(&self) -> f32 {
        let [w, h] = self.stored;
        let mut largest = 0.0f32;
        for j in 0..h - 1 {
            for i in 0..w - 1 {
                let corners = [(i, j), (i + 1, j + 1), (i + 1, j), (i, j + 1)];
                if self.holes.count() == 0 || !corners.iter().any(|&(i, j)| self.is_hole(i, j)) {
                    let [a, d, b, c] = corners.map(|(i, j)| self.height(i, j));
                    largest = largest.max((a + d - b - c).abs() / 2.0);
                }
            }
        }
        largest
    }

    /// Gives the land under holes the heights around them and forgets the holes.
    pub fn without_holes(mut self) -> Self {
        self.holes = Holes::none(self.samples.len());
        self
    }

    /// The same heights with data only at holes and at the samples next to them: where land may be missing.
    pub fn around_holes(&self) -> Field {
        let [w, h] = self.stored.map(|n| n as usize);
        let near = |k: usize| {
            let (i, j) = (k % w, k / w);
            let mut around = (j.saturating_sub(1)..=(j + 1).min(h - 1))
                .flat_map(|j| (i.saturating_sub(1)..=(i + 1).min(w - 1)).map(move |i| j * w + i));
            around.any(|k| self.holes.contains(k))
        };
        let mut holes = Holes::none(self.samples.len());
        (0..self.samples.len()).filter(|&k| !near(k)).for_each(|k| holes.insert(k));
        Field { holes, source: None, ..self.clone() }
    }

    /// Fills the samples under holes by push-pull: means of the known samples on ever coarser grids, then
    /// each hole takes the value of the finest coarser cell that knows one, bilinearly.
    fn fill_holes(&mut self) {
        if self.holes.count() == 0 {
            return;
        }
        let [w, h] = self.stored.map(|n| n as usize);
        let base: Vec<f32> = (0..self.samples.len())
            .map(|k| if self.holes.contains(k) { f32::NAN } else { self.samples.height(k) })
            .collect();
        for (k, height) in pull(base, w, h).into_iter().enumerate() {
            if self.holes.contains(k) {
                self.samples.set(k, height);
            }
        }
    }
}

/// Fills the NaNs of a grid from the means of 2 × 2 blocks, recursively.
fn pull(mut grid: Vec<f32>, w: usize, h: usize) -> Vec<f32> {
    if !grid.iter().any(|v| v.is_nan()) {
        return grid;
    }
    if w == 1 && h == 1 {
        return vec![0.0];
    }
    let (half_w, half_h) = (w.div_ceil(2), h.div_ceil(2));
    let mut half = Vec::with_capacity(half_w * half_h);
    for j in 0..half_h {
        for i in 0..half_w {
            let (mut sum, mut count) = (0.0, 0.0);
            for (x, z) in [(2 * i, 2 * j), (2 * i + 1, 2 * j), (2 * i, 2 * j + 1), (2 * i + 1, 2 * j + 1)] {
                if x < w && z < h && !grid[z * w + x].is_nan() {
                    sum += f64::from(grid[z * w + x]);
                    count += 1.0;
                }
            }
            half.push((sum / count) as f32);
        }
    }
    let half = pull(half, half_w, half_h);
    for (k, value) in grid.iter_mut().enumerate().filter(|(_, v)| v.is_nan()) {
        let at = |n: usize, last: usize| {
            let t = (n as f32 - 0.5) / 2.0;
            let low = t.max(0.0) as usize;
            (low, (low + 1).min(last), (t - low as f32).clamp(0.0, 1.0))
        };
        let (i0, i1, u) = at(k % w, half_w - 1);
        let (j0, j1, v) = at(k / w, half_h - 1);
        let row = |j: usize| half[j * half_w + i0] * (1.0 - u) + half[j * half_w + i1] * u;
        *value = row(j0) * (1.0 - v) + row(j1) * v;
    }
    grid
}
