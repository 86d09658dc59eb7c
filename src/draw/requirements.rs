//! The pipelines that the lists of a technique need.

use super::draws::{Source, Topology};

/// Morphing of lattice vertices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Morph {
    /// Vertices do not morph.
    #[default]
    No,
    /// To the next coarser level, or onto coarser sides, by the [`weights`](super::weights) of their instance.
    ByInstance,
    /// To the next coarser level, each vertex by its own [`distance`](super::distance).
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

/// Source of the normals that light a technique's triangles.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Normals {
    /// Computed from the height texture for each pixel.
    #[default]
    Texture,
    /// Interpolated between the vertices ([`Geometry::normals`](super::Geometry::normals)).
    Vertices,
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
