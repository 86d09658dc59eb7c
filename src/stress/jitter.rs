//! How far vertices of a still scene tremble on the screen while the camera moves slowly, for three ways to place them:
//! world coordinates in single precision; double-precision differences to the eye rounded once; and the product's own,
//! differences of whole samples to the one nearest the eye ([`place::relative_position`](crate::draw::place)).

use std::io;
use std::path::Path;

use anyhow::{Context, Result};
use glam::{DVec2, Mat4, Vec3, Vec4};
use image::imageops::{FilterType, resize};
use image::{ImageFormat, Rgb, RgbImage};

use super::Finding;
use super::fields::hills_at;
use super::rows::Picture;
use crate::draw::layout::Frame;
use crate::draw::place::relative_position;
use crate::height::Field;
use crate::height::save::replace;
use crate::measure::in_view;
use crate::view::{Lens, Metric, Tolerance, View};

/// What the product may tremble by, pixels.
pub const LIMIT_PX: f64 = 1.0 / 16.0;

/// Radius of the Earth, and a millimetre, metres.
pub const EARTH_M: f64 = 6.4e6 + 1e-3;

/// Where the scene lies, metres from the world's origin along both axes.
pub const PLACES: [(f64, &str); 4] = [(0.0, "0 m"), (1e5, "1e5 m"), (1e7, "1e7 m"), (EARTH_M, "the Earth's radius")];

/// Frames, and how far the camera moves in each, metres.
const FRAMES: usize = 48;
const STEP_M: f64 = 0.05;

/// A way to place vertices.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// World coordinates as f32, with one matrix from world to clip space.
    World,
    /// Differences to the eye in f64, rounded to f32.
    Relative,
    /// As the vertex program does it.
    Product,
}

/// The ways, and what they are called in the suite's rows.
pub const MORPH_RANGES: [(Way, &str); 3] = [
    (Way::World, "world coordinates in single precision, px"),
    (Way::Relative, "relative to the camera, px"),
    (Way::Product, "as it is drawn, px"),
];

/// How much each sample of a field trembles, pixels; none for samples out of sight.
pub struct Jitter {
    size: [u32; 2],
    px: Vec<Option<f64>>,
}

impl Jitter {
    /// Of a field at some place, for one way.
    pub fn of(origin_m: f64, way: Way) -> Self {
        let field = hills_at(origin_m);
        let views: Vec<_> = (0..FRAMES).map(|frame| view(&field, frame)).collect();
        let [w, h] = field.size();
        let of_sample = |k: u32| {
            let off: Option<Vec<_>> = views.iter().map(|view| off(&field, view, way, [k % w, k / w])).collect();
            Some(off?.array_windows().map(|[a, b]| (*b - *a).length()).fold(0.0, f64::max))
        };
        Self { size: [w, h], px: (0..w * h).map(of_sample).collect() }
    }

    /// The largest, pixels.
    pub fn max_px(&self) -> f64 {
        self.px.iter().flatten().copied().fold(0.0, f64::max)
    }

    /// A pixel a sample: grey where out of sight, from blue (none) over white (the limit) to red (16 times the limit and
    /// more).
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

/// The three ways at one place.
pub fn findings(origin_m: f64) -> Vec<Finding> {
    let finding = |(way, name): (Way, &'static str)| {
        let px = Jitter::of(origin_m, way).max_px();
        if way == Way::Product { Finding::within(name, px, LIMIT_PX) } else { Finding::reported(name, px) }
    };
    MORPH_RANGES.map(finding).to_vec()
}

/// A camera that creeps over the land.
fn view(field: &Field, frame: usize) -> View {
    let start = field.world_at(30.0, 70.0, 330.0);
    let way = glam::DVec3::new(0.7, 0.1, -0.7) * STEP_M * frame as f64;
    View {
        eye: start + way,
        world_from_eye: View::turned(-50.0, -20.0, 0.0),
        lens: Lens::Perspective { fov_x: 60f64.to_radians() },
        size: [1920, 1080],
        near: 0.1,
        tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
        time_s: 0.0,
    }
}

/// How far off its true place a sample is drawn in a view, pixels; `None` if it is out of sight.
fn off(field: &Field, view: &View, way: Way, [i, j]: [u32; 2]) -> Option<DVec2> {
    let point = field.world(i, j);
    if !in_view(view, point) {
        return None;
    }
    let truth = view.project(point)?.pixel;
    let drawn = match way {
        Way::World => {
            let clip_from_world = view.clip_from_relative() * glam::DMat4::from_translation(-view.eye);
            clip_from_world.as_mat4() * point.as_vec3().extend(1.0)
        }
        Way::Relative => view.clip_from_relative().as_mat4() * (point - view.eye).as_vec3().extend(1.0),
        Way::Product => {
            let frame = Frame::placing(field, view);
            let relative = relative_position(&frame, [i as i32, j as i32], field.height(i, j));
            Mat4::from_cols_array_2d(&frame.camera.clip_from_relative) * Vec3::from(relative).extend(1.0)
        }
    };
    Some(pixel(drawn, view) - truth)
}

/// Where the rasteriser finds a position in clip space, pixels.
fn pixel(clip: Vec4, view: &View) -> DVec2 {
    let size = DVec2::new(view.size[0].into(), view.size[1].into());
    let at = DVec2::new((clip.x / clip.w).into(), (clip.y / clip.w).into());
    (at + 1.0) / 2.0 * size
}

/// Saves a map of each way at each place, an enlarged pixel a sample, and says what they show.
pub fn save_maps(folder: &Path) -> Result<Vec<Picture>> {
    const ENLARGED: u32 = 3;
    let mut pictures = Vec::new();
    for (origin_m, place) in PLACES {
        for (way, name) in MORPH_RANGES {
            let jitter = Jitter::of(origin_m, way);
            let [w, h] = jitter.size;
            let map = resize(&jitter.map(), ENLARGED * w, ENLARGED * h, FilterType::Nearest);
            let file = format!("jitter-{place}-{way:?}.png").to_lowercase().replace(' ', "-").replace('\'', "");
            let path = folder.join(&file);
            replace(&path, |out| map.write_to(out, ImageFormat::Png).map_err(io::Error::other))
                .with_context(|| path.display().to_string())?;
            let caption = format!("Jitter at {place}, {name}: at most {:.3}", jitter.max_px());
            pictures.push(Picture { file, caption });
        }
    }
    Ok(pictures)
}
