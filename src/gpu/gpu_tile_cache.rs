//! Tile cache of a virtual texture: slots of one size in one array image, filled by frames while they are drawn.
//!
//! A frame copies at most `FRAME_BYTES` into slots before it draws, from staging memory of its own. The barrier before
//! the copies waits for the frames that still read. [`VirtualOverlay`] and [`VirtualGround`] choose the slots. They reuse no
//! slot of the frame before, so that with two frames in flight no tile is overwritten while it is read.

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
use crate::texture::tile_cache::TileUpload;
use crate::texture::virtual_ground::{VirtualGround, VirtualGroundLayout};
use crate::texture::virtual_overlay::VirtualOverlay;
pub use crate::texture::virtual_overlay::VirtualTextureStats;
use crate::view::View;

/// Most bytes that a frame copies into slots.
const FRAME_BYTES: u64 = 4 << 20;
/// Limit of loading rounds. Each round brings at least one tile, and no cache has as many slots.
const MAX_ROUNDS: u32 = 100_000;

/// The cache slots and the staging buffers that fill them.
pub struct GpuTileCache {
    /// The array image: one layer per slot.
    pub image: Image,
    /// Linear filtering, clamped to the edges of a slot.
    pub sampler: Sampler,
    tile_bytes: u64,
    staging: Vec<Buffer>,
}

impl GpuTileCache {
    /// Makes `count` slots of `side` × `side` texels with undefined content.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn new(gpu: &Arc<Gpu>, purpose: &'static str, side: u32, count: u32) -> Result<Self> {
        let usage = vk::ImageUsageFlags::SAMPLED | vk::ImageUsageFlags::TRANSFER_DST;
        let format = vk::Format::R8G8B8A8_SRGB;
        let image = Image::new(gpu, ImageInfo { purpose, size: [side; 2], layers: Some(count), format, usage })?;
        let tile_bytes = 4 * u64::from(side).pow(2);
        let staging_bytes = tile_bytes * (FRAME_BYTES / tile_bytes).clamp(1, u64::from(count));
        let staging = |_| Buffer::host(gpu, "texture staging", staging_bytes, vk::BufferUsageFlags::TRANSFER_SRC);
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

    /// Returns the maximum number of tiles that a frame uploads.
    pub fn max_uploads(&self) -> usize {
        (self.staging[0].size / self.tile_bytes) as usize
    }

    /// Records the upload of tiles into their slots. Must precede the beginning of rendering.
    ///
    /// # Panics
    /// If there are more than [`Self::max_uploads`] tiles, or if a tile has another size.
    pub fn upload(&mut self, recording: &Recording, uploads: &[TileUpload]) {
        if uploads.is_empty() {
            return;
        }
        let staging = &mut self.staging[recording.slot];
        for (k, upload) in uploads.iter().enumerate() {
            assert_eq!(size_of_val(upload.texels.as_slice()) as u64, self.tile_bytes, "bytes of a tile");
            staging.write(k * self.tile_bytes as usize, bytemuck::cast_slice(&upload.texels));
        }
        let regions: Vec<_> =
            (0u64..).zip(uploads).map(|(k, upload)| self.region(k * self.tile_bytes, upload.slot)).collect();
        let (image, staging) = (&self.image, self.staging[recording.slot].raw);
        let (gpu, commands) = (recording.gpu, recording.commands);
        barriers(gpu, commands, &[image.barrier(READ, WRITTEN)]);
        // SAFETY: staging and image live until the frame has ended.
        unsafe { gpu.raw.cmd_copy_buffer_to_image(commands, staging, image.raw, WRITTEN.2, &regions) };
        barriers(gpu, commands, &[image.barrier(WRITTEN, READ)]);
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

/// Use of the image by fragment shaders.
const READ: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout) = (
    vk::PipelineStageFlags2::FRAGMENT_SHADER,
    vk::AccessFlags2::SHADER_SAMPLED_READ,
    vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
);
/// Use of the image by copies.
const WRITTEN: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout) =
    (vk::PipelineStageFlags2::COPY, vk::AccessFlags2::TRANSFER_WRITE, vk::ImageLayout::TRANSFER_DST_OPTIMAL);

/// The virtual texture of a scene: a draped picture, or the ground. A scene without one has placeholders of one texel.
pub struct Overlay {
    /// The tile cache.
    pub slots: GpuTileCache,
    /// Page tables, one per frame in flight.
    pub tables: Vec<Buffer>,
    texture: VirtualTexture,
}

/// Source of the texels.
enum VirtualTexture {
    None,
    Picture(Box<VirtualOverlay>),
    Ground(Box<VirtualGround>),
}

impl Overlay {
    /// Makes the virtual texture that the plan needs.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn new(
        gpu: &Arc<Gpu>,
        plan: &ScenePlan,
        field: &Arc<Field>,
        picture: Option<&image::RgbaImage>,
    ) -> Result<Self> {
        let texture = match (plan.ground, plan.maps.zip(picture)) {
            (Some(layout), _) => VirtualTexture::Ground(Box::new(VirtualGround::new(field, layout))),
            (None, Some((layout, picture))) => {
                let texels = bytemuck::cast_slice(picture.as_raw());
                let picture = Picture { size: picture.dimensions().into(), texels };
                VirtualTexture::Picture(Box::new(VirtualOverlay::new(field, layout, plan.drape, picture)))
            }
            (None, None) => VirtualTexture::None,
        };
        let (slots, words) = match &texture {
            VirtualTexture::None => (GpuTileCache::new(gpu, "no texture maps", 1, 1)?, 1),
            VirtualTexture::Picture(texture) => {
                let layout = texture.layout();
                (GpuTileCache::new(gpu, "texture maps", layout.cells + 1, layout.slots)?, texture.table().len())
            }
            VirtualTexture::Ground(texture) => {
                let layout = texture.layout();
                (
                    GpuTileCache::new(gpu, "ground texels", VirtualGroundLayout::tile_side(), layout.slots)?,
                    layout.table_words(),
                )
            }
        };
        let table = |_| Buffer::host(gpu, "texture table", 4 * words as u64, vk::BufferUsageFlags::STORAGE_BUFFER);
        let mut overlay = Self { slots, tables: (0..gpu.frames_in_flight).map(table).collect::<Result<_>>()?, texture };
        // All pages start with the root tile.
        if let Some(table) = overlay.texture.table() {
            overlay.tables.iter_mut().for_each(|buffer| buffer.write(0, bytemuck::cast_slice(table)));
        }
        Ok(overlay)
    }

    /// Returns true if the virtual texture is the one that a plan needs.
    pub fn serves(&self, plan: &ScenePlan) -> bool {
        match &self.texture {
            VirtualTexture::None => plan.ground.is_none() && plan.maps.is_none(),
            VirtualTexture::Picture(texture) => plan.ground.is_none() && plan.maps == Some(*texture.layout()),
            VirtualTexture::Ground(texture) => plan.ground == Some(*texture.layout()),
        }
    }

    /// Takes a list that will be drawn: its triangles determine the texels of the ground that are needed.
    pub fn see(&mut self, view: &View, resident: &Geometry, list: &DrawList) {
        if let VirtualTexture::Ground(texture) = &mut self.texture {
            texture.require(view, resident, list);
        }
    }

    /// Chooses the tiles for a view and writes the page table of a slot. Returns the tiles that are ready for upload.
    pub fn choose(&mut self, slot: usize, view: &View) -> Vec<TileUpload> {
        let max = self.slots.max_uploads();
        let uploads = match &mut self.texture {
            VirtualTexture::None => return Vec::new(),
            VirtualTexture::Picture(texture) => texture.update(view, max),
            VirtualTexture::Ground(texture) => texture.update(max),
        };
        if let Some(table) = self.texture.table() {
            self.tables[slot].write(0, bytemuck::cast_slice(table));
        }
        uploads
    }

    /// Chooses the tiles for a view and records their uploads. Must precede the beginning of rendering.
    pub fn look(&mut self, recording: &Recording, view: &View) {
        let uploads = self.choose(recording.slot, view);
        self.slots.upload(recording, &uploads);
    }

    /// Loads all tiles that a view needs. The device must be idle.
    ///
    /// # Errors
    /// If tiles are still missing after `MAX_ROUNDS` rounds.
    pub fn settle(&mut self, gpu: &Arc<Gpu>, view: &View) -> Result<()> {
        for _ in 0..MAX_ROUNDS {
            once(gpu, |r| {
                self.look(r, view);
                Ok(())
            })?;
            if self.stats().is_none_or(|stats| stats.pending == 0) {
                return Ok(());
            }
            match &mut self.texture {
                VirtualTexture::None => {}
                VirtualTexture::Picture(texture) => texture.wait(),
                VirtualTexture::Ground(texture) => texture.wait(),
            }
        }
        bail!("virtual-texture tiles of the view are still missing after {MAX_ROUNDS} rounds")
    }

    /// Returns the statistics of the virtual texture, if there is one.
    pub fn stats(&self) -> Option<VirtualTextureStats> {
        match &self.texture {
            VirtualTexture::None => None,
            VirtualTexture::Picture(texture) => Some(texture.stats()),
            VirtualTexture::Ground(texture) => Some(texture.stats()),
        }
    }
}

impl VirtualTexture {
    fn table(&self) -> Option<&[u32]> {
        match self {
            VirtualTexture::None => None,
            VirtualTexture::Picture(texture) => Some(texture.table()),
            VirtualTexture::Ground(texture) => Some(texture.table().words()),
        }
    }
}
