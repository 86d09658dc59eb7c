//! Sampled images: the height pages, the hole mask, and pictures.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;

use super::device::Gpu;
use super::frames::once;
use super::memory::{Buffer, Image, ImageInfo, barriers};
use super::mipmaps;
use crate::height::{Field, Samples};
use crate::plan::{ScenePlan, mip_levels};

/// Bytes staged at once: rows are copied in bands of this size, so that staging stays small beside the field.
const STAGING: u64 = 32 << 20;

/// The field's heights as an array of pages.
pub fn heights(gpu: &Arc<Gpu>, plan: &ScenePlan, field: &Field) -> Result<Image> {
    surface(gpu, plan, "heights", field)
}

/// The heights of a cave's ceiling, alike; a stand-in of one texel where there is none.
pub fn ceiling(gpu: &Arc<Gpu>, plan: &ScenePlan, field: &Field) -> Result<Image> {
    match field.ceiling().filter(|_| plan.ceiling) {
        Some(ceiling) => surface(gpu, plan, "ceiling", ceiling),
        None => one_texel(gpu, "no ceiling", vk::Format::R32_SFLOAT, Some(1), &[0; 4]),
    }
}

fn surface(gpu: &Arc<Gpu>, plan: &ScenePlan, purpose: &'static str, field: &Field) -> Result<Image> {
    let format = if plan.coded { vk::Format::R16_UNORM } else { vk::Format::R32_SFLOAT };
    paged(gpu, plan, purpose, format, plan.texel_bytes(), |first, count, row| match field.samples() {
        Samples::F32(heights) => row.extend_from_slice(bytemuck::cast_slice(&heights[first..first + count])),
        Samples::Coded { codes, .. } if plan.coded => {
            row.extend_from_slice(bytemuck::cast_slice(&codes[first..first + count]))
        }
        coded => (first..first + count).for_each(|k| row.extend_from_slice(&coded.height(k).to_ne_bytes())),
    })
}

/// One byte a sample, not 0 for holes; a stand-in of one texel if the plan leaves holes out.
pub fn holes(gpu: &Arc<Gpu>, plan: &ScenePlan, field: &Field) -> Result<Image> {
    if !plan.holes {
        return one_texel(gpu, "no holes", vk::Format::R8_UINT, Some(1), &[0]);
    }
    paged(gpu, plan, "hole mask", vk::Format::R8_UINT, 1, |first, count, row| {
        row.extend((first..first + count).map(|k| u8::from(field.holes().contains(k))));
    })
}

/// A picture laid over the field, with its mipmap levels; a stand-in of one texel if there is none.
pub fn overlay(gpu: &Arc<Gpu>, picture: Option<&image::RgbaImage>) -> Result<Image> {
    match picture {
        Some(rgba) => {
            let (size, format) = (rgba.dimensions().into(), vk::Format::R8G8B8A8_SRGB);
            let image = filled(gpu, "overlay", format, size, (None, mip_levels(size)), rgba)?;
            mipmaps::make(gpu, &image, mip_levels(size))?;
            Ok(image)
        }
        None => one_texel(gpu, "no overlay", vk::Format::R8G8B8A8_SRGB, None, &[255; 4]),
    }
}

/// A stand-in of one texel, ready for sampling.
fn one_texel(
    gpu: &Arc<Gpu>,
    purpose: &'static str,
    format: vk::Format,
    layers: Option<u32>,
    texel: &[u8],
) -> Result<Image> {
    let image = filled(gpu, purpose, format, [1, 1], (layers, 1), texel)?;
    finish(gpu, &image)?;
    Ok(image)
}

/// An image with the texels of its finest level, not yet ready for sampling.
fn filled(
    gpu: &Arc<Gpu>,
    purpose: &'static str,
    format: vk::Format,
    size: [u32; 2],
    (layers, levels): (Option<u32>, u32),
    data: &[u8],
) -> Result<Image> {
    let copied = if levels > 1 { vk::ImageUsageFlags::TRANSFER_SRC } else { vk::ImageUsageFlags::empty() };
    let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST | copied;
    let image = Image::with_levels(gpu, ImageInfo { purpose, size, layers, format, usage }, levels)?;
    let row = data.len() as u64 / u64::from(size[1]);
    upload(gpu, &image, 1, size, row, |_, y, rows, staging| {
        staging.extend_from_slice(&data[y as usize * row as usize..(y + rows) as usize * row as usize]);
    })?;
    Ok(image)
}

fn paged(
    gpu: &Arc<Gpu>,
    plan: &ScenePlan,
    purpose: &'static str,
    format: vk::Format,
    texel: u64,
    copy: impl Fn(usize, usize, &mut Vec<u8>),
) -> Result<Image> {
    let (size, [columns, rows]) = (plan.page_size(), plan.pages());
    let layers = columns * rows;
    let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST;
    let image = Image::new(gpu, ImageInfo { purpose, size, layers: Some(layers), format, usage })?;
    let stored = plan.stored;
    upload(gpu, &image, layers, size, u64::from(size[0]) * texel, |layer, y, count, staging| {
        let corner = [layer % columns * size[0], layer / columns * size[1]];
        for z in corner[1] + y..corner[1] + y + count {
            // What sticks out of the field is never read; it repeats the last row and stays short.
            let z = z.min(stored[1] - 1) as usize;
            let width = size[0].min(stored[0] - corner[0]) as usize;
            copy(z * stored[0] as usize + corner[0] as usize, width, staging);
            staging.resize(staging.len() + (size[0] as usize - width) * texel as usize, 0);
        }
    })?;
    finish(gpu, &image)?;
    Ok(image)
}

/// As copies write an image.
pub(super) const WRITTEN: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout) =
    (vk::PipelineStageFlags2::COPY, vk::AccessFlags2::TRANSFER_WRITE, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
/// As any shader samples it.
pub(super) const SAMPLED: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout) = (
    vk::PipelineStageFlags2::ALL_COMMANDS,
    vk::AccessFlags2::SHADER_SAMPLED_READ,
    vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
);

/// Makes a written image ready for sampling.
fn finish(gpu: &Arc<Gpu>, image: &Image) -> Result<()> {
    once(gpu, |r| {
        barriers(gpu, r.commands, &[image.barrier(WRITTEN, SAMPLED)]);
        Ok(())
    })
}

/// Fills the finest level of all layers band by band, and leaves the image as copies write it. `fill(layer, first row, rows, out)`
/// appends the rows' bytes.
fn upload(
    gpu: &Arc<Gpu>,
    image: &Image,
    layers: u32,
    size: [u32; 2],
    row_bytes: u64,
    fill: impl Fn(u32, u32, u32, &mut Vec<u8>),
) -> Result<()> {
    let band = ((STAGING / row_bytes) as u32).clamp(1, size[1]);
    let mut staging = Buffer::host(gpu, "staging", u64::from(band) * row_bytes, vk::BufferUsageFlags::TRANSFER_SRC)?;
    let nothing = (vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE, vk::ImageLayout::UNDEFINED);
    once(gpu, |r| {
        barriers(gpu, r.commands, &[image.barrier(nothing, WRITTEN)]);
        Ok(())
    })?;
    let mut bytes = Vec::new();
    for layer in 0..layers {
        for y in (0..size[1]).step_by(band as usize) {
            let rows = band.min(size[1] - y);
            bytes.clear();
            fill(layer, y, rows, &mut bytes);
            staging.write(0, &bytes);
            let region = [vk::BufferImageCopy::default()
                .image_subresource(
                    vk::ImageSubresourceLayers::default()
                        .aspect_mask(vk::ImageAspectFlags::COLOR)
                        .base_array_layer(layer)
                        .layer_count(1),
                )
                .image_offset(vk::Offset3D { x: 0, y: y as i32, z: 0 })
                .image_extent(vk::Extent3D { width: size[0], height: rows, depth: 1 })];
            once(gpu, |r| {
                // SAFETY: staging and image outlive the wait in `once`.
                unsafe {
                    gpu.raw.cmd_copy_buffer_to_image(r.commands, staging.raw, image.raw, WRITTEN.2, &region);
                }
                Ok(())
            })?;
        }
    }
    Ok(())
}

/// How an image is sampled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// Single texels.
    Texels,
    /// Linear, the edge texel beyond the edge.
    Clamped,
    /// Linear, repeating.
    Repeated,
    /// Linear, repeating along some axes (x, z) and with the edge texel beyond the edge of others.
    Along([bool; 2]),
}

/// A sampler. What uses it has ended when it is dropped.
pub struct Sampler {
    /// The sampler.
    pub raw: vk::Sampler,
    gpu: Arc<Gpu>,
}

impl Drop for Sampler {
    fn drop(&mut self) {
        // SAFETY: it is not in use any more.
        unsafe { self.gpu.raw.destroy_sampler(self.raw, None) };
    }
}

/// Makes a sampler.
pub fn sampler(gpu: &Arc<Gpu>, sampling: Sampling) -> Result<Sampler> {
    let (filter, mipmap) = match sampling {
        Sampling::Texels => (vk::Filter::NEAREST, vk::SamplerMipmapMode::NEAREST),
        _ => (vk::Filter::LINEAR, vk::SamplerMipmapMode::LINEAR),
    };
    let (repeats, name) = match sampling {
        Sampling::Texels => ([false; 2], "texel sampler"),
        Sampling::Clamped => ([false; 2], "clamping sampler"),
        Sampling::Repeated => ([true; 2], "repeating sampler"),
        Sampling::Along(repeats) => (repeats, "overlay sampler"),
    };
    let [u, v] = repeats.map(|repeats| match repeats {
        true => vk::SamplerAddressMode::REPEAT,
        false => vk::SamplerAddressMode::CLAMP_TO_EDGE,
    });
    let info = vk::SamplerCreateInfo::default()
        .mag_filter(filter)
        .min_filter(filter)
        .mipmap_mode(mipmap)
        .address_mode_u(u)
        .address_mode_v(v)
        .address_mode_w(u)
        .max_lod(vk::LOD_CLAMP_NONE);
    // SAFETY: the device is alive.
    let raw = unsafe { gpu.raw.create_sampler(&info, None) }?;
    gpu.name(raw, name);
    Ok(Sampler { raw, gpu: Arc::clone(gpu) })
}
