//! Builds the coarsest conforming mesh of right triangles within a vertical error.
//!
//! The hierarchy starts with a square of 2^n cells that contains the field, divided into two right triangles. A
//! triangle is split at the midpoint of its base (the hypotenuse), together with the triangle on the other side of the
//! base. A mesh is thus given by the set of its split points. A split point requires those at the apexes of its two
//! triangles.
//!
//! A triangle is split only if its true error is too large, or if another split requires it. All splits are therefore
//! necessary in every mesh of the hierarchy within the error, and the result is the coarsest.
//!
//! Beyond the field's last column and row, heights are those of the border. Samples and triangles there are not
//! counted.

use crate::height::Field;
use crate::height::surface::{self, Corner, Triangle, doubled_area};
use crate::measure::facing_up;

/// Returns the number of triangles of the coarsest mesh and its largest vertical error, metres. The field must not have
/// holes.
pub fn coarsest(field: &Field, tolerance_m: f64) -> (u64, f64) {
    let mesh = Rtin::refined(field, tolerance_m);
    let (mut count, mut largest) = (0, 0.0f64);
    mesh.visit(|triangle| {
        count += 1;
        largest = largest.max(mesh.error(triangle));
    });
    (count, largest)
}

/// A mesh of the hierarchy. Triangles are given as \[apex, base, base\], positions as (x, z) in samples.
struct Rtin<'a> {
    field: &'a Field,
    /// Cells along a side of the square.
    side: i32,
    /// Last column and row of the field.
    last: [i32; 2],
    tolerance_m: f64,
    /// One bit per position of the square: 1 at split points.
    split: Vec<u64>,
}

impl<'a> Rtin<'a> {
    /// Builds the coarsest mesh whose triangles are all within the error.
    fn refined(field: &'a Field, tolerance_m: f64) -> Self {
        let cells = field.size().map(|n| n - 1);
        let side = cells[0].max(cells[1]).next_power_of_two() as i32;
        let words = (side as usize + 1).pow(2).div_ceil(64);
        let mut mesh = Rtin { field, side, last: cells.map(|n| n as i32), tolerance_m, split: vec![0; words] };
        let mut pending = Vec::new();
        roots(side).into_iter().for_each(|triangle| mesh.demand(triangle, &mut pending));
        while let Some(at) = pending.pop() {
            if mesh.mark(at) {
                mesh.follow(at, &mut pending);
            }
        }
        mesh
    }

    /// Adds to `pending` the split points that the one at `at` requires, and those of the four triangles that it
    /// creates, where their error is too large.
    fn follow(&self, at: [i32; 2], pending: &mut Vec<[i32; 2]>) {
        let (before, after) = around(at, self.side);
        pending.extend(before.into_iter().filter(|&p| self.is_inside(p) && !self.is_corner(p)));
        (0..4).for_each(|k| self.demand([at, after[k], after[(k + 1) % 4]], pending));
    }

    /// Adds the split point of a triangle to `pending` if its error is too large.
    fn demand(&self, triangle: [[i32; 2]; 3], pending: &mut Vec<[i32; 2]>) {
        if triangle.iter().all(|&p| self.is_inside(p))
            && let Some(at) = midpoint(triangle)
            && self.error(triangle) > self.tolerance_m
        {
            pending.push(at);
        }
    }

    /// Calls `visit` for each triangle of the mesh that covers part of the field.
    fn visit(&self, mut visit: impl FnMut([[i32; 2]; 3])) {
        let mut open = roots(self.side).to_vec();
        while let Some(triangle) = open.pop() {
            let [apex, a, b] = triangle;
            match midpoint(triangle).filter(|&at| self.is_split(at)) {
                Some(at) => open.extend([[at, apex, a], [at, b, apex]]),
                None if self.meets_field(triangle) => visit(triangle),
                None => {}
            }
        }
    }

    /// Returns the largest vertical distance of a triangle from the field's samples in it, metres.
    fn error(&self, triangle: [[i32; 2]; 3]) -> f64 {
        let triangle = facing_up(&triangle.map(|at| self.corner(at)));
        if triangle.iter().all(|corner| corner.x <= self.last[0] && corner.z <= self.last[1]) {
            return f64::from(surface::deviation(self.field, &triangle));
        }
        let mut largest = 0.0f64;
        surface::visit_samples(&triangle, |x, z, y| {
            if x as i32 <= self.last[0] && z as i32 <= self.last[1] {
                largest = largest.max((y - f64::from(self.field.height(x, z))).abs());
            }
        });
        largest
    }

    /// Returns the corner at a position with its height.
    fn corner(&self, [x, z]: [i32; 2]) -> Corner {
        let y = self.field.height(x.min(self.last[0]) as u32, z.min(self.last[1]) as u32);
        Corner { x, z, y }
    }

    /// Returns true if a triangle overlaps the field's rectangle. By the separating axis theorem, they overlap unless a
    /// side of either separates them.
    fn meets_field(&self, triangle: [[i32; 2]; 3]) -> bool {
        let at = |[x, z]: [i32; 2]| Corner { x, z, y: 0.0 };
        let [a, b, c]: Triangle = facing_up(&triangle.map(at));
        let [w, h] = self.last;
        let field = [[0, 0], [w, 0], [0, h], [w, h]].map(at);
        let within = |[p, q]: [Corner; 2]| field.iter().any(|&corner| doubled_area(&[corner, p, q]) > 0);
        a.x.min(b.x).min(c.x) < w && a.z.min(b.z).min(c.z) < h && [[a, b], [b, c], [c, a]].into_iter().all(within)
    }

    fn is_inside(&self, at: [i32; 2]) -> bool {
        at.iter().all(|n| (0..=self.side).contains(n))
    }

    fn is_corner(&self, at: [i32; 2]) -> bool {
        at.iter().all(|&n| n == 0 || n == self.side)
    }

    fn bit(&self, [x, z]: [i32; 2]) -> (usize, u64) {
        let k = z as usize * (self.side as usize + 1) + x as usize;
        (k / 64, 1 << (k % 64))
    }

    fn is_split(&self, at: [i32; 2]) -> bool {
        let (word, bit) = self.bit(at);
        self.split[word] & bit != 0
    }

    /// Marks a split point. Returns true if it was not marked before.
    fn mark(&mut self, at: [i32; 2]) -> bool {
        let (word, bit) = self.bit(at);
        let new = self.split[word] & bit == 0;
        self.split[word] |= bit;
        new
    }
}

/// Returns the two triangles of the square.
fn roots(side: i32) -> [[[i32; 2]; 3]; 2] {
    [[[0, side], [side, side], [0, 0]], [[side, 0], [0, 0], [side, side]]]
}

/// Returns the midpoint of a triangle's base; `None` if the base is a side or a diagonal of a cell, which is not split.
fn midpoint([_, a, b]: [[i32; 2]; 3]) -> Option<[i32; 2]> {
    let sum = [a[0] + b[0], a[1] + b[1]];
    (sum[0] % 2 == 0 && sum[1] % 2 == 0).then_some(sum.map(|n| n / 2))
}

/// Returns the apexes of the two triangles that are split at a point, and the corners of the square that both form, in
/// order. Some may lie outside the mesh.
fn around([x, z]: [i32; 2], side: i32) -> ([[i32; 2]; 2], [[i32; 2]; 4]) {
    let step = 1 << (x | z | side).trailing_zeros();
    let straight = [[x + step, z], [x, z + step], [x - step, z], [x, z - step]];
    let aslant = [[x - step, z - step], [x + step, z - step], [x + step, z + step], [x - step, z + step]];
    match [x / step % 2, z / step % 2] {
        // The centre of a square. Diagonals alternate as in `height::rtin`.
        [1, 1] => {
            let parity = (x + z - 2 * step) / (2 * step) % 2;
            (if parity == 0 { [aslant[1], aslant[3]] } else { [aslant[0], aslant[2]] }, aslant)
        }
        // The midpoint of a side along x.
        [1, _] => ([straight[1], straight[3]], straight),
        _ => ([straight[0], straight[2]], straight),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::expand::Drawn;
    use crate::height::{Holes, Samples};
    use crate::measure::watertight;
    use crate::view::{Lens, Metric, Tolerance, View};
    use glam::DVec3;

    /// A flat field with one spike, which requires splits all around it.
    fn spike(side: u32, at: [u32; 2]) -> Field {
        let height = |k: u32| if [k % side, k / side] == at { 10.0 } else { 0.0 };
        let heights = (0..side * side).map(height).collect();
        Field::new(Samples::F32(heights), [side; 2], [1.0, 1.0], Holes::none((side * side) as usize))
    }

    #[test]
    fn a_mesh_is_one_surface() {
        let view = View {
            eye: DVec3::new(16.0, 100.0, 16.0),
            world_from_eye: View::turned(-90.0, -90.0, 0.0),
            lens: Lens::Orthographic { width: 100.0, far: 1e3 },
            size: [100, 100],
            near: 1.0,
            tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
            time_s: 0.0,
        };
        for at in [[1, 1], [16, 16], [7, 20], [32, 5], [11, 12], [0, 31]] {
            let field = spike(33, at);
            let mesh = Rtin::refined(&field, 1.0);
            let mut triangles = Vec::new();
            mesh.visit(|t| triangles.push(Drawn { corners: facing_up(&t.map(|p| mesh.corner(p))), instance: 0 }));
            let proof = watertight::prove(&field, &view.frustum(), &triangles, 0).unwrap();
            assert_eq!(proof.doubled_area, 2 * 32 * 32);
            assert!((10..200).contains(&proof.triangles), "{at:?}: {} triangles", proof.triangles);
        }
    }

    #[test]
    fn the_field_need_not_fill_the_square() {
        let field = spike(20, [19, 18]);
        let mesh = Rtin::refined(&field, 1.0);
        let (mut found, mut all) = (Vec::new(), Vec::new());
        mesh.visit(|triangle| found.push(triangle));
        Rtin { last: [32, 32], split: mesh.split.clone(), ..mesh }.visit(|triangle| all.push(triangle));
        // Points inside the quarters of the field's cells, in quarters of a sample.
        let points = (0..19 * 19)
            .flat_map(|k| [[1, 2], [2, 1], [3, 2], [2, 3]].map(|[x, z]| [4 * (k % 19) + x, 4 * (k / 19) + z]));
        let points: Vec<_> = points.map(|[x, z]| Corner { x, z, y: 0.0 }).collect();
        all.retain(|t| {
            let [a, b, c] = facing_up(&t.map(|[x, z]| Corner { x: 4 * x, z: 4 * z, y: 0.0 }));
            points.iter().any(|&p| [[a, b, p], [b, c, p], [c, a, p]].iter().all(|side| doubled_area(side) > 0))
        });
        assert_eq!(found, all);
        assert!(found.iter().flatten().flatten().any(|&n| n > 19), "some triangles stick out");
        assert!(coarsest(&field, 1.0).1 <= 1.0);
    }
}
