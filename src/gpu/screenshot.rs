//! A copy of one frame of the window.

use std::sync::Arc;

use anyhow::{Result, bail};
use ash::vk;
use gpu_allocator::MemoryLocation;

use super::device::Gpu;
use super::frames::Recording;
use super::memory::{Buffer, barriers, image_barrier, memory_barrier};
use super::target::{Attachment, Use};

/// The buffer of the copy.
pub struct Screenshot {
    buffer: Buffer,
    size: [u32; 2],
    is_bgra: bool,
}

impl Screenshot {
    /// Makes the buffer for a frame of this format and size.
    ///
    /// # Errors
    /// If pixels of the format are not four bytes, or the device is out of memory.
    pub fn new(gpu: &Arc<Gpu>, format: vk::Format, size: [u32; 2]) -> Result<Self> {
        use vk::Format as F;
        let is_bgra = match format {
            F::B8G8R8A8_SRGB | F::B8G8R8A8_UNORM => true,
            F::R8G8B8A8_SRGB | F::R8G8B8A8_UNORM | F::A8B8G8R8_SRGB_PACK32 | F::A8B8G8R8_UNORM_PACK32 => false,
            _ => bail!("screenshots of a window in format {format:?} are not supported"),
        };
        let bytes = 4 * u64::from(size[0]) * u64::from(size[1]);
        let (usage, location) = (vk::BufferUsageFlags::TRANSFER_DST, MemoryLocation::GpuToCpu);
        Ok(Self { buffer: Buffer::new(gpu, "screenshot", bytes, usage, location)?, size, is_bgra })
    }

    /// Records the copy of an image last used as `last`. Returns its use by the copy.
    pub(super) fn record(&self, recording: &Recording, image: Attachment, last: Use) -> Use {
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
        let (gpu, commands) = (recording.gpu, recording.commands);
        let copied = (Stage::COPY, Access::TRANSFER_READ, Layout::TRANSFER_SRC_OPTIMAL);
        barriers(gpu, commands, &[image_barrier(image.image, image.format, last, copied)]);
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
        let [width, height] = self.size;
        let region = [vk::BufferImageCopy::default().image_subresource(layers).image_extent(vk::Extent3D {
            width,
            height,
            depth: 1,
        })];
        // SAFETY: the command buffer is being recorded; image and buffer live until the frame has ended.
        unsafe { gpu.raw.cmd_copy_image_to_buffer(commands, image.image, copied.2, self.buffer.raw, &region) };
        memory_barrier(gpu, commands, (Stage::COPY, Access::TRANSFER_WRITE), (Stage::HOST, Access::HOST_READ));
        copied
    }

    /// Returns the picture, once its frame has finished.
    ///
    /// # Panics
    /// Never: the buffer always matches the size.
    pub fn picture(&self) -> image::RgbaImage {
        let [width, height] = self.size;
        let mut bytes = self.buffer.read()[..4 * width as usize * height as usize].to_vec();
        if self.is_bgra {
            bytes.chunks_exact_mut(4).for_each(|pixel| pixel.swap(0, 2));
        }
        image::RgbaImage::from_raw(width, height, bytes).expect("4 bytes per pixel")
    }
}
