//! Pass `shading only`: the fragment work of a frame without its triangles, a lower bound of the frame's time.
//!
//! A full-screen triangle reads the depth that the frame left, finds the point behind each pixel, and colours it as the
//! frame did.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;

use super::fullscreen::Fullscreen;
use crate::gpu::device::Gpu;
use crate::gpu::frames::Recording;
use crate::gpu::pass::{MakeInput, Occurs, Origin, Pass, PassInput, Resource, Row};
use crate::gpu::target::Offscreen;
use crate::gpu::terrain::Terrain;
use crate::plan::ScenePlan;

pub(super) static ROW: Row = Row {
    name: "shading only",
    reads: &[Resource::Uniforms, Resource::Textures, Resource::DrawnDepth],
    writes: &[Resource::Colour],
    occurs: Occurs::Last,
    origin: Origin::Caller,
};

/// The pass over one picture.
pub struct ShadingOnly(Fullscreen);

impl ShadingOnly {
    /// Makes the pass for a scene over pictures of a target, which has depth.
    ///
    /// # Errors
    /// If the device is out of memory.
    ///
    /// # Panics
    /// If the target has no depth.
    pub fn new(gpu: &Arc<Gpu>, plan: &ScenePlan, scene: &Terrain, target: &Offscreen) -> Result<Self> {
        let formats = Offscreen::formats(false);
        let input = MakeInput { gpu, plan, scene: scene.set_layout(), formats, drawn: None };
        let depth = (target.depth_image().view, vk::ImageLayout::DEPTH_READ_ONLY_OPTIMAL);
        Fullscreen::new(&input, ROW.name, ["shading_only.vert", "shading_only.frag"], depth).map(Self)
    }
}

impl Pass for ShadingOnly {
    fn row(&self) -> &'static Row {
        &ROW
    }

    fn record(&mut self, recording: &mut Recording, scene: &mut Terrain, _: &PassInput) -> Result<()> {
        self.0.draw(recording, scene.scene_set(recording));
        Ok(())
    }
}
