//! Runs `position.glsl` in a compute shader and reads the positions back, for comparison with the CPU reference.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;
use gpu_allocator::MemoryLocation;

use super::bindings::{Bindings, Bound};
use super::device::Gpu;
use super::frames::once;
use super::height_pages::{self, Sampling};
use super::memory::{Buffer, memory_barrier};
use super::pipelines;
use super::shaders::Constants;
use crate::draw::layout::{ExplicitVertex, Frame, Instance, VertexNormals};
use crate::height::Field;
use crate::plan::ScenePlan;

/// A vertex and the instance that places it. Laid out as `Query` in `shaders/position.comp`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Query {
    /// The vertex; a lattice vertex has only a position.
    pub vertex: ExplicitVertex,
    /// Its normals, if it carries its height.
    pub normals: VertexNormals,
    /// Its instance.
    pub instance: Instance,
    /// Not 0: the vertex carries its height.
    pub explicit_height: u32,
}

/// Position and normal of a vertex, computed on the device. Laid out as `Answer` in `shaders/position.comp`.
#[repr(C)]
#[derive(Clone, Copy, Debug, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Answer {
    /// Position relative to the eye, metres.
    pub position: [f32; 3],
    /// Unit normal, if the vertex carries its height.
    pub normal: [f32; 3],
}

/// Computes the positions and normals of the queries on the device.
pub fn answers(
    gpu: &Arc<Gpu>,
    plan: &ScenePlan,
    field: &Field,
    frame: &Frame,
    queries: &[Query],
) -> Result<Vec<Answer>> {
    let heights = height_pages::heights(gpu, plan, field)?;
    let sampler = height_pages::sampler(gpu, Sampling::Texels)?;
    let storage = vk::BufferUsageFlags::STORAGE_BUFFER;
    let mut uniform = Buffer::host(gpu, "frame", size_of::<Frame>() as u64, vk::BufferUsageFlags::UNIFORM_BUFFER)?;
    uniform.write(0, bytemuck::bytes_of(frame));
    let mut input = Buffer::host(gpu, "queries", size_of_val(queries) as u64, storage)?;
    input.write(0, bytemuck::cast_slice(queries));
    let bytes = queries.len() * size_of::<Answer>();
    let output = Buffer::new(gpu, "answers", bytes as u64, storage, MemoryLocation::GpuToCpu)?;
    let bound = [
        Bound::Uniform(&uniform),
        Bound::Texture(sampler.raw, heights.view, vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL),
        Bound::Storage(&input),
        Bound::Storage(&output),
    ];
    let bindings = Bindings::new(gpu, "position check", None, vk::ShaderStageFlags::COMPUTE, &bound, 0)?;
    let pipeline = pipelines::compute(gpu, bindings.layout, "position check", "position.comp", &Constants::of(plan))?;
    // SAFETY: the resources live until `once` has waited; the pipeline is destroyed after that.
    unsafe {
        let ran = once(gpu, |r| {
            let point = vk::PipelineBindPoint::COMPUTE;
            gpu.raw.cmd_bind_pipeline(r.commands, point, pipeline);
            gpu.raw.cmd_bind_descriptor_sets(r.commands, point, bindings.layout, 0, &[bindings.set], &[]);
            gpu.raw.cmd_dispatch(r.commands, queries.len().div_ceil(64) as u32, 1, 1);
            use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
            let host = (Stage::HOST, Access::HOST_READ);
            memory_barrier(gpu, r.commands, (Stage::COMPUTE_SHADER, Access::SHADER_WRITE), host);
            Ok(())
        });
        gpu.raw.destroy_pipeline(pipeline, None);
        ran?;
    }
    Ok(bytemuck::cast_slice(&output.read()[..bytes]).to_vec())
}
