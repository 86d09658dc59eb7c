//! Builds the flat meshes of the clusters: one grid of vertices, and one range of indices for each seed.

use std::ops::Range;

use super::states::State;
use crate::draw::{Geometry, LatticeVertex, Seams, skirts};
use crate::height::rtin;

/// Vertex grid with the index ranges of all seeds.
pub struct Mesh {
    /// (4n + 1)² vertices, with skirts (4n + 6)². Two units per cell of a quadrant that is one block.
    pub geometry: Geometry,
    /// Index range by seed.
    pub ranges: Vec<Range<u32>>,
}

impl Mesh {
    /// Builds clusters of blocks of `n` × `n` cells in these states. With skirts, each quadrant has its own rows and
    /// columns of vertices.
    pub fn new(n: i32, states: &[State], seams: Seams) -> Self {
        let last = match seams {
            Seams::Shared => 4 * n,
            Seams::Skirts => skirts::cells(2 * n as u32) as i32,
        };
        let positions = (0..=last).flat_map(|z| (0..=last).map(move |x| [x, z]));
        let lattice = positions.map(|position| LatticeVertex { position }).collect();
        let mut indices: Vec<u32> = Vec::new();
        let mut append = |state: &State| {
            let first = indices.len() as u32;
            for (quadrant, &what) in state.iter().enumerate() {
                let half = [quadrant & 1, quadrant >> 1].map(|half| half as i32);
                let line = |k: usize, place: i32| match seams {
                    Seams::Shared => half[k] * 2 * n + place,
                    Seams::Skirts => skirts::line(2 * n, half[k], place),
                };
                let index = |[x, z]: [i32; 2]| (line(1, z) * (last + 1) + line(0, x)) as u32;
                indices.extend(quadrant_triangles(n, what).flatten().map(index));
                if seams == Seams::Skirts {
                    indices.extend(skirt_triangles(n, what).flatten().map(index));
                }
            }
            first..indices.len() as u32
        };
        let ranges = states.iter().map(&mut append).collect();
        Self { geometry: Geometry { lattice, indices, ..Geometry::default() }, ranges }
    }
}

/// Returns the cells along a quadrant's side, and the units per cell.
fn cells_of(n: i32, what: u8) -> (i32, i32) {
    [(0, 0), (n, 2), (2 * n, 1)][usize::from(what)]
}

/// Returns the triangles of a quadrant. Each begins with a vertex inside the quadrant, whose level applies to the whole
/// triangle.
fn quadrant_triangles(n: i32, what: u8) -> impl Iterator<Item = [[i32; 2]; 3]> {
    let (cells, step) = cells_of(n, what);
    let grid = (0..cells).flat_map(move |j| (0..cells).map(move |i| (i, j)));
    grid.flat_map(|(i, j)| rtin::cell(i, j)).map(move |triangle| {
        let inside = |[x, z]: &[i32; 2]| x % cells != 0 && z % cells != 0;
        let mut corners = triangle;
        corners.rotate_left(triangle.iter().position(inside).unwrap_or(0));
        corners.map(|[x, z]| [step * x, step * z])
    })
}

/// Returns the triangles of the skirts along a quadrant's sides, facing outward. Each begins with a skirt vertex.
fn skirt_triangles(n: i32, what: u8) -> impl Iterator<Item = [[i32; 2]; 3]> {
    let (cells, step) = cells_of(n, what);
    let last = 2 * n;
    // Around the quadrant with the terrain on the left, seen from above: along a side, and beyond it.
    let sides = (0..4).flat_map(move |side| (0..cells).map(move |k| (side, step * k, step * (k + 1))));
    sides.flat_map(move |(side, from, to)| {
        let at = |along: i32, beyond: i32| match side {
            0 => [-beyond, along],
            1 => [along, last + beyond],
            2 => [last + beyond, last - along],
            _ => [last - along, -beyond],
        };
        [[at(from, 1), at(to, 0), at(from, 0)], [at(from, 1), at(to, 1), at(to, 0)]]
    })
}
