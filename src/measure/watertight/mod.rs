//! Proof that the drawn triangles are one surface, on the integer lattice, without rounding; or the triangles
//! that refute it.
//!
//! In plan, let m be the number of triangles over a point. The steps of [`prove`], each exact:
//!
//! 1. every corner lies on the field, and every triangle faces up;
//! 2. every lattice vertex has one height, to the bit, in all triangles around it;
//! 3. every directed edge occurs once. An edge used in both directions joins two triangles, and m is the same
//!    on both sides of it; the others make up the border;
//! 4. no vertex of the border lies strictly inside an edge of the border: no T-junction. By 2 to 4 triangles
//!    that touch along a line share whole edges with the same ends in space: no crack;
//! 5. m is 0 outside the field and changes across the border only. A sweep over the rows follows the border
//!    and shows that m is 0 or 1 everywhere: covered once, and the drawn area is the covered area;
//! 6. where m is 0, every triangle of the samples' own surface that has data is outside the frustum: nothing
//!    in view is left out. The test is [`Frustum::contains`] on the triangle's own box: culling by boxes around the
//!    terrain passes, and culling of anything visible does not.
//!
//! What lies along a culled region or a hole is thus no matter of the border's shape but of what is missing
//! beyond it. In a view of everything all land must be covered, and [`Proof::doubled_area`] is the field's.
//!
//! Surfaces with skirts have gaps between edges, which [`prove_with_skirts`] finds and shows hidden instead of 2 to 4.

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
    /// Triangles.
    pub triangles: usize,
    /// Twice the land covered, in samples²; that of a cave by its floor.
    pub doubled_area: i64,
    /// Edges with a triangle on one side only; with skirts, their parts from sample to sample.
    pub border_edges: usize,
}

/// Proves that triangles are one surface that leaves out nothing in view. Needs about 100 bytes a triangle.
///
/// Corners have `fraction_bits` fraction bits. If there are any, the border must consist of straight lines between
/// samples; vertices may lie anywhere on these lines.
///
/// # Panics
/// If there are more than 2^31 triangles, or more than 2^24 parts of samples a side.
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

/// The border, in samples, of triangles that are one surface but perhaps for land covered twice.
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

/// Proves that triangles are one surface but for gaps between edges one above the other, each of which is hidden by a
/// skirt; and that they leave out nothing in view. `skirts` are upright triangles ([`expand::skirts`]).
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

/// The proof of a list whose meshes are said to meet in this way, expanded in this view: up to where it reaches.
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

/// Writes triangles, whose corners have `fraction_bits` fraction bits, as ASCII PLY, world metres.
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
