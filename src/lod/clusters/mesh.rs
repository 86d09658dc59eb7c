//! The flat meshes of the clusters: one grid of vertices, and one range of indices for each seed.

use std::ops::Range;

use super::states::State;
use crate::draw::{Geometry, LatticeVertex};
use crate::height::rtin;

/// The grid with its index ranges.
pub struct Mesh {
    /// (4n + 1)² vertices, two units a cell of a quadrant that is one block.
    pub geometry: Geometry,
    /// By seed.
    pub ranges: Vec<Range<u32>>,
}

impl Mesh {
    /// Clusters of blocks of `n` × `n` cells in these states.
    pub fn new(n: i32, states: &[State]) -> Self {
        let units = 4 * n;
        let positions = (0..=units).flat_map(|z| (0..=units).map(move |x| [x, z]));
        let lattice = positions.map(|position| LatticeVertex { position }).collect();
        let index = |[x, z]: [i32; 2]| (z * (units + 1) + x) as u32;
        let mut indices: Vec<u32> = Vec::new();
        let mut append = |state: &State| {
            let first = indices.len() as u32;
            let quadrants =
                state.iter().enumerate().flat_map(|(quadrant, &what)| quadrant_triangles(n, quadrant, what));
            indices.extend(quadrants.flatten().map(index));
            first..indices.len() as u32
        };
        let ranges = states.iter().map(&mut append).collect();
        Self { geometry: Geometry { lattice, indices, ..Geometry::default() }, ranges }
    }
}

/// The triangles of a quadrant; each begins with a vertex inside it, which alone tells the level of the whole.
fn quadrant_triangles(n: i32, quadrant: usize, what: u8) -> impl Iterator<Item = [[i32; 2]; 3]> {
    let (cells, step) = [(0, 0), (n, 2), (2 * n, 1)][usize::from(what)];
    let first = [quadrant & 1, quadrant >> 1].map(|half| half as i32 * 2 * n);
    let grid = (0..cells).flat_map(move |j| (0..cells).map(move |i| (i, j)));
    grid.flat_map(|(i, j)| rtin::cell(i, j)).map(move |triangle| {
        let inside = |[x, z]: &[i32; 2]| x % cells != 0 && z % cells != 0;
        let mut corners = triangle;
        corners.rotate_left(triangle.iter().position(inside).unwrap_or(0));
        corners.map(|[x, z]| [first[0] + step * x, first[1] + step * z])
    })
}
