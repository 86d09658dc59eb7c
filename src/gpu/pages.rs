//! Sampled images: the height pages, the hole mask, and pictures.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;

use super::device::Gpu;
use super::frames::once;
use super::memory::{Buffer, Image, ImageInfo, barriers};
use crate::height::{Field, Samples};
use crate::plan::ScenePlan;

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
        None => picture(gpu, "no ceiling", vk::Format::R32_SFLOAT, [1, 1], true, &[0; 4]),
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
        return picture(gpu, "no holes", vk::Format::R8_UINT, [1, 1], true, &[0]);
    }
    paged(gpu, plan, "hole mask", vk::Format::R8_UINT, 1, |first, count, row| {
        row.extend((first..first + count).map(|k| u8::from(field.holes().contains(k))));
    })
}

/// A picture laid over the field; a stand-in of one texel if there is none.
pub fn overlay(gpu: &Arc<Gpu>, picture_: Option<&image::RgbaImage>) -> Result<Image> {
    match picture_ {
        Some(rgba) => picture(gpu, "overlay", vk::Format::R8G8B8A8_SRGB, rgba.dimensions().into(), false, rgba),
        None => picture(gpu, "no overlay", vk::Format::R8G8B8A8_SRGB, [1, 1], false, &[255; 4]),
    }
}

fn picture(
    gpu: &Arc<Gpu>,
    purpose: &'static str,
    format: vk::Format,
    size: [u32; 2],
    array: bool,
    data: &[u8],
) -> Result<Image> {
    let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST;
    let image = Image::new(gpu, ImageInfo { purpose, size, layers: array.then_some(1), format, usage })?;
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
    Ok(image)
}

/// Fills all layers band by band and leaves the image ready for sampling. `fill(layer, first row, rows, out)`
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
    use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
    let ready = (Stage::COPY, Access::TRANSFER_WRITE, Layout::TRANSFER_DST_OPTIMAL);
    once(gpu, |r| {
        barriers(gpu, r.commands, &[image.barrier((Stage::NONE, Access::NONE, Layout::UNDEFINED), ready)]);
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
                    let layout = Layout::TRANSFER_DST_OPTIMAL;
                    gpu.raw.cmd_copy_buffer_to_image(r.commands, staging.raw, image.raw, layout, &region);
                }
                Ok(())
            })?;
        }
    }
    once(gpu, |r| {
        let sampled = (Stage::ALL_COMMANDS, Access::SHADER_SAMPLED_READ, Layout::SHADER_READ_ONLY_OPTIMAL);
        barriers(gpu, r.commands, &[image.barrier(ready, sampled)]);
        Ok(())
    })
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
        Sampling::Clamped | Sampling::Repeated => (vk::Filter::LINEAR, vk::SamplerMipmapMode::LINEAR),
    };
    let (mode, name) = match sampling {
        Sampling::Texels => (vk::SamplerAddressMode::CLAMP_TO_EDGE, "texel sampler"),
        Sampling::Clamped => (vk::SamplerAddressMode::CLAMP_TO_EDGE, "clamping sampler"),
        Sampling::Repeated => (vk::SamplerAddressMode::REPEAT, "repeating sampler"),
    };
    let info = vk::SamplerCreateInfo::default()
        .mag_filter(filter)
        .min_filter(filter)
        .mipmap_mode(mipmap)
        .address_mode_u(mode)
        .address_mode_v(mode)
        .address_mode_w(mode)
        .max_lod(vk::LOD_CLAMP_NONE);
    // SAFETY: the device is alive.
    let raw = unsafe { gpu.raw.create_sampler(&info, None) }?;
    gpu.name(raw, name);
    Ok(Sampler { raw, gpu: Arc::clone(gpu) })
}
