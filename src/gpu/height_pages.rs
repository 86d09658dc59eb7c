//! Sampled images: pages of heights, the hole mask, and overlays; and their samplers.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;

use super::device::Gpu;
use super::frames::once;
use super::memory::{Buffer, Image, ImageInfo, barriers};
use crate::height::{Field, Samples};
use crate::plan::{ScenePlan, mip_levels};
use crate::texture::mipmaps;
use crate::texture::overlay_pyramid::Picture;

/// Size of a band of rows that is staged at once, bytes: staging stays small beside the field.
const STAGING: u64 = 32 << 20;

/// Creates the field's height texture, an array of pages.
pub fn heights(gpu: &Arc<Gpu>, plan: &ScenePlan, field: &Field) -> Result<Image> {
    surface(gpu, plan, "heights", field)
}

/// Creates the height texture of a cave's ceiling; a placeholder of one texel if there is none.
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

/// Creates the hole mask, a byte a sample, not 0 in holes; a placeholder of one texel if the plan omits holes.
pub fn holes(gpu: &Arc<Gpu>, plan: &ScenePlan, field: &Field) -> Result<Image> {
    if !plan.holes {
        return one_texel(gpu, "no holes", vk::Format::R8_UINT, Some(1), &[0]);
    }
    paged(gpu, plan, "hole mask", vk::Format::R8_UINT, 1, |first, count, row| {
        row.extend((first..first + count).map(|k| u8::from(field.holes().contains(k))));
    })
}

/// Creates the overlay with its mipmap levels; a placeholder of one texel if there is none.
pub fn overlay(gpu: &Arc<Gpu>, picture: Option<&image::RgbaImage>) -> Result<Image> {
    const FORMAT: vk::Format = vk::Format::R8G8B8A8_SRGB;
    let Some(rgba) = picture else { return one_texel(gpu, "no overlay", FORMAT, None, &[255; 4]) };
    let (purpose, size) = ("overlay", rgba.dimensions().into());
    let image = Image::with_levels(gpu, info(purpose, size, None, FORMAT), mip_levels(size))?;
    begin(gpu, &image)?;
    let mut finer = Picture { size, texels: bytemuck::cast_slice(rgba) };
    level(gpu, &image, 0, finer.size, bytemuck::cast_slice(finer.texels))?;
    let mut texels;
    for n in 1..mip_levels(size) {
        let next = mipmaps::halved(finer);
        texels = next.1;
        finer = Picture { size: next.0, texels: &texels };
        level(gpu, &image, n, finer.size, bytemuck::cast_slice(finer.texels))?;
    }
    finish(gpu, &image)?;
    Ok(image)
}

/// Creates a placeholder of one texel.
fn one_texel(
    gpu: &Arc<Gpu>,
    purpose: &'static str,
    format: vk::Format,
    layers: Option<u32>,
    texel: &[u8],
) -> Result<Image> {
    let image = Image::new(gpu, info(purpose, [1, 1], layers, format))?;
    begin(gpu, &image)?;
    level(gpu, &image, 0, [1, 1], texel)?;
    finish(gpu, &image)?;
    Ok(image)
}

fn info(purpose: &'static str, size: [u32; 2], layers: Option<u32>, format: vk::Format) -> ImageInfo {
    let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST;
    ImageInfo { purpose, size, layers, format, usage }
}

/// Fills one level of an image of one layer.
fn level(gpu: &Arc<Gpu>, image: &Image, level: u32, size: [u32; 2], data: &[u8]) -> Result<()> {
    let row = data.len() as u64 / u64::from(size[1]);
    upload(gpu, image, (level, 1), size, row, |_, y, rows, staging| {
        staging.extend_from_slice(&data[y as usize * row as usize..(y + rows) as usize * row as usize]);
    })
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
    let image = Image::new(gpu, info(purpose, size, Some(layers), format))?;
    begin(gpu, &image)?;
    let stored = plan.stored;
    upload(gpu, &image, (0, layers), size, u64::from(size[0]) * texel, |layer, y, count, staging| {
        let corner = [layer % columns * size[0], layer / columns * size[1]];
        for z in corner[1] + y..corner[1] + y + count {
            // Texels outside the field are never read: rows repeat the last one, columns are 0.
            let z = z.min(stored[1] - 1) as usize;
            let width = size[0].min(stored[0] - corner[0]) as usize;
            copy(z * stored[0] as usize + corner[0] as usize, width, staging);
            staging.resize(staging.len() + (size[0] as usize - width) * texel as usize, 0);
        }
    })?;
    finish(gpu, &image)?;
    Ok(image)
}

/// State of an image that copies write.
const WRITTEN: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout) =
    (vk::PipelineStageFlags2::COPY, vk::AccessFlags2::TRANSFER_WRITE, vk::ImageLayout::TRANSFER_DST_OPTIMAL);
/// State of an image that shaders sample.
const SAMPLED: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout) = (
    vk::PipelineStageFlags2::ALL_COMMANDS,
    vk::AccessFlags2::SHADER_SAMPLED_READ,
    vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
);

/// Transitions a new image for copies.
fn begin(gpu: &Arc<Gpu>, image: &Image) -> Result<()> {
    let nothing = (vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE, vk::ImageLayout::UNDEFINED);
    once(gpu, |r| {
        barriers(gpu, r.commands, &[image.barrier(nothing, WRITTEN)]);
        Ok(())
    })
}

/// Transitions a written image for sampling.
fn finish(gpu: &Arc<Gpu>, image: &Image) -> Result<()> {
    once(gpu, |r| {
        barriers(gpu, r.commands, &[image.barrier(WRITTEN, SAMPLED)]);
        Ok(())
    })
}

/// Fills a level of all layers of an image, band by band. `fill(layer, first row, rows, out)` appends the rows' bytes.
/// The image must be in the state [`WRITTEN`].
fn upload(
    gpu: &Arc<Gpu>,
    image: &Image,
    (level, layers): (u32, u32),
    size: [u32; 2],
    row_bytes: u64,
    fill: impl Fn(u32, u32, u32, &mut Vec<u8>),
) -> Result<()> {
    let band = ((STAGING / row_bytes) as u32).clamp(1, size[1]);
    let mut staging = Buffer::host(gpu, "staging", u64::from(band) * row_bytes, vk::BufferUsageFlags::TRANSFER_SRC)?;
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
                        .mip_level(level)
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

/// Filtering and addressing of an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sampling {
    /// Nearest texel.
    Texels,
    /// Linear, clamped to the edge.
    Clamped,
    /// Linear, repeating.
    Repeated,
    /// Linear, repeating along the axes (x, z) that are true and clamped to the edge along others.
    Along([bool; 2]),
}

/// A sampler. It must not be in use when it is dropped.
pub struct Sampler {
    /// The sampler.
    pub raw: vk::Sampler,
    gpu: Arc<Gpu>,
}

impl Drop for Sampler {
    fn drop(&mut self) {
        // SAFETY: nothing uses it any more.
        unsafe { self.gpu.raw.destroy_sampler(self.raw, None) };
    }
}

/// Creates a sampler.
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
