//! The appearance of the terrain, and the shader constants of a frame.

use glam::DVec3;

use super::colour::Colour;
use super::forced_set::Forced;
use super::mipmaps::overlay_bytes;
use crate::draw::layout::{Frame, Lighting, SurfaceTextures};
use crate::height::Field;
use crate::texture::drape::Drape;
use crate::view::View;

/// The appearance of the terrain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// The quantity that colours show.
    pub colour: Colour,
    /// Azimuth (0 = north, 90 = east) and altitude of the sun, degrees.
    pub sun: [f64; 2],
    /// Optical density of the fog, per metre; 0: no fog.
    pub fog: f64,
    /// Triangles are drawn as edges.
    pub wireframe: bool,
    /// Detail textures cover the ground, under the tint and the overlay.
    pub detail: bool,
    /// Change of the sun's azimuth, degrees per second.
    pub sun_speed: f64,
    /// Memory budget of the overlay, or of the virtual ground, bytes. A larger picture becomes a virtual texture.
    pub texture_bytes: u64,
    /// Position of the overlay on the field; `None`: it covers the field.
    pub drape: Option<Drape>,
    /// Features that are kept or omitted whatever the scene needs.
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
    /// Returns true if a picture of this size (texels) is within the memory budget.
    pub fn holds(&self, size: [u32; 2]) -> bool {
        overlay_bytes(size) <= self.texture_bytes
    }

    /// Position of the overlay on a field.
    pub fn drape_over(&self, field: &Field) -> Drape {
        self.drape.unwrap_or_else(|| Drape::over(field))
    }

    /// The look after some seconds: the sun has moved.
    pub fn after(&self, seconds: f64) -> Look {
        let [azimuth, altitude] = self.sun;
        Look { sun: [(azimuth + self.sun_speed * seconds).rem_euclid(360.0), altitude], ..*self }
    }

    /// Unit vector towards the sun (x east, y up, z south).
    pub fn towards_sun(&self) -> DVec3 {
        let [azimuth, altitude] = self.sun.map(f64::to_radians);
        DVec3::new(azimuth.sin() * altitude.cos(), altitude.sin(), -azimuth.cos() * altitude.cos())
    }

    /// The shader constants of a view of the field. `range`: lowest and highest sample, metres.
    pub fn frame(&self, field: &Field, view: &View, range: [f32; 2]) -> Frame {
        let placing = Frame::placing(field, view);
        Frame {
            lighting: Lighting {
                sun: self.towards_sun().as_vec3().to_array(),
                fog_density: self.fog as f32,
                lamp_reach: lamp_reach(field, view.eye, range),
                tint_range: tinted_range(field, range),
            },
            textures: self.textures(field, placing.camera.origin.at),
            ..placing
        }
    }

    fn textures(&self, field: &Field, render_origin: [i32; 2]) -> SurfaceTextures {
        let overlay = self.drape_over(field).uv_from_samples(render_origin);
        let repeats = |k: usize| Repeats::new(render_origin[k], field.spacing[k]);
        SurfaceTextures {
            detail_first: [0, 1].map(|k| repeats(k).first),
            detail_scale: [0, 1].map(|k| repeats(k).scale),
            overlay_first: overlay.first,
            overlay_scale: overlay.scale,
            overlay_period: overlay.period,
            overlay_start: overlay.start,
        }
    }
}

/// Reach of the lamp in a cave whose heights have this range, metres: about the height of the cave, and from outside the
/// distance to the cave too.
fn lamp_reach(field: &Field, eye: DVec3, range: [f32; 2]) -> f32 {
    let [low, high] = range.map(f64::from);
    let [east, south] = field.size().map(|n| f64::from(n) - 1.0);
    let ends = [field.world_at(0.0, 0.0, low), field.world_at(east, south, high)];
    let away = (ends[0] - eye).max(eye - ends[1]).max(DVec3::ZERO).length();
    (0.7 * (high - low) + 2.0 * away) as f32
}

/// Approximate period of the detail textures along an axis, metres.
const PERIOD_M: f64 = 4096.0;

/// Repetition of the detail textures along an axis of the lattice. The period is a power of two of samples, or a power of
/// two of periods make a sample. The position of any render origin in the period is therefore exact.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Repeats {
    /// Position of the render origin in the period, samples.
    first: f32,
    /// Periods per sample.
    scale: f32,
}

impl Repeats {
    fn new(render_origin: i32, spacing_m: f64) -> Self {
        let shift = (PERIOD_M / spacing_m).log2().round().clamp(-24.0, 24.0) as i32;
        let first = if shift > 0 { render_origin.rem_euclid(1 << shift) } else { 0 };
        Self { first: first as f32, scale: 2f32.powi(-shift) }
    }
}

/// The range of the tint, metres. It exceeds a range of heights that is too small, beside the field's length, for heights
/// reconstructed in single precision.
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
            // The same position relative to two render origins has the same phase.
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
    fn the_sun_moves() {
        let look = Look { sun: [350.0, 30.0], sun_speed: 15.0, ..Look::default() };
        assert_eq!(look.after(2.0).sun, [20.0, 30.0]);
        assert_eq!(look.after(0.0), look);
    }
}
