//! The constants of a frame that decide positions: the eye, and the lattice of samples.

use super::layout::{Camera, Frame, HeightMap, RenderOrigin, VertexFormat};
use crate::height::{Field, Samples};
use crate::view::{Lens, View};

impl RenderOrigin {
    /// The render origin of an eye over a lattice whose first sample lies at `origin` (x, z).
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

impl Camera {
    fn new(field: &Field, view: &View) -> Self {
        let (slope, size) = match view.lens {
            Lens::Perspective { .. } => (1.0 / view.focal_px(), 0.0),
            Lens::Orthographic { .. } => (0.0, 1.0 / view.focal_px()),
        };
        Self {
            clip_from_relative: view.clip_from_relative().as_mat4().to_cols_array_2d(),
            origin: RenderOrigin::new(field.origin, field.spacing, view.eye),
            pixel_slope: slope as f32,
            pixel_size: size as f32,
        }
    }
}

impl HeightMap {
    fn new(field: &Field, render_origin: [i32; 2]) -> Self {
        let (zero, scale) = match *field.samples() {
            Samples::F32(_) => (0.0, 1.0),
            Samples::Coded { zero, scale, .. } => (zero, scale),
        };
        Self {
            spacing: field.spacing.map(|s| s as f32),
            last: field.size().map(|n| n as i32 - 1),
            stored: field.stored().map(|n| n as i32),
            origin_stored: [0, 1].map(|k| repeated(field, render_origin[k], k)),
            zero,
            scale,
        }
    }
}

impl Frame {
    /// The parts of a frame that decide positions: camera and heights.
    pub fn placing(field: &Field, view: &View) -> Frame {
        let camera = Camera::new(field, view);
        Frame { camera, heights: HeightMap::new(field, camera.origin.at), ..Frame::default() }
    }

    /// A frame for positions on the lattice alone, whose last sample is this one.
    pub fn of_lattice(last: [i32; 2]) -> Frame {
        Frame { heights: HeightMap { last, ..HeightMap::default() }, ..Frame::default() }
    }

    /// The same frame for explicit vertices whose positions have this many binary digits of a fraction of a sample.
    pub fn with_fractions(self, bits: u32) -> Frame {
        Frame { vertices: VertexFormat { fraction_bits: bits as i32, ..self.vertices }, ..self }
    }
}

/// A position along an axis. Far positions on a tiled field are moved back by whole repetitions.
fn repeated(field: &Field, at: i32, axis: usize) -> i32 {
    const FAR: u32 = 4096;
    if field.is_tiled() && at.unsigned_abs() > FAR { at % field.stored()[axis] as i32 } else { at }
}
