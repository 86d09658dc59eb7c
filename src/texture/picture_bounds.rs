//! Bounding boxes of the terrain under tiles of an overlay image, and the footprint of a pixel there.

use glam::DVec3;

use super::drape::Drape;
use super::virtual_layout::VirtualTextureLayout;
use crate::height::Field;
use crate::height::bounds::{Bounds, Measure};
use crate::height::progress::Progress;
use crate::view::{Aabb, Containment, Frustum, Lens, View};

/// Bounds of the terrain under an overlay image. A tile at `up` is a square of 2^`up` × 2^`up` pages; `at` is its
/// index along (x, z).
pub struct PictureBounds {
    origin: [f64; 2],
    spacing: [f64; 2],
    /// Index of the field's last sample along (x, z).
    last: [u32; 2],
    drape: Drape,
    /// Samples along the sides of a page.
    page: [f64; 2],
    /// Texels, less one, along a side of a tile.
    cells: u32,
    heights: Bounds,
    /// Greatest height of the field's ceiling; −∞ if it has none.
    top: f32,
}

impl PictureBounds {
    /// Computes the height bounds of the terrain under an image divided into pages.
    pub fn new(field: &Field, layout: &VirtualTextureLayout, drape: Drape) -> Self {
        let page = [0, 1].map(|k| drape.length[k] / layout.extent[k]);
        // Squares about as long as a page: each tile then touches few of them.
        let cells = (page[0].max(page[1]).clamp(8.0, 4096.0) as u32).next_power_of_two();
        let measure = Measure { cells, growth: 1.0, errors: false, morph: false };
        Self {
            origin: field.origin,
            spacing: field.spacing,
            last: field.size().map(|n| n - 1),
            drape,
            page,
            cells: layout.cells,
            heights: Bounds::new(field, measure, &Progress::default()),
            top: field.ceiling().map_or(f32::NEG_INFINITY, |ceiling| ceiling.range()[1]),
        }
    }

    /// Returns the length of a texel of a tile, metres.
    pub fn texel_m(&self, up: u32) -> f64 {
        let along = |k: usize| self.page[k] * self.spacing[k];
        along(0).max(along(1)) * f64::from(1u32 << up) / f64::from(self.cells)
    }

    /// Returns the size of a pixel, metres, at the nearest visible point of a tile beyond the near plane; `None` if
    /// the tile is outside the frustum.
    ///
    /// On a tiled field only the copies around the eye are tested. Copies farther away count as visible.
    pub fn pixel_m(&self, up: u32, at: [u32; 2], view: &View, frustum: &Frustum) -> Option<f64> {
        let samples = self.samples(up, at)?;
        let range = self.range(samples)?;
        let [(columns, more_x), (rows, more_z)] = [0, 1].map(|k| self.tiles_around(k, samples[k], view.eye));
        let boxes = rows.flat_map(|z| columns.clone().map(move |x| [x, z]));
        let boxes = boxes.filter_map(|tile| self.placed(samples, range, tile));
        let near = boxes.filter(|b| frustum.contains(b) != Containment::Outside).map(|b| b.distance(view.eye));
        let beyond = |k: usize| f64::from(self.drape.period[k].unwrap_or(0)) * self.spacing[k];
        let farther = [(more_x, beyond(0)), (more_z, beyond(1))].into_iter().filter(|(more, _)| *more);
        let nearest = near.chain(farther.map(|(_, m)| m)).reduce(f64::min)?;
        Some(match view.lens {
            Lens::Perspective { .. } => nearest.max(view.near) / view.focal_px(),
            Lens::Orthographic { .. } => 1.0 / view.focal_px(),
        })
    }

    /// Returns the sample ranges under a tile within the first copy of the image; `None` beyond the field.
    fn samples(&self, up: u32, at: [u32; 2]) -> Option<[[f64; 2]; 2]> {
        let samples = [0, 1].map(|k| {
            let end = f64::from(self.drape.period[k].unwrap_or(self.last[k]));
            let side = |n: u32| self.drape.first[k] + f64::from(n << up) * self.page[k];
            let [low, high] = [side(at[k]), side(at[k] + 1).min(self.drape.first[k] + self.drape.length[k])];
            // An image that wraps around begins half a sample before its period.
            if self.drape.repeats()[k] { [low, high] } else { [low.clamp(0.0, end), high.clamp(0.0, end)] }
        });
        samples.iter().all(|[low, high]| low < high).then_some(samples)
    }

    /// Returns the lowest and highest height under a tile, metres; `None` if it has no terrain.
    fn range(&self, samples: [[f64; 2]; 2]) -> Option<[f32; 2]> {
        let period = |k: usize| self.drape.period[k].map_or(0.0, f64::from);
        let first = samples.map(|[low, _]| low.floor());
        let side = [0, 1].map(|k| (samples[k][1].ceil() - first[k]).max(1.0) as u32);
        let first = [0, 1].map(|k| (if first[k] < 0.0 { first[k] + period(k) } else { first[k] }).max(0.0) as u32);
        let level = (0..self.heights.levels() - 1).find(|&l| self.heights.side(l) >= side[0].max(side[1]));
        let square = self.heights.covering(level.unwrap_or(self.heights.levels() - 1), first, side);
        square.has_terrain().then(|| [square.range[0], square.range[1].max(self.top)])
    }

    /// Returns the copies along axis `k` in which a tile is nearest to the eye, and true if there are others.
    fn tiles_around(&self, k: usize, [low, high]: [f64; 2], eye: DVec3) -> (std::ops::RangeInclusive<u32>, bool) {
        let Some(period) = self.drape.period[k] else { return (0..=0, false) };
        let tiles = (self.last[k] + 1) / period;
        let eye = ([eye.x, eye.z][k] - self.origin[k]) / self.spacing[k];
        let nearest = ((eye - (low + high) / 2.0) / f64::from(period)).round().clamp(0.0, f64::from(tiles - 1)) as u32;
        let (first, last) = (nearest.saturating_sub(1), (nearest + 1).min(tiles - 1));
        (first..=last, last - first + 1 < tiles)
    }

    /// Returns the box of a tile in one copy of the image; `None` beyond the field.
    fn placed(&self, samples: [[f64; 2]; 2], [low, high]: [f32; 2], tile: [u32; 2]) -> Option<Aabb> {
        let along = |k: usize| {
            let shift = f64::from(tile[k]) * f64::from(self.drape.period[k].unwrap_or(0));
            let within = samples[k].map(|n| (n + shift).clamp(0.0, f64::from(self.last[k])));
            (within[0] < within[1]).then(|| within.map(|n| self.origin[k] + n * self.spacing[k]))
        };
        let [x, z] = [along(0)?, along(1)?];
        let corner = |n: usize, y: f32| DVec3::new(x[n], f64::from(y), z[n]);
        Some(Aabb { min: corner(0, low), max: corner(1, high) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::{Holes, Samples};
    use crate::view::{Metric, Tolerance};

    /// 256 × 192 samples a metre apart, rising from west to east.
    fn field(holes: Holes) -> Field {
        let heights = (0..256 * 192).map(|k| (k % 256) as f32 / 8.0).collect();
        Field::new(Samples::F32(heights), [256, 192], [1.0; 2], holes)
    }

    fn bounds(field: &Field, drape: Drape) -> PictureBounds {
        let layout = VirtualTextureLayout::new([2048, 1536], drape.repeats(), 1 << 28, 2048).unwrap();
        PictureBounds::new(field, &layout, drape)
    }

    fn view(eye: DVec3, pitch: f64) -> View {
        View {
            eye,
            world_from_eye: View::turned(0.0, pitch, 0.0),
            lens: Lens::Perspective { fov_x: 1.0 },
            size: [640, 360],
            near: 0.1,
            tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
            time_s: 0.0,
        }
    }

    #[test]
    fn terrain_without_samples_needs_nothing() {
        let mut holes = Holes::none(256 * 192);
        (0..256 * 192).filter(|k| k % 256 < 200).for_each(|k| holes.insert(k));
        let field = field(holes);
        let bounds = bounds(&field, Drape::over(&field));
        assert!(bounds.range(bounds.samples(0, [0, 0]).unwrap()).is_none());
        assert!(bounds.range(bounds.samples(0, [15, 0]).unwrap()).is_some());
    }

    /// An image larger than the field: tiles beyond the field are never needed.
    #[test]
    fn tiles_beyond_the_field_have_no_bounds() {
        let field = field(Holes::none(256 * 192));
        let drape = Drape { first: [-100.0, 50.0], length: [200.0, 400.0], period: [None; 2], ends: true };
        let bounds = bounds(&field, drape);
        // Pages of 12.5 × 33.3 samples, sixteen columns and twelve rows.
        assert!(bounds.samples(0, [7, 0]).is_none() && bounds.samples(0, [0, 0]).is_none());
        let [[west, east], [north, south]] = bounds.samples(0, [9, 0]).unwrap();
        assert_eq!(([west, east], north, south.round()), ([12.5, 25.0], 50.0, 83.0));
        let [low, high] = bounds.range([[west, east], [north, south]]).unwrap();
        assert!(low <= 12.5 / 8.0 && (25.0 / 8.0..10.0).contains(&high), "{low} to {high}");
        assert!(bounds.samples(0, [9, 11]).is_none(), "south of the field");
    }

    /// On a tiled field the copy around the eye counts, not the first one.
    #[test]
    fn the_copy_nearest_to_the_eye_counts() {
        let tiled = field(Holes::none(256 * 192)).tiled([500, 400]);
        let bounds = bounds(&tiled, Drape::over(&tiled));
        let frustum = |view: &View| view.frustum();
        // Above the middle of a page deep in the field, looking down.
        let [x, z] = [256.0 * 321.0 + 24.0, 192.0 * 123.0 + 24.0];
        let down = view(DVec3::new(x, 40.0, z), -89.0);
        let below = bounds.pixel_m(0, [1, 1], &down, &frustum(&down)).unwrap() * down.focal_px();
        assert!((30.0..=40.0).contains(&below), "{below} m to the ground");
        // Another page is outside the frustum nearby, and counts as one period away.
        let aside = bounds.pixel_m(0, [8, 6], &down, &frustum(&down)).unwrap() * down.focal_px();
        assert!((aside - 192.0).abs() < 1e-9, "{aside} m");
    }
}
