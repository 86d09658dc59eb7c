//! Brute force: draws every sample of the field in every view, as the ground truth for the other techniques.
//!
//! One static grid mesh is instanced over the field and displaced in the vertex shader. Nothing is culled; only blocks
//! that consist of holes are omitted.
//!
//! Invariants: all of them, with error 0.

use std::sync::Arc;

use super::entry::Entry;
use super::settings::Settings;
use super::technique::Technique;
use crate::draw::{Draw, DrawList, Geometry, Instance, LatticeVertex, Limits, Source, Topology};
use crate::height::surface::has_terrain;
use crate::height::{Field, MAX_SIDE, rtin};
use crate::view::View;

/// Row of [`super::TECHNIQUES`].
pub const ENTRY: Entry = Entry {
    name: "brute-force",
    about: "every sample, always: ground truth and baseline",
    paper: "none",
    variants: &[],
    settings: &[],
    needs: &[],
    max_samples: 1 << 32,
    max_side: MAX_SIDE,
    takes_endless: false,
    build: |field, _: &Settings| Box::new(BruteForce::new(field)),
};

/// Cells along a side of the mesh. With 64, the 65² transformed vertices fit most GPUs' caches.
const CELLS: i32 = 64;

struct BruteForce {
    mesh: Geometry,
    instances: Vec<Instance>,
}

impl BruteForce {
    fn new(field: Arc<Field>) -> Self {
        let [w, h] = field.size();
        let blocks = [w, h].map(|n| (n - 1).div_ceil(CELLS as u32) as i32);
        let instances = (0..blocks[1])
            .flat_map(|j| (0..blocks[0]).map(move |i| [i * CELLS, j * CELLS]))
            .filter(|&[x, z]| {
                has_terrain(&field, [x, z], [(x + CELLS).min(w as i32 - 1), (z + CELLS).min(h as i32 - 1)])
            })
            .map(|origin| Instance { origin, cells: CELLS as u32, ..Instance::default() })
            .collect();
        Self { mesh: grid(), instances }
    }
}

fn grid() -> Geometry {
    let positions = (0..=CELLS).flat_map(|z| (0..=CELLS).map(move |x| [x, z]));
    let index = |[x, z]: [i32; 2]| (z * (CELLS + 1) + x) as u32;
    let cells = (0..CELLS).flat_map(|j| (0..CELLS).flat_map(move |i| rtin::cell(i, j)));
    Geometry {
        lattice: positions.map(|position| LatticeVertex { position }).collect(),
        indices: cells.flatten().map(index).collect(),
        ..Geometry::default()
    }
}

impl Technique for BruteForce {
    fn resident(&self) -> &Geometry {
        &self.mesh
    }

    fn limits(&self) -> Limits {
        Limits { draws: 1, instances: self.instances.len(), ..Limits::default() }
    }

    fn select(&mut self, _: &View, list: &mut DrawList) {
        list.instances.extend_from_slice(&self.instances);
        list.draws.push(Draw {
            source: Source::Lattice,
            topology: Topology::Triangles,
            indices: 0..self.mesh.indices.len() as u32,
            instances: 0..self.instances.len() as u32,
            first_vertex: 0,
        });
    }

    fn keeps_tolerance(&self) -> bool {
        true
    }
}
