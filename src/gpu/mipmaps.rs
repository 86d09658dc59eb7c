//! Mipmap levels of an image, each made of the one before by the device.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;

use super::device::Gpu;
use super::frames::once;
use super::memory::{Image, aspect, barriers};
use super::pages::{SAMPLED, WRITTEN};

/// As blits read a level.
const READ: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout) =
    (vk::PipelineStageFlags2::BLIT, vk::AccessFlags2::TRANSFER_READ, vk::ImageLayout::TRANSFER_SRC_OPTIMAL);
/// As they write one.
const BLITTED: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout) =
    (vk::PipelineStageFlags2::BLIT, vk::AccessFlags2::TRANSFER_WRITE, vk::ImageLayout::TRANSFER_DST_OPTIMAL);

/// Makes all levels of an image without layers whose finest one was copied into it, and leaves it ready for sampling.
///
/// A texel is the mean of four of the level before, or nearly so where a side is odd. Blits of sRGB images filter in linear light (Vulkan specification,
/// "Image Copies With Scaling").
pub fn make(gpu: &Arc<Gpu>, image: &Image, levels: u32) -> Result<()> {
    once(gpu, |r| {
        for level in 1..levels {
            let written = if level == 1 { WRITTEN } else { BLITTED };
            let coarser = image.level_barrier(level, WRITTEN, BLITTED);
            barriers(gpu, r.commands, &[image.level_barrier(level - 1, written, READ), coarser]);
            let blit = [vk::ImageBlit::default()
                .src_subresource(layer(image, level - 1))
                .src_offsets(corners(image, level - 1))
                .dst_subresource(layer(image, level))
                .dst_offsets(corners(image, level))];
            // SAFETY: the image outlives the wait in `once`; its levels are in the layouts stated.
            unsafe {
                let (from, to, linear) = (READ.2, BLITTED.2, vk::Filter::LINEAR);
                gpu.raw.cmd_blit_image(r.commands, image.raw, from, image.raw, to, &blit, linear);
            }
        }
        let last = if levels == 1 { WRITTEN } else { BLITTED };
        let made = (0..levels - 1).map(|level| image.level_barrier(level, READ, SAMPLED));
        let all: Vec<_> = made.chain([image.level_barrier(levels - 1, last, SAMPLED)]).collect();
        barriers(gpu, r.commands, &all);
        Ok(())
    })
}

fn layer(image: &Image, level: u32) -> vk::ImageSubresourceLayers {
    vk::ImageSubresourceLayers::default().aspect_mask(aspect(image.format)).mip_level(level).layer_count(1)
}

/// The first and the last corner of a level.
fn corners(image: &Image, level: u32) -> [vk::Offset3D; 2] {
    let [x, y] = image.size.map(|n| (n >> level).max(1) as i32);
    [vk::Offset3D::default(), vk::Offset3D { x, y, z: 1 }]
}
