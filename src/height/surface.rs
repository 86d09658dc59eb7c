//! Surfaces over the lattice: triangles with corners on samples or on a finer lattice between them, and their distance
//! from the samples inside.

use std::ops::RangeInclusive;

use glam::DVec3;
use serde::{Deserialize, Serialize};

use super::field::Field;
use super::rtin;

/// A corner of a drawn triangle: lattice position and height, metres. Positions count samples, or 2^−bits samples where
/// a number of *fraction bits* is given.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Corner {
    /// East.
    pub x: i32,
    /// South.
    pub z: i32,
    /// Height, metres.
    pub y: f32,
}

/// Three corners, counter-clockwise seen from above if the triangle faces up.
pub type Triangle = [Corner; 3];

/// Returns twice the area in plan, in squares of the positions' unit: positive if the triangle faces up, 0 if it is
/// degenerate.
pub fn doubled_area([a, b, c]: &Triangle) -> i64 {
    let (bx, bz) = (i64::from(b.x) - i64::from(a.x), i64::from(b.z) - i64::from(a.z));
    let (cx, cz) = (i64::from(c.x) - i64::from(a.x), i64::from(c.z) - i64::from(a.z));
    bz * cx - bx * cz
}

/// Returns the world position, metres, of a corner with this number of fraction bits.
pub fn world(field: &Field, corner: &Corner, fraction_bits: u32) -> DVec3 {
    let [x, z] = [corner.x, corner.z].map(|n| f64::from(n) / f64::from(1u32 << fraction_bits));
    field.world_at(x, z, f64::from(corner.y))
}

/// Calls `visit(x, z, y)` for every sample's position inside or on the border of an up-facing triangle, with the
/// triangle's height there.
pub fn visit_samples(triangle: &Triangle, visit: impl FnMut(u32, u32, f64)) {
    visit_samples_between(triangle, 0, visit);
}

/// Calls `visit` like [`visit_samples`], for corners with this number of fraction bits.
pub fn visit_samples_between(triangle: &Triangle, fraction_bits: u32, mut visit: impl FnMut(u32, u32, f64)) {
    let area = doubled_area(triangle);
    debug_assert!(area > 0, "faces up: {triangle:?}");
    // Edge functions w = wx·x + wz·z + w0, each zero on the edge opposite its corner.
    let edge = |p: &Corner, q: &Corner| {
        let (px, pz, qx, qz) = (i64::from(p.x), i64::from(p.z), i64::from(q.x), i64::from(q.z));
        (qz - pz, px - qx, qx * pz - px * qz)
    };
    let [a, b, c] = triangle;
    let edges = [edge(b, c), edge(c, a), edge(a, b)];
    let heights = triangle.map(|corner| f64::from(corner.y));
    let samples = |n: [i32; 3]| {
        let (min, max) = (n[0].min(n[1]).min(n[2]), n[0].max(n[1]).max(n[2]));
        (-i64::from(-min >> fraction_bits), i64::from(max >> fraction_bits))
    };
    let ((west, east), (north, south)) = (samples([a.x, b.x, c.x]), samples([a.z, b.z, c.z]));
    for z in north..=south {
        let row = edges.map(|(wx, wz, w0)| [wx << fraction_bits, wz * (z << fraction_bits) + w0]);
        for x in span(&row, west, east) {
            let weight = |k: usize| (row[k][0] * x + row[k][1]) as f64;
            let y = (weight(0) * heights[0] + weight(1) * heights[1] + weight(2) * heights[2]) / area as f64;
            visit(x as u32, z as u32, y);
        }
    }
}

/// Longest row, samples, whose ends are found by search; for longer rows divisions cost less.
const SEARCHED: i64 = 16;

/// Returns the x between `west` and `east` at which all edge functions [slope, value at 0] of a row are at least 0.
fn span(row: &[[i64; 2]; 3], west: i64, east: i64) -> RangeInclusive<i64> {
    if east - west <= SEARCHED {
        let inside = |x: &i64| row.iter().all(|[slope, value]| slope * x + value >= 0);
        return match (west..=east).find(inside) {
            Some(first) => first..=(first..=east).rfind(inside).unwrap_or(first),
            None => east + 1..=east,
        };
    }
    let (mut first, mut last) = (west, east);
    for &[slope, value] in row {
        match slope.signum() {
            1 => first = first.max((-value).div_euclid(slope) + i64::from((-value).rem_euclid(slope) != 0)),
            -1 => last = last.min(value.div_euclid(-slope)),
            _ if value < 0 => last = west - 1,
            _ => {}
        }
    }
    first..=last
}

/// Returns true if a triangle of the finest surface has data at its three corners.
pub fn is_terrain(field: &Field, triangle: &[[i32; 2]; 3]) -> bool {
    triangle.iter().all(|&[x, z]| !field.is_hole(x as u32, z as u32))
}

/// Returns true if there is a triangle with data between two lattice positions, both inclusive.
pub fn has_terrain(field: &Field, first: [i32; 2], last: [i32; 2]) -> bool {
    let mut cells = (first[1]..last[1]).flat_map(|j| (first[0]..last[0]).map(move |i| (i, j)));
    field.holes().count() == 0 || cells.any(|(i, j)| rtin::cell(i, j).iter().any(|t| is_terrain(field, t)))
}

/// Returns the height of the finest surface, metres, at a position in samples; `None` outside or where the triangle has
/// no data.
pub fn height_at(field: &Field, at: [f64; 2]) -> Option<f64> {
    let last = field.size().map(|n| f64::from(n) - 1.0);
    if !(0..2).all(|k| (0.0..=last[k]).contains(&at[k])) {
        return None;
    }
    let [i, j] = [0, 1].map(|k| at[k].min(last[k] - 1.0) as i32);
    let weights = |triangle: &[[i32; 2]; 3]| {
        let [a, b, c] = triangle.map(|p| [0, 1].map(|k| at[k] - f64::from(p[k])));
        let area = |p: [f64; 2], q: [f64; 2]| p[1] * q[0] - p[0] * q[1];
        [area(b, c), area(c, a), area(a, b)]
    };
    let triangle = rtin::cell(i, j).into_iter().max_by(|a, b| {
        let min = |t| weights(t).into_iter().fold(f64::INFINITY, f64::min);
        min(a).total_cmp(&min(b))
    })?;
    let height = |[x, z]: [i32; 2]| f64::from(field.height(x as u32, z as u32));
    is_terrain(field, &triangle).then(|| weights(&triangle).iter().zip(triangle).map(|(w, p)| w * height(p)).sum())
}

/// Returns the largest vertical distance, metres, of an up-facing triangle from the field's samples inside it, holes
/// excepted.
pub fn deviation(field: &Field, triangle: &Triangle) -> f32 {
    let mut largest = 0.0f64;
    visit_samples(triangle, |x, z, y| {
        if !field.is_hole(x, z) {
            largest = largest.max((y - f64::from(field.height(x, z))).abs());
        }
    });
    // Upwards: the bound must not shrink by rounding.
    (largest as f32).next_up() * f32::from(largest > 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::{Holes, Samples};

    fn corner(x: i32, z: i32, y: f32) -> Corner {
        Corner { x, z, y }
    }

    #[test]
    fn samples_of_a_triangle_by_brute_force() {
        visits_what_lies_inside([corner(1, 2, 3.0), corner(4, 11, -5.0), corner(9, 4, 7.5)], 0);
        // Between samples, on them, and with none inside.
        visits_what_lies_inside([corner(7, 9, 3.0), corner(17, 71, -5.0), corner(75, 19, 7.5)], 2);
        visits_what_lies_inside([corner(8, 8, 3.0), corner(16, 80, -5.0), corner(150, 16, 7.5)], 3);
        visits_what_lies_inside([corner(65, 65, 3.0), corner(66, 120, -5.0), corner(127, 70, 7.5)], 6);
    }

    fn visits_what_lies_inside(triangle: Triangle, fraction_bits: u32) {
        let area = doubled_area(&triangle) as f64;
        assert!(area > 0.0);
        let mut visited = Vec::new();
        visit_samples_between(&triangle, fraction_bits, |x, z, y| visited.push((x as i32, z as i32, y)));
        let mut expected = Vec::new();
        for z in 0..20 {
            for x in 0..20 {
                let p = corner(x << fraction_bits, z << fraction_bits, 0.0);
                let [a, b, c] = triangle;
                let w = [[p, b, c], [a, p, c], [a, b, p]].map(|t| doubled_area(&t));
                if w.iter().all(|w| *w >= 0) {
                    let y = (0..3).map(|k| w[k] as f64 / area * f64::from(triangle[k].y)).sum::<f64>();
                    expected.push((x, z, y));
                }
            }
        }
        assert_eq!(visited.len(), expected.len());
        for (v, e) in visited.iter().zip(&expected) {
            assert_eq!((v.0, v.1), (e.0, e.1));
            assert!((v.2 - e.2).abs() < 1e-12);
        }
    }

    #[test]
    fn heights_between_samples_are_those_of_their_triangles() {
        let heights = (0..20).map(|k| (k * 7 % 11) as f32);
        let mut holes = Holes::none(20);
        holes.insert(19);
        let field = Field::new(Samples::F32(heights.collect()), [5, 4], [3.0, 2.0], holes);
        let mut seen = 0;
        for (i, j) in (0..3).flat_map(|j| (0..4).map(move |i| (i, j))) {
            for triangle in rtin::cell(i, j) {
                let [a, b, c] =
                    triangle.map(|[x, z]| [f64::from(x), f64::from(z), f64::from(field.height(x as u32, z as u32))]);
                for [u, v] in [[0.1, 0.1], [0.2, 0.3], [0.3, 0.6], [0.6, 0.1]] {
                    let at = |k: usize| a[k] + u * (b[k] - a[k]) + v * (c[k] - a[k]);
                    let height = height_at(&field, [at(0), at(1)]);
                    if is_terrain(&field, &triangle) {
                        assert!((height.unwrap() - at(2)).abs() < 1e-9, "cell ({i}, {j}): {height:?}, not {}", at(2));
                        seen += 1;
                    }
                }
            }
        }
        assert_eq!(seen, 4 * 23, "all triangles but the one at the hole");
        assert_eq!([[3.9, 2.9], [-0.1, 0.0], [0.0, 3.1]].map(|at| height_at(&field, at)), [None; 3]);
    }
}
