//! The draws of one view.

use super::draws::{Draw, RESTART, Source, Topology};
use super::geometry::{Geometry, Upload};
use super::layout::{Instance, VertexFormat};
use super::limits::Limits;

/// Submission of the draws. It does not change the triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Submission {
    /// One indirect command buffer per pipeline.
    #[default]
    Indirect,
    /// One recorded draw call per draw.
    Direct,
    /// Compute shaders find draws and instances ([`GpuSelection`](super::GpuSelection)) from
    /// [`DrawList::parameters`]. Draws in the list, if any, were read back.
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
