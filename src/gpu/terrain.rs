//! A scene on the device: its geometry, textures and pipelines, and the commands that draw a list with them.

use std::ops::Range;
use std::sync::Arc;

use anyhow::{Context, Result};
use ash::vk;
use bytemuck::cast_slice;

use super::device::Gpu;
use super::formats::Formats;
use super::frames::Recording;
use super::gpu_selection::GpuSelector;
use super::gpu_tile_cache::Overlay;
use super::height_pages::{self, Sampler, Sampling};
use super::materials;
use super::memory::{Buffer, Image, filled, memory_barrier};
use super::pipelines::{IMAGES, Pipelines};
use super::slot::{COMMAND, Part, Slot};
use crate::draw::layout::{ExplicitVertex, Frame, VertexNormals};
use crate::draw::{
    DeviceGeometry, Draw, DrawList, Geometry, GpuSelection, Limits, Source, Submission, Topology, Upload,
};
use crate::height::Field;
use crate::plan::ScenePlan;

/// Resources of one scene and one technique on the device.
pub struct Terrain {
    gpu: Arc<Gpu>,
    pipelines: Pipelines,
    limits: Limits,
    resident: Resident,
    slots: Vec<Slot>,
    descriptors: vk::DescriptorPool,
    samplers: [Sampler; IMAGES],
    images: [Image; IMAGES],
    /// Virtual texture of the overlay or of the ground.
    pub overlay: Overlay,
    gpu_selector: Option<GpuSelector>,
}

/// A scene to draw: its plan, and the data behind the plan.
#[derive(Clone, Copy)]
pub struct SceneInput<'a> {
    /// Features of its pipelines and resources.
    pub plan: &'a ScenePlan,
    /// The heights.
    pub field: &'a Arc<Field>,
    /// A picture draped over the field.
    pub overlay: Option<&'a image::RgbaImage>,
}

/// Geometry that stays on the device from frame to frame.
struct Resident {
    lattice: Buffer,
    vertices: Buffer,
    normals: Buffer,
    indices: Buffer,
}

impl Terrain {
    /// Makes the resources of a scene for a technique with this geometry, drawn to these formats.
    ///
    /// # Errors
    /// If the scene exceeds a limit of the device, or its memory.
    pub fn new(gpu: &Arc<Gpu>, scene: SceneInput, geometry: DeviceGeometry, formats: Formats) -> Result<Self> {
        let SceneInput { plan, field, overlay } = scene;
        let pipelines = Pipelines::new(gpu, plan, formats)?;
        let images = [
            height_pages::heights(gpu, plan, field)?,
            height_pages::holes(gpu, plan, field)?,
            height_pages::overlay(gpu, overlay.filter(|_| plan.maps.is_none()))?,
            materials::image(gpu, plan)?,
            height_pages::ceiling(gpu, plan, field)?,
        ];
        let heights = if !plan.filtered {
            Sampling::Texels
        } else if plan.tiled {
            Sampling::Repeated
        } else {
            Sampling::Clamped
        };
        let samplers = [
            height_pages::sampler(gpu, heights)?,
            height_pages::sampler(gpu, Sampling::Texels)?,
            height_pages::sampler(gpu, Sampling::Along(plan.drape.repeats()))?,
            height_pages::sampler(gpu, Sampling::Repeated)?,
            height_pages::sampler(gpu, heights)?,
        ];
        let resident = Resident::new(gpu, geometry.geometry)?;
        let gpu_selector = gpu_selector(gpu, geometry.gpu_selection)?;
        let overlay = Overlay::new(gpu, plan, field, overlay)?;
        // Created last, so that earlier errors cannot leak it.
        let descriptors = descriptor_pool(gpu)?;
        let mut terrain = Self {
            gpu: Arc::clone(gpu),
            pipelines,
            limits: geometry.limits,
            resident,
            slots: Vec::new(),
            descriptors,
            samplers,
            images,
            overlay,
            gpu_selector,
        };
        terrain.make_slots()?;
        Ok(terrain)
    }

    fn make_slots(&mut self) -> Result<()> {
        let gpu = &self.gpu;
        let layouts = vec![self.pipelines.set_layout; gpu.frames_in_flight];
        let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(self.descriptors).set_layouts(&layouts);
        // SAFETY: the pool holds as many sets as there are slots, and they are free.
        let sets = unsafe { gpu.raw.allocate_descriptor_sets(&info) }?;
        self.slots = sets.into_iter().map(|set| Slot::new(gpu, set, &self.limits)).collect::<Result<_>>()?;
        for (slot, table) in self.slots.iter().zip(&self.overlay.tables) {
            slot.describe(gpu, &self.images, &self.samplers, &self.overlay.slots, table);
        }
        Ok(())
    }

    /// Changes the look: makes the pipelines again, and the virtual texture if the plan has another one. Waits for the
    /// device. Field, device and picture are those that the scene was made with.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn replan(&mut self, SceneInput { plan, field, overlay }: SceneInput, formats: Formats) -> Result<()> {
        self.gpu.wait_idle()?;
        self.pipelines = Pipelines::new(&self.gpu, plan, formats)?;
        if !self.overlay.serves(plan) {
            self.overlay = Overlay::new(&self.gpu, plan, field, overlay)?;
            self.remake_slots()?;
        }
        Ok(())
    }

    /// Swaps the pipelines for others of the same scene.
    pub(super) fn exchange(&mut self, pipelines: &mut Pipelines) {
        std::mem::swap(&mut self.pipelines, pipelines);
    }

    /// Changes the technique: geometry and frame buffers are made again, textures stay. Waits for the device.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn retarget(&mut self, geometry: DeviceGeometry) -> Result<()> {
        self.gpu.wait_idle()?;
        self.slots.clear();
        self.gpu_selector = None;
        self.resident = Resident::new(&self.gpu, geometry.geometry)?;
        self.limits = geometry.limits;
        self.gpu_selector = gpu_selector(&self.gpu, geometry.gpu_selection)?;
        self.remake_slots()
    }

    /// Makes the frame buffers again. The device must be idle.
    fn remake_slots(&mut self) -> Result<()> {
        self.slots.clear();
        // SAFETY: the device is idle and the slots that used the sets are gone.
        unsafe { self.gpu.raw.reset_descriptor_pool(self.descriptors, vk::DescriptorPoolResetFlags::empty())? };
        self.make_slots()
    }

    /// The selection on the device, if the technique has one and the device can run it.
    pub fn gpu_selector(&self) -> Option<&GpuSelector> {
        self.gpu_selector.as_ref()
    }

    /// Returns true if a list is within the limits that its technique stated.
    pub(super) fn holds(&self, list: &DrawList) -> bool {
        self.limits.hold(&list.size())
    }

    /// Writes the data of a part of a frame for the device.
    ///
    /// # Panics
    /// If the list exceeds the limits that its technique stated.
    pub(super) fn write(&mut self, slot: usize, frame: &Frame, list: &DrawList, part: &Part) {
        assert!(self.holds(list), "the list fits its technique's limits: {:?}", list.size());
        self.slots[slot].write(frame, list, part);
    }

    /// Records the selection of a list that the device fills, before rendering begins.
    ///
    /// # Errors
    /// If the technique has no selection for the device, or the device cannot run it.
    pub fn select(&mut self, recording: &mut Recording, list: &DrawList) -> Result<()> {
        if list.submission != Submission::GpuDriven {
            return Ok(());
        }
        let gpu_selector = self.gpu_selector.as_mut().context("no selection on this device")?;
        gpu_selector.select(recording, &list.parameters);
        Ok(())
    }

    /// Copies changed geometry to the device.
    pub(super) fn upload(&mut self, recording: &Recording, uploads: &[Upload]) {
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

    /// Records the draws of a part of a list.
    pub(super) fn draw_part(&self, r: &Recording, list: &DrawList, part: &Part) {
        self.each_run(r, list, part.before.draws, |r, run| self.submit(r, list, run));
    }

    /// Records the sky: one triangle over the whole picture.
    pub(super) fn draw_sky(&self, r: &Recording) {
        // SAFETY: the pipeline outlives the frame; three vertices without input.
        unsafe {
            self.gpu.raw.cmd_bind_pipeline(r.commands, vk::PipelineBindPoint::GRAPHICS, self.pipelines.sky);
            self.bind_scene(r);
            self.gpu.raw.cmd_draw(r.commands, 3, 1, 0, 0);
        }
    }

    /// Calls `record` for each run of draws with one pipeline, from draw `first` on. Pipeline and geometry are bound then.
    pub(super) fn each_run(
        &self,
        r: &Recording,
        list: &DrawList,
        mut first: usize,
        mut record: impl FnMut(&Recording, Range<usize>),
    ) {
        self.bind_scene(r);
        if list.submission == Submission::GpuDriven {
            self.bind_pipeline(r, Source::Lattice, Topology::Triangles);
            self.bind_geometry(r, Source::Lattice);
            if let Some(gpu_selector) = &self.gpu_selector {
                // SAFETY: the buffer lives until the frame has ended.
                unsafe { self.gpu.raw.cmd_bind_vertex_buffers(r.commands, 1, &[gpu_selector.instances(r)], &[0]) };
            }
            return record(r, 0..list.draws.len());
        }
        let kind = |d: &Draw| (d.source, d.topology);
        for run in list.draws[first..].chunk_by(|a, b| kind(a) == kind(b)) {
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

    /// Layout of the descriptors: the frame's data and the scene's images.
    pub fn set_layout(&self) -> vk::DescriptorSetLayout {
        self.pipelines.set_layout
    }

    /// The descriptors of a frame that was prepared.
    pub fn scene_set(&self, recording: &Recording) -> vk::DescriptorSet {
        self.slots[recording.slot].set
    }

    /// Records draws of one run, submitted as the list says.
    pub(super) fn submit(&self, r: &Recording, list: &DrawList, draws: Range<usize>) {
        let raw = &self.gpu.raw;
        match list.submission {
            Submission::Indirect => {
                let max = self.gpu.limits.max_draw_indirect_count as usize;
                for first in draws.clone().step_by(max) {
                    let (offset, count) = ((first * COMMAND) as u64, max.min(draws.end - first) as u32);
                    let commands = self.slots[r.slot].commands.raw;
                    // SAFETY: the slot's buffer holds these commands until the frame has ended.
                    unsafe { raw.cmd_draw_indexed_indirect(r.commands, commands, offset, count, COMMAND as u32) };
                }
            }
            Submission::GpuDriven => match &self.gpu_selector {
                Some(gpu_selector) if draws == (0..list.draws.len()) => gpu_selector.draw(r),
                Some(gpu_selector) => gpu_selector.draw_some(r, draws),
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

fn gpu_selector(gpu: &Arc<Gpu>, gpu_selection: Option<&GpuSelection>) -> Result<Option<GpuSelector>> {
    gpu_selection.filter(|_| gpu.counts_draws).map(|gpu_selection| GpuSelector::new(gpu, gpu_selection)).transpose()
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

fn descriptor_pool(gpu: &Gpu) -> Result<vk::DescriptorPool> {
    let slots = gpu.frames_in_flight as u32;
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
            let _ = self.gpu.wait_idle();
            self.gpu.raw.destroy_descriptor_pool(self.descriptors, None);
        }
    }
}
