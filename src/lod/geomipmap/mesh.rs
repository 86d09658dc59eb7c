//! Builds the flat mesh of a block: one grid of vertices, and for each level the indices of its centre and of its
//! border for each border mask.

use std::ops::Range;

use crate::draw::{Geometry, LatticeVertex};
use crate::height::rtin;

/// Sides of a block that meet a coarser one, as bits.
pub mod side {
    /// x = 0.
    pub const LEFT: u8 = 1;
    /// z = 0.
    pub const TOP: u8 = 2;
    /// x = cells.
    pub const RIGHT: u8 = 4;
    /// z = cells.
    pub const BOTTOM: u8 = 8;
}

/// The six masks from which quarter turns make all sixteen: no side, one, two adjacent, two opposite, three, four. By
/// Burnside's lemma (16 + 2 + 4 + 2) / 4 = 6.
pub const CLASSES: [u8; 6] = [0b0000, 0b0001, 0b0011, 0b0101, 0b0111, 0b1111];

/// Rotates a mask by quarter turns, each of which maps left to top, top to right, right to bottom, bottom to left.
fn rotated(mask: u8, rotation: u32) -> u8 {
    ((mask << rotation) | (mask >> (4 - rotation))) & 15
}

/// Returns the class and the number of quarter turns (0–3) that give a mask.
pub fn class_of(mask: u8) -> (usize, u32) {
    let find =
        |rotation| CLASSES.iter().position(|&class| rotated(class, rotation) == mask).map(|class| (class, rotation));
    (0..4).find_map(find).expect("six classes and their rotations cover all masks")
}

/// Border masks for which indices are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Masks {
    /// All sixteen, as published.
    Sixteen,
    /// The six of [`CLASSES`], rotated per instance.
    Six,
}

impl Masks {
    fn list(self) -> Vec<u8> {
        match self {
            Masks::Sixteen => (0..16).collect(),
            Masks::Six => CLASSES.to_vec(),
        }
    }

    /// Returns the index of the border for a mask, and its number of quarter turns.
    pub fn border(self, mask: u8) -> (usize, u32) {
        match self {
            Masks::Sixteen => (usize::from(mask), 0),
            Masks::Six => class_of(mask),
        }
    }

    /// Returns the number of borders of a level.
    pub fn count(self) -> usize {
        self.list().len()
    }
}

/// Mesh of a block with its index ranges.
pub struct BlockMesh {
    /// (cells + 1)² vertices; indices of the borders of every level first, then of the centres.
    pub geometry: Geometry,
    /// Index ranges by level, then mask or class.
    pub borders: Vec<Vec<Range<u32>>>,
    /// Index ranges by level; empty if a level is all border.
    pub centres: Vec<Range<u32>>,
}

impl BlockMesh {
    /// Builds a block of `cells` (a power of two) cells a side with all of its log2(cells) + 1 levels.
    pub fn new(cells: i32, masks: Masks) -> Self {
        Self::used(cells, masks, 0, false)
    }

    /// Builds a block without indices for levels finer than `finest` and, if it is `alone`, for sides that meet others.
    pub fn used(cells: i32, masks: Masks, finest: u32, alone: bool) -> Self {
        let levels = cells.ilog2() + 1;
        let positions = (0..=cells).flat_map(|z| (0..=cells).map(move |x| [x, z]));
        let lattice = positions.map(|position| LatticeVertex { position }).collect();
        let mut indices: Vec<u32> = Vec::new();
        let mut append = |level: u32, triangles: Vec<[[i32; 2]; 3]>| {
            let first = indices.len() as u32;
            let index = |[x, z]: [i32; 2]| (((z * (cells + 1)) + x) << level) as u32;
            indices.extend(triangles.into_iter().flatten().map(index));
            first..indices.len() as u32
        };
        let mut append = |level: u32, is_used: bool, triangles: fn(i32, u8) -> Vec<[[i32; 2]; 3]>, mask: u8| {
            append(level, if is_used && level >= finest { triangles(cells >> level, mask) } else { Vec::new() })
        };
        let mut borders =
            |level| masks.list().into_iter().map(|mask| append(level, !alone || mask == 0, border, mask)).collect();
        let borders = (0..levels).map(&mut borders).collect();
        let centres = (0..levels).map(|level| append(level, true, |n, _| centre(n), 0)).collect();
        Self { geometry: Geometry { lattice, indices, ..Geometry::default() }, borders, centres }
    }
}

/// Returns true if cell `(i, j)` of `n` × `n` touches a side.
fn on_border(i: i32, j: i32, n: i32) -> bool {
    i == 0 || j == 0 || i == n - 1 || j == n - 1
}

/// Returns the triangles of all cells off the border.
pub fn centre(n: i32) -> Vec<[[i32; 2]; 3]> {
    cells(n).filter(|&(i, j)| !on_border(i, j, n)).flat_map(|(i, j)| rtin::cell(i, j)).collect()
}

/// Returns the triangles of the cells next to the border cells.
pub fn inner_border(n: i32) -> Vec<[[i32; 2]; 3]> {
    let next = |(i, j): &(i32, i32)| (1..n - 1).contains(i) && (1..n - 1).contains(j) && on_border(i - 1, j - 1, n - 2);
    cells(n).filter(next).flat_map(|(i, j)| rtin::cell(i, j)).collect()
}

/// Returns the triangles of the border cells. On a side of the mask every second vertex snaps to the one before it, and
/// collapsed triangles are dropped.
pub fn border(n: i32, mask: u8) -> Vec<[[i32; 2]; 3]> {
    let snap = |[x, z]: [i32; 2]| {
        let on = |bit: u8, at: bool| mask & bit != 0 && at;
        if on(side::TOP, z == 0) || on(side::BOTTOM, z == n) {
            [x & !1, z]
        } else if on(side::LEFT, x == 0) || on(side::RIGHT, x == n) {
            [x, z & !1]
        } else {
            [x, z]
        }
    };
    cells(n)
        .filter(|&(i, j)| on_border(i, j, n))
        .flat_map(|(i, j)| rtin::cell(i, j))
        .map(|t| t.map(snap))
        .filter(|[a, b, c]| a != b && b != c && c != a)
        .collect()
}

fn cells(n: i32) -> impl Iterator<Item = (i32, i32)> {
    (0..n).flat_map(move |j| (0..n).map(move |i| (i, j)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn set(triangles: impl IntoIterator<Item = [[i32; 2]; 3]>) -> BTreeSet<[[i32; 2]; 3]> {
        // Corners in cyclic order from the smallest, which keeps the winding.
        triangles.into_iter().map(|[a, b, c]| [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().unwrap()).collect()
    }

    /// Proves by enumeration that six classes with quarter turns draw what sixteen masks draw.
    #[test]
    fn six_rotated_classes_cover_all_masks() {
        for n in [2, 4, 8, 16, 32, 64, 128, 256] {
            for mask in 0..16 {
                let (class, rotation) = class_of(mask);
                let turn = |[x, z]: [i32; 2]| [[x, z], [n - z, x], [n - x, n - z], [z, n - x]][rotation as usize];
                let rotated = border(n, CLASSES[class]).into_iter().map(|t| t.map(turn));
                assert_eq!(set(rotated), set(border(n, mask)), "n {n}, mask {mask:04b}");
            }
            let quarter = centre(n).into_iter().map(|t| t.map(|[x, z]| [n - z, x]));
            assert_eq!(set(quarter), set(centre(n)));
        }
    }

    #[test]
    fn border_and_centre_cover_the_block_once() {
        for n in [1, 2, 4, 8, 16] {
            for mask in if n == 1 { 0..1 } else { 0..16 } {
                let doubled: i32 = border(n, mask)
                    .iter()
                    .chain(&centre(n))
                    .map(|[a, b, c]| (b[1] - a[1]) * (c[0] - a[0]) - (b[0] - a[0]) * (c[1] - a[1]))
                    .inspect(|area| assert!(*area > 0))
                    .sum();
                assert_eq!(doubled, 2 * n * n, "n {n}, mask {mask:04b}");
            }
        }
    }

    #[test]
    fn index_counts() {
        // 65² vertices: the border of the finest level has 4·64 − 4 cells, two triangles each.
        let sixteen = BlockMesh::new(64, Masks::Sixteen);
        assert_eq!(sixteen.borders[0][0].len(), 3 * 2 * (4 * 64 - 4));
        assert_eq!(sixteen.centres[0].len(), 3 * 2 * 62 * 62);
        assert_eq!(sixteen.borders.len(), 7);
        assert!(sixteen.centres[5].is_empty() && sixteen.centres[6].is_empty());
        let six = BlockMesh::new(64, Masks::Six);
        assert!(six.geometry.indices.len() < sixteen.geometry.indices.len());
    }
}
