//! An array of texture slots of one size that frames fill while they are drawn, and the maps of a picture in it.
//!
//! A slot is a layer of one array image, bound by a plain descriptor. A frame copies at most so many bytes into slots, from
//! staging of its own, before it draws; the barrier before the copies waits for the frames that still read. Whoever
//! chooses the slots ([`PictureMaps`]) gives none away that served in the frame before, so that with two frames in flight
//! nothing that is read is overwritten.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;

use super::device::Gpu;
use super::frames::{Recording, SLOTS, once};
use super::memory::{Buffer, Image, ImageInfo, barriers};
use super::pages::{self, Sampler, Sampling};
use crate::height::Field;
use crate::plan::ScenePlan;
use crate::texture::page_maps::Picture;
pub use crate::texture::picture_maps::Figures;
use crate::texture::picture_maps::PictureMaps;
use crate::texture::slots::Fill;
use crate::view::View;

/// The most bytes that a frame copies into slots.
const FRAME_BYTES: u64 = 4 << 20;

/// The slots.
pub struct TextureSlots {
    /// A layer a slot.
    pub image: Image,
    /// Linear within a slot.
    pub sampler: Sampler,
    tile_bytes: u64,
    staging: Vec<Buffer>,
}

impl TextureSlots {
    /// So many slots of `side` × `side` texels, in no defined state.
    pub fn new(gpu: &Arc<Gpu>, purpose: &'static str, side: u32, count: u32) -> Result<Self> {
        let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST;
        let format = vk::Format::R8G8B8A8_SRGB;
        let image = Image::new(gpu, ImageInfo { purpose, size: [side; 2], layers: Some(count), format, usage })?;
        let tile_bytes = 4 * u64::from(side).pow(2);
        let room = tile_bytes * (FRAME_BYTES / tile_bytes).clamp(1, u64::from(count));
        let staging = |_| Buffer::host(gpu, "texture staging", room, vk::BufferUsageFlags::TRANSFER_SRC);
        let slots = Self {
            image,
            sampler: pages::sampler(gpu, Sampling::Clamped)?,
            tile_bytes,
            staging: (0..SLOTS).map(staging).collect::<Result<_>>()?,
        };
        once(gpu, |r| {
            let nothing = (vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE, vk::ImageLayout::UNDEFINED);
            barriers(gpu, r.commands, &[slots.image.barrier(nothing, READ)]);
            Ok(())
        })?;
        Ok(slots)
    }

    /// The most slots that a frame fills.
    pub fn most_fills(&self) -> usize {
        (self.staging[0].size / self.tile_bytes) as usize
    }

    /// Records the filling of slots: before the target begins.
    ///
    /// # Panics
    /// If there are more than [`Self::most_fills`], or texels of another size.
    pub fn fill(&mut self, recording: &mut Recording, fills: &[Fill]) -> Result<()> {
        if fills.is_empty() {
            return Ok(());
        }
        let staging = &mut self.staging[recording.slot];
        for (k, fill) in fills.iter().enumerate() {
            assert_eq!(size_of_val(fill.texels.as_slice()) as u64, self.tile_bytes, "a tile's texels");
            staging.write(k * self.tile_bytes as usize, bytemuck::cast_slice(&fill.texels));
        }
        let regions: Vec<_> =
            (0u64..).zip(fills).map(|(k, fill)| self.region(k * self.tile_bytes, fill.slot)).collect();
        let (image, staging) = (&self.image, self.staging[recording.slot].raw);
        recording.scope("textures", |r| {
            barriers(r.gpu, r.commands, &[image.barrier(READ, WRITTEN)]);
            // SAFETY: staging and image live until the frame has ended.
            unsafe { r.gpu.raw.cmd_copy_buffer_to_image(r.commands, staging, image.raw, WRITTEN.2, &regions) };
            barriers(r.gpu, r.commands, &[image.barrier(WRITTEN, READ)]);
            Ok(())
        })
    }

    fn region(&self, offset: u64, slot: u32) -> vk::BufferImageCopy {
        let [width, height] = self.image.size;
        let layer = vk::ImageSubresourceLayers::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .base_array_layer(slot)
            .layer_count(1);
        let extent = vk::Extent3D { width, height, depth: 1 };
        vk::BufferImageCopy::default().buffer_offset(offset).image_subresource(layer).image_extent(extent)
    }
}

/// As fragments read the image.
const READ: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout) = (
    vk::PipelineStageFlags2::FRAGMENT_SHADER,
    vk::AccessFlags2::SHADER_SAMPLED_READ,
    vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
);
/// As copies write it.
const WRITTEN: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout) =
    (vk::PipelineStageFlags2::COPY, vk::AccessFlags2::TRANSFER_WRITE, vk::ImageLayout::TRANSFER_DST_OPTIMAL);

/// The maps of the picture laid over a scene; without a picture, or with one that is there as a whole, stand-ins.
pub struct Overlay {
    /// The slots.
    pub slots: TextureSlots,
    /// Each page's entry, one table a frame in flight.
    pub tables: Vec<Buffer>,
    maps: Option<PictureMaps>,
}

impl Overlay {
    /// What the plan says of the picture.
    pub fn new(gpu: &Arc<Gpu>, plan: &ScenePlan, field: &Field, picture: Option<&image::RgbaImage>) -> Result<Self> {
        let maps = plan.maps.zip(picture).map(|(cut, picture)| {
            let texels = bytemuck::cast_slice(picture.as_raw());
            PictureMaps::new(field, cut, Picture { size: picture.dimensions().into(), texels })
        });
        let slots = match &maps {
            Some(maps) => TextureSlots::new(gpu, "texture maps", maps.cut().cells + 1, maps.cut().slots)?,
            None => TextureSlots::new(gpu, "no texture maps", 1, 1)?,
        };
        let entries = maps.as_ref().map_or(1, |maps| maps.table().len());
        let table = |_| Buffer::host(gpu, "texture table", 4 * entries as u64, vk::BufferUsageFlags::STORAGE_BUFFER);
        let mut overlay = Self { slots, tables: (0..SLOTS).map(table).collect::<Result<_>>()?, maps };
        overlay.write_root();
        Ok(overlay)
    }

    /// Every page by the root's tile.
    fn write_root(&mut self) {
        if let Some(maps) = &self.maps {
            self.tables.iter_mut().for_each(|table| table.write(0, bytemuck::cast_slice(maps.table())));
        }
    }

    /// Chooses the maps for a view, fills what was made meanwhile, and writes the frame's table: before the target begins.
    pub fn look(&mut self, recording: &mut Recording, view: &View) -> Result<()> {
        let Some(maps) = &mut self.maps else { return Ok(()) };
        let fills = maps.look(view, self.slots.most_fills());
        self.slots.fill(recording, &fills)?;
        self.tables[recording.slot].write(0, bytemuck::cast_slice(maps.table()));
        Ok(())
    }

    /// Goes on until all that a view needs is there. Nothing may be under way on the device.
    pub fn settle(&mut self, gpu: &Arc<Gpu>, view: &View) -> Result<()> {
        loop {
            once(gpu, |r| self.look(r, view))?;
            let Some(maps) = self.maps.as_mut().filter(|maps| maps.figures().waiting > 0) else { return Ok(()) };
            maps.wait();
        }
    }

    /// What is held, if the picture is there as maps.
    pub fn figures(&self) -> Option<Figures> {
        self.maps.as_ref().map(PictureMaps::figures)
    }
}
