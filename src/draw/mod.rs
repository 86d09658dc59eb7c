//! The draw list of a frame, as plain data. It depends neither on the techniques that fill it nor on the renderer.

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

/// The vertices that a draw's indices address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Source {
    /// [`Geometry::lattice`] of the resident geometry, once per instance, displaced by the height texture.
    Lattice,
    /// [`Geometry::vertices`] of the resident geometry.
    Resident,
    /// [`Geometry::vertices`] of the list's own streamed geometry.
    Streamed,
}

/// Primitive topology of a draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Topology {
    /// Three indices a triangle, counter-clockwise seen from above.
    Triangles,
    /// Each index makes a triangle with the two before it, with alternating winding. [`RESTART`] ends a strip. The next
    /// strip begins after an even number of indices, so that its position in the draw gives its winding.
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
    /// Normals of the explicit vertices, one each, if they light them; else empty.
    pub normals: Vec<VertexNormals>,
    /// Indices into `lattice` or `vertices`, depending on the draw's source.
    pub indices: Vec<u32>,
}

/// One indexed, instanced draw.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Draw {
    /// The vertices that the indices address.
    pub source: Source,
    /// Primitive topology.
    pub topology: Topology,
    /// Range of indices.
    pub indices: Range<u32>,
    /// Range of the list's instances.
    pub instances: Range<u32>,
    /// Added to each index, so that meshes stored one after the other share one pattern of indices.
    pub first_vertex: u32,
}

/// A change to the resident geometry that is made before the list is drawn.
#[derive(Clone, Debug)]
pub enum Upload {
    /// Overwrites resident explicit vertices from this one on.
    Vertices(u32, Vec<ExplicitVertex>),
    /// Overwrites normals of resident vertices from this one on.
    Normals(u32, Vec<VertexNormals>),
    /// Overwrites resident indices from this one on.
    Indices(u32, Vec<u32>),
}

/// Morphing of lattice vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Morph {
    /// Vertices do not morph.
    #[default]
    No,
    /// To the next coarser level, or onto coarser sides, by the [`weights`] of their instance.
    ByInstance,
    /// To the next coarser level, each vertex by its own [`distance`].
    ByDistance,
}

/// Joints between the meshes of a list.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Seams {
    /// Neighbours share whole edges with the same ends: one surface without gaps.
    #[default]
    Shared,
    /// Neighbours have edges of their own. A skirt hangs from the higher edge down to the lower one.
    Skirts,
}

/// Hidden-surface removal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum DepthMode {
    /// A depth buffer: draws come in any order.
    #[default]
    Buffer,
    /// Painter's algorithm: the farthest triangle is drawn first, and later ones cover it.
    Painter,
}

/// The kinds of draws that a technique's lists hold. Each needs a pipeline.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DrawKinds {
    /// Draws of [`Source::Lattice`].
    pub lattice: bool,
    /// Draws of [`Source::Resident`] or [`Source::Streamed`], which share a pipeline.
    pub explicit: bool,
    /// Draws of [`Topology::Triangles`].
    pub triangles: bool,
    /// Draws of [`Topology::Strip`].
    pub strips: bool,
}

/// The pipelines that a technique's lists need.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PipelineRequirements {
    /// Kinds of draws in the lists.
    pub draws: DrawKinds,
    /// Morphing of lattice vertices.
    pub morph: Morph,
    /// Joints between meshes. They decide which proof the lists pass ([`watertight`](crate::measure::watertight)).
    pub seams: Seams,
    /// Source of normals.
    pub normals: Normals,
    /// Hidden-surface removal.
    pub depth_mode: DepthMode,
}

/// Submission of the draws. It does not change the triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Submission {
    /// One indirect command buffer per pipeline.
    #[default]
    Indirect,
    /// One recorded draw call per draw.
    Direct,
    /// Compute shaders find draws and instances ([`GpuSelection`]) from [`DrawList::parameters`]. Draws in the list, if
    /// any, were read back.
    GpuDriven,
}

/// The draws of one view.
#[derive(Clone, Debug)]
pub struct DrawList {
    /// The draws, grouped by source and topology.
    pub draws: Vec<Draw>,
    /// Instances, addressed by the draws' ranges.
    pub instances: Vec<Instance>,
    /// Geometry of this frame only.
    pub streamed: Geometry,
    /// Binary digits of a fraction of a sample in positions of explicit vertices: 0 if all lie on samples. The corners
    /// of all triangles of the list have as many.
    pub fraction_bits: u32,
    /// The height that vertex heights are relative to, metres. A base near the eye's height keeps heights around the eye
    /// exact where single precision would round them.
    pub height_base: f32,
    /// Changes to the resident geometry.
    pub uploads: Vec<Upload>,
    /// Submission of the draws.
    pub submission: Submission,
    /// Words of shader parameters for [`Submission::GpuDriven`].
    pub parameters: Vec<u32>,
    /// Draw distance in plan, metres: infinite unless a setting of the technique limits it.
    pub reach_m: f64,
    /// Factor on the view's tolerance that made the list fit its limits: 1 if it fitted at once, infinite if it keeps no
    /// tolerance.
    pub tolerance_scale: f64,
    /// Instances in view that are coarser than the tolerance allows because finer data is still being built.
    pub pending: usize,
}

/// Upper bounds of all lists of a technique. Buffers of this size are made once.
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

/// Geometry of a technique that stays on the device, and the buffer sizes that its lists need.
#[derive(Clone, Copy, Debug)]
pub struct DeviceGeometry<'a> {
    /// Geometry.
    pub geometry: &'a Geometry,
    /// Upper bounds of its lists.
    pub limits: Limits,
    /// Selection on the device, if the technique has one.
    pub gpu_selection: Option<&'a GpuSelection>,
}

impl Default for DrawKinds {
    fn default() -> Self {
        Self { lattice: true, explicit: false, triangles: true, strips: false }
    }
}

impl DrawKinds {
    /// Triangle lists of explicit vertices only.
    pub const EXPLICIT: Self = Self::explicit(Topology::Triangles);

    /// Explicit vertices in one topology only.
    pub const fn explicit(topology: Topology) -> Self {
        let strips = matches!(topology, Topology::Strip);
        Self { lattice: false, explicit: true, triangles: !strips, strips }
    }

    /// Returns true if such draws occur.
    pub fn hold(&self, source: Source, topology: Topology) -> bool {
        let has_source = if source == Source::Lattice { self.lattice } else { self.explicit };
        let has_topology = if topology == Topology::Strip { self.strips } else { self.triangles };
        has_source && has_topology
    }
}

impl Topology {
    /// Upper bound of the triangles that `indices` indices make, degenerate ones included. It ignores ends of strips.
    pub fn triangles(self, indices: usize) -> usize {
        match self {
            Topology::Triangles => indices / 3,
            Topology::Strip => indices.saturating_sub(2),
        }
    }
}

impl Draw {
    /// Splits the draw into draws of at most `triangles` each, with the same triangles in the same order. Parallel loops
    /// over triangles use them as units of work.
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
        // A strip is cut after an even number of triangles, which keeps the winding.
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

    /// Number of submitted triangles, degenerate ones included.
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

    /// Number of draw calls that the host records: one for each run of draws of one source and topology, one for each
    /// draw, or one in all, depending on the submission.
    pub fn commands(&self) -> usize {
        match self.submission {
            Submission::Direct => self.draws.len(),
            Submission::GpuDriven => 1,
            Submission::Indirect => {
                self.draws.chunk_by(|a, b| (a.source, a.topology) == (b.source, b.topology)).count()
            }
        }
    }

    /// Number of instances of each level of detail, from the finest.
    pub fn levels(&self) -> Vec<usize> {
        let mut counts = Vec::new();
        for instance in &self.instances {
            let level = instance.level as usize;
            counts.resize(counts.len().max(level + 1), 0);
            counts[level] += 1;
        }
        counts
    }

    /// Sizes of the list.
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
    /// Returns true if no value of `size` exceeds these limits.
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
