//! Positions relative to the eye, without large numbers: the CPU reference of `shaders/position.glsl`.

use super::layout::Frame;

/// Position relative to the eye (metres, world axes) from a position as
/// [`explicit_position`](super::place::explicit_position) returns it and a height.
pub fn relative_position(frame: &Frame, at: [i32; 2], height: f32) -> [f32; 3] {
    let [x, z] = relative_to_eye(frame, from_render_origin(frame, at));
    [x, (height - (frame.camera.origin.height - frame.vertices.height_base)) + frame.camera.origin.height_relative, z]
}

/// Offset from the render origin to a position, samples. Whole samples are exact however far the origin is.
pub fn from_render_origin(frame: &Frame, at: [i32; 2]) -> [f32; 2] {
    let unit = 1 << frame.vertices.fraction_bits;
    [0, 1].map(|k| {
        let whole = (at[k] >> frame.vertices.fraction_bits) - frame.camera.origin.at[k];
        whole as f32 + (at[k] & (unit - 1)) as f32 * (1.0 / unit as f32)
    })
}

/// Offset from the eye to a lattice position in plan (x, z), metres.
pub fn relative_plan(frame: &Frame, at: [i32; 2]) -> [f32; 2] {
    relative_to_eye(frame, [0, 1].map(|k| (at[k] - frame.camera.origin.at[k]) as f32))
}

fn relative_to_eye(frame: &Frame, from_render_origin: [f32; 2]) -> [f32; 2] {
    [0, 1].map(|k| from_render_origin[k] * frame.heights.spacing[k] + frame.camera.origin.relative[k])
}
