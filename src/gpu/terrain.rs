//! The executor: a scene's resources, and draw lists turned into commands.

use std::ops::Range;
use std::sync::Arc;

use anyhow::{Context, Result};
use ash::vk;
use bytemuck::cast_slice;

use super::device::Gpu;
use super::driven::Driven;
use super::frames::{Recording, SLOTS};
use super::materials;
use super::memory::{Buffer, Image, filled, memory_barrier};
use super::pages::{self, Sampler, Sampling};
use super::pipelines::Pipelines;
use super::target::Formats;
use super::texture_slots::{Overlay, TextureSlots};
use crate::draw::layout::{ExplicitVertex, Frame, Instance, VertexNormals};
use crate::draw::{Draw, DrawList, Driver, Geometry, Kept, Limits, RESTART, Source, Submission, Topology, Upload};
use crate::height::Field;
use crate::plan::ScenePlan;

/// Everything on the device that one scene and one technique need.
pub struct Terrain {
    gpu: Arc<Gpu>,
    pipelines: Pipelines,
    limits: Limits,
    resident: Resident,
    slots: Vec<Slot>,
    descriptors: vk::DescriptorPool,
    samplers: [Sampler; IMAGES],
    images: [Image; IMAGES],
    /// What is laid over it in parts.
    pub overlay: Overlay,
    driven: Option<Driven>,
}

/// Geometry that stays.
struct Resident {
    lattice: Buffer,
    vertices: Buffer,
    normals: Buffer,
    indices: Buffer,
}

/// What one frame in flight writes.
struct Slot {
    set: vk::DescriptorSet,
    frame: Buffer,
    instances: Buffer,
    commands: Buffer,
    vertices: Buffer,
    normals: Buffer,
    indices: Buffer,
    /// Width of the streamed indices: 16 bits where all of the frame's fit.
    index_type: vk::IndexType,
    staging: Buffer,
}

/// Sampled images of a scene.
pub(super) const IMAGES: usize = 5;

/// Bytes of an indexed indirect command.
pub(super) const COMMAND: usize = size_of::<vk::DrawIndexedIndirectCommand>();

impl Terrain {
    /// Makes the resources of a scene for a technique that keeps these on the device.
    pub fn new(
        gpu: &Arc<Gpu>,
        plan: &ScenePlan,
        field: &Arc<Field>,
        overlay: Option<&image::RgbaImage>,
        kept: Kept,
        formats: Formats,
    ) -> Result<Self> {
        let pipelines = Pipelines::new(gpu, plan, formats)?;
        let images = [
            pages::heights(gpu, plan, field)?,
            pages::holes(gpu, plan, field)?,
            pages::overlay(gpu, overlay.filter(|_| plan.maps.is_none()))?,
            materials::image(gpu, plan)?,
            pages::ceiling(gpu, plan, field)?,
        ];
        let heights = if !plan.filtered {
            Sampling::Texels
        } else if plan.tiled {
            Sampling::Repeated
        } else {
            Sampling::Clamped
        };
        let samplers = [
            pages::sampler(gpu, heights)?,
            pages::sampler(gpu, Sampling::Texels)?,
            pages::sampler(gpu, Sampling::Clamped)?,
            pages::sampler(gpu, Sampling::Repeated)?,
            pages::sampler(gpu, heights)?,
        ];
        let resident = Resident::new(gpu, kept.geometry)?;
        let driven = driven(gpu, kept.driver)?;
        let overlay = Overlay::new(gpu, plan, field, overlay)?;
        // Last: whoever fails before has none to destroy.
        let descriptors = descriptor_pool(gpu)?;
        let mut terrain = Self {
            gpu: Arc::clone(gpu),
            pipelines,
            limits: kept.limits,
            resident,
            slots: Vec::new(),
            descriptors,
            samplers,
            images,
            overlay,
            driven,
        };
        terrain.make_slots()?;
        Ok(terrain)
    }

    fn make_slots(&mut self) -> Result<()> {
        let gpu = &self.gpu;
        let layouts = [self.pipelines.set_layout; SLOTS];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.descriptors).set_layouts(&layouts);
        // SAFETY: the pool holds as many sets as there are slots, and they are free.
        let sets = unsafe { gpu.raw.allocate_descriptor_sets(&info) }?;
        self.slots = sets.into_iter().map(|set| Slot::new(gpu, set, &self.limits)).collect::<Result<_>>()?;
        for (slot, table) in self.slots.iter().zip(&self.overlay.tables) {
            slot.describe(gpu, &self.images, &self.samplers, &self.overlay.slots, table);
        }
        Ok(())
    }

    /// Gives the scene another look: only pipelines are made anew, and what is laid over it in parts if that is another. The
    /// plan must be of the same field on the same device, and the picture the one that the scene was made with.
    pub fn replan(
        &mut self,
        plan: &ScenePlan,
        field: &Arc<Field>,
        picture: Option<&image::RgbaImage>,
        formats: Formats,
    ) -> Result<()> {
        self.gpu.wait_idle()?;
        self.pipelines = Pipelines::new(&self.gpu, plan, formats)?;
        if !self.overlay.serves(plan) {
            self.overlay = Overlay::new(&self.gpu, plan, field, picture)?;
            self.remake_slots()?;
        }
        Ok(())
    }

    /// Draws from now on with other pipelines of the same scene, which get these in exchange.
    pub fn exchange(&mut self, pipelines: &mut Pipelines) {
        std::mem::swap(&mut self.pipelines, pipelines);
    }

    /// Gives the scene another technique: what comes from the field alone stays.
    pub fn retarget(&mut self, kept: Kept) -> Result<()> {
        self.gpu.wait_idle()?;
        self.slots.clear();
        self.driven = None;
        self.resident = Resident::new(&self.gpu, kept.geometry)?;
        self.limits = kept.limits;
        self.driven = driven(&self.gpu, kept.driver)?;
        self.remake_slots()
    }

    /// The device must be idle.
    fn remake_slots(&mut self) -> Result<()> {
        self.slots.clear();
        // SAFETY: the device is idle and the slots that used the sets are gone.
        unsafe { self.gpu.raw.reset_descriptor_pool(self.descriptors, vk::DescriptorPoolResetFlags::empty())? };
        self.make_slots()
    }

    /// The selection on the device, if the technique has a driver and the device can run it.
    pub fn driven(&self) -> Option<&Driven> {
        self.driven.as_ref()
    }

    /// Writes a frame's data and records its uploads: before the target begins.
    ///
    /// # Panics
    /// If the list exceeds the limits that its technique stated.
    pub fn prepare(&mut self, recording: &mut Recording, frame: &Frame, list: &DrawList) -> Result<()> {
        assert!(self.limits.hold(&list.size()), "the list fits its technique's limits: {:?}", list.size());
        let slot = &mut self.slots[recording.slot];
        slot.frame.write(0, bytemuck::bytes_of(frame));
        slot.instances.write(0, cast_slice(&list.instances));
        slot.vertices.write(0, cast_slice(&list.streamed.vertices));
        slot.normals.write(0, cast_slice(&list.streamed.normals));
        slot.write_indices(&list.streamed.indices);
        for (k, draw) in list.draws.iter().enumerate() {
            slot.commands.write(k * COMMAND, &command_bytes(draw));
        }
        if list.uploads.is_empty() {
            return Ok(());
        }
        recording.scope("upload", |r| {
            self.upload(r, &list.uploads);
            Ok(())
        })
    }

    /// Records the selection of a list that the device fills: before the target begins.
    pub fn select(&mut self, recording: &mut Recording, list: &DrawList) -> Result<()> {
        if list.submission != Submission::Driven {
            return Ok(());
        }
        self.driven.as_mut().context("no selection on this device")?.select(recording, &list.parameters)
    }

    fn upload(&mut self, recording: &Recording, uploads: &[Upload]) {
        use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
        let read = (Stage::VERTEX_INPUT, Access::VERTEX_ATTRIBUTE_READ | Access::INDEX_READ);
        let write = (Stage::COPY, Access::TRANSFER_WRITE);
        // Earlier frames may still read what is overwritten.
        memory_barrier(&self.gpu, recording.commands, read, write);
        let staging = &mut self.slots[recording.slot].staging;
        let mut at = 0;
        for upload in uploads {
            let (bytes, target, offset): (&[u8], _, _) = match upload {
                Upload::Vertices(first, v) => {
                    (cast_slice(v), &self.resident.vertices, *first as usize * size_of::<ExplicitVertex>())
                }
                Upload::Normals(first, n) => {
                    (cast_slice(n), &self.resident.normals, *first as usize * size_of::<VertexNormals>())
                }
                Upload::Indices(first, i) => (cast_slice(i), &self.resident.indices, *first as usize * 4),
            };
            if bytes.is_empty() {
                continue;
            }
            staging.write(at, bytes);
            let region =
                [vk::BufferCopy { src_offset: at as u64, dst_offset: offset as u64, size: bytes.len() as u64 }];
            // SAFETY: both buffers live until the frame has ended.
            unsafe { self.gpu.raw.cmd_copy_buffer(recording.commands, staging.raw, target.raw, &region) };
            at += bytes.len();
        }
        memory_barrier(&self.gpu, recording.commands, write, read);
    }

    /// Records the land and the sky: between the target's begin and end.
    pub fn draw(&self, recording: &mut Recording, list: &DrawList) -> Result<()> {
        self.with_sky(recording, |recording| {
            recording.scope("terrain", |r| {
                self.each_run(r, list, |r, run| self.submit(r, list, run));
                Ok(())
            })
        })
    }

    /// Records land, and the sky after it, where depth is 0 still; without depth before it.
    pub(super) fn with_sky(
        &self,
        recording: &mut Recording,
        record: impl FnOnce(&mut Recording) -> Result<()>,
    ) -> Result<()> {
        if self.pipelines.has_depth {
            record(recording)?;
            return self.draw_sky(recording);
        }
        self.draw_sky(recording)?;
        record(recording)
    }

    /// Calls `record` for each run of draws of one pipeline, with that and its geometry bound.
    pub(super) fn each_run(&self, r: &Recording, list: &DrawList, mut record: impl FnMut(&Recording, Range<usize>)) {
        self.bind_scene(r);
        if list.submission == Submission::Driven {
            self.bind_pipeline(r, Source::Lattice, Topology::Triangles);
            self.bind_geometry(r, Source::Lattice);
            if let Some(driven) = &self.driven {
                // SAFETY: the buffer lives until the frame has ended.
                unsafe { self.gpu.raw.cmd_bind_vertex_buffers(r.commands, 1, &[driven.instances(r)], &[0]) };
            }
            return record(r, 0..list.draws.len());
        }
        let mut first = 0;
        let kind = |d: &Draw| (d.source, d.topology);
        for run in list.draws.chunk_by(|a, b| kind(a) == kind(b)) {
            self.bind_geometry(r, run[0].source);
            self.bind_pipeline(r, run[0].source, run[0].topology);
            record(r, first..first + run.len());
            first += run.len();
        }
    }

    fn bind_pipeline(&self, r: &Recording, source: Source, topology: Topology) {
        let pipeline = self.pipelines.terrain(source, topology);
        // SAFETY: the pipeline outlives the frame.
        unsafe { self.gpu.raw.cmd_bind_pipeline(r.commands, vk::PipelineBindPoint::GRAPHICS, pipeline) };
    }

    fn draw_sky(&self, recording: &mut Recording) -> Result<()> {
        recording.scope("sky", |r| {
            // SAFETY: the pipeline outlives the frame; three vertices without input.
            unsafe {
                self.gpu.raw.cmd_bind_pipeline(r.commands, vk::PipelineBindPoint::GRAPHICS, self.pipelines.sky);
                self.bind_scene(r);
                self.gpu.raw.cmd_draw(r.commands, 3, 1, 0, 0);
            }
            Ok(())
        })
    }

    /// The layout of the descriptors of the frame and the scene's images.
    pub fn set_layout(&self) -> vk::DescriptorSetLayout {
        self.pipelines.set_layout
    }

    /// The descriptors of a frame that was prepared.
    pub fn scene_set(&self, recording: &Recording) -> vk::DescriptorSet {
        self.slots[recording.slot].set
    }

    /// Records draws of one run as the list says.
    pub(super) fn submit(&self, r: &Recording, list: &DrawList, draws: Range<usize>) {
        let raw = &self.gpu.raw;
        match list.submission {
            Submission::Indirect => {
                let most = self.gpu.limits.max_draw_indirect_count as usize;
                for first in draws.clone().step_by(most) {
                    let (offset, count) = ((first * COMMAND) as u64, most.min(draws.end - first) as u32);
                    let commands = self.slots[r.slot].commands.raw;
                    // SAFETY: the slot's buffer holds these commands until the frame has ended.
                    unsafe { raw.cmd_draw_indexed_indirect(r.commands, commands, offset, count, COMMAND as u32) };
                }
            }
            Submission::Driven => match &self.driven {
                Some(driven) if draws == (0..list.draws.len()) => driven.draw(r),
                Some(driven) => driven.draw_some(r, draws),
                None => {}
            },
            Submission::Direct => {
                for draw in &list.draws[draws] {
                    let (indices, instances) = (draw.indices.len() as u32, draw.instances.len() as u32);
                    // SAFETY: ranges lie in the bound buffers.
                    unsafe {
                        let (first_index, first_instance) = (draw.indices.start, draw.instances.start);
                        let offset = draw.first_vertex as i32;
                        raw.cmd_draw_indexed(r.commands, indices, instances, first_index, offset, first_instance);
                    }
                }
            }
        }
    }

    fn bind_scene(&self, r: &Recording) {
        let (sets, layout) = ([self.slots[r.slot].set], self.pipelines.layout);
        // SAFETY: the set was written when the slot was made.
        unsafe {
            let graphics = vk::PipelineBindPoint::GRAPHICS;
            self.gpu.raw.cmd_bind_descriptor_sets(r.commands, graphics, layout, 0, &sets, &[]);
        }
    }

    pub(super) fn bind_geometry(&self, r: &Recording, source: Source) {
        let slot = &self.slots[r.slot];
        let (resident, wide) = (&self.resident, vk::IndexType::UINT32);
        let (vertices, normals, indices, index_type) = match source {
            Source::Lattice => (&resident.lattice, &resident.normals, &resident.indices, wide),
            Source::Resident => (&resident.vertices, &resident.normals, &resident.indices, wide),
            Source::Streamed => (&slot.vertices, &slot.normals, &slot.indices, slot.index_type),
        };
        // SAFETY: the buffers live until the frame has ended.
        unsafe {
            let buffers = [vertices.raw, slot.instances.raw, normals.raw];
            self.gpu.raw.cmd_bind_vertex_buffers(r.commands, 0, &buffers, &[0; 3]);
            self.gpu.raw.cmd_bind_index_buffer(r.commands, indices.raw, 0, index_type);
        }
    }
}

fn driven(gpu: &Arc<Gpu>, driver: Option<&Driver>) -> Result<Option<Driven>> {
    driver.filter(|_| gpu.counts_draws).map(|driver| Driven::new(gpu, driver)).transpose()
}

fn command_bytes(draw: &Draw) -> [u8; COMMAND] {
    let words = [
        draw.indices.len() as u32,
        draw.instances.len() as u32,
        draw.indices.start,
        draw.first_vertex,
        draw.instances.start,
    ];
    bytemuck::cast(words)
}

impl Resident {
    fn new(gpu: &Arc<Gpu>, geometry: &Geometry) -> Result<Self> {
        let vertex = vk::BufferUsageFlags::VERTEX_BUFFER;
        let index = vk::BufferUsageFlags::INDEX_BUFFER;
        Ok(Self {
            lattice: filled(gpu, "lattice vertices", cast_slice(&geometry.lattice), vertex)?,
            vertices: filled(gpu, "resident vertices", cast_slice(&geometry.vertices), vertex)?,
            normals: filled(gpu, "vertex normals", cast_slice(&geometry.normals), vertex)?,
            indices: filled(gpu, "resident indices", cast_slice(&geometry.indices), index)?,
        })
    }
}

impl Slot {
    fn new(gpu: &Arc<Gpu>, set: vk::DescriptorSet, limits: &Limits) -> Result<Self> {
        use vk::BufferUsageFlags as Usage;
        let host = |purpose, bytes: usize, usage| Buffer::host(gpu, purpose, bytes as u64, usage);
        Ok(Self {
            set,
            frame: host("frame", size_of::<Frame>(), Usage::UNIFORM_BUFFER)?,
            instances: host("instances", limits.instances * size_of::<Instance>(), Usage::VERTEX_BUFFER)?,
            commands: host("indirect commands", limits.draws * COMMAND, Usage::INDIRECT_BUFFER)?,
            vertices: host("streamed vertices", limits.vertices * size_of::<ExplicitVertex>(), Usage::VERTEX_BUFFER)?,
            normals: host("streamed normals", limits.normals * size_of::<VertexNormals>(), Usage::VERTEX_BUFFER)?,
            indices: host("streamed indices", limits.indices * 4, Usage::INDEX_BUFFER)?,
            index_type: vk::IndexType::UINT32,
            staging: host("upload staging", limits.upload_bytes, Usage::TRANSFER_SRC)?,
        })
    }

    /// Writes the frame's streamed indices, 16 bits each if all of them fit.
    fn write_indices(&mut self, indices: &[u32]) {
        let highest = indices.iter().copied().filter(|&k| k != RESTART).fold(0, u32::max);
        // The highest number of either kind ends a strip.
        if highest < u32::from(u16::MAX) {
            self.index_type = vk::IndexType::UINT16;
            self.indices.write_short(indices);
        } else {
            self.index_type = vk::IndexType::UINT32;
            self.indices.write(0, cast_slice(indices));
        }
    }

    fn describe(
        &self,
        gpu: &Gpu,
        images: &[Image; IMAGES],
        samplers: &[Sampler; IMAGES],
        maps: &TextureSlots,
        table: &Buffer,
    ) {
        let table = [vk::DescriptorBufferInfo { buffer: table.raw, offset: 0, range: vk::WHOLE_SIZE }];
        let frame = [vk::DescriptorBufferInfo { buffer: self.frame.raw, offset: 0, range: vk::WHOLE_SIZE }];
        let layout = vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL;
        let infos: Vec<_> = images
            .iter()
            .zip(samplers)
            .chain([(&maps.image, &maps.sampler)])
            .map(|(image, sampler)| {
                let (sampler, image_view) = (sampler.raw, image.view);
                [vk::DescriptorImageInfo { sampler, image_view, image_layout: layout }]
            })
            .collect();
        let write = vk::WriteDescriptorSet::default().dst_set(self.set);
        let mut writes =
            vec![write.dst_binding(0).descriptor_type(vk::DescriptorType::UNIFORM_BUFFER).buffer_info(&frame)];
        for (binding, info) in (1u32..).zip(&infos) {
            let kind = vk::DescriptorType::COMBINED_IMAGE_SAMPLER;
            writes.push(write.dst_binding(binding).descriptor_type(kind).image_info(info));
        }
        let kind = vk::DescriptorType::STORAGE_BUFFER;
        writes.push(write.dst_binding(infos.len() as u32 + 1).descriptor_type(kind).buffer_info(&table));
        // SAFETY: buffers and images live as long as the set.
        unsafe { gpu.raw.update_descriptor_sets(&writes, &[]) };
    }
}

fn descriptor_pool(gpu: &Gpu) -> Result<vk::DescriptorPool> {
    let slots = SLOTS as u32;
    let sizes = [
        vk::DescriptorPoolSize { ty: vk::DescriptorType::UNIFORM_BUFFER, descriptor_count: slots },
        vk::DescriptorPoolSize {
            ty: vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
            descriptor_count: (IMAGES as u32 + 1) * slots,
        },
        vk::DescriptorPoolSize { ty: vk::DescriptorType::STORAGE_BUFFER, descriptor_count: slots },
    ];
    let info = vk::DescriptorPoolCreateInfo::default().max_sets(slots).pool_sizes(&sizes);
    // SAFETY: the device is alive; Drop destroys the pool.
    let pool = unsafe { gpu.raw.create_descriptor_pool(&info, None) }?;
    gpu.name(pool, "scene");
    Ok(pool)
}

impl Drop for Terrain {
    fn drop(&mut self) {
        // SAFETY: nothing is in use once the device is idle.
        unsafe {
            let _ = self.gpu.raw.device_wait_idle();
            self.gpu.raw.destroy_descriptor_pool(self.descriptors, None);
        }
    }
}
