//! Runs `position.glsl` in a compute shader and reads the positions back, for comparison with its CPU twin.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;
use gpu_allocator::MemoryLocation;

use super::device::Gpu;
use super::frames::once;
use super::memory::{Buffer, memory_barrier};
use super::pages::{self, Sampling};
use super::shaders::{self, Constants};
use crate::draw::layout::{ExplicitVertex, Frame, Instance};
use crate::height::Field;
use crate::plan::ScenePlan;

/// A vertex and the instance that places it. Laid out as `Query` in `shaders/position.comp`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Query {
    /// The vertex; a lattice vertex has only a position.
    pub vertex: ExplicitVertex,
    /// Its instance.
    pub instance: Instance,
    /// Not 0: the vertex carries its height.
    pub explicit_height: u32,
}

/// Positions relative to the eye, metres, as the device computes them.
pub fn positions(
    gpu: &Arc<Gpu>,
    plan: &ScenePlan,
    field: &Field,
    frame: &Frame,
    queries: &[Query],
) -> Result<Vec<[f32; 3]>> {
    let heights = pages::heights(gpu, plan, field)?;
    let sampler = pages::sampler(gpu, Sampling::Texels)?;
    let storage = vk::BufferUsageFlags::STORAGE_BUFFER;
    let mut uniform = Buffer::host(gpu, "frame", size_of::<Frame>() as u64, vk::BufferUsageFlags::UNIFORM_BUFFER)?;
    uniform.write(0, bytemuck::bytes_of(frame));
    let mut input = Buffer::host(gpu, "queries", size_of_val(queries) as u64, storage)?;
    input.write(0, bytemuck::cast_slice(queries));
    let bytes = queries.len() * size_of::<[f32; 3]>();
    let output = Buffer::new(gpu, "answers", bytes as u64, storage, MemoryLocation::GpuToCpu)?;
    let constants = Constants::of(plan);
    // SAFETY: everything bound lives until `once` has waited; what is made here is destroyed after it.
    unsafe {
        let kinds = [
            vk::DescriptorType::UNIFORM_BUFFER,
            vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
            vk::DescriptorType::STORAGE_BUFFER,
            vk::DescriptorType::STORAGE_BUFFER,
        ];
        let bindings: Vec<_> = (0u32..)
            .zip(kinds)
            .map(|(binding, kind)| vk::DescriptorSetLayoutBinding {
                binding,
                descriptor_type: kind,
                descriptor_count: 1,
                stage_flags: vk::ShaderStageFlags::COMPUTE,
                ..Default::default()
            })
            .collect();
        let set_layout = gpu
            .raw
            .create_descriptor_set_layout(&vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings), None)?;
        let layouts = [set_layout];
        let layout =
            gpu.raw.create_pipeline_layout(&vk::PipelineLayoutCreateInfo::default().set_layouts(&layouts), None)?;
        let sizes = kinds.map(|ty| vk::DescriptorPoolSize { ty, descriptor_count: 1 });
        let pool = gpu
            .raw
            .create_descriptor_pool(&vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes), None)?;
        let set = gpu.raw.allocate_descriptor_sets(
            &vk::DescriptorSetAllocateInfo::default().descriptor_pool(pool).set_layouts(&layouts),
        )?[0];
        let whole =
            |buffer: &Buffer| [vk::DescriptorBufferInfo { buffer: buffer.raw, offset: 0, range: vk::WHOLE_SIZE }];
        let (frame_info, input_info, output_info) = (whole(&uniform), whole(&input), whole(&output));
        let image = [vk::DescriptorImageInfo {
            sampler,
            image_view: heights.view,
            image_layout: vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
        }];
        let write =
            |k: usize| vk::WriteDescriptorSet::default().dst_set(set).dst_binding(k as u32).descriptor_type(kinds[k]);
        let writes = [
            write(0).buffer_info(&frame_info),
            write(1).image_info(&image),
            write(2).buffer_info(&input_info),
            write(3).buffer_info(&output_info),
        ];
        gpu.raw.update_descriptor_sets(&writes, &[]);
        let module = shaders::module(gpu, "position.comp")?;
        let special = constants.info();
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(vk::ShaderStageFlags::COMPUTE)
            .module(module)
            .name(c"main")
            .specialization_info(&special);
        let info = vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout);
        let made = gpu.raw.create_compute_pipelines(vk::PipelineCache::null(), &[info], None);
        gpu.raw.destroy_shader_module(module, None);
        let pipeline = made.map_err(|(_, e)| e)?[0];
        gpu.name(pipeline, "position twin");
        let ran = once(gpu, |r| {
            let point = vk::PipelineBindPoint::COMPUTE;
            gpu.raw.cmd_bind_pipeline(r.commands, point, pipeline);
            gpu.raw.cmd_bind_descriptor_sets(r.commands, point, layout, 0, &[set], &[]);
            gpu.raw.cmd_dispatch(r.commands, queries.len().div_ceil(64) as u32, 1, 1);
            use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
            let host = (Stage::HOST, Access::HOST_READ);
            memory_barrier(gpu, r.commands, (Stage::COMPUTE_SHADER, Access::SHADER_WRITE), host);
            Ok(())
        });
        gpu.raw.destroy_pipeline(pipeline, None);
        gpu.raw.destroy_descriptor_pool(pool, None);
        gpu.raw.destroy_pipeline_layout(layout, None);
        gpu.raw.destroy_descriptor_set_layout(set_layout, None);
        gpu.raw.destroy_sampler(sampler, None);
        ran?;
    }
    Ok(bytemuck::cast_slice(&output.read()[..bytes]).to_vec())
}
