//! Edges of triangles: finds those at the border of a surface, and T-junctions between them.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use super::counter_example::{CounterExample, Kind, refuted};
use crate::draw::expand::Drawn;

/// An edge that only one triangle has. Seen from above, the triangle lies to its left: an edge that runs south has its
/// triangle to the east.
#[derive(Clone, Copy, Debug)]
pub struct BorderEdge {
    /// Lattice position of the start.
    pub from: [i32; 2],
    /// Lattice position of the end.
    pub to: [i32; 2],
    /// Number of the triangle.
    pub triangle: u32,
}

/// An edge and its triangle in one integer, which sorts fast. From the highest bits on: both ends, [`packed`], the
/// smaller one first; the direction, 0 from the smaller end to the greater; the number of the triangle (31 bits).
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
struct Edge(u128);

impl Edge {
    fn new(from: [i32; 2], to: [i32; 2], triangle: u32) -> Self {
        let [from, to] = [packed(from), packed(to)].map(u128::from);
        let (low, high, backward) = if from < to { (from, to, 0) } else { (to, from, 1) };
        Self(low << 80 | high << 32 | backward << 31 | u128::from(triangle))
    }

    fn ends(self) -> [[i32; 2]; 2] {
        [80, 32].map(|shift| unpacked((self.0 >> shift) as u64))
    }

    fn same_ends(&self, other: &Edge) -> bool {
        self.0 >> 32 == other.0 >> 32
    }

    fn is_backward(self) -> bool {
        self.0 >> 31 & 1 == 1
    }

    fn triangle(self) -> u32 {
        self.0 as u32 & (u32::MAX >> 1)
    }

    fn border(self) -> BorderEdge {
        let [low, high] = self.ends();
        let (from, to) = if self.is_backward() { (high, low) } else { (low, high) };
        BorderEdge { from, to, triangle: self.triangle() }
    }
}

/// Packs a lattice position into 48 bits. Coordinates are from 0 to 2^24 − 1.
pub fn packed([x, z]: [i32; 2]) -> u64 {
    (x as u64) << 24 | z as u64
}

/// Unpacks a lattice position from the lowest 48 bits.
pub fn unpacked(bits: u64) -> [i32; 2] {
    [24, 0].map(|shift| (bits >> shift & 0xff_ffff) as i32)
}

/// Returns the border edges of a surface: edges of one triangle only, and both edges of a pair for which `joined`
/// returns false. `joined` gets the numbers of the two triangles and the ends of their common edge.
///
/// # Errors
/// If an edge occurs twice in the same direction.
pub fn border(
    triangles: &[Drawn],
    joined: impl Fn([u32; 2], [[i32; 2]; 2]) -> bool,
) -> Result<Vec<BorderEdge>, Box<CounterExample>> {
    let mut edges: Vec<Edge> = (0u32..).zip(triangles).flat_map(|(k, t)| edges_of(k, t)).collect();
    edges.par_sort_unstable();
    let mut border = Vec::new();
    for uses in edges.chunk_by(Edge::same_ends) {
        match uses {
            [only] => border.push(only.border()),
            [forth, back] if forth.is_backward() != back.is_backward() => {
                if !joined([forth.triangle(), back.triangle()], forth.ends()) {
                    border.extend([forth.border(), back.border()]);
                }
            }
            _ => {
                let twice = if uses[0].is_backward() == uses[1].is_backward() { &uses[..2] } else { &uses[1..3] };
                let text = format!("edge {:?} used {} times", uses[0].ends(), uses.len());
                return refuted(Kind::Overlap, triangles, twice.iter().map(|e| e.triangle()), text);
            }
        }
    }
    Ok(border)
}

fn edges_of(k: u32, triangle: &Drawn) -> [Edge; 3] {
    let [a, b, c] = triangle.corners.map(|corner| [corner.x, corner.z]);
    [Edge::new(a, b, k), Edge::new(b, c, k), Edge::new(c, a, k)]
}

/// Proves that no end of a border edge lies inside another border edge.
///
/// # Errors
/// If one does: a T-junction.
pub fn no_t_junction(triangles: &[Drawn], border: &[BorderEdge]) -> Result<(), Box<CounterExample>> {
    let ends: HashMap<_, _> = border.iter().flat_map(|e| [(e.from, e.triangle), (e.to, e.triangle)]).collect();
    for edge in border {
        let along = [0, 1].map(|k| edge.to[k] - edge.from[k]);
        let steps = gcd(along[0].unsigned_abs(), along[1].unsigned_abs()) as i32;
        for step in 1..steps {
            let inner = [0, 1].map(|k| edge.from[k] + along[k] / steps * step);
            if let Some(&other) = ends.get(&inner) {
                let text = format!("vertex {inner:?} inside edge {:?} {:?}", edge.from, edge.to);
                return refuted(Kind::TJunction, triangles, [edge.triangle, other], text);
            }
        }
    }
    Ok(())
}

/// Merges consecutive border edges of the same direction into lines between samples, and converts positions with
/// fraction bits to samples.
///
/// # Errors
/// If such a line does not start and end at a sample.
pub fn between_samples(
    triangles: &[Drawn],
    border: Vec<BorderEdge>,
    fraction_bits: u32,
) -> Result<Vec<BorderEdge>, Box<CounterExample>> {
    let direction = |edge: &BorderEdge| {
        let along = [0, 1].map(|k| edge.to[k] - edge.from[k]);
        along.map(|n| n / gcd(along[0].unsigned_abs(), along[1].unsigned_abs()) as i32)
    };
    // Two edges may start at the same position in different directions, where parts of the border touch.
    let next: HashMap<_, _> = border.iter().map(|edge| ((edge.from, direction(edge)), edge)).collect();
    let entered: HashSet<_> = border.iter().map(|edge| (edge.to, direction(edge))).collect();
    let starts = border.iter().filter(|edge| !entered.contains(&(edge.from, direction(edge))));
    let whole_line = |first: &BorderEdge| {
        let mut line = *first;
        while let Some(edge) = next.get(&(line.to, direction(first))) {
            line.to = edge.to;
        }
        let mask = (1 << fraction_bits) - 1;
        if line.from.iter().chain(&line.to).any(|n| n & mask != 0) {
            let text = format!("border {:?} {:?} does not go from sample to sample", line.from, line.to);
            return refuted(Kind::Gap, triangles, [line.triangle], text);
        }
        let [from, to] = [line.from, line.to].map(|at| at.map(|n| n >> fraction_bits));
        Ok(BorderEdge { from, to, ..line })
    };
    starts.map(whole_line).collect()
}

/// Returns the greatest common divisor.
pub fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}
