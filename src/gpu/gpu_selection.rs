//! Selection on the device: runs the programs of a [`GpuSelection`], whose technique it does not know, and reads back what
//! they found.

use std::sync::Arc;

use anyhow::{Result, bail};
use ash::vk;
use gpu_allocator::MemoryLocation;

use super::bindings::{Bindings, Bound};
use super::device::Gpu;
use super::frames::{Recording, SLOTS, once};
use super::memory::{Buffer, filled, memory_barrier};
use super::pipelines;
use super::shaders::Constants;
use super::slot::COMMAND;
use crate::draw::gpu_selection::{Groups, Step};
use crate::draw::layout::{Instance, Tally};
use crate::draw::{Draw, DrawList, GpuSelection, Source, Submission, Topology};

use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};

const HEAD: usize = size_of::<Tally>();

/// Pipelines, the table, and what each frame in flight writes.
pub struct GpuSelector {
    gpu: Arc<Gpu>,
    pool: vk::CommandPool,
    slots: Vec<Slot>,
    pipelines: Vec<vk::Pipeline>,
    scratch: Buffer,
    table: Buffer,
    steps: Vec<Step>,
    draws: usize,
    /// The slot of the newest frame.
    newest: usize,
}

struct Slot {
    /// The whole selection, recorded once: a frame adds no more than its parameters.
    selection: vk::CommandBuffer,
    bindings: Bindings,
    parameters: Buffer,
    instances: Buffer,
    commands: Buffer,
    /// A copy of the commands for the host.
    found: Buffer,
    has_run: bool,
}

impl GpuSelector {
    /// Makes what a driver needs. The device must count draws ([`Gpu::counts_draws`]).
    pub fn new(gpu: &Arc<Gpu>, gpu_selection: &GpuSelection) -> Result<Self> {
        use vk::BufferUsageFlags as Usage;
        let table = filled(gpu, "selection table", bytemuck::cast_slice(&gpu_selection.table), Usage::STORAGE_BUFFER)?;
        let usage = Usage::STORAGE_BUFFER | Usage::INDIRECT_BUFFER;
        let scratch = Buffer::device(gpu, "selection scratch", 4 * gpu_selection.scratch as u64, usage)?;
        // SAFETY: the device is alive; Drop destroys the pool.
        let pool = unsafe {
            let info = vk::CommandPoolCreateInfo::default().queue_family_index(gpu.queue_family);
            gpu.raw.create_command_pool(&info, None)?
        };
        let (gpu, steps, draws) = (Arc::clone(gpu), gpu_selection.steps.clone(), gpu_selection.draws);
        let (slots, pipelines) = (Vec::new(), Vec::new());
        let mut gpu_selector = Self { gpu, pool, slots, pipelines, scratch, table, steps, draws, newest: 0 };
        for _ in 0..SLOTS {
            gpu_selector.slots.push(Slot::new(
                &gpu_selector.gpu,
                pool,
                gpu_selection,
                &gpu_selector.table,
                &gpu_selector.scratch,
            )?);
        }
        for program in gpu_selection.programs {
            let layout = gpu_selector.slots[0].bindings.layout;
            let pipeline = pipelines::compute(&gpu_selector.gpu, layout, program, program, &Constants::none())?;
            gpu_selector.pipelines.push(pipeline);
        }
        gpu_selector.slots.iter().try_for_each(|slot| gpu_selector.record(slot))?;
        Ok(gpu_selector)
    }

    /// Records the selection for a view told by its parameters: before the target begins.
    pub fn select(&mut self, recording: &mut Recording, parameters: &[u32]) -> Result<()> {
        self.newest = recording.slot;
        let slot = &mut self.slots[self.newest];
        slot.parameters.write(0, bytemuck::cast_slice(parameters));
        slot.has_run = true;
        let selection = [slot.selection];
        recording.scope("select", |r| {
            // SAFETY: the slot's last frame has ended, so its selection is not under way.
            unsafe { r.gpu.raw.cmd_execute_commands(r.commands, &selection) };
            Ok(())
        })
    }

    fn record(&self, slot: &Slot) -> Result<()> {
        let inherited = vk::CommandBufferInheritanceInfo::default();
        let info = vk::CommandBufferBeginInfo::default().inheritance_info(&inherited);
        // SAFETY: nothing uses the new command buffer, and what is bound outlives it.
        unsafe {
            let (raw, point) = (&self.gpu.raw, vk::PipelineBindPoint::COMPUTE);
            raw.begin_command_buffer(slot.selection, &info)?;
            raw.cmd_bind_descriptor_sets(slot.selection, point, slot.bindings.layout, 0, &[slot.bindings.set], &[]);
        }
        self.record_steps(slot);
        self.record_copy(slot);
        // SAFETY: it was begun above.
        Ok(unsafe { self.gpu.raw.end_command_buffer(slot.selection) }?)
    }

    fn record_steps(&self, slot: &Slot) {
        let working = Access::SHADER_STORAGE_READ | Access::SHADER_STORAGE_WRITE;
        let steps = (Stage::COMPUTE_SHADER | Stage::TRANSFER, working | Access::TRANSFER_WRITE);
        let reading = (Stage::COMPUTE_SHADER | Stage::DRAW_INDIRECT, working | Access::INDIRECT_COMMAND_READ);
        // Frames before may still work in the scratch.
        memory_barrier(&self.gpu, slot.selection, (steps.0 | reading.0, steps.1), steps);
        for step in &self.steps {
            match step {
                Step::Fill(words, value) => {
                    let (first, bytes) = (4 * words.start as u64, 4 * words.len() as u64);
                    // SAFETY: the words lie in the scratch.
                    unsafe { self.gpu.raw.cmd_fill_buffer(slot.selection, self.scratch.raw, first, bytes, *value) };
                }
                Step::Run { program, groups, argument } => {
                    memory_barrier(&self.gpu, slot.selection, steps, reading);
                    self.run(slot, *program, *groups, *argument);
                }
            }
        }
    }

    fn record_copy(&self, slot: &Slot) {
        let used = (
            Stage::DRAW_INDIRECT | Stage::VERTEX_ATTRIBUTE_INPUT | Stage::COPY,
            Access::INDIRECT_COMMAND_READ | Access::VERTEX_ATTRIBUTE_READ | Access::TRANSFER_READ,
        );
        memory_barrier(&self.gpu, slot.selection, (Stage::COMPUTE_SHADER, Access::SHADER_STORAGE_WRITE), used);
        let region = [vk::BufferCopy { size: slot.found.size, ..Default::default() }];
        // SAFETY: both buffers are of this size and live until the frame has ended.
        unsafe { self.gpu.raw.cmd_copy_buffer(slot.selection, slot.commands.raw, slot.found.raw, &region) };
        let copied = (Stage::COPY, Access::TRANSFER_WRITE);
        memory_barrier(&self.gpu, slot.selection, copied, (Stage::HOST, Access::HOST_READ));
    }

    fn run(&self, slot: &Slot, program: usize, groups: Groups, argument: u32) {
        let (raw, stage) = (&self.gpu.raw, vk::ShaderStageFlags::COMPUTE);
        // SAFETY: the pipelines outlive the frame; group counts lie in the scratch.
        unsafe {
            raw.cmd_bind_pipeline(slot.selection, vk::PipelineBindPoint::COMPUTE, self.pipelines[program]);
            raw.cmd_push_constants(slot.selection, slot.bindings.layout, stage, 0, &argument.to_ne_bytes());
            match groups {
                Groups::One => raw.cmd_dispatch(slot.selection, 1, 1, 1),
                Groups::Counted(word) => raw.cmd_dispatch_indirect(slot.selection, self.scratch.raw, 4 * word as u64),
            }
        }
    }

    /// The instances of a frame.
    pub(super) fn instances(&self, r: &Recording) -> vk::Buffer {
        self.slots[r.slot].instances.raw
    }

    /// Records the draws that were found.
    pub(super) fn draw(&self, r: &Recording) {
        let commands = self.slots[r.slot].commands.raw;
        // SAFETY: the buffer holds a count and at most that many commands.
        unsafe {
            let (raw, max) = (&self.gpu.raw, self.draws as u32);
            raw.cmd_draw_indexed_indirect_count(r.commands, commands, HEAD as u64, commands, 0, max, COMMAND as u32);
        }
    }

    /// Records some of the draws that were found: one that is not there would be an old one.
    pub(super) fn draw_some(&self, r: &Recording, draws: std::ops::Range<usize>) {
        let (first, commands) = ((HEAD + draws.start * COMMAND) as u64, self.slots[r.slot].commands.raw);
        let count = draws.len() as u32;
        // SAFETY: the buffer holds these commands.
        unsafe { self.gpu.raw.cmd_draw_indexed_indirect(r.commands, commands, first, count, COMMAND as u32) };
    }

    /// Fills a list with the draws that the newest frame of a slot found, once it has finished, and no instances.
    /// Before the first frame it is left as it is.
    pub fn read_draws(&self, slot: usize, list: &mut DrawList) {
        if !self.slots[slot].has_run {
            return;
        }
        let found = self.slots[slot].found.read();
        let tally: Tally = bytemuck::pod_read_unaligned(&found[..HEAD]);
        let commands = found[HEAD..].chunks_exact(COMMAND).take(tally.draws as usize);
        list.draws.clear();
        list.draws.extend(commands.map(draw));
        list.instances.clear();
        list.submission = Submission::GpuDriven;
        list.tolerance_scale = if tally.overflow == 0 { 1.0 } else { f64::INFINITY };
    }

    /// The slot of the newest frame.
    pub fn newest(&self) -> usize {
        self.newest
    }

    /// The first instances of the newest frame, once it has finished.
    pub fn read_instances(&self, count: usize) -> Result<Vec<Instance>> {
        let bytes = count * size_of::<Instance>();
        let instances = &self.slots[self.newest].instances;
        if bytes as u64 > instances.size {
            bail!("selection: {count} instances were found, {} bytes hold them", instances.size);
        }
        let usage = vk::BufferUsageFlags::TRANSFER_DST;
        let copy = Buffer::new(&self.gpu, "instances read back", bytes as u64, usage, MemoryLocation::GpuToCpu)?;
        if count > 0 {
            once(&self.gpu, |r| {
                let written = (Stage::COMPUTE_SHADER, Access::SHADER_STORAGE_WRITE);
                memory_barrier(&self.gpu, r.commands, written, (Stage::COPY, Access::TRANSFER_READ));
                let region = [vk::BufferCopy { size: bytes as u64, ..Default::default() }];
                // SAFETY: both buffers outlive the wait in `once`.
                unsafe { self.gpu.raw.cmd_copy_buffer(r.commands, instances.raw, copy.raw, &region) };
                let copied = (Stage::COPY, Access::TRANSFER_WRITE);
                memory_barrier(&self.gpu, r.commands, copied, (Stage::HOST, Access::HOST_READ));
                Ok(())
            })?;
        }
        Ok(bytemuck::pod_collect_to_vec(&copy.read()[..bytes]))
    }
}

/// A command as the draw that it is.
fn draw(command: &[u8]) -> Draw {
    let [indices, instances, first_index, first_vertex, first_instance]: [u32; 5] =
        bytemuck::pod_read_unaligned(command);
    Draw {
        source: Source::Lattice,
        topology: Topology::Triangles,
        indices: first_index..first_index + indices,
        instances: first_instance..first_instance + instances,
        first_vertex,
    }
}

impl Slot {
    fn new(
        gpu: &Arc<Gpu>,
        pool: vk::CommandPool,
        gpu_selection: &GpuSelection,
        table: &Buffer,
        scratch: &Buffer,
    ) -> Result<Self> {
        use vk::BufferUsageFlags as Usage;
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(pool)
            .level(vk::CommandBufferLevel::SECONDARY)
            .command_buffer_count(1);
        // SAFETY: the pool is alive.
        let selection = unsafe { gpu.raw.allocate_command_buffers(&info)? }[0];
        gpu.name(selection, "selection");
        let storage = Usage::STORAGE_BUFFER | Usage::TRANSFER_SRC;
        let parameters =
            Buffer::host(gpu, "selection parameters", 4 * gpu_selection.parameters as u64, Usage::STORAGE_BUFFER)?;
        let bytes = (gpu_selection.instances * size_of::<Instance>()) as u64;
        let instances = Buffer::device(gpu, "selected instances", bytes, storage | Usage::VERTEX_BUFFER)?;
        let bytes = (HEAD + gpu_selection.draws * COMMAND) as u64;
        let commands = Buffer::device(gpu, "selected commands", bytes, storage | Usage::INDIRECT_BUFFER)?;
        let found = Buffer::new(gpu, "selection read back", bytes, Usage::TRANSFER_DST, MemoryLocation::GpuToCpu)?;
        let bound = [table, &parameters, scratch, &instances, &commands].map(Bound::Storage);
        let bindings = Bindings::new(gpu, "selection", None, vk::ShaderStageFlags::COMPUTE, &bound, 4)?;
        Ok(Self { selection, bindings, parameters, instances, commands, found, has_run: false })
    }
}

impl Drop for GpuSelector {
    fn drop(&mut self) {
        // SAFETY: nothing is in use once the device is idle.
        unsafe {
            let _ = self.gpu.raw.device_wait_idle();
            self.gpu.raw.destroy_command_pool(self.pool, None);
            for pipeline in &self.pipelines {
                self.gpu.raw.destroy_pipeline(*pipeline, None);
            }
        }
    }
}
