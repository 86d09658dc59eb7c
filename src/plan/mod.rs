//! The plan of a scene: the features it needs, and those that are omitted.
//!
//! It is made before any object on the device, and alone decides which objects exist.

mod builder;
mod colour;
mod constants;
pub mod features;
pub mod forced;
mod look;

use crate::draw::{DepthMode, DrawKinds, Morph, PipelineRequirements, Seams};
use crate::texture::drape::Drape;
use crate::texture::virtual_ground::VirtualGroundLayout;
use crate::texture::virtual_layout::VirtualTextureLayout;
pub use builder::ScenePlanBuilder;
pub use colour::Colour;
pub use constants::SceneConstants;
pub use features::{FEATURES, Feature, mip_levels};
pub use forced::Forced;
pub use look::Look;

/// The limits of a device on which plans depend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeviceLimits {
    /// Maximum side of a 2D image, texels.
    pub image_side: u32,
    /// Maximum number of layers of an image.
    pub image_layers: u32,
    /// True if samplers can filter height textures linearly.
    pub filters_heights: bool,
}

/// The features of a scene's pipelines and resources.
#[derive(Clone, Debug, PartialEq)]
pub struct ScenePlan {
    /// The height texture holds 16-bit codes.
    pub coded: bool,
    /// The field repeats.
    pub tiled: bool,
    /// Some samples have no data.
    pub holes: bool,
    /// A ceiling lies over the field: a second height texture, and a lamp at the eye.
    pub ceiling: bool,
    /// Fog is computed.
    pub fog: bool,
    /// The quantity that colours show.
    pub colour: Colour,
    /// Triangles are drawn as edges.
    pub wireframe: bool,
    /// Side of a page of the height texture as a power of two; 0: one page holds the whole field.
    pub page_shift: u32,
    /// The device's sampler filters heights for normals.
    pub filtered: bool,
    /// The pipelines that the technique's lists need.
    pub requirements: PipelineRequirements,
    /// The kinds of draws that have pipelines.
    pub draws: DrawKinds,
    /// Detail textures cover the ground.
    pub detail: bool,
    /// Timestamp and pipeline statistics queries run.
    pub measured: bool,
    /// Pictures go to a window.
    pub windowed: bool,
    /// Number of samples stored along (x, z).
    pub stored: [u32; 2],
    /// Size of the overlay picture, texels (x, z).
    pub overlay: Option<[u32; 2]>,
    /// Layout of the overlay as a virtual texture, if it is one.
    pub maps: Option<VirtualTextureLayout>,
    /// Position of the overlay on the field.
    pub drape: Drape,
    /// Layout of the virtual ground, if colours show it.
    pub ground: Option<VirtualGroundLayout>,
    /// Features that were kept or omitted by hand.
    pub forced: Forced,
}

/// Smallest side of a page as a power of two: smaller pages cost more in lookups than they save.
const MIN_PAGE_SHIFT: u32 = 4;

/// The side of a page of the height texture as a power of two; 0: one image holds all samples. The largest side whose
/// pages hold at most an eighth more texels than samples, or else the side with the fewest texels.
fn page_shift(stored: [u32; 2], device: &DeviceLimits) -> u32 {
    if stored.iter().all(|&n| n <= device.image_side) {
        return 0;
    }
    let largest = device.image_side.ilog2();
    let pages = |shift: u32| stored.iter().map(|n| u64::from(n.div_ceil(1 << shift))).product::<u64>();
    let texels = |shift: u32| pages(shift) << (2 * shift);
    let samples: u64 = stored.iter().map(|&n| u64::from(n)).product();
    let shifts = || (MIN_PAGE_SHIFT..=largest).rev().filter(|&shift| pages(shift) <= u64::from(device.image_layers));
    let tight = shifts().find(|&shift| texels(shift) <= samples + samples / 8);
    tight.or_else(|| shifts().min_by_key(|&shift| texels(shift))).unwrap_or(largest)
}

/// A feature that a plan keeps or omits.
#[derive(Clone, Debug, serde::Serialize)]
pub struct Decision {
    /// Its name.
    pub feature: &'static str,
    /// The reason.
    pub reason: String,
    /// Device bytes that it takes, or that omitting it saves.
    pub bytes: u64,
}

impl ScenePlan {
    /// The plan of the same scene for another technique.
    pub fn with_requirements(&self, requirements: PipelineRequirements) -> Self {
        let mut plan = Self { requirements, draws: requirements.draws, ..self.clone() };
        plan.force();
        plan
    }

    fn check_layers(&self, limits: &DeviceLimits) -> Result<(), String> {
        let layers = self.pages()[0] * self.pages()[1];
        if layers <= limits.image_layers {
            return Ok(());
        }
        let ([x, z], [side, _]) = (self.stored, self.page_size());
        let available = limits.image_layers;
        Err(format!("{x} x {z} samples need {layers} pages of {side}²: maxImageArrayLayers is {available}"))
    }

    fn force(&mut self) {
        for (feature, keep) in self.forced.each() {
            feature.force(self, keep);
        }
    }

    /// The plan with one more feature, named by its [`word`](forced::word), whether the scene needs it or not.
    ///
    /// # Errors
    /// If there is no such feature, or it cannot be forced.
    pub fn keeping(&self, name: &str) -> Result<Self, String> {
        let mut plan = self.clone();
        for (feature, keep) in Forced::default().with(name, true)?.each() {
            feature.force(&mut plan, keep);
        }
        Ok(plan)
    }

    /// Cuts heights that fit one page into pages at most half as long as the field's longer side.
    fn cut_into_pages(&mut self) {
        let longest = self.stored[0].max(self.stored[1]).max(4);
        if self.page_shift == 0 {
            self.page_shift = (longest - 1).ilog2();
            self.filtered = false;
        }
    }

    /// The specialization constants of the scene's shaders.
    pub fn constants(&self) -> SceneConstants {
        let [map_columns, map_rows] = self.maps.map_or([0.0; 2], |layout| layout.extent.map(|pages| pages as f32));
        SceneConstants {
            coded: self.coded,
            tiled: self.tiled,
            page_shift: self.page_shift,
            holes: self.holes,
            fog: self.fog,
            colour: self.colour,
            filtered: self.filtered,
            morph: self.requirements.morph != Morph::No,
            skirts: self.requirements.seams == Seams::Skirts,
            detail: self.detail,
            distance: self.requirements.morph == Morph::ByDistance,
            masked: self.stored.iter().all(|n| n.is_power_of_two()),
            ceiling: self.ceiling,
            map_shift: self.ground.map_or(0, |layout| 32 - layout.root_shift),
            map_columns,
            map_rows,
            overlay_ends: self.drape.ends,
        }
    }

    /// Returns true if the host reads the draw list: its triangles tell which texels of the virtual ground are needed.
    pub fn reads_lists(&self) -> bool {
        self.ground.is_some()
    }

    /// Returns true if pictures need a depth buffer.
    pub fn has_depth(&self) -> bool {
        self.requirements.depth_mode == DepthMode::Buffer
    }

    /// Size of a page of the height texture, texels (x, z).
    pub fn page_size(&self) -> [u32; 2] {
        if self.page_shift == 0 { self.stored } else { [1 << self.page_shift; 2] }
    }

    /// Number of pages of the height texture along (x, z).
    pub fn pages(&self) -> [u32; 2] {
        let page = self.page_size();
        [0, 1].map(|k| self.stored[k].div_ceil(page[k]))
    }

    /// Size of a stored height, bytes.
    pub fn texel_bytes(&self) -> u64 {
        if self.coded { 2 } else { 4 }
    }

    fn samples(&self) -> u64 {
        u64::from(self.stored[0]) * u64::from(self.stored[1])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_hold_few_texels_more_than_samples() {
        let device = DeviceLimits { image_side: 16_384, image_layers: 2048, filters_heights: true };
        for (stored, shift) in [
            ([16_384, 16_384], 0),
            ([16_385, 16_385], 9),
            ([16_385, 2], 4),
            ([32_768, 32_768], 14),
            ([40_000, 40_000], 13),
            ([131_072, 131_072], 14),
        ] {
            let found = page_shift(stored, &device);
            assert_eq!(found, shift, "{stored:?}");
            let pages = stored.iter().map(|n| u64::from(n.div_ceil(1 << found))).product::<u64>();
            assert!(found == 0 || pages <= 2048, "{stored:?}: {pages} pages");
        }
        // A field that no layers hold gets the largest pages; the check of layers rejects it.
        assert_eq!(page_shift([1 << 30, 1 << 30], &device), 14);
    }
}
