//! An array of texture slots of one size that frames fill while they are drawn, with the maps of a picture in it or the
//! texels of the ground.
//!
//! A slot is a layer of one array image, bound by a plain descriptor. A frame copies at most so many bytes into slots, from
//! staging of its own, before it draws; the barrier before the copies waits for the frames that still read. Whoever
//! chooses the slots ([`VirtualOverlay`], [`VirtualGround`]) gives none away that served in the frame before, so that with two frames in flight
//! nothing that is read is overwritten.

use std::sync::Arc;

use anyhow::{Result, bail};
use ash::vk;

use super::device::Gpu;
use super::frames::{Recording, once};
use super::height_pages::{self, Sampler, Sampling};
use super::memory::{Buffer, Image, ImageInfo, barriers};
use crate::draw::{DrawList, Geometry};
use crate::height::Field;
use crate::plan::ScenePlan;
use crate::texture::overlay_pyramid::Picture;
use crate::texture::tile_cache::Fill;
use crate::texture::virtual_ground::{VirtualGround, VirtualGroundLayout};
use crate::texture::virtual_overlay::VirtualOverlay;
pub use crate::texture::virtual_overlay::VirtualTextureStats;
use crate::view::View;

/// The most bytes that a frame copies into slots.
const FRAME_BYTES: u64 = 4 << 20;
/// More rounds than any view takes to load: each brings one tile at least, and no table of slots has as many.
const MAX_ROUNDS: u32 = 100_000;

/// The slots.
pub struct GpuTileCache {
    /// A layer a slot.
    pub image: Image,
    /// Linear within a slot.
    pub sampler: Sampler,
    tile_bytes: u64,
    staging: Vec<Buffer>,
}

impl GpuTileCache {
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
            sampler: height_pages::sampler(gpu, Sampling::Clamped)?,
            tile_bytes,
            staging: (0..gpu.frames_in_flight).map(staging).collect::<Result<_>>()?,
        };
        once(gpu, |r| {
            let nothing = (vk::PipelineStageFlags2::NONE, vk::AccessFlags2::NONE, vk::ImageLayout::UNDEFINED);
            barriers(gpu, r.commands, &[slots.image.barrier(nothing, READ)]);
            Ok(())
        })?;
        Ok(slots)
    }

    /// The most slots that a frame fills.
    pub fn max_fills(&self) -> usize {
        (self.staging[0].size / self.tile_bytes) as usize
    }

    /// Records the filling of slots: before the target begins.
    ///
    /// # Panics
    /// If there are more than [`Self::max_fills`], or texels of another size.
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

/// The texels laid over a scene in parts: those of a picture, or of the ground; without either stand-ins.
pub struct Overlay {
    /// The slots.
    pub slots: GpuTileCache,
    /// In which a fragment finds its part, one table a frame in flight.
    pub tables: Vec<Buffer>,
    parts: Parts,
}

/// Whose texels they are.
enum Parts {
    None,
    Picture(Box<VirtualOverlay>),
    Ground(Box<VirtualGround>),
}

impl Overlay {
    /// What the plan says of the picture and the ground.
    pub fn new(
        gpu: &Arc<Gpu>,
        plan: &ScenePlan,
        field: &Arc<Field>,
        picture: Option<&image::RgbaImage>,
    ) -> Result<Self> {
        let parts = match (plan.ground, plan.maps.zip(picture)) {
            (Some(layout), _) => Parts::Ground(Box::new(VirtualGround::new(field, layout))),
            (None, Some((layout, picture))) => {
                let texels = bytemuck::cast_slice(picture.as_raw());
                let picture = Picture { size: picture.dimensions().into(), texels };
                Parts::Picture(Box::new(VirtualOverlay::new(field, layout, plan.drape, picture)))
            }
            (None, None) => Parts::None,
        };
        let (slots, words) = match &parts {
            Parts::None => (GpuTileCache::new(gpu, "no texture maps", 1, 1)?, 1),
            Parts::Picture(maps) => {
                let layout = maps.layout();
                (GpuTileCache::new(gpu, "texture maps", layout.cells + 1, layout.slots)?, maps.table().len())
            }
            Parts::Ground(maps) => {
                let layout = maps.layout();
                (
                    GpuTileCache::new(gpu, "ground texels", VirtualGroundLayout::tile_side(), layout.slots)?,
                    layout.table_words(),
                )
            }
        };
        let table = |_| Buffer::host(gpu, "texture table", 4 * words as u64, vk::BufferUsageFlags::STORAGE_BUFFER);
        let mut overlay = Self { slots, tables: (0..gpu.frames_in_flight).map(table).collect::<Result<_>>()?, parts };
        // Everything by the root.
        if let Some(table) = overlay.parts.table() {
            overlay.tables.iter_mut().for_each(|buffer| buffer.write(0, bytemuck::cast_slice(table)));
        }
        Ok(overlay)
    }

    /// Whether it is what a plan says.
    pub fn serves(&self, plan: &ScenePlan) -> bool {
        match &self.parts {
            Parts::None => plan.ground.is_none() && plan.maps.is_none(),
            Parts::Picture(maps) => plan.ground.is_none() && plan.maps == Some(*maps.layout()),
            Parts::Ground(maps) => plan.ground == Some(*maps.layout()),
        }
    }

    /// Is told of a list that is to be drawn: its triangles say which texels of the ground are needed.
    pub fn see(&mut self, view: &View, resident: &Geometry, list: &DrawList) {
        if let Parts::Ground(maps) = &mut self.parts {
            maps.see(view, resident, list);
        }
    }

    /// Chooses the parts for a view, fills what was made meanwhile, and writes the frame's table: before the target begins.
    pub fn look(&mut self, recording: &mut Recording, view: &View) -> Result<()> {
        let max = self.slots.max_fills();
        let fills = match &mut self.parts {
            Parts::None => return Ok(()),
            Parts::Picture(maps) => maps.look(view, max),
            Parts::Ground(maps) => maps.look(max),
        };
        self.slots.fill(recording, &fills)?;
        if let Some(table) = self.parts.table() {
            self.tables[recording.slot].write(0, bytemuck::cast_slice(table));
        }
        Ok(())
    }

    /// Loads all that a view needs of the list seen last. Nothing may be under way on the device.
    ///
    /// # Errors
    /// If something is still missing after `MAX_ROUNDS` rounds.
    pub fn settle(&mut self, gpu: &Arc<Gpu>, view: &View) -> Result<()> {
        for _ in 0..MAX_ROUNDS {
            once(gpu, |r| self.look(r, view))?;
            if self.stats().is_none_or(|stats| stats.pending == 0) {
                return Ok(());
            }
            match &mut self.parts {
                Parts::None => {}
                Parts::Picture(maps) => maps.wait(),
                Parts::Ground(maps) => maps.wait(),
            }
        }
        bail!("textures of the view are still missing after {MAX_ROUNDS} rounds")
    }

    /// What is held, if something is there in parts.
    pub fn stats(&self) -> Option<VirtualTextureStats> {
        match &self.parts {
            Parts::None => None,
            Parts::Picture(maps) => Some(maps.stats()),
            Parts::Ground(maps) => Some(maps.stats()),
        }
    }
}

impl Parts {
    fn table(&self) -> Option<&[u32]> {
        match self {
            Parts::None => None,
            Parts::Picture(maps) => Some(maps.table()),
            Parts::Ground(maps) => Some(maps.table().words()),
        }
    }
}
