//! How the land is to look, and what a frame needs for it.

use glam::DVec3;

use super::features::overlay_bytes;
use super::forced::Forced;
use crate::draw::layout::Frame;
use crate::height::Field;
use crate::texture::drape::Drape;
use crate::view::{Lens, View};

/// What a fragment's colour says.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u32)]
pub enum Colour {
    /// Hypsometric tint.
    #[default]
    Height = 0,
    /// Level of detail.
    Level = 1,
    /// A picture laid over the field.
    Overlay = 2,
    /// Distance of the drawn surface from the samples' own, in pixels.
    Error = 3,
    /// Surface normal.
    Normal = 4,
    /// Draw.
    Batch = 5,
    /// Which map of the picture, where that is there in parts: its level, and where it ends.
    Maps = 6,
    /// A ground whose texels are made where they are seen ([`ground`](crate::texture::ground)).
    Ground = 7,
    /// Which node of the ground's map serves: its level, and where it ends.
    Nodes = 8,
}

impl Colour {
    /// Whether texels of the ground are needed for it.
    pub fn shows_ground(self) -> bool {
        matches!(self, Colour::Ground | Colour::Nodes)
    }
}

/// How the land is to look.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// What the colours say.
    pub colour: Colour,
    /// Azimuth (0 = north, 90 = east) and altitude of the sun, degrees.
    pub sun: [f64; 2],
    /// Optical density of the fog, per metre; 0: no fog.
    pub fog: f64,
    /// Edges only.
    pub wireframe: bool,
    /// The ground's materials are seen from near, under the tint and the overlay.
    pub detail: bool,
    /// How fast the sun goes on in azimuth, degrees a second.
    pub sun_speed: f64,
    /// The most bytes for a picture laid over the field, or for the texels of the ground: what is larger is there in parts,
    /// as fine as a view needs.
    pub texture_bytes: u64,
    /// Where a picture lies over the field; `None`: over all of it.
    pub drape: Option<Drape>,
    /// Features that are kept or left out whatever the scene needs.
    pub forced: Forced,
}

impl Default for Look {
    fn default() -> Self {
        Self {
            colour: Colour::Height,
            sun: [300.0, 35.0],
            fog: 0.0,
            wireframe: false,
            detail: false,
            sun_speed: 0.0,
            texture_bytes: 1 << 30,
            drape: None,
            forced: Forced::default(),
        }
    }
}

impl Look {
    /// Whether a picture of so many texels is within its bytes.
    pub fn holds(&self, size: [u32; 2]) -> bool {
        overlay_bytes(size) <= self.texture_bytes
    }

    /// The place of a picture over a field.
    pub fn drape_over(&self, field: &Field) -> Drape {
        self.drape.unwrap_or_else(|| Drape::over(field))
    }

    /// The look so many seconds later.
    pub fn after(&self, seconds: f64) -> Look {
        let [azimuth, altitude] = self.sun;
        Look { sun: [(azimuth + self.sun_speed * seconds).rem_euclid(360.0), altitude], ..*self }
    }

    /// Unit vector towards the sun (x east, y up, z south).
    pub fn towards_sun(&self) -> DVec3 {
        let [azimuth, altitude] = self.sun.map(f64::to_radians);
        DVec3::new(azimuth.sin() * altitude.cos(), altitude.sin(), -azimuth.cos() * altitude.cos())
    }

    /// All that a frame needs for this view of the field; `range` is the tint's, metres.
    pub fn frame(&self, field: &Field, view: &View, range: [f32; 2]) -> Frame {
        let (slope, size) = match view.lens {
            Lens::Perspective { .. } => (1.0 / view.focal_px(), 0.0),
            Lens::Orthographic { .. } => (0.0, 1.0 / view.focal_px()),
        };
        let placing = Frame::placing(field, view);
        let overlay = self.drape_over(field).uv_from_samples(placing.render_origin);
        let repeats = |k: usize| Repeats::new(placing.render_origin[k], field.spacing[k]);
        Frame {
            height_range: tinted_range(field, range),
            lamp_reach: lamp_reach(field, view.eye, range),
            sun: self.towards_sun().as_vec3().to_array(),
            fog_density: self.fog as f32,
            detail_first: [0, 1].map(|k| repeats(k).first),
            detail_scale: [0, 1].map(|k| repeats(k).scale),
            overlay_first: overlay.first,
            overlay_scale: overlay.scale,
            overlay_period: overlay.period,
            overlay_start: overlay.start,
            pixel_slope: slope as f32,
            pixel_size: size as f32,
            ..placing
        }
    }
}

/// How far a lamp at the eye reaches in a cave whose heights have this range, metres: about as far as the cave is high, and
/// to the cave from outside.
fn lamp_reach(field: &Field, eye: DVec3, range: [f32; 2]) -> f32 {
    let [low, high] = range.map(f64::from);
    let [east, south] = field.size().map(|n| f64::from(n) - 1.0);
    let ends = [field.world_at(0.0, 0.0, low), field.world_at(east, south, high)];
    let away = (ends[0] - eye).max(eye - ends[1]).max(DVec3::ZERO).length();
    (0.7 * (high - low) + 2.0 * away) as f32
}

/// How far materials reach along an axis before they repeat, about, metres.
const PERIOD_M: f64 = 4096.0;

/// The materials' repetition along an axis of the lattice: after a power of two of samples, or so many times a sample.
/// Thus the anchor's place in it is exact wherever the anchor is, and from one anchor to another nothing moves.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Repeats {
    /// Where the anchor lies in it, samples.
    first: f32,
    /// Repetitions a sample.
    scale: f32,
}

impl Repeats {
    fn new(render_origin: i32, spacing_m: f64) -> Self {
        let shift = (PERIOD_M / spacing_m).log2().round().clamp(-24.0, 24.0) as i32;
        let first = if shift > 0 { render_origin.rem_euclid(1 << shift) } else { 0 };
        Self { first: first as f32, scale: 2f32.powi(-shift) }
    }
}

/// The ends of the tint: the range of heights, or more where that is too little beside the field's length for heights
/// that are reconstructed in single precision.
fn tinted_range(field: &Field, [low, high]: [f32; 2]) -> [f32; 2] {
    let length_m = (0..2).map(|k| f64::from(field.size()[k]) * field.spacing[k]).fold(0.0, f64::max);
    let min_m = 1e-5 * length_m.min(1e9).max(f64::from(low.abs().max(high.abs())));
    [low, high.max((f64::from(low) + min_m.max(1e-12)) as f32).max(low.next_up())]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_repeat_alike_from_every_render_origin() {
        for spacing in [0.001, 0.3, 1.0, 20.0, 30.7, 512.0, 9000.0, 1e5] {
            let scale = Repeats::new(0, spacing).scale;
            // A place some samples from one anchor is the same place as that many more from another one.
            for render_origin in [-3, 0, 1, 77, 499_773, 1 << 29] {
                let at = |render_origin: i32, along: i32| {
                    let Repeats { first, scale } = Repeats::new(render_origin, spacing);
                    (f64::from(first) + f64::from(along)) * f64::from(scale)
                };
                let apart = at(render_origin, 500) - at(render_origin + 500, 0);
                assert_eq!(apart, apart.round(), "{spacing} m from {render_origin}");
            }
            assert!(f64::from(scale) * PERIOD_M / spacing <= 1.5 && f64::from(scale) * PERIOD_M / spacing > 0.7);
        }
    }

    #[test]
    fn the_sun_goes_on() {
        let look = Look { sun: [350.0, 30.0], sun_speed: 15.0, ..Look::default() };
        assert_eq!(look.after(2.0).sun, [20.0, 30.0]);
        assert_eq!(look.after(0.0), look);
    }
}
