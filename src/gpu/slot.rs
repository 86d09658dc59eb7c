//! Buffers of one frame in flight: uniforms, instances, commands and streamed geometry. The host writes them while the
//! device draws the other frame.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;
use bytemuck::cast_slice;

use super::device::Gpu;
use super::gpu_tile_cache::GpuTileCache;
use super::height_pages::Sampler;
use super::memory::{Buffer, Image};
use super::pipelines::IMAGES;
use crate::draw::layout::{ExplicitVertex, Frame, Instance, VertexNormals};
use crate::draw::{Draw, DrawList, Limits, RESTART};

/// Bytes of an indexed indirect command.
pub(super) const COMMAND: usize = size_of::<vk::DrawIndexedIndirectCommand>();

/// A part of a frame's list, submitted while the rest is still being selected.
#[derive(Clone, Copy, Debug)]
pub struct Part {
    /// Size of the earlier parts together.
    pub before: Limits,
    /// True for the last part.
    pub is_last: bool,
}

impl Part {
    /// A whole list as its only part.
    pub fn whole() -> Self {
        Self { before: Limits::default(), is_last: true }
    }

    /// Returns true for the first part.
    pub fn is_first(&self) -> bool {
        self.before.draws == 0
    }

    /// Returns true if the part is the whole list.
    pub fn is_whole(&self) -> bool {
        self.is_first() && self.is_last
    }
}

/// Buffers and descriptors of one frame in flight.
pub struct Slot {
    /// Descriptors of the frame's data and the scene's images.
    pub set: vk::DescriptorSet,
    frame: Buffer,
    /// Instances.
    pub instances: Buffer,
    /// Indirect commands, one per draw.
    pub commands: Buffer,
    /// Streamed vertices.
    pub vertices: Buffer,
    /// Normals of the streamed vertices.
    pub normals: Buffer,
    /// Streamed indices.
    pub indices: Buffer,
    /// Width of the streamed indices: 16 bits where all of them fit.
    pub index_type: vk::IndexType,
    /// Staging memory of uploads to resident geometry.
    pub staging: Buffer,
}

impl Slot {
    /// Makes buffers for every list within the limits.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn new(gpu: &Arc<Gpu>, set: vk::DescriptorSet, limits: &Limits) -> Result<Self> {
        use vk::BufferUsageFlags as Usage;
        let host = |purpose, bytes: usize, usage| Buffer::host(gpu, purpose, bytes as u64, usage);
        Ok(Self {
            set,
            frame: host("frame", size_of::<Frame>(), Usage::UNIFORM_BUFFER)?,
            instances: host("instances", limits.instances * size_of::<Instance>(), Usage::VERTEX_BUFFER)?,
            commands: host("indirect commands", limits.draws * COMMAND, Usage::INDIRECT_BUFFER)?,
            vertices: host("streamed vertices", limits.vertices * size_of::<ExplicitVertex>(), Usage::VERTEX_BUFFER)?,
            normals: host("streamed normals", limits.normals * size_of::<VertexNormals>(), Usage::VERTEX_BUFFER)?,
            indices: host("streamed indices", limits.indices * 4, Usage::INDEX_BUFFER)?,
            index_type: vk::IndexType::UINT32,
            staging: host("upload staging", limits.upload_bytes, Usage::TRANSFER_SRC)?,
        })
    }

    /// Writes the data of a part of a frame.
    pub fn write(&mut self, frame: &Frame, list: &DrawList, part: &Part) {
        let before = &part.before;
        if part.is_first() {
            let frame = Frame { vertices: list.vertex_format(), ..*frame };
            self.frame.write(0, bytemuck::bytes_of(&frame));
        }
        append(&mut self.instances, before.instances, &list.instances);
        append(&mut self.vertices, before.vertices, &list.streamed.vertices);
        append(&mut self.normals, before.normals, &list.streamed.normals);
        if part.is_whole() {
            self.write_indices(&list.streamed.indices);
        } else {
            // Later parts may have indices of more than 16 bits.
            self.index_type = vk::IndexType::UINT32;
            append(&mut self.indices, before.indices, &list.streamed.indices);
        }
        for (k, draw) in list.draws.iter().enumerate().skip(before.draws) {
            self.commands.write(k * COMMAND, &command_bytes(draw));
        }
    }

    /// Writes the frame's streamed indices, 16 bits each if all of them fit.
    fn write_indices(&mut self, indices: &[u32]) {
        let highest = indices.iter().copied().filter(|&k| k != RESTART).fold(0, u32::max);
        // The highest index of either width restarts a strip.
        if highest < u32::from(u16::MAX) {
            self.index_type = vk::IndexType::UINT16;
            self.indices.write_short(indices);
        } else {
            self.index_type = vk::IndexType::UINT32;
            self.indices.write(0, cast_slice(indices));
        }
    }

    /// Binds the frame's data and the scene's images.
    pub fn describe(
        &self,
        gpu: &Gpu,
        images: &[Image; IMAGES],
        samplers: &[Sampler; IMAGES],
        maps: &GpuTileCache,
        table: &Buffer,
    ) {
        let table = [vk::DescriptorBufferInfo { buffer: table.raw, offset: 0, range: vk::WHOLE_SIZE }];
        let frame = [vk::DescriptorBufferInfo { buffer: self.frame.raw, offset: 0, range: vk::WHOLE_SIZE }];
        let layout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
        let infos: Vec<_> = images
            .iter()
            .zip(samplers)
            .chain([(&maps.image, &maps.sampler)])
            .map(|(image, sampler)| {
                let (sampler, image_view) = (sampler.raw, image.view);
                [vk::DescriptorImageInfo { sampler, image_view, image_layout: layout }]
            })
            .collect();
        let write = vk::WriteDescriptorSet::default().dst_set(self.set);
        let mut writes =
            vec![write.dst_binding(0).descriptor_type(vk::DescriptorType::UNIFORM_BUFFER).buffer_info(&frame)];
        for (binding, info) in (1u32..).zip(&infos) {
            let kind = vk::DescriptorType::COMBINED_IMAGE_SAMPLER;
            writes.push(write.dst_binding(binding).descriptor_type(kind).image_info(info));
        }
        let kind = vk::DescriptorType::STORAGE_BUFFER;
        writes.push(write.dst_binding(infos.len() as u32 + 1).descriptor_type(kind).buffer_info(&table));
        // SAFETY: buffers and images live as long as the set.
        unsafe { gpu.raw.update_descriptor_sets(&writes, &[]) };
    }
}

/// Writes the items from index `before` on to their place in the buffer.
fn append<T: bytemuck::NoUninit>(buffer: &mut Buffer, before: usize, items: &[T]) {
    buffer.write(before * size_of::<T>(), cast_slice(&items[before..]));
}

fn command_bytes(draw: &Draw) -> [u8; COMMAND] {
    let words = [
        draw.indices.len() as u32,
        draw.instances.len() as u32,
        draw.indices.start,
        draw.first_vertex,
        draw.instances.start,
    ];
    bytemuck::cast(words)
}
