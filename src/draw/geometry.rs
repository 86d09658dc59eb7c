//! Vertices and indices, and changes to those that stay on the device.

use super::layout::{ExplicitVertex, LatticeVertex, VertexNormals};

/// Vertices and indices.
#[derive(Clone, Debug, Default)]
pub struct Geometry {
    /// Vertices without heights, for [`Source::Lattice`](super::Source::Lattice).
    pub lattice: Vec<LatticeVertex>,
    /// Vertices with heights, for [`Source::Resident`](super::Source::Resident) and
    /// [`Source::Streamed`](super::Source::Streamed).
    pub vertices: Vec<ExplicitVertex>,
    /// Normals of the explicit vertices, one each, if they light them; else empty.
    pub normals: Vec<VertexNormals>,
    /// Indices into `lattice` or `vertices`, depending on the draw's source.
    pub indices: Vec<u32>,
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
