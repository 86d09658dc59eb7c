//! What a scene needs, and therefore what is left out: worked out before anything is made on the device, and
//! everything on the device is made from it alone.

use glam::DVec3;

use crate::draw::layout::Frame;
use crate::draw::{Hiding, Manner, Morph, Normals, Seams};
use crate::height::{Field, Samples};
use crate::texture::detail;
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
}

impl Default for Look {
    fn default() -> Self {
        Self { colour: Colour::Height, sun: [300.0, 35.0], fog: 0.0, wireframe: false, detail: false, sun_speed: 0.0 }
    }
}

/// What the device allows, as far as the plan depends on it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeviceLimits {
    /// Largest side of a 2D image.
    pub image_side: u32,
    /// Most layers of an image.
    pub image_layers: u32,
    /// Whether height textures can be filtered linearly.
    pub filters_heights: bool,
}

/// The features of one scene's pipelines and resources.
#[derive(Clone, Debug, PartialEq)]
pub struct ScenePlan {
    /// 16-bit heights stay 16-bit.
    pub coded: bool,
    /// The field repeats.
    pub tiled: bool,
    /// Some samples have no data.
    pub holes: bool,
    /// A ceiling lies over the field: its heights are there, and a lamp at the eye lights both.
    pub ceiling: bool,
    /// Fog is computed.
    pub fog: bool,
    /// What colours say; `Overlay` keeps a picture.
    pub colour: Colour,
    /// Edges only.
    pub wireframe: bool,
    /// Side of a page of the height texture as a power of two; 0: one page holds the whole field.
    pub page_shift: u32,
    /// Normals filter heights with the device's sampler.
    pub filtered: bool,
    /// What the technique's lists ask for.
    pub manner: Manner,
    /// The ground's materials are there, and looked up.
    pub detail: bool,
    /// Timestamps and pipeline statistics are taken.
    pub measured: bool,
    /// Samples stored along (x, z).
    pub stored: [u32; 2],
}

/// One feature of a plan and what became of it.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Decision {
    /// What it is.
    pub feature: &'static str,
    /// Why it is kept or left out.
    pub reason: String,
    /// Device bytes that leaving it out saves, or that it takes.
    pub bytes: u64,
}

impl ScenePlan {
    /// The plan for a field and a look, or which limit of the device the field exceeds.
    pub fn new(field: &Field, look: &Look, device: &DeviceLimits) -> Result<Self, String> {
        let (stored, is_endless) = (field.stored(), field.land().is_some());
        let page_shift = if stored.iter().all(|&n| n <= device.image_side) { 0 } else { device.image_side.ilog2() };
        let plan = Self {
            coded: matches!(field.samples(), Samples::Coded { .. }),
            tiled: field.is_tiled(),
            holes: field.holes().count() > 0,
            ceiling: field.ceiling().is_some(),
            fog: look.fog > 0.0,
            // Without samples there is nothing to be compared with.
            colour: if is_endless && look.colour == Colour::Error { Colour::Height } else { look.colour },
            wireframe: look.wireframe,
            page_shift,
            filtered: device.filters_heights && page_shift == 0,
            manner: Manner::default(),
            detail: look.detail,
            measured: true,
            stored,
        };
        let layers = plan.pages()[0] * plan.pages()[1];
        if layers > device.image_layers {
            return Err(format!(
                "{} x {} samples need {layers} pages of {}²: maxImageArrayLayers is {}",
                stored[0],
                stored[1],
                plan.page_size()[0],
                device.image_layers
            ));
        }
        Ok(plan)
    }

    /// The plan for a technique whose lists ask for this.
    pub fn with_manner(self, manner: Manner) -> Self {
        Self { manner, ..self }
    }

    /// Whether pictures need a depth buffer.
    pub fn has_depth(&self) -> bool {
        self.manner.hiding == Hiding::ByDepth
    }

    /// Texels of a page of the height texture (x, z).
    pub fn page_size(&self) -> [u32; 2] {
        if self.page_shift == 0 { self.stored } else { [1 << self.page_shift; 2] }
    }

    /// Pages of the height texture along (x, z).
    pub fn pages(&self) -> [u32; 2] {
        let page = self.page_size();
        [0, 1].map(|k| self.stored[k].div_ceil(page[k]))
    }

    /// Bytes of a stored height.
    pub fn texel_bytes(&self) -> u64 {
        if self.coded { 2 } else { 4 }
    }

    fn samples(&self) -> u64 {
        u64::from(self.stored[0]) * u64::from(self.stored[1])
    }

    /// What is kept and what is left out, in that order.
    pub fn decisions(&self, field: &Field) -> (Vec<Decision>, Vec<Decision>) {
        let samples = self.samples();
        let overlay = self.colour == Colour::Overlay;
        let sort = |keep: bool, feature, kept: &str, left_out: &str, bytes: u64| {
            (keep, Decision { feature, reason: if keep { kept } else { left_out }.to_string(), bytes })
        };
        let holes = format!("{} samples without data", field.holes().count());
        let all = [
            sort(
                !self.coded,
                "32-bit heights",
                "heights do not fit 16 bits",
                "heights are exact in 16 bits",
                2 * samples,
            ),
            sort(self.holes, "hole mask", &holes, "every sample has data", samples),
            sort(
                self.ceiling,
                "ceiling",
                "the field is the floor of a cave",
                "nothing lies over the field",
                self.texel_bytes() * samples,
            ),
            sort(self.tiled, "tiling", "the field repeats", "the field does not repeat", 0),
            sort(self.page_shift > 0, "height pages", "the field exceeds one image", "one image holds the field", 0),
            sort(!self.filtered, "filtering in the shader", "the device cannot", "the device's sampler does it", 0),
            sort(
                self.manner.morph != Morph::No,
                "vertex weights",
                "lattice vertices morph or fall onto coarser sides",
                "no lattice vertex moves",
                0,
            ),
            sort(
                self.manner.seams == Seams::Skirts,
                "skirts",
                "meshes have edges of their own",
                "meshes share their edges",
                0,
            ),
            sort(
                self.manner.normals == Normals::Vertices,
                "vertex normals",
                "vertices carry what lights them",
                "the height texture lights each pixel",
                0,
            ),
            sort(self.has_depth(), "depth buffer", "triangles come in any order", "the furthest come first", 0),
            sort(self.fog, "fog", "asked for", "density 0", 0),
            sort(self.detail, "detail textures", "asked for", "the ground is not looked at from near", detail::bytes()),
            sort(overlay, "overlay", "asked for", "no picture is laid over", 0),
            sort(self.wireframe, "wireframe", "asked for", "faces are filled", 0),
            sort(self.measured, "queries", "times are reported", "nothing is measured", 0),
        ];
        let (kept, left_out): (Vec<_>, Vec<_>) = all.into_iter().partition(|(keep, _)| *keep);
        let decisions = |part: Vec<(bool, Decision)>| part.into_iter().map(|(_, decision)| decision).collect();
        (decisions(kept), decisions(left_out))
    }
}

impl Look {
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
        let repeats = |k: usize| Repeats::new(placing.anchor[k], field.spacing[k]);
        Frame {
            height_range: range,
            sun: self.towards_sun().as_vec3().to_array(),
            fog_density: self.fog as f32,
            detail_first: [0, 1].map(|k| repeats(k).first),
            detail_scale: [0, 1].map(|k| repeats(k).scale),
            pixel_slope: slope as f32,
            pixel_size: size as f32,
            ..placing
        }
    }
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
    fn new(anchor: i32, spacing_m: f64) -> Self {
        let shift = (PERIOD_M / spacing_m).log2().round().clamp(-24.0, 24.0) as i32;
        let first = if shift > 0 { anchor.rem_euclid(1 << shift) } else { 0 };
        Self { first: first as f32, scale: 2f32.powi(-shift) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn materials_repeat_alike_from_every_anchor() {
        for spacing in [0.001, 0.3, 1.0, 20.0, 30.7, 512.0, 9000.0, 1e5] {
            let scale = Repeats::new(0, spacing).scale;
            // A place some samples from one anchor is the same place as that many more from another one.
            for anchor in [-3, 0, 1, 77, 499_773, 1 << 29] {
                let at = |anchor: i32, along: i32| {
                    let Repeats { first, scale } = Repeats::new(anchor, spacing);
                    (f64::from(first) + f64::from(along)) * f64::from(scale)
                };
                let apart = at(anchor, 500) - at(anchor + 500, 0);
                assert_eq!(apart, apart.round(), "{spacing} m from {anchor}");
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
