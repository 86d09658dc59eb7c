//! Where lattice vertices lie: the CPU twin of `shaders/position.glsl`, function by function.

use super::distance::{self, is_by_distance};
use super::layout::{ExplicitVertex, Frame, Instance};
use super::skirts::{self, SKIRT, is_skirted};
use super::weights::region_weight;
use super::weights::{FINER, ONE, Slot, get, inside, is_stitched, slot, vertex_level};
use crate::height::{Field, Samples};
use crate::view::View;

/// What positions are told from, so that nothing large is rounded.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RenderOrigin {
    /// The lattice position nearest the eye.
    pub at: [i32; 2],
    /// Where that lies relative to the eye (x, z), metres.
    pub relative: [f32; 2],
    /// A height near the eye's, metres.
    pub height: f32,
    /// Where that lies relative to the eye, metres.
    pub height_relative: f32,
}

impl RenderOrigin {
    /// The anchor of an eye over a lattice.
    pub fn new(origin: [f64; 2], spacing: [f64; 2], eye: glam::DVec3) -> Self {
        // It may lie far outside the field: i32 is clamped so that differences stay exact.
        let at = [0, 1].map(|k| {
            let at = (eye[2 * k] - origin[k]) / spacing[k];
            at.round().clamp(-(2f64.powi(29)), 2f64.powi(29)) as i32
        });
        let relative = [0, 1].map(|k| (origin[k] + f64::from(at[k]) * spacing[k] - eye[2 * k]) as f32);
        let height = eye.y as f32;
        Self { at, relative, height, height_relative: (f64::from(height) - eye.y) as f32 }
    }
}

impl Frame {
    /// The part of a frame that says where vertices lie.
    pub fn placing(field: &Field, view: &View) -> Frame {
        let render_origin = RenderOrigin::new(field.origin, field.spacing, view.eye);
        let (height_zero, height_scale) = match *field.samples() {
            Samples::F32(_) => (0.0, 1.0),
            Samples::Coded { zero, scale, .. } => (zero, scale),
        };
        Frame {
            clip_from_relative: view.clip_from_relative().as_mat4().to_cols_array_2d(),
            render_origin: render_origin.at,
            render_origin_relative: render_origin.relative,
            render_origin_height: render_origin.height,
            render_origin_height_relative: render_origin.height_relative,
            spacing: field.spacing.map(|s| s as f32),
            last: field.size().map(|n| n as i32 - 1),
            stored: field.stored().map(|n| n as i32),
            render_origin_stored: [0, 1].map(|k| repeated(field, render_origin.at[k], k)),
            height_zero,
            height_scale,
            ..Frame::default()
        }
    }
}

/// A place along an axis, back by whole repetitions of a tiled field if it is far away.
fn repeated(field: &Field, at: i32, axis: usize) -> i32 {
    const FAR: u32 = 4096;
    if field.is_tiled() && at.unsigned_abs() > FAR { at % field.stored()[axis] as i32 } else { at }
}

/// A lattice vertex where it is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placed {
    /// Lattice position.
    pub at: [i32; 2],
    /// Height, metres.
    pub height: f32,
    /// Level of detail, with [`SKIRT`] set if it hangs under a side.
    pub level: u32,
}

/// Where an instance draws a vertex of its mesh.
pub fn placed(field: &Field, frame: &Frame, instance: &Instance, position: [i32; 2]) -> Placed {
    let turned = turned_position(instance, position);
    if is_skirted(instance) {
        return hung_vertex(field, frame, instance, turned);
    }
    if is_by_distance(instance) {
        return distant_vertex(field, frame, instance, turned);
    }
    let turned = stitched_position(instance, turned);
    Placed {
        at: lattice_position(frame, instance, turned),
        height: lattice_height(field, frame, instance, turned),
        level: vertex_level(instance, turned) as u32,
    }
}

/// A turned vertex of a mesh with skirts. Its quadrant goes over to the next coarser level by itself.
fn hung_vertex(field: &Field, frame: &Frame, instance: &Instance, turned: [i32; 2]) -> Placed {
    let skirt_vertex = skirts::skirt_vertex(instance, turned);
    let level = skirts::quadrant_level(instance, skirt_vertex.quadrant);
    let height = quadrant_height(
        field,
        frame,
        instance,
        skirt_vertex.at,
        level,
        get(instance, inside(skirt_vertex.quadrant)) & !FINER,
    );
    let skirt = if skirt_vertex.side.is_some() { SKIRT } else { 0 };
    Placed {
        at: lattice_position(frame, instance, skirt_vertex.at),
        height: height - skirts::depth(instance, &skirt_vertex),
        level: level as u32 | skirt,
    }
}

/// Height of a vertex of a quadrant that has gone to the next coarser level as far as a weight says.
fn quadrant_height(field: &Field, frame: &Frame, instance: &Instance, at: [i32; 2], level: i32, weight: u32) -> f32 {
    let sampled = |at: [i32; 2]| sampled_height(field, frame, instance, at);
    let apart = half_edge(instance, at, level);
    if weight == 0 || apart == [0, 0] {
        return sampled(at);
    }
    let end = |sign: i32| sampled([0, 1].map(|k| at[k] + sign * apart[k]));
    morphed_height(sampled(at), midpoint(end(-1), end(1)), unit_weight(weight))
}

/// A turned vertex that goes over to the next coarser level by its own distance. One whose edge of that level ends
/// beyond the field stays.
fn distant_vertex(field: &Field, frame: &Frame, instance: &Instance, turned: [i32; 2]) -> Placed {
    let level = vertex_level(instance, turned);
    let weight = distance::weight(frame, instance, lattice_position(frame, instance, turned), level);
    let is_stitched = weight == ONE && distance::is_beside_another(instance, turned);
    let turned = if is_stitched { even_position(instance, turned) } else { turned };
    let apart = half_edge(instance, turned, level);
    let ends = [-1, 1].map(|sign| [0, 1].map(|k| turned[k] + sign * apart[k]));
    let is_inside = |end: &[i32; 2]| (0..2).all(|k| instance.origin[k] + scaled(instance, end[k]) <= frame.last[k]);
    let weight = if ends.iter().all(is_inside) { weight } else { 0 };
    Placed {
        at: lattice_position(frame, instance, turned),
        height: quadrant_height(field, frame, instance, turned, level, weight),
        level: level as u32,
    }
}

/// A mesh vertex turned as its instance says, in mesh units.
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

/// Mesh units between neighbouring vertices at a turned one.
fn step_at(instance: &Instance, turned: [i32; 2]) -> i32 {
    1 << (vertex_level(instance, turned) - instance.shift)
}

/// Where a turned mesh vertex comes to lie in its mesh: on a line that meets a coarser mesh, an odd vertex falls
/// onto the even one before it.
pub fn stitched_position(instance: &Instance, turned: [i32; 2]) -> [i32; 2] {
    if is_stitched(instance, slot(instance, turned)) { even_position(instance, turned) } else { turned }
}

/// The even vertex before one on a side or seam, or itself.
fn even_position(instance: &Instance, turned: [i32; 2]) -> [i32; 2] {
    let step = step_at(instance, turned);
    let [x, z] = turned;
    if slot(instance, turned).1 < 2 { [x, z - (z & step)] } else { [x - (x & step), z] }
}

/// Lattice position of a turned mesh vertex: scaled, moved, and held inside the field, so that the part of a
/// mesh that sticks out collapses onto the field's edge.
pub fn lattice_position(frame: &Frame, instance: &Instance, turned: [i32; 2]) -> [i32; 2] {
    [0, 1].map(|k| (instance.origin[k] + scaled(instance, turned[k])).min(frame.last[k]))
}

/// Height of a stitched mesh vertex. One that the next coarser level lacks goes to the midpoint of the edge of that
/// level on which it lies, as far as its weight says.
pub fn lattice_height(field: &Field, frame: &Frame, instance: &Instance, turned: [i32; 2]) -> f32 {
    let slot = slot(instance, turned);
    if is_outer(slot) {
        return edge_height(field, frame, instance, turned);
    }
    let sampled = sampled_height(field, frame, instance, turned);
    let weight = get(instance, slot) & !FINER;
    let apart = half_edge(instance, turned, vertex_level(instance, turned));
    if weight == 0 || apart == [0, 0] {
        return sampled;
    }
    let end = |sign: i32| end_height(field, frame, instance, [0, 1].map(|k| turned[k] + sign * apart[k]));
    morphed_height(sampled, midpoint(end(-1), end(1)), unit_weight(weight))
}

/// From a vertex of a level, in mesh units, to one end of the edge of the next coarser level in whose middle it
/// lies; nothing if that level has the vertex.
fn half_edge(instance: &Instance, turned: [i32; 2], level: i32) -> [i32; 2] {
    let step = 1 << (level - instance.shift);
    let mut apart = turned.map(|n| n & step);
    if apart == [step; 2] {
        // The diagonal of the coarser cell: it turns with the parity of the cell's place in the whole field.
        let cell = |k: usize| (instance.origin[k] + scaled(instance, turned[k])) >> (level + 1);
        if (cell(0) + cell(1)) & 1 == 1 {
            apart[1] = -apart[1];
        }
    }
    apart
}

/// Height of the end of a coarser edge: inside the mesh it stays, on a side it may be on its own way.
fn end_height(field: &Field, frame: &Frame, instance: &Instance, turned: [i32; 2]) -> f32 {
    let height = if is_outer(slot(instance, turned)) { edge_height } else { sampled_height };
    height(field, frame, instance, turned)
}

/// Height of a stitched vertex on a side of the mesh. It goes to the midpoint of its neighbours along the side,
/// so that both meshes of a side agree on it. A mesh's corners stay: no level within reach lacks them.
fn edge_height(field: &Field, frame: &Frame, instance: &Instance, turned: [i32; 2]) -> f32 {
    let slot = slot(instance, turned);
    let upright = slot.1 < 2;
    let along = if upright { turned[1] } else { turned[0] };
    let step = step_at(instance, turned);
    let second_target = i32::from(along & step == 0);
    let weight = (get(instance, slot) as i32 - second_target * ONE as i32).clamp(0, ONE as i32);
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

fn is_outer((word, _): Slot) -> bool {
    word == 1 || word == 2
}

fn unit_weight(weight: u32) -> f32 {
    weight as f32 * (1.0 / ONE as f32)
}

fn midpoint(a: f32, b: f32) -> f32 {
    (a + b) * 0.5
}

/// How far a vertex that carries its own height has gone to its target, and its target to where that goes: as the
/// weights of its two regions say, or as it says itself.
pub fn explicit_weights(instance: &Instance, vertex: &ExplicitVertex) -> [f32; 2] {
    let region = vertex.regions & 255;
    if region == 0 {
        return [vertex.morph, 0.0];
    }
    [region, vertex.regions >> 8 & 255].map(|region| unit_weight(region_weight(instance, region)))
}

/// Height of a vertex that carries its own.
pub fn explicit_height(instance: &Instance, vertex: &ExplicitVertex) -> f32 {
    let [weight, second_target] = explicit_weights(instance, vertex);
    morphed_height(vertex.height, morphed_height(vertex.target, vertex.second_target, second_target), weight)
}

/// Where an instance draws a vertex that carries its own height: its position in samples, or as the frame says in parts
/// of them.
pub fn explicit_position(frame: &Frame, instance: &Instance, vertex: &ExplicitVertex) -> [i32; 2] {
    let turned = turned_position(instance, vertex.position);
    [0, 1].map(|k| {
        let origin = instance.origin[k] << frame.fraction_bits;
        (origin + scaled(instance, turned[k])).min(frame.last[k] << frame.fraction_bits)
    })
}

/// Position relative to the eye in metres, world axes, of a corner: its position, as [`explicit_position`] tells it, and
/// its height.
pub fn relative_position(frame: &Frame, at: [i32; 2], height: f32) -> [f32; 3] {
    let [x, z] = relative_to_eye(frame, from_render_origin(frame, at));
    [x, (height - (frame.render_origin_height - frame.height_base)) + frame.render_origin_height_relative, z]
}

/// From the anchor to a corner's position, samples: whole ones are exact however far away the anchor is from the field.
pub fn from_render_origin(frame: &Frame, at: [i32; 2]) -> [f32; 2] {
    let unit = 1 << frame.fraction_bits;
    [0, 1].map(|k| {
        let whole = (at[k] >> frame.fraction_bits) - frame.render_origin[k];
        whole as f32 + (at[k] & (unit - 1)) as f32 * (1.0 / unit as f32)
    })
}

/// From the eye to a lattice position in plan (x, z), metres.
pub fn relative_plan(frame: &Frame, at: [i32; 2]) -> [f32; 2] {
    relative_to_eye(frame, [0, 1].map(|k| (at[k] - frame.render_origin[k]) as f32))
}

fn relative_to_eye(frame: &Frame, from_render_origin: [f32; 2]) -> [f32; 2] {
    [0, 1].map(|k| from_render_origin[k] * frame.spacing[k] + frame.render_origin_relative[k])
}

/// Height between two shapes: `weight` 0 is the finer one, 1 the coarser one, both to the bit.
pub fn morphed_height(finer: f32, coarser: f32, weight: f32) -> f32 {
    if weight == 1.0 { coarser } else { finer + (coarser - finer) * weight }
}
