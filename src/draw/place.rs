//! Positions of vertices: the CPU reference of `shaders/position.glsl`, function by function.

use super::distance;
use super::layout::{ExplicitVertex, Frame, Instance};
use super::skirts::{self, SKIRT};
use super::weights::{DistanceWeights, FINER, ONE, SkirtWeights, Slot, SlotWeights, Weights, vertex_level};
use crate::height::Field;

pub use super::relative::relative_position;

/// A lattice vertex at its drawn position.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// Lattice position.
    pub at: [i32; 2],
    /// Height, metres.
    pub height: f32,
    /// Level of detail, with the flag [`SKIRT`] on vertices that hang under a side.
    pub level: u32,
}

/// Position of a vertex of an instance's mesh.
pub fn placed(field: &Field, frame: &Frame, instance: &Instance, position: [i32; 2]) -> Placed {
    let turned = turned_position(instance, position);
    match instance.weights() {
        Weights::Slots(weights) => slot_vertex(field, frame, instance, &weights, turned),
        Weights::Skirts(weights) => skirted_vertex(field, frame, instance, &weights, turned),
        Weights::Distance(weights) => distant_vertex(field, frame, instance, &weights, turned),
    }
}

/// A vertex (after the rotation) with the weight of its slot.
fn slot_vertex(field: &Field, frame: &Frame, instance: &Instance, weights: &SlotWeights, turned: [i32; 2]) -> Placed {
    let turned = stitched_position(instance, weights, turned);
    Placed {
        at: lattice_position(frame, instance, turned),
        height: lattice_height(field, frame, instance, weights, turned),
        level: vertex_level(instance, turned) as u32,
    }
}

/// A vertex (after the rotation) of a mesh with skirts. It has the weight of its quadrant.
fn skirted_vertex(
    field: &Field,
    frame: &Frame,
    instance: &Instance,
    weights: &SkirtWeights,
    turned: [i32; 2],
) -> Placed {
    let vertex = skirts::skirt_vertex(instance, turned);
    let level = skirts::quadrant_level(instance, vertex.quadrant);
    let height = quadrant_height(field, frame, instance, vertex.at, level, weights.inside(vertex.quadrant));
    let skirt = if vertex.side.is_some() { SKIRT } else { 0 };
    Placed {
        at: lattice_position(frame, instance, vertex.at),
        height: height - skirts::depth(weights, &vertex),
        level: level as u32 | skirt,
    }
}

/// Height of a vertex of a quadrant at a weight of the next coarser level.
fn quadrant_height(field: &Field, frame: &Frame, instance: &Instance, at: [i32; 2], level: i32, weight: u32) -> f32 {
    let sampled = |at: [i32; 2]| sampled_height(field, frame, instance, at);
    let apart = half_edge(instance, at, level);
    if weight == 0 || apart == [0, 0] {
        return sampled(at);
    }
    let end = |sign: i32| sampled([0, 1].map(|k| at[k] + sign * apart[k]));
    morphed_height(sampled(at), midpoint(end(-1), end(1)), unit_weight(weight))
}

/// A vertex (after the rotation) with the weight of its distance. It does not morph if its edge of the next coarser
/// level ends outside the field.
fn distant_vertex(
    field: &Field,
    frame: &Frame,
    instance: &Instance,
    weights: &DistanceWeights,
    turned: [i32; 2],
) -> Placed {
    let level = vertex_level(instance, turned);
    let weight = distance::weight(frame, instance, weights, lattice_position(frame, instance, turned), level);
    let is_stitched = weight == ONE && distance::is_beside_another(instance, weights, turned);
    let turned = if is_stitched { even_position(instance, turned) } else { turned };
    let apart = half_edge(instance, turned, level);
    let ends = [-1, 1].map(|sign| [0, 1].map(|k| turned[k] + sign * apart[k]));
    let last = frame.heights.last;
    let is_inside = |end: &[i32; 2]| (0..2).all(|k| instance.origin[k] + scaled(instance, end[k]) <= last[k]);
    let weight = if ends.iter().all(is_inside) { weight } else { 0 };
    Placed {
        at: lattice_position(frame, instance, turned),
        height: quadrant_height(field, frame, instance, turned, level, weight),
        level: level as u32,
    }
}

/// A vertex position after the instance's rotation, in mesh units.
pub fn turned_position(instance: &Instance, [x, z]: [i32; 2]) -> [i32; 2] {
    let cells = instance.cells as i32;
    match instance.rotation {
        0 => [x, z],
        1 => [cells - z, x],
        2 => [cells - x, cells - z],
        _ => [z, cells - x],
    }
}

/// Samples of a length in mesh units.
fn scaled(instance: &Instance, length: i32) -> i32 {
    if instance.shift < 0 { length >> 1 } else { length << instance.shift }
}

/// Mesh units between neighbouring vertices at a vertex after the rotation.
fn step_at(instance: &Instance, turned: [i32; 2]) -> i32 {
    1 << (vertex_level(instance, turned) - instance.shift)
}

/// Position of a vertex (after the rotation) in its mesh: on a line that meets a coarser mesh, an odd vertex snaps to
/// the even one before it.
pub fn stitched_position(instance: &Instance, weights: &SlotWeights, turned: [i32; 2]) -> [i32; 2] {
    if weights.is_stitched(Slot::of_vertex(instance, turned)) { even_position(instance, turned) } else { turned }
}

/// The even vertex before a vertex on a side or seam, or itself.
fn even_position(instance: &Instance, turned: [i32; 2]) -> [i32; 2] {
    let step = step_at(instance, turned);
    let [x, z] = turned;
    if Slot::of_vertex(instance, turned).is_upright() { [x, z - (z & step)] } else { [x - (x & step), z] }
}

/// Lattice position of a mesh vertex after the rotation. It is clamped to the field, so that the part of a mesh outside
/// the field collapses onto the field's edge.
pub fn lattice_position(frame: &Frame, instance: &Instance, turned: [i32; 2]) -> [i32; 2] {
    [0, 1].map(|k| (instance.origin[k] + scaled(instance, turned[k])).min(frame.heights.last[k]))
}

/// Height of a stitched mesh vertex. A vertex that the next coarser level lacks morphs to the midpoint of the edge of
/// that level on which it lies.
pub fn lattice_height(
    field: &Field,
    frame: &Frame,
    instance: &Instance,
    weights: &SlotWeights,
    turned: [i32; 2],
) -> f32 {
    let slot = Slot::of_vertex(instance, turned);
    if slot.is_outer() {
        return edge_height(field, frame, instance, weights, turned);
    }
    let sampled = sampled_height(field, frame, instance, turned);
    let weight = weights.get(slot) & !FINER;
    let apart = half_edge(instance, turned, vertex_level(instance, turned));
    if weight == 0 || apart == [0, 0] {
        return sampled;
    }
    let end = |sign: i32| end_height(field, frame, instance, weights, [0, 1].map(|k| turned[k] + sign * apart[k]));
    morphed_height(sampled, midpoint(end(-1), end(1)), unit_weight(weight))
}

/// Offset in mesh units from a vertex of a level to one end of the edge of the next coarser level in whose middle it
/// lies. Zero if that level has the vertex.
fn half_edge(instance: &Instance, turned: [i32; 2], level: i32) -> [i32; 2] {
    let step = 1 << (level - instance.shift);
    let mut apart = turned.map(|n| n & step);
    if apart == [step; 2] {
        // The diagonal of the coarser cell: its direction depends on the parity of the cell's position in the field.
        let cell = |k: usize| (instance.origin[k] + scaled(instance, turned[k])) >> (level + 1);
        if (cell(0) + cell(1)) & 1 == 1 {
            apart[1] = -apart[1];
        }
    }
    apart
}

/// Height of the end of a coarser edge: its sample inside the mesh, its morphed height on an outer side.
fn end_height(field: &Field, frame: &Frame, instance: &Instance, weights: &SlotWeights, turned: [i32; 2]) -> f32 {
    if Slot::of_vertex(instance, turned).is_outer() {
        return edge_height(field, frame, instance, weights, turned);
    }
    sampled_height(field, frame, instance, turned)
}

/// Height of a stitched vertex on a side of the mesh. It morphs to the midpoint of its neighbours along the side, so
/// that both meshes of a side agree on it. A mesh's corners do not morph: no level within reach lacks them.
fn edge_height(field: &Field, frame: &Frame, instance: &Instance, weights: &SlotWeights, turned: [i32; 2]) -> f32 {
    let slot = Slot::of_vertex(instance, turned);
    let upright = slot.is_upright();
    let along = if upright { turned[1] } else { turned[0] };
    let step = step_at(instance, turned);
    let second_target = i32::from(along & step == 0);
    let weight = (weights.get(slot) as i32 - second_target * ONE as i32).clamp(0, ONE as i32);
    let reach = step << second_target;
    let sampled = sampled_height(field, frame, instance, turned);
    if weight == 0 || along & reach == 0 {
        return sampled;
    }
    let apart = if upright { [0, reach] } else { [reach, 0] };
    let end = |sign: i32| sampled_height(field, frame, instance, [0, 1].map(|k| turned[k] + sign * apart[k]));
    morphed_height(sampled, midpoint(end(-1), end(1)), unit_weight(weight as u32))
}

fn sampled_height(field: &Field, frame: &Frame, instance: &Instance, turned: [i32; 2]) -> f32 {
    let [x, z] = lattice_position(frame, instance, turned);
    field.height(x as u32, z as u32)
}

fn unit_weight(weight: u32) -> f32 {
    weight as f32 * (1.0 / ONE as f32)
}

fn midpoint(a: f32, b: f32) -> f32 {
    (a + b) * 0.5
}

/// Morph weights of an explicit vertex towards its target, and of the target towards the second target: those of its two
/// regions, or its own.
pub fn explicit_weights(instance: &Instance, vertex: &ExplicitVertex) -> [f32; 2] {
    let region = vertex.regions & 255;
    if region == 0 {
        return [vertex.morph, 0.0];
    }
    let weights = SlotWeights::of(instance);
    [region, vertex.regions >> 8 & 255].map(|region| unit_weight(weights.of_region(region)))
}

/// Height of an explicit vertex, metres above the list's height base.
pub fn explicit_height(instance: &Instance, vertex: &ExplicitVertex) -> f32 {
    let [weight, second_target] = explicit_weights(instance, vertex);
    morphed_height(vertex.height, morphed_height(vertex.target, vertex.second_target, second_target), weight)
}

/// Lattice position of an explicit vertex, in the units of
/// [`VertexFormat::fraction_bits`](super::layout::VertexFormat::fraction_bits).
pub fn explicit_position(frame: &Frame, instance: &Instance, vertex: &ExplicitVertex) -> [i32; 2] {
    let turned = turned_position(instance, vertex.position);
    [0, 1].map(|k| {
        let origin = instance.origin[k] << frame.vertices.fraction_bits;
        (origin + scaled(instance, turned[k])).min(frame.heights.last[k] << frame.vertices.fraction_bits)
    })
}

/// Height between two shapes. Weight 0 gives the finer one and 1 the coarser one, both to the bit.
pub fn morphed_height(finer: f32, coarser: f32, weight: f32) -> f32 {
    if weight == 1.0 { coarser } else { finer + (coarser - finer) * weight }
}
