//! Proves that skirts cover the gaps between edges that lie above each other.
//!
//! Edges that two triangles do not share in space are cut at the samples on them. Two parts over the same segment, one
//! in each direction, form a seam: as at a shared edge, the number of covering triangles is equal on both sides. All
//! other parts form the border. Heights are linear along a segment, so it suffices to compare them at its two ends.
//!
//! Where one side of a seam is higher, skirts that face away from it must cover the gap down to the other side. The
//! first skirt must start at the upper edge, bit by bit, and each further one where the previous one ends. At samples
//! without data nothing is drawn, and gaps are allowed.

use rayon::prelude::*;

use super::counter_example::{CounterExample, Kind, refuted};
use super::edges::{self, BorderEdge};
use crate::draw::expand::Drawn;
use crate::height::Field;
use crate::height::surface::{Corner, Triangle};

/// A segment between adjacent samples on a line, as [`edges::packed`] positions, the smaller one first.
type Way = [u64; 2];

/// Heights at the two ends of a segment, metres.
type Heights = [f64; 2];

/// Part of an edge over one segment.
#[derive(Clone, Copy)]
struct Part {
    way: Way,
    /// True if the edge runs from the greater position to the smaller one.
    is_backward: bool,
    heights: Heights,
    triangle: u32,
}

/// Part of a skirt, an upright triangle, over one segment.
#[derive(Clone, Copy)]
struct Wall {
    way: Way,
    /// Direction of the edge that this side of the skirt belongs to, as in [`Part`].
    is_backward: bool,
    top: Heights,
    bottom: Heights,
}

/// Returns the border: the parts of edges that are neither shared nor part of a seam.
///
/// # Errors
/// If triangles overlap along an edge, or skirts do not cover a seam.
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

/// Proves that skirts cover the gap where `upper` is above `lower`. `walls` are sorted by segment and direction.
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

/// Returns the segments of the line between two corners, with the line's heights. Both directions give the same values,
/// bit by bit.
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

/// Returns the parts of an upright triangle with two corners above each other; none for other triangles.
fn walls(triangle: &Triangle) -> impl Iterator<Item = Wall> + use<> {
    let [a, b, c] = *triangle;
    let above = |p: &Corner, q: &Corner| (p.x, p.z) == (q.x, q.z);
    // The two corners above each other in the order of the winding, then the third.
    let pairs = [[a, b, c], [b, c, a], [c, a, b]].into_iter().find(|[p, q, _]| above(p, q));
    pairs.into_iter().flat_map(|[p, q, far]| {
        let (upper, lower) = if p.y > q.y { (p, q) } else { (q, p) };
        let [here, there] = [p, far].map(|corner| edges::packed([corner.x, corner.z]));
        // If the winding goes down at `here` and then to `there`, the triangle faces to the right of that direction,
        // away from an edge that runs in it.
        let is_backward = (p.y > q.y) != (here < there);
        let lines = along(upper, far).zip(along(lower, far));
        lines.map(move |((way, top), (_, bottom))| Wall { way, is_backward, top, bottom })
    })
}
