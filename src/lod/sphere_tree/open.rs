//! Builds the mesh of procedural terrain, culling wedges by their balls because no table of blocks exists.
//!
//! Balls are nested: nothing below an invisible wedge is visible, and a greater tolerance never draws more. Vertices
//! have normals, because no height texture exists to compute them from.

use std::collections::HashMap;

use glam::DVec3;
use rayon::prelude::*;

use super::lattice::Place;
use super::mesh::{Mesh, Wedge, push};
use super::patches::Piece;
use crate::draw::normals::pack;
use crate::draw::{DrawList, ExplicitVertex, VertexNormals};
use crate::height::bezier::{Bezier, SPACING_M};
use crate::view::{Lens, View};

/// Width of the filter for normals, pixels. Triangles are not much smaller than this.
const SMOOTHED_PX: f64 = 6.0;

impl Mesh<'_> {
    /// Fills an empty list with one draw.
    pub fn fill_procedural(&self, terrain: &Bezier, view: &View, list: &mut DrawList) {
        // The terrain height nearest the eye's. No vertex is further from it than from the eye.
        let [low, high] = terrain.range_m();
        list.height_base = view.eye.y.clamp(low, high) as f32;
        let (mut piece, mut numbers) = (Piece::default(), HashMap::new());
        for wedge in self.roots() {
            self.walk(&wedge, view, &mut |wedge| {
                for corner in wedge {
                    let number = *numbers.entry(corner.at).or_insert_with(|| {
                        piece.vertices.push(corner.vertex(&self.measured.lattice, list.height_base));
                        piece.vertices.len() as u32 - 1
                    });
                    piece.indices.push(number);
                }
            });
        }
        let height_base = f64::from(list.height_base);
        let normal =
            |vertex: &ExplicitVertex| normal(terrain, view, vertex.position, height_base + f64::from(vertex.height));
        list.streamed.normals = piece.vertices.par_iter().with_min_len(64).map(normal).collect();
        push(list, piece);
    }

    /// Calls `visit` for the visible wedges that have not split.
    fn walk(&self, wedge: &Wedge, view: &View, visit: &mut impl FnMut(&Wedge)) {
        if !self.may_be_visible(wedge, view) {
            return;
        }
        match self.halves(wedge) {
            Some(halves) => halves.iter().for_each(|half| self.walk(half, view, visit)),
            None => visit(wedge),
        }
    }

    /// Returns true if the ball of a wedge's diamond intersects the view volume.
    fn may_be_visible(&self, [_, left, right]: &Wedge, view: &View) -> bool {
        let sum = [0, 1].map(|k| left.at[k] + right.at[k]);
        let index = self.measured.lattice.index(sum.map(|n| n / 2)).filter(|_| (sum[0] | sum[1]) & 1 == 0);
        let Some(index) = index else { return true };
        let diamond = self.measured.diamond(sum.map(|n| n / 2), index);
        let from_eye = diamond.centre - self.from.eye;
        view.planes().iter().all(|(normal, offset)| normal.dot(from_eye) + offset >= -f64::from(diamond.ball))
    }
}

fn normal(terrain: &Bezier, view: &View, at: Place, height: f64) -> VertexNormals {
    let [x, z] = at.map(|n| f64::from(n) * SPACING_M);
    let distance = match view.lens {
        Lens::Perspective { .. } => view.eye.distance(DVec3::new(x, height, z)),
        Lens::Orthographic { .. } => 1.0,
    };
    let [along_x, along_z] = terrain.slopes([x, z], SMOOTHED_PX * distance / view.focal_px());
    let normal = pack(DVec3::new(-along_x, 1.0, -along_z).normalize_or(DVec3::Y).as_vec3());
    VertexNormals { normal, target: normal, second_target: normal }
}
