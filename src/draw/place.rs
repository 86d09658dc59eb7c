//! Where lattice vertices lie: the CPU twin of `shaders/position.glsl`, function by function.

use super::layout::{Frame, Instance};
use crate::height::{Field, Samples};
use crate::view::View;

impl Frame {
    /// The part of a frame that says where vertices lie.
    pub fn placing(field: &Field, view: &View) -> Frame {
        // The anchor may lie far outside the field: i32 is clamped so that differences stay exact.
        let anchor = [0, 1].map(|k| {
            let at = (view.eye[2 * k] - field.origin[k]) / field.spacing[k];
            at.round().clamp(-(2f64.powi(29)), 2f64.powi(29)) as i32
        });
        let relative = |k: usize| field.origin[k] + f64::from(anchor[k]) * field.spacing[k] - view.eye[2 * k];
        let anchor_height = view.eye.y as f32;
        let (height_zero, height_scale) = match *field.samples() {
            Samples::F32(_) => (0.0, 1.0),
            Samples::Coded { zero, scale, .. } => (zero, scale),
        };
        Frame {
            clip_from_relative: view.clip_from_relative().as_mat4().to_cols_array_2d(),
            anchor,
            anchor_relative: [relative(0) as f32, relative(1) as f32],
            anchor_height,
            anchor_height_relative: (f64::from(anchor_height) - view.eye.y) as f32,
            spacing: field.spacing.map(|s| s as f32),
            last: field.size().map(|n| n as i32 - 1),
            stored: field.stored().map(|n| n as i32),
            height_zero,
            height_scale,
            ..Frame::default()
        }
    }
}

/// Lattice position of a mesh vertex: turned, scaled, moved, and held inside the field, so that the part of
/// a mesh that sticks out collapses onto the field's edge.
pub fn lattice_position(frame: &Frame, instance: &Instance, position: [i32; 2]) -> [i32; 2] {
    let cells = instance.cells as i32;
    let [x, z] = position;
    let turned = match instance.turns {
        0 => [x, z],
        1 => [cells - z, x],
        2 => [cells - x, cells - z],
        _ => [z, cells - x],
    };
    [0, 1].map(|k| (instance.origin[k] + (turned[k] << instance.shift)).min(frame.last[k]))
}

/// Position relative to the eye in metres, world axes, of a lattice position and height.
pub fn relative_position(frame: &Frame, [x, z]: [i32; 2], height: f32) -> [f32; 3] {
    [
        (x - frame.anchor[0]) as f32 * frame.spacing[0] + frame.anchor_relative[0],
        (height - frame.anchor_height) + frame.anchor_height_relative,
        (z - frame.anchor[1]) as f32 * frame.spacing[1] + frame.anchor_relative[1],
    ]
}

/// Height between two shapes: `weight` 0 is the finer one, 1 the coarser one.
pub fn morphed_height(finer: f32, coarser: f32, weight: f32) -> f32 {
    finer + (coarser - finer) * weight
}
