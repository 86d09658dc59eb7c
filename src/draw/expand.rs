//! From a draw list to its triangles, on the CPU: what the device draws, without a device.

use super::layout::Frame;
use super::place::{lattice_height, lattice_position, morphed_height, turned_position};
use super::{Draw, DrawList, Geometry, Instance, Source, Topology};
use crate::height::Field;
use crate::height::surface::{Corner, Triangle, doubled_area};

/// A triangle of a draw list.
#[derive(Clone, Copy, Debug)]
pub struct Drawn {
    /// Its corners.
    pub corners: Triangle,
    /// The instance it belongs to, an index into the list's instances.
    pub instance: u32,
}

/// Calls `visit` for every triangle of the list that is not degenerate in plan.
///
/// `frame` needs only its placing part ([`Frame::placing`]).
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

/// All triangles of the list.
pub fn triangles(field: &Field, frame: &Frame, resident: &Geometry, list: &DrawList) -> Vec<Drawn> {
    let mut drawn = Vec::new();
    visit_triangles(field, frame, resident, list, |t| drawn.push(*t));
    drawn
}

/// Calls `visit` for every triangle of one draw, or part of a draw, of the list.
pub fn visit_draw(
    field: &Field,
    frame: &Frame,
    resident: &Geometry,
    list: &DrawList,
    draw: &Draw,
    visit: &mut impl FnMut(&Drawn),
) {
    for instance in draw.instances.clone() {
        visit_instance(field, frame, resident, list, draw, instance, visit);
    }
}

fn visit_instance(
    field: &Field,
    frame: &Frame,
    resident: &Geometry,
    list: &DrawList,
    draw: &Draw,
    instance: u32,
    visit: &mut impl FnMut(&Drawn),
) {
    let geometry = if draw.source == Source::Streamed { &list.streamed } else { resident };
    let indices = &geometry.indices[draw.indices.start as usize..draw.indices.end as usize];
    let placed = &list.instances[instance as usize];
    let corner = |index: u32| corner(field, frame, geometry, draw.source, placed, index);
    let mut emit = |corners: Triangle| {
        if doubled_area(&corners) != 0 {
            visit(&Drawn { corners, instance });
        }
    };
    match draw.topology {
        Topology::Triangles => {
            for t in indices.chunks_exact(3) {
                emit([corner(t[0]), corner(t[1]), corner(t[2])]);
            }
        }
        Topology::Strip => {
            for (k, t) in indices.windows(3).enumerate() {
                let [a, b, c] = [corner(t[0]), corner(t[1]), corner(t[2])];
                emit(if k % 2 == 0 { [a, b, c] } else { [b, a, c] });
            }
        }
    }
}

fn corner(field: &Field, frame: &Frame, geometry: &Geometry, source: Source, placed: &Instance, index: u32) -> Corner {
    match source {
        Source::Lattice => {
            let turned = turned_position(placed, geometry.lattice[index as usize].position);
            let [x, z] = lattice_position(frame, placed, turned);
            Corner { x, z, y: lattice_height(field, frame, placed, turned) }
        }
        Source::Resident | Source::Streamed => {
            let vertex = &geometry.vertices[index as usize];
            let [x, z] = lattice_position(frame, placed, turned_position(placed, vertex.position));
            Corner { x, z, y: morphed_height(vertex.height, vertex.target, vertex.morph) }
        }
    }
}
