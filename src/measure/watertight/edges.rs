//! Edges of triangles: which are shared, which make the border, and whether the border is clean.

use std::collections::{HashMap, HashSet};

use rayon::prelude::*;

use super::counter_example::{CounterExample, Kind, refuted};
use crate::draw::expand::Drawn;

/// An edge of a triangle that no other triangle uses the other way round. The land is to the left of it, seen
/// from above with north up: an edge that runs south has it to the east.
#[derive(Clone, Copy, Debug)]
pub struct BorderEdge {
    /// Start.
    pub from: [i32; 2],
    /// End.
    pub to: [i32; 2],
    /// Its triangle.
    pub triangle: u32,
}

/// An edge with its triangle as one number, which sorts fast: from the top the two ends as [`packed`], the
/// direction (0 from the smaller end to the greater), the triangle (31 bits).
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

/// A lattice position in 48 bits.
pub fn packed([x, z]: [i32; 2]) -> u64 {
    (x as u64) << 24 | z as u64
}

/// The lattice position in the last 48 bits.
pub fn unpacked(bits: u64) -> [i32; 2] {
    [24, 0].map(|shift| (bits >> shift & 0xff_ffff) as i32)
}

/// The edges without a partner, and pairs that are not `joined`: by the triangles of both, and the edge's ends.
/// Refuted if a directed edge occurs twice.
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

/// Refuted if an end of a border edge lies strictly inside another border edge.
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

/// Converts a border with fraction bits to samples: consecutive edges in one direction become one.
///
/// # Errors
/// If a line of the border does not go from sample to sample.
pub fn between_samples(
    triangles: &[Drawn],
    border: Vec<BorderEdge>,
    fraction_bits: u32,
) -> Result<Vec<BorderEdge>, Box<CounterExample>> {
    let direction = |edge: &BorderEdge| {
        let along = [0, 1].map(|k| edge.to[k] - edge.from[k]);
        along.map(|n| n / gcd(along[0].unsigned_abs(), along[1].unsigned_abs()) as i32)
    };
    // Two edges may leave one place, in two directions: where two parts of the border touch.
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

pub fn gcd(a: u32, b: u32) -> u32 {
    if b == 0 { a } else { gcd(b, a % b) }
}
