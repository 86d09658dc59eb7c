//! Proves that a floor and a ceiling enclose a cave: each is one surface, and they share their border edges.
//!
//! [`prove_cave`] verifies exactly:
//!
//! 1. Triangles that face up form one surface, by steps 1 to 5 of the [parent module](super). So do those that face
//!    down, after turning them over.
//! 2. In plan view, both surfaces consist of the same triangles, and no vertex of the ceiling is below that of the
//!    floor.
//! 3. Border edges of floor and ceiling have the same ends in space. Where they differ, the cave is open. This is
//!    allowed only at the border of the field and out of view.

use super::counter_example::{CounterExample, Kind, refuted};
use super::edges::{self, BorderEdge};
use super::sweep;
use super::vertices::{faces_up, on_the_field, one_height_a_vertex};
use crate::draw::expand::Drawn;
use crate::height::Field;
use crate::height::surface::{Corner, doubled_area};
use crate::view::{Aabb, Containment, Frustum};

/// Result of a cave's proof.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CaveProof {
    /// Number of triangles of the floor; the ceiling has as many.
    pub pairs: usize,
    /// Twice the area of the floor in plan view, samples².
    pub doubled_area: i64,
    /// Number of border edges that floor and ceiling share.
    pub seam_edges: usize,
    /// Number of border edges at which the cave is open: at the border of the field or out of view.
    pub open_edges: usize,
}

/// Proves that triangles are the floor and the ceiling of a cave, enclosing the space between them.
///
/// # Errors
/// If they do not; the error has the triangles at fault.
///
/// # Panics
/// As [`super::prove`].
pub fn prove_cave(field: &Field, frustum: &Frustum, triangles: &[Drawn]) -> Result<CaveProof, Box<CounterExample>> {
    let turned = |t: &Drawn| Drawn { corners: [t.corners[0], t.corners[2], t.corners[1]], ..*t };
    let (floor, ceiling): (Vec<_>, Vec<_>) = triangles.iter().partition(|t| doubled_area(&t.corners) > 0);
    let mut surfaces = [floor, ceiling.iter().map(turned).collect()];
    surfaces.iter_mut().for_each(|surface| surface.sort_unstable_by_key(in_plan));
    let [of_floor, of_ceiling] = [&surfaces[0], &surfaces[1]].map(|surface| one_surface(field, surface));
    let (of_floor, of_ceiling) = (of_floor?, of_ceiling?);
    one_over_the_other(&surfaces)?;
    let [low, high] = [sorted(&surfaces[0], of_floor), sorted(&surfaces[1], of_ceiling)];
    let mut seam_edges = 0;
    for (below, above) in low.iter().zip(&high) {
        if below.1 == above.1 {
            seam_edges += 1;
        } else if !is_open(field, frustum, &below.1, &above.1) {
            let both = [surfaces[0][below.0.triangle as usize], surfaces[1][above.0.triangle as usize]];
            let text = format!("floor and ceiling end apart at {:?} {:?}", below.0.from, below.0.to);
            return refuted(Kind::Gap, &both, [0, 1], text);
        }
    }
    let doubled_area = surfaces[0].iter().map(|t| doubled_area(&t.corners)).sum();
    Ok(CaveProof { pairs: surfaces[0].len(), doubled_area, seam_edges, open_edges: low.len() - seam_edges })
}

/// Returns a triangle's corners in plan view in ascending order, to compare and sort triangles.
fn in_plan(triangle: &Drawn) -> [u64; 3] {
    let mut corners = triangle.corners.map(|c| edges::packed([c.x, c.z]));
    corners.sort_unstable();
    corners
}

/// Proves that triangles are one surface, and returns its border.
fn one_surface(field: &Field, triangles: &[Drawn]) -> Result<Vec<BorderEdge>, Box<CounterExample>> {
    on_the_field(field, triangles, 0)?;
    faces_up(triangles)?;
    one_height_a_vertex(triangles)?;
    let border = edges::border(triangles, |_, _| true)?;
    edges::no_t_junction(triangles, &border)?;
    sweep::strips(triangles, &border)?;
    Ok(border)
}

/// Fails if floor and ceiling do not consist of the same triangles in plan view, or the ceiling is below the floor.
/// Both lists are sorted by [`in_plan`].
fn one_over_the_other([floor, ceiling]: &[Vec<Drawn>; 2]) -> Result<(), Box<CounterExample>> {
    let differ = floor.iter().zip(ceiling).position(|(low, high)| in_plan(low) != in_plan(high));
    let first = differ.or((floor.len() != ceiling.len()).then_some(floor.len().min(ceiling.len())));
    if let Some(k) = first {
        let alone: Vec<_> = floor.get(k).or(ceiling.get(k)).into_iter().copied().collect();
        return refuted(Kind::Gap, &alone, [0], "floor or ceiling alone".into());
    }
    let height = |t: &Drawn, at: &Corner| t.corners.iter().find(|c| (c.x, c.z) == (at.x, at.z)).map(|c| c.y);
    let crosses = |(low, high): &(&Drawn, &Drawn)| low.corners.iter().any(|c| height(high, c) < Some(c.y));
    match floor.iter().zip(ceiling).find(crosses) {
        Some((low, high)) => refuted(Kind::Overlap, &[*low, *high], [0, 1], "the ceiling is below the floor".into()),
        None => Ok(()),
    }
}

/// Sorts a border by its edges in plan view, and adds the heights of their ends.
fn sorted(triangles: &[Drawn], border: Vec<BorderEdge>) -> Vec<(BorderEdge, [Corner; 2])> {
    let corner = |edge: &BorderEdge, [x, z]: [i32; 2]| {
        let corners = triangles[edge.triangle as usize].corners;
        corners.into_iter().find(|c| (c.x, c.z) == (x, z)).unwrap_or(Corner { x, z, y: f32::NAN })
    };
    let mut ends: Vec<_> =
        border.into_iter().map(|edge| (edge, [corner(&edge, edge.from), corner(&edge, edge.to)])).collect();
    // Each directed edge occurs once, and the borders of both surfaces have the same edges.
    ends.sort_unstable_by_key(|(edge, _)| (edge.from, edge.to));
    ends
}

/// Returns true if a cave may be open at an edge: at the border of the field, or out of view.
fn is_open(field: &Field, frustum: &Frustum, below: &[Corner; 2], above: &[Corner; 2]) -> bool {
    let last = field.size().map(|n| n as i32 - 1);
    let is_rim = |n: [i32; 2], last: i32| n == [0; 2] || n == [last; 2];
    if is_rim(below.map(|c| c.x), last[0]) || is_rim(below.map(|c| c.z), last[1]) {
        return true;
    }
    let points = below.iter().chain(above).map(|c| field.world_at(f64::from(c.x), f64::from(c.z), f64::from(c.y)));
    let bounds = points.map(|p| Aabb { min: p, max: p }).reduce(|a, b| a.union(&b));
    bounds.is_some_and(|bounds| frustum.contains(&bounds) == Containment::Outside)
}
