//! Builds the triangles of a tile at each level as indices into its chunk: the centre, and a border for each set of
//! sides that meet a coarser tile. Vertices of a chunk are numbered row by row.
//!
//! Sides of a tile are numbered: x = 0, z = 0, x = last, z = last. Side q meets side `(q + 2) % 4` of the neighbour
//! (Larsen & Christensen, figure 8).

use std::ops::Range;

use crate::height::rtin;

/// A triangle as grid coordinates (x, z) of a level.
pub type Triangle = [[i32; 2]; 3];

/// Index patterns of tiles of one size.
pub struct Patterns {
    /// Indices of all patterns.
    pub indices: Vec<u32>,
    /// Index range by level of the cells that touch no side; empty if there are none.
    pub centres: Vec<Range<u32>>,
    /// Index ranges by level and set of sides (bit q: side q meets a coarser tile) of the cells that touch a side.
    borders: Vec<[Range<u32>; 16]>,
}

impl Patterns {
    /// Builds the patterns of tiles with `cells` cells a side, a power of two. Omits indices for levels finer than
    /// `finest` and, if the tile is `alone`, for sides that meet others.
    pub fn new(cells: i32, finest: u32, alone: bool) -> Self {
        let mut patterns = Self { indices: Vec::new(), centres: Vec::new(), borders: Vec::new() };
        for level in 0..=cells.ilog2() {
            let n = cells >> level;
            if level < finest {
                patterns.centres.push(0..0);
                patterns.borders.push(std::array::from_fn(|_| 0..0));
                continue;
            }
            let centre = patterns.append(n, &centre(n));
            patterns.centres.push(centre);
            let borders = std::array::from_fn(|mask| {
                // A single cell has no vertex between its corners; bit 0 selects the diagonal instead.
                let triangles = if n == 1 {
                    rtin::cell(mask as i32 & 1, 0).map(|t| unshifted(t, mask)).into()
                } else if alone && mask > 0 {
                    Vec::new()
                } else {
                    border(n, mask)
                };
                patterns.append(n, &triangles)
            });
            patterns.borders.push(borders);
        }
        patterns
    }

    /// Returns the border of a tile at a level whose sides in `mask` meet coarser tiles. The diagonal of a tile of a
    /// single cell depends on the parity of its place.
    pub fn border(&self, level: u32, mask: usize, is_odd: bool) -> Range<u32> {
        let borders = &self.borders[level as usize];
        let is_single = level as usize + 1 == self.borders.len();
        borders[if is_single { usize::from(is_odd) } else { mask }].clone()
    }

    /// Returns the number of triangles of a level whose neighbours are not coarser: 2^(2(w − l) + 1) (Larsen &
    /// Christensen, §2).
    pub fn triangles(&self, level: u32) -> u32 {
        (self.centres[level as usize].len() + self.border(level, 0, false).len()) as u32 / 3
    }

    fn append(&mut self, n: i32, triangles: &[Triangle]) -> Range<u32> {
        let first = self.indices.len() as u32;
        self.indices.extend(triangles.iter().flatten().map(|&[x, z]| (z * (n + 1) + x) as u32));
        first..self.indices.len() as u32
    }
}

/// Moves a triangle of the cell at (1, 0) to (0, 0).
fn unshifted(triangle: Triangle, mask: usize) -> Triangle {
    triangle.map(|[x, z]| [x - (mask as i32 & 1), z])
}

/// Returns the triangles of the cells of an n × n grid that touch no side.
pub fn centre(n: i32) -> Vec<Triangle> {
    (1..n - 1).flat_map(|j| (1..n - 1).flat_map(move |i| rtin::cell(i, j))).collect()
}

/// Returns the triangles of the cells of an n × n grid, n even, that touch a side. On sides in `mask`, odd vertices
/// snap to the even ones before them, which leaves triangles twice as long (figure 6).
pub fn border(n: i32, mask: usize) -> Vec<Triangle> {
    let on = |i: i32| i == 0 || i == n - 1;
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| [i, j])).filter(|&[i, j]| on(i) || on(j));
    let snapped = |triangle: Triangle| triangle.map(|vertex| snap(n, mask, vertex));
    let triangles = cells.flat_map(|[i, j]| rtin::cell(i, j)).map(snapped);
    triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect()
}

fn snap(n: i32, mask: usize, [x, z]: [i32; 2]) -> [i32; 2] {
    match side(n, [x, z]) {
        Some(side) if mask >> side & 1 == 1 => {
            if side % 2 == 0 {
                [x, z & !1]
            } else {
                [x & !1, z]
            }
        }
        _ => [x, z],
    }
}

/// Returns the side on which a vertex of an n × n grid lies; `None` inside and at a corner, which every level has.
pub fn side(n: i32, [x, z]: [i32; 2]) -> Option<usize> {
    let on = |k: i32| k == 0 || k == n;
    match (on(x), on(z)) {
        (true, false) => Some(if x == 0 { 0 } else { 2 }),
        (false, true) => Some(if z == 0 { 1 } else { 3 }),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn doubled_area(triangles: &[Triangle]) -> i32 {
        let area = |[a, b, c]: &Triangle| (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1]);
        assert!(triangles.iter().all(|t| area(t) > 0), "all face up");
        triangles.iter().map(area).sum()
    }

    #[test]
    fn triangle_counts_match_the_paper() {
        let patterns = Patterns::new(32, 0, false);
        for (level, percent) in [(0, 0.0), (1, 75.0), (2, 93.75), (3, 98.44), (4, 99.61)] {
            let triangles = patterns.triangles(level);
            assert_eq!(triangles, 1 << (2 * (5 - level) + 1), "2^(2(w − l) + 1)");
            let reduction = 100.0 * (1.0 - f64::from(triangles) / 2048.0);
            assert!((reduction - percent).abs() < 0.006, "table 2: {reduction} % at level {level}");
        }
        let single = [false, true].map(|is_odd| patterns.border(5, 15, is_odd));
        assert_eq!(single.clone().map(|range| range.len()), [6, 6]);
        let [even, odd] = single.map(|range| patterns.indices[range.start as usize..range.end as usize].to_vec());
        assert!(even.contains(&0) && even.iter().filter(|&&k| k == 3).count() == 2, "from corner to corner");
        assert!(odd.iter().filter(|&&k| k == 1).count() == 2, "the other diagonal");
    }

    #[test]
    fn borders_cover_their_cells_without_odd_vertices() {
        for (n, mask) in [2, 4, 8].into_iter().flat_map(|n| (0..16).map(move |mask| (n, mask))) {
            let border = border(n, mask);
            assert_eq!(doubled_area(&border) + doubled_area(&centre(n)), 2 * n * n, "{n} {mask}");
            for (side, k) in (0..4).flat_map(|side| (1..n).step_by(2).map(move |k| (side, k))) {
                let vertex = [[0, k], [k, 0], [n, k], [k, n]][side];
                let is_there = border.iter().flatten().any(|v| *v == vertex);
                assert_eq!(is_there, mask >> side & 1 == 0, "{n} {mask} {vertex:?}");
            }
        }
    }
}
