//! The neck: what is to be drawn, as plain data. It knows neither who chose it nor who draws it.

pub mod distance;
pub mod expand;
pub mod gpu_selection;
pub mod layout;
pub mod normals;
pub mod place;
pub mod shared;
pub mod skirts;
pub mod weights;

use std::ops::Range;

pub use gpu_selection::GpuSelection;
use layout::VertexFormat;
pub use layout::{ExplicitVertex, Instance, LatticeVertex, VertexNormals};
pub use normals::Normals;

/// What a draw's indices address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Source {
    /// [`Geometry::lattice`] of the resident geometry, once per instance, displaced by the height texture.
    Lattice,
    /// [`Geometry::vertices`] of the resident geometry.
    Resident,
    /// [`Geometry::vertices`] of the list's own streamed geometry.
    Streamed,
}

/// How indices make triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Topology {
    /// Three indices a triangle, counter-clockwise seen from above.
    Triangles,
    /// Each index makes a triangle with the two before it, the winding alternating. [`RESTART`] ends a strip; the next
    /// one begins after an even number of indices, so that its winding is that of its place in the draw.
    Strip,
}

/// The index that ends a strip.
pub const RESTART: u32 = u32::MAX;

/// Vertices and indices.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// Vertices without heights, for [`Source::Lattice`].
    pub lattice: Vec<LatticeVertex>,
    /// Vertices with heights, for [`Source::Resident`] and [`Source::Streamed`].
    pub vertices: Vec<ExplicitVertex>,
    /// Normals of the vertices, one each, where they are lit by them; else none.
    pub normals: Vec<VertexNormals>,
    /// Indices into one of the two, as the draw's source says.
    pub indices: Vec<u32>,
}

/// One indexed, instanced draw.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Draw {
    /// What the indices address.
    pub source: Source,
    /// How they make triangles.
    pub topology: Topology,
    /// Which indices.
    pub indices: Range<u32>,
    /// Which of the list's instances.
    pub instances: Range<u32>,
    /// Added to each index: one pattern of indices serves meshes that lie one after the other.
    pub first_vertex: u32,
}

/// A change to the resident geometry, made before the list is drawn.
#[derive(Clone, Debug)]
pub enum Upload {
    /// Overwrites resident explicit vertices from the given one on.
    Vertices(u32, Vec<ExplicitVertex>),
    /// Overwrites normals of resident vertices from the given one on.
    Normals(u32, Vec<VertexNormals>),
    /// Overwrites resident indices from the given one on.
    Indices(u32, Vec<u32>),
}

/// How the lattice vertices of a technique's lists move.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Morph {
    /// They do not.
    #[default]
    No,
    /// To the next coarser level, or onto coarser sides, as their instance's [`weights`] say.
    ByInstance,
    /// The same, each as its own [`distance`] says.
    ByDistance,
}

/// How meshes of a technique's lists meet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Seams {
    /// They share whole edges with the same ends: one surface without a gap.
    #[default]
    Shared,
    /// Each has edges of its own, and the skirt that hangs from the higher one reaches down to the lower one.
    Skirts,
}

/// What keeps land behind other land out of the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DepthMode {
    /// A depth buffer: draws come in any order.
    #[default]
    Buffer,
    /// The order of the triangles: the furthest one comes first, and the last one drawn shows (painter's algorithm).
    Painter,
}

/// The kinds of draws that a technique's lists hold: what the executor has programs for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DrawKinds {
    /// Some are of [`Source::Lattice`].
    pub lattice: bool,
    /// Some are of [`Source::Resident`] or [`Source::Streamed`]: one program draws both.
    pub explicit: bool,
    /// Some are [`Topology::Triangles`].
    pub triangles: bool,
    /// Some are [`Topology::Strip`].
    pub strips: bool,
}

/// What a technique's lists ask of the programs that draw them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PipelineRequirements {
    /// What the lists hold.
    pub draws: DrawKinds,
    /// How lattice vertices move.
    pub morph: Morph,
    /// How meshes meet: which of the two proofs lists pass ([`watertight`](crate::measure::watertight)).
    pub seams: Seams,
    /// Where normals come from.
    pub normals: Normals,
    /// What hides land behind other land.
    pub depth_mode: DepthMode,
}

/// How draws reach the device; the triangles are the same.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Submission {
    /// One indirect command buffer per pipeline.
    #[default]
    Indirect,
    /// One recorded draw call per draw.
    Direct,
    /// The device finds draws and instances itself ([`GpuSelection`]) from [`DrawList::parameters`]; those in the list, if
    /// any, were read back.
    GpuDriven,
}

/// What a technique wants drawn in one view.
#[derive(Clone, Debug)]
pub struct DrawList {
    /// The draws, those of one source and topology side by side.
    pub draws: Vec<Draw>,
    /// Instances, addressed by the draws' ranges.
    pub instances: Vec<Instance>,
    /// Geometry of this frame only.
    pub streamed: Geometry,
    /// Bits of explicit vertices' positions that are parts of a sample: 0 where all lie on samples. The corners of the
    /// list's triangles have as many, whatever their source.
    pub fraction_bits: u32,
    /// The height that heights of explicit vertices are relative to, metres. Near the eye's height, it keeps those
    /// around the eye exact where single precision would round them.
    pub height_base: f32,
    /// Changes to the resident geometry.
    pub uploads: Vec<Upload>,
    /// How the draws reach the device.
    pub submission: Submission,
    /// What the device is told of the view where it finds the draws itself.
    pub parameters: Vec<u32>,
    /// Land further from the eye in plan than this may be left out although it is in sight, metres: infinite unless a
    /// technique was asked for an end.
    pub reach_m: f64,
    /// What the view's tolerance was multiplied by because the list would not have fitted its limits: 1 where
    /// nothing was, infinite where no tolerance was kept.
    pub tolerance_scale: f64,
    /// Instances in sight that are coarser than the tolerance allows because something finer is not there yet.
    pub pending: usize,
}

/// The most that any list of a technique holds: buffers of this size are made once.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits {
    /// Draws in a list.
    pub draws: usize,
    /// Instances in a list.
    pub instances: usize,
    /// Streamed explicit vertices in a list.
    pub vertices: usize,
    /// Normals of streamed vertices in a list.
    pub normals: usize,
    /// Streamed indices in a list.
    pub indices: usize,
    /// Bytes of uploads in a list.
    pub upload_bytes: usize,
}

/// What a technique keeps on the device, and the room that its lists need there.
#[derive(Clone, Copy, Debug)]
pub struct DeviceGeometry<'a> {
    /// Geometry.
    pub geometry: &'a Geometry,
    /// The most of any list.
    pub limits: Limits,
    /// How the device finds draws itself, if it can.
    pub gpu_selection: Option<&'a GpuSelection>,
}

impl Default for DrawKinds {
    fn default() -> Self {
        Self { lattice: true, explicit: false, triangles: true, strips: false }
    }
}

impl DrawKinds {
    /// Triangles of explicit vertices, and no other draws.
    pub const EXPLICIT: Self = Self::explicit(Topology::Triangles);

    /// Explicit vertices in one topology, and no other draws.
    pub const fn explicit(topology: Topology) -> Self {
        let strips = matches!(topology, Topology::Strip);
        Self { lattice: false, explicit: true, triangles: !strips, strips }
    }

    /// Whether such a draw is among them.
    pub fn hold(&self, source: Source, topology: Topology) -> bool {
        let has_source = if source == Source::Lattice { self.lattice } else { self.explicit };
        let has_topology = if topology == Topology::Strip { self.strips } else { self.triangles };
        has_source && has_topology
    }
}

impl Topology {
    /// Triangles that `indices` indices make at most, degenerate ones included: ends of strips are not known.
    pub fn triangles(self, indices: usize) -> usize {
        match self {
            Topology::Triangles => indices / 3,
            Topology::Strip => indices.saturating_sub(2),
        }
    }
}

impl Draw {
    /// The same triangles in the same order as several draws of at most `triangles` (or one instance's
    /// indices cut there): pieces of work for those who walk them in parallel.
    pub fn parts(&self, triangles: usize) -> Vec<Draw> {
        let own = self.topology.triangles(self.indices.len());
        if own == 0 {
            return Vec::new();
        }
        let instances = self.instances.clone().step_by((triangles / own).max(1)).flat_map(|first| {
            let last = first.saturating_add((triangles / own).max(1) as u32).min(self.instances.end);
            self.index_parts(triangles).into_iter().map(move |indices| (indices, first..last))
        });
        instances.map(|(indices, instances)| Draw { indices, instances, ..self.clone() }).collect()
    }

    fn index_parts(&self, triangles: usize) -> Vec<Range<u32>> {
        // A strip is cut after an even number of triangles, so that the winding goes on as it was.
        let (step, shared) = match self.topology {
            Topology::Triangles => (3 * triangles.max(1), 0),
            Topology::Strip => (2 * triangles.div_ceil(2).max(1), 2),
        };
        let Range { start, end } = self.indices;
        let starts = (start..end - shared).step_by(step);
        starts.map(|first| first..first.saturating_add(step as u32 + shared).min(end)).collect()
    }
}

impl Default for DrawList {
    fn default() -> Self {
        Self {
            draws: Vec::new(),
            instances: Vec::new(),
            streamed: Geometry::default(),
            fraction_bits: 0,
            height_base: 0.0,
            uploads: Vec::new(),
            submission: Submission::default(),
            parameters: Vec::new(),
            reach_m: f64::INFINITY,
            tolerance_scale: 1.0,
            pending: 0,
        }
    }
}

impl DrawList {
    /// Empties the list and keeps its memory.
    pub fn clear(&mut self) {
        self.draws.clear();
        self.instances.clear();
        self.streamed.lattice.clear();
        self.streamed.vertices.clear();
        self.streamed.normals.clear();
        self.streamed.indices.clear();
        self.fraction_bits = 0;
        self.height_base = 0.0;
        self.uploads.clear();
        self.submission = Submission::default();
        self.parameters.clear();
        self.reach_m = f64::INFINITY;
        self.tolerance_scale = 1.0;
        self.pending = 0;
    }

    /// The encoding of its explicit vertices.
    pub fn vertex_format(&self) -> VertexFormat {
        VertexFormat { fraction_bits: self.fraction_bits as i32, height_base: self.height_base }
    }

    /// Height above zero of a vertex's height, metres. Exact where the base is 0, else rounded once.
    pub fn absolute_height(&self, height: f32) -> f32 {
        if self.height_base == 0.0 {
            return height;
        }
        (f64::from(height) + f64::from(self.height_base)) as f32
    }

    /// Triangles the list submits, degenerate ones included.
    pub fn triangles(&self) -> u64 {
        let of_draw = |d: &Draw| match (d.source, d.topology) {
            (Source::Streamed, Topology::Strip) => {
                let indices = &self.streamed.indices[d.indices.start as usize..d.indices.end as usize];
                indices.split(|&k| k == RESTART).map(|strip| d.topology.triangles(strip.len())).sum()
            }
            _ => d.topology.triangles(d.indices.len()),
        };
        self.draws.iter().map(|d| of_draw(d) as u64 * d.instances.len() as u64).sum()
    }

    /// Draw calls that the host records for the list: one for each run of draws of one source and topology, or
    /// one for each draw, or one for all that the device finds.
    pub fn commands(&self) -> usize {
        match self.submission {
            Submission::Direct => self.draws.len(),
            Submission::GpuDriven => 1,
            Submission::Indirect => {
                self.draws.chunk_by(|a, b| (a.source, a.topology) == (b.source, b.topology)).count()
            }
        }
    }

    /// Instances by level of detail, from the finest.
    pub fn levels(&self) -> Vec<usize> {
        let mut counts = Vec::new();
        for instance in &self.instances {
            let level = instance.level as usize;
            counts.resize(counts.len().max(level + 1), 0);
            counts[level] += 1;
        }
        counts
    }

    /// What the list holds, in the terms of [`Limits`].
    pub fn size(&self) -> Limits {
        let bytes = |upload: &Upload| match upload {
            Upload::Vertices(_, v) => size_of_val(v.as_slice()),
            Upload::Normals(_, n) => size_of_val(n.as_slice()),
            Upload::Indices(_, i) => size_of_val(i.as_slice()),
        };
        Limits {
            draws: self.draws.len(),
            instances: self.instances.len(),
            vertices: self.streamed.vertices.len(),
            normals: self.streamed.normals.len(),
            indices: self.streamed.indices.len(),
            upload_bytes: self.uploads.iter().map(bytes).sum(),
        }
    }
}

impl Limits {
    /// Whether nothing in `size` exceeds these limits.
    pub fn hold(&self, size: &Limits) -> bool {
        size.draws <= self.draws
            && size.instances <= self.instances
            && size.vertices <= self.vertices
            && size.normals <= self.normals
            && size.indices <= self.indices
            && size.upload_bytes <= self.upload_bytes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Instance, first index of a triangle, and whether a strip turns it over.
    fn triangles(draw: &Draw) -> Vec<(u32, u32, bool)> {
        let own = draw.topology.triangles(draw.indices.len()) as u32;
        let triangle = |draw: &Draw, k: u32| match draw.topology {
            Topology::Triangles => (draw.indices.start + 3 * k, false),
            Topology::Strip => (draw.indices.start + k, k % 2 == 1),
        };
        let of_instance = |i| (0..own).map(move |k| triangle(draw, k)).map(move |(first, over)| (i, first, over));
        draw.instances.clone().flat_map(of_instance).collect()
    }

    #[test]
    fn parts_are_the_whole_in_order() {
        for topology in [Topology::Triangles, Topology::Strip] {
            for count in [0, 3, 30, 33, 300] {
                let draw = Draw {
                    source: Source::Lattice,
                    topology,
                    indices: 7..7 + count,
                    instances: 2..11,
                    first_vertex: 0,
                };
                for size in [1, 2, 7, 16, 40, 1000] {
                    let parts = draw.parts(size);
                    let joined: Vec<_> = parts.iter().flat_map(triangles).collect();
                    assert_eq!(joined, triangles(&draw), "{topology:?}, {count} indices by {size}");
                    assert!(parts.iter().all(|p| triangles(p).len() <= size.next_multiple_of(2)));
                }
            }
        }
    }
}
