//! Which triangles a tile draws at each level, as indices into its chunk: the centre, and a border for each set of
//! sides that meet a coarser tile. Vertices of a chunk are numbered row by row.

use std::ops::Range;

use crate::height::rtin;

/// Sides of a tile: x = 0, z = 0, x = last, z = last. The neighbour's side on the other hand of side q is
/// `(q + 2) % 4` (Larsen & Christensen, figure 8).
pub const SIDES: usize = 4;

/// A triangle in the units of a level.
pub type Triangle = [[i32; 2]; 3];

/// All index patterns of tiles of one size.
pub struct Patterns {
    /// All indices.
    pub indices: Vec<u32>,
    /// By level: the cells that touch no side; nothing if there are none.
    pub centres: Vec<Range<u32>>,
    /// By level and by set of sides (bit q: side q meets a coarser tile): the cells that touch a side.
    borders: Vec<[Range<u32>; 16]>,
}

impl Patterns {
    /// Of tiles of so many cells a side, a power of two, without indices for levels finer than `finest` and, if the tile
    /// is `alone`, for sides that meet others.
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
                // A single cell has no vertex between its corners: the bit tells the diagonal.
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

    /// The border of a tile at a level, of which the sides of a set meet coarser tiles. A tile of a single cell
    /// has its diagonal by its own parity among the tiles.
    pub fn border(&self, level: u32, mask: usize, is_odd: bool) -> Range<u32> {
        let borders = &self.borders[level as usize];
        let is_single = level as usize + 1 == self.borders.len();
        borders[if is_single { usize::from(is_odd) } else { mask }].clone()
    }

    /// Triangles of a level of a tile beside none that is coarser: 2^(2(w − l) + 1) (Larsen & Christensen, §2).
    pub fn triangles(&self, level: u32) -> u32 {
        (self.centres[level as usize].len() + self.border(level, 0, false).len()) as u32 / 3
    }

    fn append(&mut self, n: i32, triangles: &[Triangle]) -> Range<u32> {
        let first = self.indices.len() as u32;
        self.indices.extend(triangles.iter().flatten().map(|&[x, z]| (z * (n + 1) + x) as u32));
        first..self.indices.len() as u32
    }
}

/// A triangle of the cell at (1, 0) moved to (0, 0).
fn unshifted(triangle: Triangle, mask: usize) -> Triangle {
    triangle.map(|[x, z]| [x - (mask as i32 & 1), z])
}

/// The cells of an n × n grid that touch no side.
pub fn centre(n: i32) -> Vec<Triangle> {
    (1..n - 1).flat_map(|j| (1..n - 1).flat_map(move |i| rtin::cell(i, j))).collect()
}

/// The cells of an n × n grid, n even, that touch a side. On sides of the set the odd vertices fall onto the even ones
/// before them: what is left of the triangles there is twice as long (figure 6).
pub fn border(n: i32, mask: usize) -> Vec<Triangle> {
    let on = |i: i32| i == 0 || i == n - 1;
    let cells = (0..n).flat_map(|j| (0..n).map(move |i| [i, j])).filter(|&[i, j]| on(i) || on(j));
    let fallen = |triangle: Triangle| triangle.map(|vertex| fallen(n, mask, vertex));
    let triangles = cells.flat_map(|[i, j]| rtin::cell(i, j)).map(fallen);
    triangles.filter(|[a, b, c]| a != b && b != c && c != a).collect()
}

fn fallen(n: i32, mask: usize, [x, z]: [i32; 2]) -> [i32; 2] {
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

/// The side on which a vertex of an n × n grid lies; `None` inside and at a corner, which no level lacks.
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
    fn a_level_has_the_published_number_of_triangles() {
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
    fn every_border_fills_its_cells_and_lacks_the_odd_vertices_of_its_sides() {
        for (n, mask) in [2, 4, 8].into_iter().flat_map(|n| (0..16).map(move |mask| (n, mask))) {
            let border = border(n, mask);
            assert_eq!(doubled_area(&border) + doubled_area(&centre(n)), 2 * n * n, "{n} {mask}");
            for (side, k) in (0..SIDES).flat_map(|side| (1..n).step_by(2).map(move |k| (side, k))) {
                let vertex = [[0, k], [k, 0], [n, k], [k, n]][side];
                let is_there = border.iter().flatten().any(|v| *v == vertex);
                assert_eq!(is_there, mask >> side & 1 == 0, "{n} {mask} {vertex:?}");
            }
        }
    }
}
