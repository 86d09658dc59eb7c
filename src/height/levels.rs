//! Surfaces of a field at coarser levels, and their distance from the samples. Level ℓ has a vertex on every 2^ℓ-th
//! sample and the diagonals of [`rtin`].

use rayon::prelude::*;

use super::field::Field;
use super::rtin;
use super::surface::{self, Corner};

/// A rectangle of cells of one level.
#[derive(Clone, Copy)]
pub struct Patch<'a> {
    /// The field.
    pub field: &'a Field,
    /// Lattice position of its first vertex, a multiple of twice a cell's side.
    pub first: [u32; 2],
    /// Cells along (x, z).
    pub cells: [u32; 2],
    /// Its level.
    pub level: u32,
    /// Positions beyond this one collapse onto it.
    pub last: [u32; 2],
}

impl Patch<'_> {
    /// Lattice position of a vertex.
    fn at(&self, vertex: [u32; 2]) -> [u32; 2] {
        [0, 1].map(|k| (self.first[k] + (vertex[k] << self.level)).min(self.last[k]))
    }

    /// Returns the largest vertical distance, metres, of its cells from the samples in them, holes excepted.
    pub fn deviation(&self) -> f32 {
        let row = |j: u32| self.row_deviation(j);
        let largest = (0..self.cells[1]).into_par_iter().map(row).reduce(|| 0.0, f64::max);
        // Upwards: the bound must not shrink by rounding.
        (largest as f32).next_up() * f32::from(largest > 0.0)
    }

    /// A row of cells, sample row by sample row.
    fn row_deviation(&self, j: u32) -> f64 {
        let ([x0, z0], [x1, z1]) = (self.at([0, j]), self.at([self.cells[0], j + 1]));
        let depth = z1 - z0;
        if depth == 0 {
            return 0.0;
        }
        let mut samples = Vec::with_capacity((x1 - x0 + 1) as usize);
        let mut largest = 0.0f64;
        let heights = |z: u32| -> Vec<f64> {
            (0..=self.cells[0]).map(|i| f64::from(self.field.height(self.at([i, 0])[0], z))).collect()
        };
        let (north, south) = (heights(z0), heights(z1));
        for v in 0..=depth {
            samples.clear();
            samples.extend((x0..=x1).map(|x| self.field.height(x, z0 + v)));
            let part = f64::from(v) / f64::from(depth);
            for i in 0..self.cells[0] {
                let [first, last] = [i, i + 1].map(|i| self.at([i, 0])[0]);
                if first == last {
                    break;
                }
                let k = i as usize;
                let corners = [north[k], north[k + 1], south[k], south[k + 1]];
                let section = Section::new(corners, part, last - first, (i + j) & 1 == 0);
                let off = section.deviation(&samples[(first - x0) as usize..=(last - x0) as usize], |u| {
                    self.field.is_hole(first + u, z0 + v)
                });
                largest = largest.max(off);
            }
        }
        largest
    }

    /// Returns the largest vertical distance, metres, of its border cells from the samples if its sides are `beyond` (1
    /// or 2) levels coarser. Vertices that a coarser side lacks lie on its edges.
    pub fn stitched_deviation(&self, beyond: u32) -> f32 {
        let [w, h] = self.cells;
        let rows = (0..h).into_par_iter().map(|j| {
            let step = if j == 0 || j == h - 1 { 1 } else { (w - 1).max(1) };
            let cells = (0..w).step_by(step as usize).flat_map(|i| rtin::cell(i as i32, j as i32));
            cells.map(|triangle| self.triangle_deviation(triangle, beyond)).fold(0.0, f32::max)
        });
        rows.reduce(|| 0.0, f32::max)
    }

    fn triangle_deviation(&self, triangle: [[i32; 2]; 3], beyond: u32) -> f32 {
        let corners = triangle.map(|vertex| self.stitched_corner(vertex.map(|n| n as u32), beyond));
        if surface::doubled_area(&corners) == 0 { 0.0 } else { surface::deviation(self.field, &corners) }
    }

    fn stitched_corner(&self, vertex: [u32; 2], beyond: u32) -> Corner {
        let on = |k: usize| vertex[k] == 0 || vertex[k] == self.cells[k];
        let along = match (on(0), on(1)) {
            (true, false) => 1,
            (false, true) => 0,
            _ => return self.corner(vertex),
        };
        let [mut before, mut after] = [vertex; 2];
        before[along] = vertex[along] >> beyond << beyond;
        after[along] = before[along] + (1 << beyond);
        // Vertices of the next level stay where they are in plan; others fall onto the one before.
        let mut place = vertex;
        place[along] &= !1;
        let ends = [before, after].map(|end| self.corner(end).y);
        let part = (place[along] - before[along]) as f32 / (1 << beyond) as f32;
        Corner { y: ends[0] + (ends[1] - ends[0]) * part, ..self.corner(place) }
    }

    fn corner(&self, vertex: [u32; 2]) -> Corner {
        let [x, z] = self.at(vertex);
        Corner { x: x as i32, z: z as i32, y: self.field.height(x, z) }
    }
}

/// A cell's surface over one row of samples: a line up to the diagonal, and another one beyond it.
struct Section {
    /// The last sample on the first line.
    split: usize,
    /// Height at the row's first sample and rise a sample, metres.
    lines: [[f64; 2]; 2],
}

impl Section {
    /// At `part` of the way from the north (corners 0 and 1) to the south (2 and 3); both triangles rise along the
    /// row as their own side of the cell does.
    fn new([a, b, c, d]: [f64; 4], part: f64, width: u32, even: bool) -> Self {
        let width = f64::from(width);
        let [west, east] = [a + (c - a) * part, b + (d - b) * part];
        let [north, south] = [(b - a) / width, (d - c) / width];
        let ([left, right], split) = if even { ([south, north], part) } else { ([north, south], 1.0 - part) };
        Self { split: (split * width) as usize, lines: [[west, left], [east - right * width, right]] }
    }

    fn deviation(&self, samples: &[f32], is_hole: impl Fn(u32) -> bool) -> f64 {
        let (left, right) = samples.split_at((self.split + 1).min(samples.len()));
        let mut largest = 0.0f64;
        for (first, samples, [start, rise]) in [(0, left, self.lines[0]), (left.len(), right, self.lines[1])] {
            for (u, &sample) in samples.iter().enumerate() {
                let off = (start + rise * (first + u) as f64 - f64::from(sample)).abs();
                if off > largest && !is_hole((first + u) as u32) {
                    largest = off;
                }
            }
        }
        largest
    }
}

/// Returns the distance, metres, that a level adds to those of finer levels, wherever its vertices lie.
///
/// It is the largest |h(p) − (h(p − a) + h(p + a)) / 2| over the samples p from `first` on, `side` along each axis, and
/// over the four directions a in which p may be the midpoint of an edge of that level. Levels nest, so the sum over a
/// level and all finer ones bounds the level's distance from the samples.
pub fn detail(field: &Field, first: [u32; 2], side: [u32; 2], level: u32) -> f32 {
    // Half an edge; once around a tiled axis changes nothing.
    let [a, b] = [0, 1].map(|k| {
        let (half, stored) = (1i64 << (level - 1), i64::from(field.stored()[k]));
        // Beyond the samples there is nothing, however far the edge reaches.
        if field.size()[k] > field.stored()[k] { half % stored } else { half.min(stored) }
    });
    let length = side[0] as usize + 1;
    let row = |z: u32| {
        let from = i64::from(first[0]) - a;
        let [before, here, after] =
            [-b, 0, b].map(|dz| heights(field, from, i64::from(z) + dz, length + 2 * a as usize));
        // One, two or three rows, from their first, middle or last third on.
        let part = |row: usize, third: usize| &[&before, &here, &after][row][third * a as usize..][..length];
        let ends = [[(1, 0), (1, 2)], [(0, 1), (2, 1)], [(0, 0), (2, 2)], [(2, 0), (0, 2)]];
        let bends = ends.map(|ends| ends.map(|(row, third)| part(row, third)));
        bends.into_iter().map(|[from, to]| largest_bend(part(1, 1), from, to)).fold(0.0, f64::max)
    };
    let largest = (first[1]..=first[1] + side[1]).into_par_iter().map(row).reduce(|| 0.0, f64::max);
    (largest as f32).next_up() * f32::from(largest > 0.0)
}

/// Returns the largest distance of a height from the mean of two others, where all three are numbers.
fn largest_bend(middle: &[f64], from: &[f64], to: &[f64]) -> f64 {
    let bend = |middle: f64, from: f64, to: f64| (middle - (from + to) / 2.0).abs();
    let [(middle, last_middle), (from, last_from), (to, last_to)] = [middle, from, to].map(|row| row.as_chunks::<8>());
    // Eight independent maxima fill the widest vector registers.
    let mut largest = [0.0f64; 8];
    for ((middle, from), to) in middle.iter().zip(from).zip(to) {
        for (lane, largest) in largest.iter_mut().enumerate() {
            let bend = bend(middle[lane], from[lane], to[lane]);
            *largest = if bend > *largest { bend } else { *largest };
        }
    }
    let last = last_middle.iter().zip(last_from).zip(last_to).map(|((middle, from), to)| bend(*middle, *from, *to));
    last.chain(largest).fold(0.0, f64::max)
}

/// Returns heights along a row of the field, which repeats endlessly along its tiled axes; NaN outside.
fn heights(field: &Field, first: i64, z: i64, count: usize) -> Vec<f64> {
    let Some(z) = wrapped(field, 1, z) else { return vec![f64::NAN; count] };
    let width = field.stored()[0] as usize;
    let mut row = Vec::with_capacity(count);
    while row.len() < count {
        let (x, left) = (first + row.len() as i64, count - row.len());
        match wrapped(field, 0, x) {
            Some(x) => field.samples().append(z * width + x..z * width + (x + left).min(width), &mut row),
            None => row.resize(row.len() + if x < 0 { left.min(-x as usize) } else { left }, f64::NAN),
        }
    }
    row
}

/// Returns the stored position along an axis, which repeats endlessly if it is tiled; `None` outside.
fn wrapped(field: &Field, axis: usize, at: i64) -> Option<usize> {
    let count = i64::from(field.stored()[axis]);
    let is_tiled = field.size()[axis] > field.stored()[axis];
    (is_tiled || (0..count).contains(&at)).then(|| at.rem_euclid(count) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::{Holes, Samples};

    /// As [`detail`] is defined, sample by sample.
    fn slow_detail(field: &Field, first: [u32; 2], side: [u32; 2], level: u32) -> f64 {
        let height = |[x, z]: [i64; 2]| {
            let place = [wrapped(field, 0, x)?, wrapped(field, 1, z)?].map(|n| n as u32);
            Some(f64::from(field.height(place[0], place[1])))
        };
        let half = 1i64 << (level - 1);
        let mut largest = 0.0f64;
        for (i, j) in (0..=side[1]).flat_map(|j| (0..=side[0]).map(move |i| (i, j))) {
            let at = [i64::from(first[0] + i), i64::from(first[1] + j)];
            for a in [[half, 0], [0, half], [half, half], [half, -half]] {
                let [before, after] = [-1, 1].map(|sign| height([at[0] + sign * a[0], at[1] + sign * a[1]]));
                if let (Some(middle), Some(before), Some(after)) = (height(at), before, after) {
                    largest = largest.max((middle - (before + after) / 2.0).abs());
                }
            }
        }
        largest
    }

    #[test]
    fn detail_is_what_it_is_defined_to_be() {
        let [w, h] = [43, 29];
        let codes = (0..w * h).map(|k| (k * 7919 % 1009) as u16).collect();
        let field = Field::new(Samples::Coded { codes, zero: 3.0, scale: 0.25 }, [w, h], [1.0; 2], Holes::none(0));
        for tiles in [[1, 1], [5, 1], [1, 5], [7, 7]] {
            let field = field.clone().tiled(tiles);
            for (level, (first, side)) in (1..8).flat_map(|level| {
                [([0, 0], [16, 16]), ([16, 8], [9, 20]), ([0, 0], [42, 28])].map(|square| (level, square))
            }) {
                let (fast, slow) = (detail(&field, first, side, level), slow_detail(&field, first, side, level));
                let next = (slow as f32).next_up() * f32::from(slow > 0.0);
                assert_eq!(fast, next, "{tiles:?} level {level} at {first:?}");
            }
        }
    }
}
