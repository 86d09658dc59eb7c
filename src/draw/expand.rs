//! Expands a draw list to its triangles on the CPU: the reference of the vertex pipeline.

use super::draws::{Draw, RESTART, Source, Topology};
use super::geometry::Geometry;
use super::layout::{Frame, Instance};
use super::list::DrawList;
use super::place::{explicit_height, explicit_position, placed};
use super::skirts::is_skirted;
use crate::height::Field;
use crate::height::surface::{self, Corner, Triangle, doubled_area};
use crate::view::View;
use glam::DVec3;

/// A triangle of a draw list.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Drawn {
    /// Its corners.
    pub corners: Triangle,
    /// The instance it belongs to, an index into the list's instances.
    pub instance: u32,
}

/// Calls `visit` for every triangle of the list that is not degenerate in plan.
///
/// `frame` needs only camera and heights ([`Frame::placing`]). Corners' positions have the list's
/// [`fraction_bits`](DrawList::fraction_bits).
pub fn visit_triangles(
    field: &Field,
    frame: &Frame,
    resident: &Geometry,
    list: &DrawList,
    mut visit: impl FnMut(&Drawn),
) {
    for draw in &list.draws {
        visit_draw(field, frame, resident, list, draw, &mut visit);
    }
}

/// Returns all triangles of the list that are not degenerate in plan.
pub fn triangles(field: &Field, frame: &Frame, resident: &Geometry, list: &DrawList) -> Vec<Drawn> {
    let mut drawn = Vec::new();
    visit_triangles(field, frame, resident, list, |t| drawn.push(*t));
    drawn
}

/// Returns the triangles that are drawn of a list, in world metres, without skirts.
///
/// `resident` is the technique's resident geometry, `view` the view that the list was selected for.
pub fn world_triangles(field: &Field, view: &View, resident: &Geometry, list: &DrawList) -> Vec<[DVec3; 3]> {
    let mut drawn = Vec::new();
    visit_triangles(field, &Frame::placing(field, view), resident, list, |triangle| {
        drawn.push(triangle.corners.each_ref().map(|corner| surface::world(field, corner, list.fraction_bits)));
    });
    drawn
}

/// Calls `visit` for every triangle of one draw of the list that is not degenerate in plan.
pub fn visit_draw(
    field: &Field,
    frame: &Frame,
    resident: &Geometry,
    list: &DrawList,
    draw: &Draw,
    visit: &mut impl FnMut(&Drawn),
) {
    each_triangle(field, frame, resident, list, draw, |drawn| {
        if doubled_area(&drawn.corners) != 0 {
            visit(&drawn);
        }
    });
}

/// Returns the triangles of the list's skirts: vertical walls that are no part of the surface and face outwards.
pub fn skirts(field: &Field, frame: &Frame, resident: &Geometry, list: &DrawList) -> Vec<Drawn> {
    let mut skirts = Vec::new();
    let is_skirted = |draw: &&Draw| list.instances[draw.instances.start as usize..].first().is_some_and(is_skirted);
    for draw in list.draws.iter().filter(is_skirted) {
        each_triangle(field, frame, resident, list, draw, |drawn| skirts.extend(is_upright(&drawn).then_some(drawn)));
    }
    skirts
}

/// Returns true if a triangle has area in space but none in plan. No surface has such triangles.
pub fn is_upright(drawn: &Drawn) -> bool {
    let [a, b, c] = drawn.corners;
    doubled_area(&drawn.corners) == 0 && a != b && b != c && c != a
}

fn each_triangle(
    field: &Field,
    frame: &Frame,
    resident: &Geometry,
    list: &DrawList,
    draw: &Draw,
    mut visit: impl FnMut(Drawn),
) {
    let geometry = geometry(draw.source, resident, list);
    let frame = &frame.with_fractions(list.fraction_bits);
    let placed = |instance: u32| &list.instances[instance as usize];
    let corner = |instance, index| {
        let corner = corner(field, frame, geometry, draw.source, placed(instance), index);
        Corner { y: list.absolute_height(corner.y), ..corner }
    };
    assemble(geometry, draw, corner, |instance, corners| visit(Drawn { corners, instance }));
}

/// Calls `visit` with the instance and the corners of every triangle of one draw, in the order of its winding. `corner`
/// returns a corner from the instance and the index, the draw's first vertex included. `geometry` holds the draw's
/// indices: see [`geometry`].
pub fn assemble<T>(
    geometry: &Geometry,
    draw: &Draw,
    corner: impl Fn(u32, u32) -> T,
    mut visit: impl FnMut(u32, [T; 3]),
) {
    let indices = &geometry.indices[draw.indices.start as usize..draw.indices.end as usize];
    for instance in draw.instances.clone() {
        let corner = |index: u32| corner(instance, index + draw.first_vertex);
        match draw.topology {
            Topology::Triangles => {
                for t in indices.chunks_exact(3) {
                    visit(instance, [corner(t[0]), corner(t[1]), corner(t[2])]);
                }
            }
            Topology::Strip => {
                for (k, t) in indices.windows(3).enumerate().filter(|(_, t)| !t.contains(&RESTART)) {
                    let (first, second) = if k % 2 == 0 { (t[0], t[1]) } else { (t[1], t[0]) };
                    visit(instance, [corner(first), corner(second), corner(t[2])]);
                }
            }
        }
    }
}

/// The geometry that a source's indices address.
pub fn geometry<'a>(source: Source, resident: &'a Geometry, list: &'a DrawList) -> &'a Geometry {
    if source == Source::Streamed { &list.streamed } else { resident }
}

fn corner(
    field: &Field,
    frame: &Frame,
    geometry: &Geometry,
    source: Source,
    instance: &Instance,
    index: u32,
) -> Corner {
    match source {
        Source::Lattice => {
            let placed = placed(field, frame, instance, geometry.lattice[index as usize].position);
            let [x, z] = placed.at.map(|n| n << frame.vertices.fraction_bits);
            Corner { x, z, y: placed.height }
        }
        Source::Resident | Source::Streamed => {
            let vertex = &geometry.vertices[index as usize];
            let [x, z] = explicit_position(frame, instance, vertex);
            Corner { x, z, y: explicit_height(instance, vertex) }
        }
    }
}
