//! Buffers and images with their memory, accounted by purpose and freed on drop.

use std::sync::Arc;

use anyhow::{Context, Result, bail, ensure};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};

use super::device::Gpu;
use super::frames::once;

/// A buffer.
pub struct Buffer {
    /// The buffer.
    pub raw: vk::Buffer,
    /// Bytes.
    pub size: u64,
    memory: Memory,
}

/// An image with one view of all of it.
pub struct Image {
    /// The image.
    pub raw: vk::Image,
    /// The view.
    pub view: vk::ImageView,
    /// Texels (x, y).
    pub size: [u32; 2],
    /// Its format.
    pub format: vk::Format,
    memory: Memory,
}

/// Description of an image.
#[derive(Clone, Copy, Debug)]
pub struct ImageInfo {
    /// Name of the image, in tools and in the account of bytes.
    pub purpose: &'static str,
    /// Texels (x, y).
    pub size: [u32; 2],
    /// Number of layers; an image with layers is viewed as an array.
    pub layers: Option<u32>,
    /// Format.
    pub format: vk::Format,
    /// Usage.
    pub usage: vk::ImageUsageFlags,
}

struct Memory {
    gpu: Arc<Gpu>,
    allocation: Option<Allocation>,
    purpose: &'static str,
    size: u64,
}

impl Memory {
    fn allocate(
        gpu: &Arc<Gpu>,
        purpose: &'static str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Self> {
        let description = AllocationCreateDesc {
            name: purpose,
            requirements,
            location,
            linear,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        let out_of_memory = || format!("out of memory: {} bytes for {purpose}", requirements.size);
        ensure!(gpu.may_allocate(), "{} (limited by --allocations)", out_of_memory());
        let mut allocator = gpu.allocator.lock().unwrap_or_else(|e| e.into_inner());
        let allocation = allocator.allocate(&description).with_context(out_of_memory)?;
        drop(allocator);
        *gpu.bytes.lock().unwrap_or_else(|e| e.into_inner()).entry(purpose).or_default() += requirements.size;
        Ok(Self { gpu: Arc::clone(gpu), allocation: Some(allocation), purpose, size: requirements.size })
    }
}

impl Drop for Memory {
    fn drop(&mut self) {
        let mut allocator = self.gpu.allocator.lock().unwrap_or_else(|e| e.into_inner());
        if let Some(allocation) = self.allocation.take() {
            // An allocation of this allocator can always be freed.
            let _ = allocator.free(allocation);
        }
        let mut bytes = self.gpu.bytes.lock().unwrap_or_else(|e| e.into_inner());
        if let Some(entry) = bytes.get_mut(self.purpose) {
            *entry -= self.size;
        }
    }
}

impl Buffer {
    /// Creates a buffer of at least 16 bytes. `location` tells whether the host writes or reads it.
    pub fn new(
        gpu: &Arc<Gpu>,
        purpose: &'static str,
        size: u64,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> Result<Self> {
        let size = size.max(16);
        let info = vk::BufferCreateInfo::default().size(size).usage(usage);
        // SAFETY: the device is alive; memory is bound before the buffer is used.
        unsafe {
            let raw = gpu.raw.create_buffer(&info, None).with_context(|| format!("buffer for {purpose}"))?;
            let requirements = gpu.raw.get_buffer_memory_requirements(raw);
            let memory = match Memory::allocate(gpu, purpose, requirements, location, true) {
                Ok(memory) => memory,
                Err(error) => {
                    gpu.raw.destroy_buffer(raw, None);
                    return Err(error);
                }
            };
            let allocation = memory.allocation.as_ref().expect("just allocated");
            gpu.raw.bind_buffer_memory(raw, allocation.memory(), allocation.offset())?;
            gpu.name(raw, purpose);
            Ok(Self { raw, size, memory })
        }
    }

    /// Creates a device-local buffer that commands fill.
    pub fn device(gpu: &Arc<Gpu>, purpose: &'static str, size: u64, usage: vk::BufferUsageFlags) -> Result<Self> {
        Self::new(gpu, purpose, size, usage | vk::BufferUsageFlags::TRANSFER_DST, MemoryLocation::GpuOnly)
    }

    /// Creates a buffer that the host writes and the device reads.
    pub fn host(gpu: &Arc<Gpu>, purpose: &'static str, size: u64, usage: vk::BufferUsageFlags) -> Result<Self> {
        Self::new(gpu, purpose, size, usage, MemoryLocation::CpuToGpu)
    }

    /// Copies plain data into a host-visible buffer.
    ///
    /// # Panics
    /// If the buffer is not host-visible or the data does not fit.
    pub fn write(&mut self, offset: usize, data: &[u8]) {
        let mapped = self.memory.allocation.as_mut().and_then(|a| a.mapped_slice_mut()).expect("host-visible");
        mapped[offset..offset + data.len()].copy_from_slice(data);
    }

    /// Writes indices to a host-visible buffer with 16 bits each.
    ///
    /// # Panics
    /// If the buffer is not host-visible or they do not fit.
    pub fn write_short(&mut self, indices: &[u32]) {
        let mapped = self.memory.allocation.as_mut().and_then(|a| a.mapped_slice_mut()).expect("host-visible");
        let short: &mut [u16] = bytemuck::cast_slice_mut(&mut mapped[..size_of::<u16>() * indices.len()]);
        short.iter_mut().zip(indices).for_each(|(short, index)| *short = *index as u16);
    }

    /// Sets every byte of a host-visible buffer to `byte`.
    ///
    /// # Panics
    /// If the buffer is not host-visible.
    pub fn fill(&mut self, byte: u8) {
        let size = self.size as usize;
        let mapped = self.memory.allocation.as_mut().and_then(|a| a.mapped_slice_mut()).expect("host-visible");
        mapped[..size].fill(byte);
    }

    /// Returns the bytes of a host-visible buffer.
    ///
    /// # Panics
    /// If the buffer is not host-visible.
    pub fn read(&self) -> &[u8] {
        let mapped = self.memory.allocation.as_ref().and_then(|a| a.mapped_slice()).expect("host-visible");
        &mapped[..self.size as usize]
    }
}

impl Drop for Buffer {
    fn drop(&mut self) {
        // SAFETY: owners wait for the device before they drop what it uses.
        unsafe { self.memory.gpu.raw.destroy_buffer(self.raw, None) };
    }
}

impl Image {
    /// Creates a device-local image with one mipmap level, and its view.
    pub fn new(gpu: &Arc<Gpu>, info: ImageInfo) -> Result<Self> {
        Self::with_levels(gpu, info, 1)
    }

    /// Creates a device-local image with this number of mipmap levels, and a view of all of them.
    pub fn with_levels(gpu: &Arc<Gpu>, info: ImageInfo, levels: u32) -> Result<Self> {
        let limit = gpu.limits.max_image_dimension2_d;
        if info.size.iter().any(|&n| n > limit) {
            bail!("{}: {} x {} texels exceed maxImageDimension2D = {limit}", info.purpose, info.size[0], info.size[1]);
        }
        let layers = info.layers.unwrap_or(1);
        let create = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(info.format)
            .extent(vk::Extent3D { width: info.size[0], height: info.size[1], depth: 1 })
            .mip_levels(levels)
            .array_layers(layers)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(info.usage);
        // SAFETY: the device is alive; memory is bound before the view is made.
        unsafe {
            let raw = gpu.raw.create_image(&create, None).with_context(|| format!("image for {}", info.purpose))?;
            let requirements = gpu.raw.get_image_memory_requirements(raw);
            let memory = match Memory::allocate(gpu, info.purpose, requirements, MemoryLocation::GpuOnly, false) {
                Ok(memory) => memory,
                Err(error) => {
                    gpu.raw.destroy_image(raw, None);
                    return Err(error);
                }
            };
            let allocation = memory.allocation.as_ref().expect("just allocated");
            gpu.raw.bind_image_memory(raw, allocation.memory(), allocation.offset())?;
            gpu.name(raw, info.purpose);
            let kind =
                if info.layers.is_some() { vk::ImageViewType::TYPE_2D_ARRAY } else { vk::ImageViewType::TYPE_2D };
            let view = vk::ImageViewCreateInfo::default()
                .image(raw)
                .view_type(kind)
                .format(info.format)
                .subresource_range(range(info.format));
            let view = gpu.raw.create_image_view(&view, None)?;
            gpu.name(view, info.purpose);
            Ok(Self { raw, view, size: info.size, format: info.format, memory })
        }
    }

    /// Returns a barrier for the whole image.
    pub fn barrier(
        &self,
        from: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout),
        to: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout),
    ) -> vk::ImageMemoryBarrier2<'static> {
        image_barrier(self.raw, self.format, from, to)
    }
}

impl Drop for Image {
    fn drop(&mut self) {
        // SAFETY: owners wait for the device before they drop what it uses.
        unsafe {
            self.memory.gpu.raw.destroy_image_view(self.view, None);
            self.memory.gpu.raw.destroy_image(self.raw, None);
        }
    }
}

/// Creates a device-local buffer with this content. Submits a copy and waits for it.
pub(super) fn filled(
    gpu: &Arc<Gpu>,
    purpose: &'static str,
    data: &[u8],
    usage: vk::BufferUsageFlags,
) -> Result<Buffer> {
    let buffer = Buffer::device(gpu, purpose, data.len() as u64, usage)?;
    if data.is_empty() {
        return Ok(buffer);
    }
    let mut staging = Buffer::host(gpu, "staging", data.len() as u64, vk::BufferUsageFlags::TRANSFER_SRC)?;
    staging.write(0, data);
    once(gpu, |r| {
        let region = [vk::BufferCopy { size: data.len() as u64, ..Default::default() }];
        // SAFETY: both buffers outlive the wait in `once`.
        unsafe { gpu.raw.cmd_copy_buffer(r.commands, staging.raw, buffer.raw, &region) };
        use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
        let read = (Stage::ALL_COMMANDS, Access::MEMORY_READ);
        memory_barrier(gpu, r.commands, (Stage::COPY, Access::TRANSFER_WRITE), read);
        Ok(())
    })?;
    Ok(buffer)
}

/// Returns a barrier for a whole image: stage, access and layout before and after.
pub fn image_barrier(
    image: vk::Image,
    format: vk::Format,
    from: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout),
    to: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout),
) -> vk::ImageMemoryBarrier2<'static> {
    vk::ImageMemoryBarrier2::default()
        .image(image)
        .src_stage_mask(from.0)
        .src_access_mask(from.1)
        .old_layout(from.2)
        .dst_stage_mask(to.0)
        .dst_access_mask(to.1)
        .new_layout(to.2)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .subresource_range(range(format))
}

/// Records image barriers.
pub fn barriers(gpu: &Gpu, commands: vk::CommandBuffer, barriers: &[vk::ImageMemoryBarrier2]) {
    let info = vk::DependencyInfo::default().image_memory_barriers(barriers);
    // SAFETY: the command buffer is being recorded.
    unsafe { gpu.raw.cmd_pipeline_barrier2(commands, &info) };
}

/// Records a barrier for all memory.
pub fn memory_barrier(
    gpu: &Gpu,
    commands: vk::CommandBuffer,
    from: (vk::PipelineStageFlags2, vk::AccessFlags2),
    to: (vk::PipelineStageFlags2, vk::AccessFlags2),
) {
    let barrier = [vk::MemoryBarrier2::default()
        .src_stage_mask(from.0)
        .src_access_mask(from.1)
        .dst_stage_mask(to.0)
        .dst_access_mask(to.1)];
    // SAFETY: the command buffer is being recorded.
    unsafe { gpu.raw.cmd_pipeline_barrier2(commands, &vk::DependencyInfo::default().memory_barriers(&barrier)) };
}

/// Returns the aspect of images of a format.
pub fn aspect(format: vk::Format) -> vk::ImageAspectFlags {
    if format == vk::Format::D32_SFLOAT { vk::ImageAspectFlags::DEPTH } else { vk::ImageAspectFlags::COLOR }
}

fn range(format: vk::Format) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange::default()
        .aspect_mask(aspect(format))
        .level_count(vk::REMAINING_MIP_LEVELS)
        .layer_count(vk::REMAINING_ARRAY_LAYERS)
}
