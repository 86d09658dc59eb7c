//! Rasters the footprint of a view to pages: the part in plan of the slab between the lowest and the highest terrain
//! that may be visible (Finch & Bishop, §4.3).
//!
//! Each plane of the frustum leaves a half-plane of the ground: all places where it keeps the slab at some height. The
//! footprint is the intersection of all five, a convex polygon around the published one, which is the shadow of frustum
//! and slab together. It is larger only near the polygon's corners. It contains every page whose box passes the planes
//! one by one, the visibility test of this crate.

use super::pages::Grid;
use crate::height::Field;
use crate::view::View;

/// Margin for rounding, relative to the largest length.
const SLACK: f64 = 1e-9;

/// Half-planes of a frustum on the ground: `x·p + z·q + offset ≥ 0`, metres from the first sample.
#[derive(Clone, Copy, Debug)]
pub struct Footprint {
    halves: [[f64; 3]; 5],
    spacing: [f64; 2],
}

impl Footprint {
    /// Computes the footprint of a view of terrain with heights from `low` to `high`, metres.
    pub fn new(field: &Field, view: &View, [low, high]: [f32; 2]) -> Self {
        let [x, z] = [view.eye.x - field.origin[0], view.eye.z - field.origin[1]];
        let extent_m = field.size().iter().zip(field.spacing).map(|(&n, s)| f64::from(n) * s).fold(0.0, f64::max);
        let [low, high] = [low, high].map(|y| f64::from(y) - view.eye.y);
        let largest_m = extent_m.max(x.abs()).max(z.abs()).max(low.abs()).max(high.abs());
        let half = |(normal, distance): (glam::DVec3, f64)| {
            let offset = distance - normal.x * x - normal.z * z + (normal.y * low).max(normal.y * high);
            [normal.x, normal.z, offset + SLACK * largest_m * normal.abs().max_element()]
        };
        Self { halves: view.planes().map(half), spacing: field.spacing }
    }

    /// Calls `visit` for each page that intersects the footprint, row by row.
    pub fn visit_pages(&self, grid: &Grid, mut visit: impl FnMut([i32; 2])) {
        for row in 0..grid.count[1] as i32 {
            let [first, last] = self.columns(grid, row);
            (first..=last).for_each(|column| visit([column, row]));
        }
    }

    /// Returns the first and the last column that the footprint intersects in a row of pages; the last is before the
    /// first if there is none.
    fn columns(&self, grid: &Grid, row: i32) -> [i32; 2] {
        let ends_m =
            |k: usize, n: i32| [n, n + 1].map(|n| f64::from((n << grid.level).min(grid.last[k])) * self.spacing[k]);
        let intersects = |[x, z, offset]: &[f64; 3], column: i32| {
            let highest = |normal: f64, [low, high]: [f64; 2]| (normal * low).max(normal * high);
            highest(*x, ends_m(0, column)) + highest(*z, ends_m(1, row)) + offset >= 0.0
        };
        let count = grid.count[0] as i32;
        let mut columns = [0, count - 1];
        for half in &self.halves {
            // In a row, each half-plane contains all columns from some column on, or all up to some column.
            let inside = if half[0] >= 0.0 {
                [partition_point(count, |column| intersects(half, column)), count - 1]
            } else {
                [0, partition_point(count, |column| !intersects(half, column)) - 1]
            };
            columns = [columns[0].max(inside[0]), columns[1].min(inside[1])];
        }
        columns
    }
}

/// Returns the first number of 0 to `count` that satisfies a monotonic predicate; `count` if none does.
fn partition_point(count: i32, holds: impl Fn(i32) -> bool) -> i32 {
    let (mut low, mut high) = (0, count);
    while low < high {
        let middle = (low + high) / 2;
        if holds(middle) {
            high = middle;
        } else {
            low = middle + 1;
        }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::{Holes, Samples};
    use crate::lod::sorted_strips::certified::bounds;
    use crate::view::{Containment, Lens, Metric, Tolerance};
    use glam::DVec3;

    fn random(seed: &mut u64) -> f64 {
        *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (*seed >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Compares the footprint with a test of every page's box, and checks that it is a small part of the field.
    #[test]
    fn footprint_contains_all_visible_pages() {
        let mut seed = 1;
        let size = [320, 201];
        let mut field = Field::new(Samples::F32(vec![0.0; 320 * 201]), size, [3.0, 5.0], Holes::none(0));
        field.origin = [1e6, -2e6];
        let grid = Grid::new(&field, 4, 1 << 16);
        let (mut touched_in_all, mut extra) = (0, 0);
        for k in 0..2000 {
            let rotation = View::turned(360.0 * random(&mut seed), 180.0 * random(&mut seed) - 90.0, 30.0);
            let share = DVec3::new(random(&mut seed), random(&mut seed), random(&mut seed)) * 2.0 - 0.5;
            let eye = field.world_at(0.0, 0.0, 0.0) + share * DVec3::new(960.0, 120.0, 1000.0);
            let lens = match k % 3 {
                0 => Lens::Orthographic { width: 700.0 * random(&mut seed), far: 1e5 },
                _ => Lens::Perspective { fov_x: 0.1 + 2.0 * random(&mut seed) },
            };
            let tolerance = Tolerance { px: 1.0, metric: Metric::Certified };
            let view =
                View { eye, world_from_eye: rotation, lens, size: [320, 200], near: 0.1, tolerance, time_s: 0.0 };
            let mut touched = vec![false; (grid.count[0] * grid.count[1]) as usize];
            let range = [0.0, if k % 2 == 0 { 120.0 } else { 0.0 }];
            Footprint::new(&field, &view, range).visit_pages(&grid, |at| touched[grid.index(at).unwrap()] = true);
            for (page, touched) in touched.into_iter().enumerate() {
                let at = [page as u32 % grid.count[0], page as u32 / grid.count[0]].map(|n| n as i32);
                let passes = view.frustum().contains(&bounds(&field, grid.level, at, range)) != Containment::Outside;
                assert!(touched || !passes, "view {k}: page {at:?}");
                touched_in_all += usize::from(touched);
                extra += usize::from(touched && !passes);
            }
        }
        assert!(touched_in_all > 20_000 && touched_in_all < 300_000 && extra < 10, "{touched_in_all} {extra}");
    }
}
