//! Draws: ranges of indices and instances that make triangles.

use std::ops::Range;

/// The vertices that a draw's indices address.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Source {
    /// [`Geometry::lattice`](super::Geometry::lattice) of the resident geometry, once per instance, displaced by the
    /// height texture.
    Lattice,
    /// [`Geometry::vertices`](super::Geometry::vertices) of the resident geometry.
    Resident,
    /// [`Geometry::vertices`](super::Geometry::vertices) of the list's own streamed geometry.
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
