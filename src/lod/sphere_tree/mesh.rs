//! Builds the triangles of split diamonds by descending the binary tree of wedges, with culling.
//!
//! A vertex fades in from the middle of its hypotenuse *as drawn* to its own height:
//! drawn(m) = mid(drawn(a), drawn(c)) + (1 − w)·(h(m) − mid(h(a), h(c))). A vertex's weight w is at least the weights of all vertices it depends on. The
//! surface is therefore the mean over t in 0..1 of the meshes of the vertices with w ≤ t. Each of these meshes is
//! conforming and contains all diamonds that must have split. Each keeps the tolerance, and so does their mean. A
//! vertex appears and disappears at w = 1, where the surface is the same with and without it.

use std::ops::Range;

use rayon::prelude::*;

use super::blocks::Blocks;
use super::lattice::{Lattice, Place};
use super::measure::Measured;
use super::patches::Patches;
use super::reach::Viewpoint;
use super::splits::Splits;
use crate::draw::{Draw, DrawList, ExplicitVertex, Instance, Source, Topology};

/// A corner of a wedge, with its fade.
#[derive(Clone, Copy, Debug, Default)]
pub struct Corner {
    /// Place on the lattice.
    pub at: Place,
    /// Height of the sample, metres.
    height: f64,
    /// Middle of the hypotenuse as drawn, metres.
    target: f64,
    /// Height above `target` when fully faded in, metres.
    rise: f64,
    weight: f32,
}

impl Corner {
    /// Returns the height at which the corner is drawn, metres.
    fn drawn(&self) -> f64 {
        self.target + (1.0 - f64::from(self.weight)) * self.rise
    }

    /// Returns the corner as a vertex with heights relative to `height_base`, metres.
    pub fn vertex(&self, lattice: &Lattice, height_base: f32) -> ExplicitVertex {
        let height = if self.rise + self.target == self.height { self.height } else { self.target + self.rise };
        let relative = |height: f64| (height - f64::from(height_base)) as f32;
        ExplicitVertex {
            position: lattice.on_field(self.at),
            height: relative(height),
            target: relative(self.target),
            morph: self.weight,
            ..ExplicitVertex::default()
        }
    }
}

/// A wedge: the corner with the right angle first, counter-clockwise seen from above.
pub type Wedge = [Corner; 3];

/// Triangles of one draw.
#[derive(Default)]
pub struct Piece {
    /// Vertices.
    pub vertices: Vec<ExplicitVertex>,
    /// Three indices per triangle.
    pub indices: Vec<u32>,
}

/// Inputs of the mesh for one viewpoint.
pub struct Mesh<'a> {
    /// Heights and diamonds.
    pub measured: &'a Measured,
    /// Split diamonds.
    pub splits: &'a Splits,
    /// Visible blocks.
    pub blocks: &'a Blocks,
    /// Viewpoint, which determines how far vertices have faded in.
    pub from: &'a Viewpoint,
}

impl Mesh<'_> {
    /// Fills an empty list: one draw for all wedges larger than a block, and one for each visible block. Draws a
    /// block's patch if `patches` has it.
    pub fn fill(&self, mut patches: Option<&mut Patches>, list: &mut DrawList) {
        let (mut large, mut small) = (Vec::new(), Vec::new());
        for wedge in self.roots() {
            self.descend(&wedge, &mut large, &mut small);
        }
        small.sort_by_key(|(block, _)| *block);
        let blocks: Vec<_> = small.chunk_by(|a, b| a.0 == b.0).collect();
        let roots = |wedges: &[(usize, Wedge)]| -> Vec<_> {
            wedges.iter().map(|(_, wedge)| wedge.map(|corner| corner.at)).collect()
        };
        let patch = |patches: &Option<&mut Patches>, wedges: &[(usize, Wedge)]| {
            patches.as_ref().and_then(|patches| patches.get(wedges[0].0, &roots(wedges)))
        };
        let changed: Vec<_> = blocks.iter().filter(|wedges| patch(&patches, wedges).is_none()).collect();
        let of_block = |wedges: &&&[(usize, Wedge)]| self.piece(wedges.iter().map(|(_, wedge)| wedge));
        let pieces: Vec<Piece> = changed.par_iter().map(of_block).collect();
        push(list, self.separate(&large));
        for (wedges, piece) in changed.into_iter().zip(pieces) {
            let store = |patches: &mut &mut Patches| {
                patches.store((wedges[0].0, roots(wedges)), &piece, self.blocks, &mut list.uploads)
            };
            if !patches.as_mut().is_some_and(store) {
                push(list, piece);
            }
        }
        for (first_vertex, indices) in blocks.iter().filter_map(|wedges| patch(&patches, wedges)) {
            push_draw(list, Source::Resident, first_vertex, indices);
        }
    }

    /// Returns the two halves of the root square.
    pub fn roots(&self) -> [Wedge; 2] {
        let side = self.measured.lattice.side();
        let [a, b, c, d] = [[0, 0], [side, 0], [0, side], [side, side]].map(|at| self.sample(at));
        // Seen from above with z to the south, the diagonal runs from the first corner to the last.
        [[c, d, a], [b, a, d]]
    }

    fn sample(&self, at: Place) -> Corner {
        let height = self.measured.height(at);
        Corner { at, height, target: height, rise: 0.0, weight: 0.0 }
    }

    /// Returns the middle of a wedge's hypotenuse as a corner.
    fn middle(&self, a: &Corner, c: &Corner, at: Place, index: usize) -> Corner {
        let mut middle = self.sample(at);
        if self.from.band > 1.0 {
            let fades = !self.measured.lattice.sticks_out(at);
            middle.target = (a.drawn() + c.drawn()) / 2.0;
            middle.rise = middle.height - (a.height + c.height) / 2.0;
            middle.weight = if fades { self.from.weight(&self.measured.diamond(at, index)) as f32 } else { 0.0 };
        }
        middle
    }

    /// Returns the two halves of a wedge; `None` if it has not split.
    pub fn halves(&self, [apex, left, right]: &Wedge) -> Option<[Wedge; 2]> {
        let sum = [0, 1].map(|k| left.at[k] + right.at[k]);
        if (sum[0] | sum[1]) & 1 == 1 {
            // Half of a cell, the finest wedge.
            return None;
        }
        let at = sum.map(|n| n / 2);
        let index = self.measured.lattice.index(at).filter(|&index| self.splits.contains(index))?;
        let middle = self.middle(left, right, at, index);
        Some([[middle, *apex, *left], [middle, *right, *apex]])
    }

    /// Sorts visible wedges into those larger than a block and those within one.
    fn descend(&self, wedge: &Wedge, large: &mut Vec<Wedge>, small: &mut Vec<(usize, Wedge)>) {
        let corners = wedge.map(|corner| corner.at);
        if self.blocks.contain(corners) {
            small.extend(self.blocks.visible_block(corners).map(|block| (block, *wedge)));
        } else if let Some(halves) = self.halves(wedge) {
            halves.iter().for_each(|half| self.descend(half, large, small));
        } else if self.covers_a_visible_block(corners) {
            large.push(*wedge);
        }
    }

    fn covers_a_visible_block(&self, wedge: [Place; 3]) -> bool {
        if self.blocks.contain(wedge) {
            return self.blocks.visible_block(wedge).is_some();
        }
        let [apex, left, right] = wedge;
        let middle = [0, 1].map(|k| (left[k] + right[k]) / 2);
        [[middle, apex, left], [middle, right, apex]].into_iter().any(|half| self.covers_a_visible_block(half))
    }

    /// Returns the triangles of the wedges of one block, with shared vertices.
    fn piece<'w>(&self, wedges: impl Iterator<Item = &'w Wedge>) -> Piece {
        let mut leaves = Vec::new();
        for wedge in wedges {
            let mut open = vec![*wedge];
            while let Some(wedge) = open.pop() {
                match self.halves(&wedge) {
                    Some([first, second]) => open.extend([second, first]),
                    None => leaves.push(wedge),
                }
            }
        }
        let along = |k: usize| leaves.iter().flatten().map(move |corner| corner.at[k]);
        let origin = [0, 1].map(|k| along(k).min().unwrap_or(0));
        let [row, rows] = [0, 1].map(|k| (along(k).max().unwrap_or(0) - origin[k] + 1) as usize);
        let mut table = vec![u32::MAX; row * rows];
        let mut piece = Piece::default();
        for wedge in leaves.iter().filter(|wedge| self.has_area(wedge)) {
            for corner in wedge {
                let [x, z] = [0, 1].map(|k| (corner.at[k] - origin[k]) as usize);
                let place = &mut table[z * row + x];
                if *place == u32::MAX {
                    *place = piece.vertices.len() as u32;
                    piece.vertices.push(corner.vertex(&self.measured.lattice, 0.0));
                }
                piece.indices.push(*place);
            }
        }
        piece
    }

    /// Returns triangles without shared vertices.
    fn separate(&self, wedges: &[Wedge]) -> Piece {
        let mut piece = Piece::default();
        for corner in wedges.iter().filter(|wedge| self.has_area(wedge)).flatten() {
            piece.indices.push(piece.vertices.len() as u32);
            piece.vertices.push(corner.vertex(&self.measured.lattice, 0.0));
        }
        piece
    }

    /// Returns true if a wedge does not collapse onto the field's edge.
    fn has_area(&self, wedge: &Wedge) -> bool {
        !self.measured.lattice.collapses(wedge.map(|corner| corner.at))
    }
}

/// Appends a draw of a piece if it has triangles.
pub fn push(list: &mut DrawList, piece: Piece) {
    let (first_vertex, first) = (list.streamed.vertices.len() as u32, list.streamed.indices.len() as u32);
    list.streamed.vertices.extend(piece.vertices);
    list.streamed.indices.extend(piece.indices);
    push_draw(list, Source::Streamed, first_vertex, first..list.streamed.indices.len() as u32);
}

fn push_draw(list: &mut DrawList, source: Source, first_vertex: u32, indices: Range<u32>) {
    if indices.is_empty() {
        return;
    }
    let batch = list.instances.len() as u32;
    list.instances.push(Instance { batch, ..Instance::default() });
    list.draws.push(Draw { source, topology: Topology::Triangles, indices, instances: batch..batch + 1, first_vertex });
}
