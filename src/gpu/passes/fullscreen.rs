//! A full-screen triangle whose fragment shader reads one image: the base of post-processing passes.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;

use crate::gpu::bindings::{Bindings, Bound};
use crate::gpu::device::Gpu;
use crate::gpu::frames::Recording;
use crate::gpu::height_pages::{self, Sampler, Sampling};
use crate::gpu::pass::MakeInput;
use crate::gpu::pipelines::{self, Description};
use crate::gpu::shaders::Constants;

/// Pipeline and descriptors of one full-screen triangle.
pub(in crate::internal::gpu) struct Fullscreen {
    gpu: Arc<Gpu>,
    bindings: Bindings,
    pipeline: vk::Pipeline,
    _sampler: Sampler,
}

impl Fullscreen {
    /// Makes the pipeline of a vertex and a fragment shader. Set 0 is the scene's; binding 0 of set 1 is the image,
    /// sampled without filtering in the layout given.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn new(
        input: &MakeInput,
        name: &'static str,
        [vertex, fragment]: [&'static str; 2],
        (view, layout): (vk::ImageView, vk::ImageLayout),
    ) -> Result<Self> {
        let gpu = input.gpu;
        let sampler = height_pages::sampler(gpu, Sampling::Texels)?;
        let image = Bound::Texture(sampler.raw, view, layout);
        let bindings = Bindings::new(gpu, name, Some(input.scene), vk::ShaderStageFlags::FRAGMENT, &[image], 0)?;
        let description = Description {
            name,
            vertex,
            fragment: Some(fragment),
            constants: &Constants::of(input.plan),
            input: vk::PipelineVertexInputStateCreateInfo::default(),
            topology: vk::PrimitiveTopology::TRIANGLE_LIST,
            wireframe: false,
            depth: None,
            cull: vk::CullModeFlags::NONE,
            formats: Some(input.formats),
        };
        let pipeline = pipelines::make(gpu, bindings.layout, description)?;
        Ok(Self { gpu: Arc::clone(gpu), bindings, pipeline, _sampler: sampler })
    }

    /// Records the triangle. `scene` holds the descriptors of the frame.
    pub fn draw(&self, recording: &Recording, scene: vk::DescriptorSet) {
        let (raw, commands, graphics) = (&self.gpu.raw, recording.commands, vk::PipelineBindPoint::GRAPHICS);
        let sets = [scene, self.bindings.set];
        // SAFETY: pipeline and sets outlive the frame; three vertices without input.
        unsafe {
            raw.cmd_bind_pipeline(commands, graphics, self.pipeline);
            raw.cmd_bind_descriptor_sets(commands, graphics, self.bindings.layout, 0, &sets, &[]);
            raw.cmd_draw(commands, 3, 1, 0, 0);
        }
    }
}

impl Drop for Fullscreen {
    fn drop(&mut self) {
        // SAFETY: nothing is in use once the device is idle.
        unsafe {
            let _ = self.gpu.wait_idle();
            self.gpu.raw.destroy_pipeline(self.pipeline, None);
        }
    }
}
