//! Triangles of the rows of pages of a frame, and their draws: one a row.

use crate::draw::{Draw, DrawList, ExplicitVertex, Geometry, Instance, Source, Topology};

/// Maximum number of triangles of a frame, for which buffers are allocated. The tolerance is scaled until they suffice.
pub const MAX_TRIANGLES: usize = 1 << 21;

/// Vertices and indices of a part of a frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Stream {
    /// Vertices, each once.
    pub vertices: Vec<ExplicitVertex>,
    /// Three indices per triangle, nearest first, relative to the first vertex of their row.
    pub indices: Vec<u32>,
}

impl Stream {
    /// Returns the number of vertices and of indices.
    pub fn lengths(&self) -> [usize; 2] {
        [self.vertices.len(), self.indices.len()]
    }

    /// Empties it and keeps its memory.
    pub fn clear(&mut self) {
        self.vertices.clear();
        self.indices.clear();
    }
}

/// Concatenates all streams. Indices count from the first vertex of their own stream. Both arrays have about the same
/// size, so one core copies the vertices and another the indices.
pub fn join(streams: &[&Stream], into: &mut Geometry) {
    let Geometry { vertices, indices, .. } = into;
    vertices.clear();
    indices.clear();
    rayon::join(
        || streams.iter().for_each(|stream| vertices.extend_from_slice(&stream.vertices)),
        || streams.iter().for_each(|stream| indices.extend_from_slice(&stream.indices)),
    );
}

/// Appends one draw of each row, from the rows' numbers of vertices and indices.
pub fn push_draws(lengths: &[[usize; 2]], list: &mut DrawList) {
    let [mut first_vertex, mut first] = [0; 2];
    for (batch, [vertices, indices]) in (0u32..).zip(lengths.iter().map(|own| own.map(|n| n as u32))) {
        list.instances.push(Instance { batch, ..Instance::default() });
        let (source, topology) = (Source::Streamed, Topology::Triangles);
        let (indices, instances) = (first..first + indices, batch..batch + 1);
        first = indices.end;
        list.draws.push(Draw { source, topology, indices, instances, first_vertex });
        first_vertex += vertices;
    }
}
