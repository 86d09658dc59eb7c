//! The detail textures of the ground with their mipmaps.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;

use super::device::Gpu;
use super::frames::once;
use super::memory::{Buffer, Image, ImageInfo, barriers};
use crate::plan::ScenePlan;
use crate::texture::detail::{self, LEVELS, SIDE, Texel};

const FORMAT: vk::Format = vk::Format::R8G8B8A8_UNORM;

/// Creates an array image with a layer for each material. If the plan omits detail textures, it is a placeholder of one
/// mean texel.
pub fn image(gpu: &Arc<Gpu>, plan: &ScenePlan) -> Result<Image> {
    if plan.detail {
        return filled(gpu, "detail textures", SIDE, &detail::layers());
    }
    filled(gpu, "no detail textures", 1, &[vec![vec![[128; 4]]]])
}

/// Creates an array image. `layers` holds the mip levels of each layer from the finest, of side `side`.
fn filled(gpu: &Arc<Gpu>, purpose: &'static str, side: u32, layers: &[Vec<Vec<Texel>>]) -> Result<Image> {
    let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST;
    let info = ImageInfo { purpose, size: [side; 2], layers: Some(layers.len() as u32), format: FORMAT, usage };
    let image = Image::with_levels(gpu, info, layers[0].len() as u32)?;
    let texels: Vec<Texel> = layers.iter().flatten().flatten().copied().collect();
    let bytes: &[u8] = bytemuck::cast_slice(&texels);
    let mut staging = Buffer::host(gpu, "staging", bytes.len() as u64, vk::BufferUsageFlags::TRANSFER_SRC)?;
    staging.write(0, bytes);
    let regions = regions(side, layers);
    use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
    let ready = (Stage::COPY, Access::TRANSFER_WRITE, Layout::TRANSFER_DST_OPTIMAL);
    let sampled = (Stage::ALL_COMMANDS, Access::SHADER_SAMPLED_READ, Layout::SHADER_READ_ONLY_OPTIMAL);
    once(gpu, |r| {
        barriers(gpu, r.commands, &[image.barrier((Stage::NONE, Access::NONE, Layout::UNDEFINED), ready)]);
        // SAFETY: staging and image outlive the wait in `once`.
        unsafe { gpu.raw.cmd_copy_buffer_to_image(r.commands, staging.raw, image.raw, ready.2, &regions) };
        barriers(gpu, r.commands, &[image.barrier(ready, sampled)]);
        Ok(())
    })?;
    Ok(image)
}

/// Copy regions from a buffer that holds all levels of all layers in turn.
fn regions(side: u32, layers: &[Vec<Vec<Texel>>]) -> Vec<vk::BufferImageCopy> {
    debug_assert!(layers.iter().all(|levels| levels.len() as u32 <= LEVELS));
    let mut offset = 0;
    let mut regions = Vec::new();
    for (layer, levels) in (0u32..).zip(layers) {
        for (level, texels) in (0u32..).zip(levels) {
            let place = vk::ImageSubresourceLayers::default()
                .aspect_mask(vk::ImageAspectFlags::COLOR)
                .mip_level(level)
                .base_array_layer(layer)
                .layer_count(1);
            let extent = vk::Extent3D { width: side >> level, height: side >> level, depth: 1 };
            regions.push(
                vk::BufferImageCopy::default().buffer_offset(offset).image_subresource(place).image_extent(extent),
            );
            offset += size_of_val(texels.as_slice()) as u64;
        }
    }
    regions
}
