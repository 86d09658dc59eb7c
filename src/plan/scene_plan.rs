//! The plan of a scene as plain data, and the sizes and constants that follow from it.

use super::colour::Colour;
use super::constants::SceneConstants;
use super::device_limits::DeviceLimits;
use super::forced_set::Forced;
use crate::draw::{DepthMode, DrawKinds, Morph, PipelineRequirements, Seams};
use crate::texture::drape::Drape;
use crate::texture::virtual_ground::VirtualGroundLayout;
use crate::texture::virtual_layout::VirtualTextureLayout;

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

impl ScenePlan {
    /// Fails if the pages of the height texture exceed the layers of an image.
    pub(super) fn check_layers(&self, limits: &DeviceLimits) -> Result<(), String> {
        let layers = self.pages()[0] * self.pages()[1];
        if layers <= limits.image_layers {
            return Ok(());
        }
        let ([x, z], [side, _]) = (self.stored, self.page_size());
        let available = limits.image_layers;
        Err(format!("{x} x {z} samples need {layers} pages of {side}²: maxImageArrayLayers is {available}"))
    }

    /// Cuts heights that fit one page into pages at most half as long as the field's longer side.
    pub(super) fn cut_into_pages(&mut self) {
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

    /// Number of samples stored.
    pub(super) fn samples(&self) -> u64 {
        u64::from(self.stored[0]) * u64::from(self.stored[1])
    }
}
