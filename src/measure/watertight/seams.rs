//! Gaps between edges, and the skirts that hide them.
//!
//! All edges but those that two triangles share with both ends in space are cut at the samples they pass. Two parts over
//! the same way, one forth and one back, are a seam: there m is the same on both sides, as where an edge is shared.
//! The others make up the border. Between its two ends everything that lies over a part is straight, so that what
//! holds at both ends holds at every point between. Where one side of a seam is higher, upright triangles that face
//! away from it must cover the way down to the other side: the first begins at the edge, to the bit, each further
//! one where the one before it ends. At a sample without data nothing is drawn, and there seams may gape.

use rayon::prelude::*;

use super::counter_example::{CounterExample, Kind, refuted};
use super::edges::{self, BorderEdge};
use crate::draw::expand::Drawn;
use crate::height::Field;
use crate::height::surface::{Corner, Triangle};

/// The way from one sample to the next one on a line, the smaller position first, as [`edges::packed`].
type Way = [u64; 2];

/// Heights at the two ends of a way, metres.
type Heights = [f64; 2];

/// Part of an edge.
#[derive(Clone, Copy)]
struct Part {
    way: Way,
    /// True if the edge runs the other way.
    is_backward: bool,
    heights: Heights,
    triangle: u32,
}

/// Part of an upright triangle.
#[derive(Clone, Copy)]
struct Wall {
    way: Way,
    /// Of the edge that it hangs from, if it faces away from it.
    is_backward: bool,
    top: Heights,
    bottom: Heights,
}

/// The parts of edges that lie along nothing else. Refuted if land is covered twice along an edge, or a seam gapes.
pub fn border(field: &Field, triangles: &[Drawn], skirts: &[Drawn]) -> Result<Vec<BorderEdge>, Box<CounterExample>> {
    let joined = |of: [u32; 2], ends: [[i32; 2]; 2]| {
        let [a, b] = of.map(|k| ends.map(|end| corner_at(&triangles[k as usize].corners, end).y.to_bits()));
        a == b
    };
    let open = edges::border(triangles, joined)?;
    let mut parts: Vec<Part> = open.iter().flat_map(|edge| parts(triangles, edge)).collect();
    parts.par_sort_unstable_by_key(|part| (part.way, part.is_backward, part.triangle));
    let mut walls: Vec<Wall> = skirts.iter().flat_map(|skirt| walls(&skirt.corners)).collect();
    walls.par_sort_unstable_by_key(|wall| (wall.way, wall.is_backward));
    let mut border = Vec::new();
    for parts in parts.chunk_by(|a, b| a.way == b.way) {
        match parts {
            [only] => border.push(only.border()),
            [forth, back] if forth.is_backward != back.is_backward => {
                hidden(field, triangles, &walls, forth, back)?;
                hidden(field, triangles, &walls, back, forth)?;
            }
            _ => {
                let text = format!("{} edges along {:?}", parts.len(), parts[0].way.map(edges::unpacked));
                return refuted(Kind::Overlap, triangles, parts.iter().map(|part| part.triangle), text);
            }
        }
    }
    Ok(border)
}

/// Refuted if the upper part is above the lower one and no skirt of it reaches down to that.
fn hidden(
    field: &Field,
    triangles: &[Drawn],
    walls: &[Wall],
    upper: &Part,
    lower: &Part,
) -> Result<(), Box<CounterExample>> {
    let ends = upper.way.map(edges::unpacked);
    if ends.iter().any(|&[x, z]| field.is_hole(x as u32, z as u32)) {
        return Ok(());
    }
    let side = (upper.way, upper.is_backward);
    let first = walls.partition_point(|wall| (wall.way, wall.is_backward) < side);
    let own = walls[first..].iter().take_while(|wall| (wall.way, wall.is_backward) == side);
    let mut reached = upper.heights;
    while (0..2).any(|k| reached[k] > lower.heights[k]) {
        let Some(next) = own.clone().find(|wall| wall.top == reached && wall.bottom != reached) else {
            let gap = (0..2).map(|k| reached[k] - lower.heights[k]).fold(0.0, f64::max);
            let text = format!("{gap} m between {:?} and {:?} at {ends:?} are open", reached, lower.heights);
            return refuted(Kind::Seam, triangles, [upper.triangle, lower.triangle], text);
        };
        reached = next.bottom;
    }
    Ok(())
}

impl Part {
    fn border(&self) -> BorderEdge {
        let [low, high] = self.way.map(edges::unpacked);
        let (from, to) = if self.is_backward { (high, low) } else { (low, high) };
        BorderEdge { from, to, triangle: self.triangle }
    }
}

fn corner_at(triangle: &Triangle, at: [i32; 2]) -> Corner {
    *triangle.iter().find(|corner| [corner.x, corner.z] == at).expect("an end of one of its edges")
}

/// The ways along a line between two corners, with its heights there. The same for both directions, to the bit.
fn along(a: Corner, b: Corner) -> impl Iterator<Item = (Way, Heights)> {
    let packed = |corner: Corner| edges::packed([corner.x, corner.z]);
    let [low, high] = if packed(a) < packed(b) { [a, b] } else { [b, a] };
    let apart = [high.x - low.x, high.z - low.z];
    let steps = edges::gcd(apart[0].unsigned_abs(), apart[1].unsigned_abs()) as i32;
    let position = move |k: i32| edges::packed([low.x + apart[0] / steps * k, low.z + apart[1] / steps * k]);
    let height = move |k: i32| {
        let part = f64::from(k) / f64::from(steps);
        f64::from(low.y) * (1.0 - part) + f64::from(high.y) * part
    };
    (0..steps).map(move |k| ([k, k + 1].map(position), [k, k + 1].map(height)))
}

fn parts(triangles: &[Drawn], edge: &BorderEdge) -> impl Iterator<Item = Part> + use<> {
    let &BorderEdge { from, to, triangle } = edge;
    let is_backward = edges::packed(from) > edges::packed(to);
    let [a, b] = [from, to].map(|end| corner_at(&triangles[triangle as usize].corners, end));
    along(a, b).map(move |(way, heights)| Part { way, is_backward, heights, triangle })
}

/// The parts of an upright triangle with two corners one above the other; none of another one.
fn walls(triangle: &Triangle) -> impl Iterator<Item = Wall> + use<> {
    let [a, b, c] = *triangle;
    let above = |p: &Corner, q: &Corner| (p.x, p.z) == (q.x, q.z);
    // Two corners in one place, in the order of the winding, and then the third.
    let pairs = [[a, b, c], [b, c, a], [c, a, b]].into_iter().find(|[p, q, _]| above(p, q));
    pairs.into_iter().flat_map(|[p, q, far]| {
        let (upper, lower) = if p.y > q.y { (p, q) } else { (q, p) };
        let [here, there] = [p, far].map(|corner| edges::packed([corner.x, corner.z]));
        // Down here and on to there, it faces to the right of that way: it hangs from an edge that goes there.
        let is_backward = (p.y > q.y) != (here < there);
        let lines = along(upper, far).zip(along(lower, far));
        lines.map(move |((way, top), (_, bottom))| Wall { way, is_backward, top, bottom })
    })
}
