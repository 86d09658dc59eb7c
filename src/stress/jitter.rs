//! Measures the jitter of static vertices on the screen under slow camera motion, for three ways to compute vertex
//! positions.
//!
//! The ways: world coordinates in f32; f64 differences to the eye, rounded once; and the renderer's own, integer
//! sample differences to the render origin ([`place::relative_position`](crate::draw::place)).

use std::io;
use std::path::Path;

use anyhow::{Context, Result};
use glam::{DVec2, Mat4, Vec3, Vec4};
use image::imageops::{FilterType, resize};
use image::{ImageFormat, Rgb, RgbImage};

use super::fields::hills_at;
use super::finding::Finding;
use super::rows::Picture;
use crate::draw::layout::Frame;
use crate::draw::place::relative_position;
use crate::height::Field;
use crate::height::save::replace;
use crate::measure::in_view;
use crate::view::{Lens, Metric, Tolerance, View};

/// Limit of the renderer's jitter, pixels.
pub const LIMIT_PX: f64 = 1.0 / 16.0;

/// Radius of the Earth plus a millimetre, metres.
pub const EARTH_M: f64 = 6.4e6 + 1e-3;

/// Distances of the scene from the world's origin along both axes, metres.
pub const ORIGINS: [(f64, &str); 4] = [(0.0, "0 m"), (1e5, "1e5 m"), (1e7, "1e7 m"), (EARTH_M, "the Earth's radius")];

/// Number of frames, and camera motion per frame, metres.
const FRAMES: usize = 48;
const STEP_M: f64 = 0.05;

/// A way to compute vertex positions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum VertexPlacement {
    /// World coordinates as f32, with one matrix from world to clip space.
    WorldF32,
    /// Differences to the eye in f64, rounded to f32.
    EyeRelative,
    /// Integer sample differences to the render origin, as in the vertex shader.
    SampleRelative,
}

/// All placements with their check names.
pub const PLACEMENTS: [(VertexPlacement, &str); 3] = [
    (VertexPlacement::WorldF32, "world coordinates in single precision, px"),
    (VertexPlacement::EyeRelative, "relative to the camera, px"),
    (VertexPlacement::SampleRelative, "as it is drawn, px"),
];

/// Jitter of each sample of a field, pixels; `None` for samples out of view.
pub struct Jitter {
    size: [u32; 2],
    px: Vec<Option<f64>>,
}

impl Jitter {
    /// Measures a field at a distance from the world's origin, metres.
    pub fn of(origin_m: f64, placement: VertexPlacement) -> Self {
        let field = hills_at(origin_m);
        let views: Vec<_> = (0..FRAMES).map(|frame| view(&field, frame)).collect();
        let [w, h] = field.size();
        let of_sample = |k: u32| {
            let offset: Option<Vec<_>> =
                views.iter().map(|view| offset(&field, view, placement, [k % w, k / w])).collect();
            Some(offset?.array_windows().map(|[a, b]| (*b - *a).length()).fold(0.0, f64::max))
        };
        Self { size: [w, h], px: (0..w * h).map(of_sample).collect() }
    }

    /// Returns the largest jitter, pixels.
    pub fn max_px(&self) -> f64 {
        self.px.iter().flatten().copied().fold(0.0, f64::max)
    }

    /// Returns an image with a pixel per sample: grey out of view, else from blue (none) over white (the limit) to
    /// red (at least 16 times the limit).
    pub fn map(&self) -> RgbImage {
        let colour = |px: f64| {
            let level = (px / LIMIT_PX).max(1e-9).log2() / 4.0;
            let faded = |share: f64| (255.0 * (1.0 - share.clamp(0.0, 1.0))) as u8;
            if level > 0.0 { Rgb([255, faded(level), faded(level)]) } else { Rgb([faded(-level), faded(-level), 255]) }
        };
        let [w, h] = self.size;
        RgbImage::from_fn(w, h, |x, z| self.px[(z * w + x) as usize].map_or(Rgb([128; 3]), colour))
    }
}

/// Returns the findings for all placements at a distance from the world's origin, metres.
pub fn findings(origin_m: f64) -> Vec<Finding> {
    let finding = |(placement, name): (VertexPlacement, &'static str)| {
        let px = Jitter::of(origin_m, placement).max_px();
        if placement == VertexPlacement::SampleRelative {
            Finding::within(name, px, LIMIT_PX)
        } else {
            Finding::reported(name, px)
        }
    };
    PLACEMENTS.map(finding).to_vec()
}

/// Returns a frame of a camera that moves slowly over the terrain.
fn view(field: &Field, frame: usize) -> View {
    let start = field.world_at(30.0, 70.0, 330.0);
    let travelled = glam::DVec3::new(0.7, 0.1, -0.7) * STEP_M * frame as f64;
    View {
        eye: start + travelled,
        world_from_eye: View::turned(-50.0, -20.0, 0.0),
        lens: Lens::Perspective { fov_x: 60f64.to_radians() },
        size: [1920, 1080],
        near: 0.1,
        tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
        time_s: 0.0,
    }
}

/// Returns the difference between the drawn and the exact screen position of a sample, pixels; `None` if it is out of
/// view.
fn offset(field: &Field, view: &View, placement: VertexPlacement, [i, j]: [u32; 2]) -> Option<DVec2> {
    let point = field.world(i, j);
    if !in_view(view, point) {
        return None;
    }
    let truth = view.project(point)?.pixel;
    let drawn = match placement {
        VertexPlacement::WorldF32 => {
            let clip_from_world = view.clip_from_relative() * glam::DMat4::from_translation(-view.eye);
            clip_from_world.as_mat4() * point.as_vec3().extend(1.0)
        }
        VertexPlacement::EyeRelative => view.clip_from_relative().as_mat4() * (point - view.eye).as_vec3().extend(1.0),
        VertexPlacement::SampleRelative => {
            let frame = Frame::placing(field, view);
            let relative = relative_position(&frame, [i as i32, j as i32], field.height(i, j));
            Mat4::from_cols_array_2d(&frame.camera.clip_from_relative) * Vec3::from(relative).extend(1.0)
        }
    };
    Some(pixel(drawn, view) - truth)
}

/// Converts a clip-space position to pixels.
fn pixel(clip: Vec4, view: &View) -> DVec2 {
    let size = DVec2::new(view.size[0].into(), view.size[1].into());
    let at = DVec2::new((clip.x / clip.w).into(), (clip.y / clip.w).into());
    (at + 1.0) / 2.0 * size
}

/// Saves the jitter image of each placement and origin, enlarged, and returns files with captions.
pub fn save_maps(folder: &Path) -> Result<Vec<Picture>> {
    const ENLARGED: u32 = 3;
    let mut pictures = Vec::new();
    for (origin_m, place) in ORIGINS {
        for (placement, name) in PLACEMENTS {
            let jitter = Jitter::of(origin_m, placement);
            let [w, h] = jitter.size;
            let map = resize(&jitter.map(), ENLARGED * w, ENLARGED * h, FilterType::Nearest);
            let file = format!("jitter-{place}-{placement:?}.png").to_lowercase().replace(' ', "-").replace('\'', "");
            let path = folder.join(&file);
            replace(&path, |out| map.write_to(out, ImageFormat::Png).map_err(io::Error::other))
                .with_context(|| path.display().to_string())?;
            let caption = format!("Jitter at {place}, {name}: at most {:.3}", jitter.max_px());
            pictures.push(Picture { file, caption });
        }
    }
    Ok(pictures)
}
