//! What a scene needs, and therefore what is left out: worked out before anything is made on the device, and
//! everything on the device is made from it alone.

mod builder;
mod colour;
mod constants;
pub mod features;
pub mod forced;
mod look;

use crate::draw::{DepthMode, DrawKinds, Morph, PipelineRequirements, Seams};
use crate::texture::drape::Drape;
use crate::texture::virtual_ground::VirtualGroundLayout;
use crate::texture::virtual_overlay::VirtualTextureLayout;
pub use builder::ScenePlanBuilder;
pub use colour::Colour;
pub use constants::SceneConstants;
pub use features::{FEATURES, Feature, mip_levels};
pub use forced::Forced;
pub use look::Look;

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
    pub requirements: PipelineRequirements,
    /// The draws that there are programs for.
    pub draws: DrawKinds,
    /// The ground's materials are there, and looked up.
    pub detail: bool,
    /// Timestamps and pipeline statistics are taken.
    pub measured: bool,
    /// Pictures go to a window.
    pub windowed: bool,
    /// Samples stored along (x, z).
    pub stored: [u32; 2],
    /// Texels of the picture that may be laid over (x, z).
    pub overlay: Option<[u32; 2]>,
    /// How it is cut where it is there in parts.
    pub maps: Option<VirtualTextureLayout>,
    /// Where it lies over the field.
    pub drape: Drape,
    /// How texels of the ground are kept, if they are asked for.
    pub ground: Option<VirtualGroundLayout>,
    /// What was kept and left out by hand.
    pub forced: Forced,
}

/// Pages of fewer samples a side than 2^4 are not worth their lookup.
const MIN_PAGE_SHIFT: u32 = 4;

/// The side of a page of the height texture as a power of two: the largest whose pages hold at most an eighth more texels
/// than samples or, where none does, that with the fewest texels. 0: one image holds all samples.
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

    /// The same plan with one feature kept whether it is needed or not, by its [`word`](forced::word); or why that
    /// cannot be.
    pub fn keeping(&self, name: &str) -> Result<Self, String> {
        let mut plan = self.clone();
        for (feature, keep) in Forced::default().with(name, true)?.each() {
            feature.force(&mut plan, keep);
        }
        Ok(plan)
    }

    /// Heights in several pages although one would hold them, half as long as the longer side or shorter.
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

    /// Whether what is drawn is looked at on the host first: its triangles say which texels the ground needs.
    pub fn reads_lists(&self) -> bool {
        self.ground.is_some()
    }

    /// Whether pictures need a depth buffer.
    pub fn has_depth(&self) -> bool {
        self.requirements.depth_mode == DepthMode::Buffer
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
        // What no layers hold is refused by the largest pages.
        assert_eq!(page_shift([1 << 30, 1 << 30], &device), 14);
    }
}
