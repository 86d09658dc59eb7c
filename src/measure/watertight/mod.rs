//! Proves that the drawn triangles are one watertight surface, exactly, on the integer lattice of the samples.
//! Otherwise returns triangles that show the fault.
//!
//! Let m be the number of triangles that cover a point in plan view. [`prove`] verifies exactly:
//!
//! 1. Every corner lies on the field, and every triangle faces up.
//! 2. Every vertex has the same height, bit by bit, in all triangles around it.
//! 3. Every directed edge occurs once. An edge that occurs in both directions joins two triangles, and m is equal on
//!    both sides of it. All other edges form the border.
//! 4. No vertex of the border lies inside an edge of the border: there are no T-junctions. By 2 to 4, triangles that
//!    touch along a line share whole edges with the same ends in space: there are no cracks.
//! 5. Since m is 0 outside the field and changes only across the border, a sweep along the border over all rows proves
//!    that m is 0 or 1 everywhere: no point is covered twice.
//! 6. Where m is 0, every triangle of the samples' surface with data is outside the frustum, by [`Frustum::contains`]
//!    of its bounding box: nothing in view is missing. Culling by larger boxes passes, culling of visible terrain does
//!    not.
//!
//! The border around culled terrain and holes may thus have any shape. If the whole field is in view, all of it must be
//! covered, and [`Proof::doubled_area`] is twice the area of the field.
//!
//! Surfaces with skirts have gaps between edges. [`prove_with_skirts`] replaces steps 2 to 4 by a proof that skirts
//! cover these gaps.

pub mod cave;
pub mod counter_example;
mod edges;
mod seams;
mod sweep;
mod vertices;

use std::io::{self, Write};

use crate::draw::expand::{self, Drawn};
use crate::draw::layout::Frame;
use crate::draw::{DrawList, Geometry, Seams};
use crate::height::Field;
use crate::height::surface::{self, Triangle, doubled_area};
use crate::view::{Frustum, View};

pub use self::counter_example::{CounterExample, Kind};
use self::vertices::{faces_up, on_the_field, one_height_a_vertex};

/// Result of a proof.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Proof {
    /// Number of triangles.
    pub triangles: usize,
    /// Twice the covered area in plan view, samples²; of a cave, that of its floor.
    pub doubled_area: i64,
    /// Number of border edges; with skirts, of their parts from sample to sample.
    pub border_edges: usize,
}

/// Proves that triangles are one surface without gaps in view. Needs about 100 bytes per triangle.
///
/// Positions have `fraction_bits` fraction bits. If there are any, the border must consist of straight lines between
/// samples, on which vertices may lie anywhere.
///
/// # Errors
/// If they are not; the error has the triangles at fault.
///
/// # Panics
/// If there are more than 2^31 triangles, or a side has more than 2^24 positions.
pub fn prove(
    field: &Field,
    frustum: &Frustum,
    triangles: &[Drawn],
    fraction_bits: u32,
) -> Result<Proof, Box<CounterExample>> {
    assert!(field.size().iter().all(|&n| n <= 1 << (24 - fraction_bits)) && triangles.len() <= 1 << 31);
    let border = one_surface(field, triangles, fraction_bits).map_err(|mut found| {
        if fraction_bits > 0 {
            found.text += &format!(", in {}ths of a sample", 1 << fraction_bits);
        }
        found
    })?;
    let strips = sweep::strips(triangles, &border)?;
    sweep::no_gap(field, frustum, &strips)?;
    let doubled_area: i64 = triangles.iter().map(|t| doubled_area(&t.corners)).sum();
    let doubled_area = doubled_area >> (2 * fraction_bits);
    Ok(Proof { triangles: triangles.len(), doubled_area, border_edges: border.len() })
}

/// Verifies steps 1 to 4, and returns the border in samples.
fn one_surface(
    field: &Field,
    triangles: &[Drawn],
    fraction_bits: u32,
) -> Result<Vec<edges::BorderEdge>, Box<CounterExample>> {
    on_the_field(field, triangles, fraction_bits)?;
    faces_up(triangles)?;
    one_height_a_vertex(triangles)?;
    let border = edges::border(triangles, |_, _| true)?;
    edges::no_t_junction(triangles, &border)?;
    if fraction_bits == 0 { Ok(border) } else { edges::between_samples(triangles, border, fraction_bits) }
}

/// Proves that triangles are one surface without gaps in view, except for gaps between edges above each other that
/// skirts cover. `skirts` are upright triangles ([`expand::skirts`]).
///
/// # Errors
/// As [`prove`].
///
/// # Panics
/// As [`prove`].
pub fn prove_with_skirts(
    field: &Field,
    frustum: &Frustum,
    triangles: &[Drawn],
    skirts: &[Drawn],
) -> Result<Proof, Box<CounterExample>> {
    assert!(field.size().iter().all(|&n| n <= 1 << 24) && triangles.len() <= 1 << 31);
    on_the_field(field, triangles, 0)?;
    faces_up(triangles)?;
    let border = seams::border(field, triangles, skirts)?;
    let strips = sweep::strips(triangles, &border)?;
    sweep::no_gap(field, frustum, &strips)?;
    let doubled_area = triangles.iter().map(|t| doubled_area(&t.corners)).sum();
    Ok(Proof { triangles: triangles.len(), doubled_area, border_edges: border.len() })
}

/// Proves that the triangles of a draw list are watertight in a view, up to the list's draw distance. `seams` is the
/// way in which the technique joins its meshes.
///
/// # Errors
/// As [`prove`].
///
/// # Panics
/// As [`prove`].
pub fn prove_list(
    field: &Field,
    view: &View,
    seams: Seams,
    resident: &Geometry,
    list: &DrawList,
) -> Result<Proof, Box<CounterExample>> {
    let (frame, frustum) = (Frame::placing(field, view), view.frustum().within(view.eye, list.reach_m));
    let triangles = expand::triangles(field, &frame, resident, list);
    if field.ceiling().is_some() {
        let cave::CaveProof { pairs, doubled_area, seam_edges, open_edges } =
            cave::prove_cave(field, &frustum, &triangles)?;
        return Ok(Proof { triangles: 2 * pairs, doubled_area, border_edges: seam_edges + open_edges });
    }
    match seams {
        Seams::Shared => prove(field, &frustum, &triangles, list.fraction_bits),
        Seams::Skirts => {
            let skirts = expand::skirts(field, &frame, resident, list);
            prove_with_skirts(field, &frustum, &triangles, &skirts)
        }
    }
}

/// Writes triangles as ASCII PLY in world metres. Positions have `fraction_bits` fraction bits.
///
/// # Errors
/// If writing fails.
pub fn write_ply(field: &Field, triangles: &[Triangle], fraction_bits: u32, mut out: impl Write) -> io::Result<()> {
    writeln!(out, "ply\nformat ascii 1.0\ncomment metres: x east, y up, z south")?;
    writeln!(out, "element vertex {}", 3 * triangles.len())?;
    writeln!(out, "property double x\nproperty double y\nproperty double z")?;
    writeln!(out, "element face {}\nproperty list uchar uint vertex_indices\nend_header", triangles.len())?;
    for corner in triangles.iter().flatten() {
        let p = surface::world(field, corner, fraction_bits);
        writeln!(out, "{} {} {}", p.x, p.y, p.z)?;
    }
    (0..triangles.len()).try_for_each(|k| writeln!(out, "3 {} {} {}", 3 * k, 3 * k + 1, 3 * k + 2))
}

#[cfg(test)]
mod tests;
