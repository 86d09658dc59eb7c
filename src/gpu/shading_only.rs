//! The floor of a frame's time: its fragment work without its triangles. One pass over the whole picture is fed
//! the depth that the frame left, finds the place behind each pixel, and colours it as the frame did.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;

use super::bindings::{Bindings, Bound};
use super::device::Gpu;
use super::frames::Recording;
use super::height_pages::{self, Sampler, Sampling};
use super::memory::barriers;
use super::pipelines::{self, Description};
use super::shaders::Constants;
use super::target::{self, Offscreen};
use crate::plan::ScenePlan;

/// What the pass needs.
pub struct ShadingOnly {
    gpu: Arc<Gpu>,
    bindings: Bindings,
    pipeline: vk::Pipeline,
    _sampler: Sampler,
}

impl ShadingOnly {
    /// Makes the pass for a scene, whose descriptors have the layout `scene`, over pictures of this target.
    pub fn new(gpu: &Arc<Gpu>, plan: &ScenePlan, scene: vk::DescriptorSetLayout, target: &Offscreen) -> Result<Self> {
        let sampler = height_pages::sampler(gpu, Sampling::Texels)?;
        let depth = Bound::Texture(sampler.raw, target.depth_image().view, vk::ImageLayout::DEPTH_READ_ONLY_OPTIMAL);
        let bindings = Bindings::new(gpu, "shading only", Some(scene), vk::ShaderStageFlags::FRAGMENT, &[depth], 0)?;
        let mut shading_only =
            Self { gpu: Arc::clone(gpu), bindings, pipeline: vk::Pipeline::null(), _sampler: sampler };
        shading_only.pipeline = pipelines::make(
            gpu,
            shading_only.bindings.layout,
            Description {
                name: "shading only",
                vertex: "shading_only.vert",
                fragment: Some("shading_only.frag"),
                constants: &Constants::of(plan),
                input: vk::PipelineVertexInputStateCreateInfo::default(),
                topology: vk::PrimitiveTopology::TRIANGLE_LIST,
                wireframe: false,
                depth: None,
                cull: vk::CullModeFlags::NONE,
                formats: Some(Offscreen::formats(false)),
            },
        )?;
        Ok(shading_only)
    }

    /// Records the pass. The target's depth is that of a frame drawn before; `scene` describes the same view.
    pub fn draw(&self, recording: &mut Recording, target: &Offscreen, scene: vk::DescriptorSet) -> Result<()> {
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
        let written = target::DEPTH_WRITTEN;
        let read = (Stage::FRAGMENT_SHADER, Access::SHADER_SAMPLED_READ, Layout::DEPTH_READ_ONLY_OPTIMAL);
        barriers(recording.gpu, recording.commands, &[target.depth_image().barrier(written, read)]);
        target::begin(recording, target.attachment(), None);
        recording.scope("shading only", |r| {
            let (raw, commands) = (&r.gpu.raw, r.commands);
            // SAFETY: pipeline and sets outlive the frame; three vertices without input.
            unsafe {
                raw.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, self.pipeline);
                let sets = [scene, self.bindings.set];
                let graphics = vk::PipelineBindPoint::GRAPHICS;
                raw.cmd_bind_descriptor_sets(commands, graphics, self.bindings.layout, 0, &sets, &[]);
                raw.cmd_draw(commands, 3, 1, 0, 0);
            }
            Ok(())
        })?;
        target::end(recording);
        barriers(recording.gpu, recording.commands, &[target.depth_image().barrier(read, written)]);
        Ok(())
    }
}

impl Drop for ShadingOnly {
    fn drop(&mut self) {
        // SAFETY: nothing is in use once the device is idle.
        unsafe {
            let _ = self.gpu.raw.device_wait_idle();
            self.gpu.raw.destroy_pipeline(self.pipeline, None);
        }
    }
}
