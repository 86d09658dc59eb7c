//! A grid of samples in memory.

use std::sync::Arc;

use super::holes::Holes;
use super::samples::Samples;
use super::statistics::Statistics;

/// Samples in memory, row by row from the north-west corner. Clones share them.
#[derive(Clone, Debug)]
pub struct Raster {
    samples: Arc<Samples>,
    holes: Arc<Holes>,
    size: [u32; 2],
}

impl Raster {
    /// Makes a raster of `x_count · z_count` samples. Samples under holes may hold anything and are filled.
    ///
    /// # Panics
    /// If the number of samples is not `x_count · z_count`, or a side is below 2.
    pub fn new(mut samples: Samples, [x_count, z_count]: [u32; 2], holes: Holes) -> Self {
        assert!(x_count >= 2 && z_count >= 2, "a field has at least 2 × 2 samples");
        assert_eq!(samples.len(), x_count as usize * z_count as usize);
        let size = [x_count, z_count];
        fill_holes(&mut samples, &holes, size);
        Self { samples: Arc::new(samples), holes: Arc::new(holes), size }
    }

    /// Returns the number of samples along (x, z).
    #[inline]
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Returns the height of sample `(i, j)`, metres.
    #[inline]
    pub fn height(&self, i: u32, j: u32) -> f32 {
        self.samples.height(self.index(i, j))
    }

    /// Returns true if sample `(i, j)` has no data.
    #[inline]
    pub fn is_hole(&self, i: u32, j: u32) -> bool {
        self.holes.count() > 0 && self.holes.contains(self.index(i, j))
    }

    /// Returns the lowest and highest height, metres, of the samples between two positions, both inclusive and holes
    /// included.
    pub fn range_of(&self, first: [u32; 2], last: [u32; 2]) -> [f32; 2] {
        let rows = (first[1]..=last[1]).map(|j| self.row(j, [first[0], last[0]]));
        rows.fold([f32::INFINITY, f32::NEG_INFINITY], |range, row| self.samples.range(row, range))
    }

    /// Returns the samples, row by row.
    #[inline]
    pub fn samples(&self) -> &Samples {
        &self.samples
    }

    /// Returns the holes among the samples.
    #[inline]
    pub fn holes(&self) -> &Holes {
        &self.holes
    }

    #[inline]
    fn index(&self, i: u32, j: u32) -> usize {
        j as usize * self.size[0] as usize + i as usize
    }

    /// Returns the indices of the samples of row `j` between two columns, both inclusive.
    fn row(&self, j: u32, [first, last]: [u32; 2]) -> std::ops::Range<usize> {
        self.index(first, j)..self.index(last, j) + 1
    }

    /// Returns the statistics of the samples that are no holes; zeros if all are holes.
    pub fn statistics(&self) -> Statistics {
        Statistics::of(&self.samples, &self.holes)
    }

    /// Returns the same samples without holes: those under holes keep the heights that were filled in.
    pub fn without_holes(&self) -> Self {
        Self { holes: Arc::new(Holes::none(self.samples.len())), ..self.clone() }
    }

    /// Returns the same samples with data only at holes and next to them.
    pub fn around_holes(&self) -> Self {
        let [w, h] = self.size.map(|n| n as usize);
        let near = |k: usize| {
            let (i, j) = (k % w, k / w);
            let mut around = (j.saturating_sub(1)..=(j + 1).min(h - 1))
                .flat_map(|j| (i.saturating_sub(1)..=(i + 1).min(w - 1)).map(move |i| j * w + i));
            around.any(|k| self.holes.contains(k))
        };
        let mut holes = Holes::none(self.samples.len());
        (0..self.samples.len()).filter(|&k| !near(k)).for_each(|k| holes.insert(k));
        Self { holes: Arc::new(holes), ..self.clone() }
    }
}

/// Fills the samples under holes by push-pull.
///
/// Means of the known samples are taken on ever coarser grids. Each hole then takes the value of the finest coarser
/// cell that has one, bilinearly.
fn fill_holes(samples: &mut Samples, holes: &Holes, size: [u32; 2]) {
    if holes.count() == 0 {
        return;
    }
    let [w, h] = size.map(|n| n as usize);
    let base: Vec<f32> =
        (0..samples.len()).map(|k| if holes.contains(k) { f32::NAN } else { samples.height(k) }).collect();
    for (k, height) in pull(base, w, h).into_iter().enumerate() {
        if holes.contains(k) {
            samples.set(k, height);
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
