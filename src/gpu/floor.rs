//! The floor of a frame's time: its fragment work without its triangles. One pass over the whole picture is fed
//! the depth that the frame left, finds the place behind each pixel, and colours it as the frame did.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;

use super::device::Gpu;
use super::frames::Recording;
use super::memory::barriers;
use super::pages::{self, Sampling};
use super::pipelines::{self, Description};
use super::shaders::Constants;
use super::target::{self, Offscreen};
use crate::plan::ScenePlan;

/// What the pass needs.
pub struct Floor {
    gpu: Arc<Gpu>,
    set_layout: vk::DescriptorSetLayout,
    layout: vk::PipelineLayout,
    pipeline: vk::Pipeline,
    descriptors: vk::DescriptorPool,
    set: vk::DescriptorSet,
    sampler: vk::Sampler,
}

impl Floor {
    /// Makes the pass for a scene, whose descriptors have the layout `scene`, over pictures of this target.
    pub fn new(gpu: &Arc<Gpu>, plan: &ScenePlan, scene: vk::DescriptorSetLayout, target: &Offscreen) -> Result<Self> {
        let kind = vk::DescriptorType::COMBINED_IMAGE_SAMPLER;
        let binding = [vk::DescriptorSetLayoutBinding::default()
            .descriptor_type(kind)
            .descriptor_count(1)
            .stage_flags(vk::ShaderStageFlags::FRAGMENT)];
        let sampler = pages::sampler(gpu, Sampling::Texels)?;
        // SAFETY: the device is alive; Drop destroys what is made here; the depth image outlives the floor.
        let mut floor = unsafe {
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&binding);
            let set_layout = gpu.raw.create_descriptor_set_layout(&info, None)?;
            let sets = [scene, set_layout];
            let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
            let layout = gpu.raw.create_pipeline_layout(&info, None)?;
            let sizes = [vk::DescriptorPoolSize { ty: kind, descriptor_count: 1 }];
            let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
            let descriptors = gpu.raw.create_descriptor_pool(&info, None)?;
            let sets = [set_layout];
            let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(descriptors).set_layouts(&sets);
            let set = gpu.raw.allocate_descriptor_sets(&info)?[0];
            let image = [vk::DescriptorImageInfo {
                sampler,
                image_view: target.depth.view,
                image_layout: vk::ImageLayout::DEPTH_READ_ONLY_OPTIMAL,
            }];
            let write = vk::WriteDescriptorSet::default().dst_set(set).descriptor_type(kind).image_info(&image);
            gpu.raw.update_descriptor_sets(&[write], &[]);
            let (gpu, pipeline) = (Arc::clone(gpu), vk::Pipeline::null());
            Self { gpu, set_layout, layout, pipeline, descriptors, set, sampler }
        };
        floor.pipeline = pipelines::make(
            gpu,
            floor.layout,
            Description {
                name: "floor",
                vertex: "floor.vert",
                fragment: Some("floor.frag"),
                constants: &Constants::of(plan),
                input: vk::PipelineVertexInputStateCreateInfo::default(),
                topology: vk::PrimitiveTopology::TRIANGLE_LIST,
                wireframe: false,
                depth: None,
                cull: vk::CullModeFlags::NONE,
                formats: Some(Offscreen::FORMATS),
            },
        )?;
        Ok(floor)
    }

    /// Records the pass. The target's depth is that of a frame drawn before; `scene` describes the same view.
    pub fn draw(&self, recording: &mut Recording, target: &Offscreen, scene: vk::DescriptorSet) -> Result<()> {
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
        let written = target::DEPTH_WRITTEN;
        let read = (Stage::FRAGMENT_SHADER, Access::SHADER_SAMPLED_READ, Layout::DEPTH_READ_ONLY_OPTIMAL);
        barriers(recording.gpu, recording.commands, &[target.depth.barrier(written, read)]);
        target::begin(recording, target.attachment(), None);
        recording.scope("floor", |r| {
            let (raw, commands) = (&r.gpu.raw, r.commands);
            // SAFETY: pipeline and sets outlive the frame; three vertices without input.
            unsafe {
                raw.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, self.pipeline);
                let sets = [scene, self.set];
                let graphics = vk::PipelineBindPoint::GRAPHICS;
                raw.cmd_bind_descriptor_sets(commands, graphics, self.layout, 0, &sets, &[]);
                raw.cmd_draw(commands, 3, 1, 0, 0);
            }
            Ok(())
        })?;
        target::end(recording);
        barriers(recording.gpu, recording.commands, &[target.depth.barrier(read, written)]);
        Ok(())
    }
}

impl Drop for Floor {
    fn drop(&mut self) {
        // SAFETY: nothing is in use once the device is idle.
        unsafe {
            let _ = self.gpu.raw.device_wait_idle();
            self.gpu.raw.destroy_pipeline(self.pipeline, None);
            self.gpu.raw.destroy_pipeline_layout(self.layout, None);
            self.gpu.raw.destroy_descriptor_pool(self.descriptors, None);
            self.gpu.raw.destroy_descriptor_set_layout(self.set_layout, None);
            self.gpu.raw.destroy_sampler(self.sampler, None);
        }
    }
}
