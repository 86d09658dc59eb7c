//! Frames in flight: command buffers, fences, and the queries of each frame, read when its slot comes round.

use std::sync::Arc;

use anyhow::{Context, Result};
use ash::vk;

use super::device::{FRAMES_IN_FLIGHT, Gpu};

/// Most passes that a frame times.
const SCOPES: u32 = 16;
/// Queries of a stamp: see [`stamp`].
pub(super) const STAMP: u32 = 2;

/// Device times and counts of one frame.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timing {
    /// Name and milliseconds of each pass, in order.
    pub passes: Vec<(&'static str, f64)>,
    /// Device ticks at the start and the end of each pass.
    pub ticks: Vec<[u64; 2]>,
    /// Milliseconds from the first pass's start to the last one's end.
    pub total_ms: f64,
    /// Vertices run, primitives after clipping, fragments run — of the pass named `terrain`.
    pub statistics: Option<[u64; 3]>,
    /// Fragments of the pass named `terrain` that passed the depth test, if the frame counted them.
    pub passed: Option<u64>,
}

/// The frames in flight, used in turn.
pub(super) struct Frames {
    gpu: Arc<Gpu>,
    slots: Vec<Slot>,
    next: usize,
    measured: bool,
    /// True if later frames count fragments that pass the depth test, where the device can. Counting costs time.
    pub counts_passed: bool,
    /// The newest timing read back.
    pub timing: Timing,
}

struct Slot {
    pool: vk::CommandPool,
    /// One command buffer per submission of a frame.
    commands: Vec<vk::CommandBuffer>,
    /// Index of the one being recorded.
    current: usize,
    fence: vk::Fence,
    stamps: vk::QueryPool,
    statistics: vk::QueryPool,
    passed: vk::QueryPool,
    counts_passed: bool,
    scopes: Vec<&'static str>,
    has_statistics: bool,
}

/// A command buffer being recorded.
pub struct Recording<'a> {
    /// The device.
    pub gpu: &'a Arc<Gpu>,
    /// The command buffer.
    pub commands: vk::CommandBuffer,
    /// The slot's number, below [`FRAMES_IN_FLIGHT`].
    pub slot: usize,
    /// Queries of the frame; none in a command buffer that another renderer began.
    queries: Option<&'a mut Slot>,
}

impl Frames {
    /// Slots with queries if `measured`.
    pub fn new(gpu: &Arc<Gpu>, measured: bool) -> Result<Self> {
        let measured = measured && gpu.timestamp_ns > 0.0;
        let slots = (0..FRAMES_IN_FLIGHT).map(|_| Slot::new(gpu, measured)).collect::<Result<_>>()?;
        let timing = Timing::default();
        Ok(Self { gpu: Arc::clone(gpu), slots, next: 0, measured, counts_passed: false, timing })
    }

    /// Waits for the next slot, reads its timing, and starts recording a frame.
    pub fn begin(&mut self) -> Result<Recording<'_>> {
        self.start()?;
        Ok(self.resume())
    }

    fn start(&mut self) -> Result<()> {
        let slot = self.next;
        self.wait(slot)?;
        let state = &mut self.slots[slot];
        state.scopes.clear();
        state.current = 0;
        state.has_statistics = false;
        state.counts_passed = self.counts_passed && state.passed != vk::QueryPool::null();
        // SAFETY: the slot's fence says its commands have ended.
        unsafe {
            self.gpu.raw.reset_command_pool(state.pool, vk::CommandPoolResetFlags::empty())?;
            if self.measured {
                self.gpu.raw.reset_query_pool(state.stamps, 0, 2 * STAMP * SCOPES);
                if state.statistics != vk::QueryPool::null() {
                    self.gpu.raw.reset_query_pool(state.statistics, 0, 1);
                }
                if state.counts_passed {
                    self.gpu.raw.reset_query_pool(state.passed, 0, 1);
                }
            }
        }
        begin(&self.gpu, state.commands[0])
    }

    /// Returns the frame that was begun, to record more of it.
    pub fn resume(&mut self) -> Recording<'_> {
        let state = &mut self.slots[self.next];
        let commands = state.commands[state.current];
        Recording { gpu: &self.gpu, commands, slot: self.next, queries: self.measured.then_some(state) }
    }

    /// Submits the part of a frame recorded so far; the rest goes into another command buffer.
    pub fn submit_part(&mut self) -> Result<()> {
        let gpu = &self.gpu;
        let slot = &mut self.slots[self.next];
        submit(gpu, slot.commands[slot.current], vk::SubmitInfo2::default(), vk::Fence::null())?;
        slot.current += 1;
        if slot.current == slot.commands.len() {
            slot.commands.push(command_buffer(gpu, slot.pool)?);
        }
        begin(gpu, slot.commands[slot.current])
    }

    /// Ends recording and submits, waiting for and signalling the target's semaphores.
    pub fn submit(&mut self, Semaphores { wait, signal }: Semaphores) -> Result<()> {
        let slot = &self.slots[self.next];
        let stage = vk::PipelineStageFlags2::ALL_COMMANDS;
        let semaphore = |s: vk::Semaphore| vk::SemaphoreSubmitInfo::default().semaphore(s).stage_mask(stage);
        let (wait, signal) = (wait.map(semaphore), signal.map(semaphore));
        let info =
            vk::SubmitInfo2::default().wait_semaphore_infos(wait.as_slice()).signal_semaphore_infos(signal.as_slice());
        // SAFETY: the frame before in this slot has ended.
        unsafe { self.gpu.raw.reset_fences(&[slot.fence])? };
        submit(&self.gpu, slot.commands[slot.current], info, slot.fence)?;
        self.next = (self.next + 1) % FRAMES_IN_FLIGHT;
        Ok(())
    }

    /// Waits for all frames and reads the newest timing.
    pub fn finish(&mut self) -> Result<()> {
        for k in 0..FRAMES_IN_FLIGHT {
            self.wait((self.next + k) % FRAMES_IN_FLIGHT)?;
        }
        Ok(())
    }

    fn wait(&mut self, slot: usize) -> Result<()> {
        let state = &mut self.slots[slot];
        // SAFETY: the fence belongs to the slot.
        let wait = || unsafe { self.gpu.raw.wait_for_fences(&[state.fence], true, u64::MAX) };
        self.gpu.check_device_lost(wait).context("waiting for a frame")?;
        if self.measured && !state.scopes.is_empty() {
            self.timing = state.timing(&self.gpu)?;
            state.scopes.clear();
        }
        Ok(())
    }
}

/// Semaphores of a submission.
#[derive(Clone, Copy, Default)]
pub struct Semaphores {
    /// The frame waits for this one before it draws.
    pub wait: Option<vk::Semaphore>,
    /// The frame signals this one when it is drawn.
    pub signal: Option<vk::Semaphore>,
}

impl<'a> Recording<'a> {
    /// Wraps a command buffer that another renderer began. Passes in it are labelled but not timed. `slot` is below
    /// [`Gpu::frames_in_flight`], and the commands recorded before under the same slot have finished.
    pub fn of_caller(gpu: &'a Arc<Gpu>, commands: vk::CommandBuffer, slot: usize) -> Self {
        Self { gpu, commands, slot, queries: None }
    }

    /// Records a pass under one name: debug label and timestamps.
    pub fn scope<T>(&mut self, name: &'static str, record: impl FnOnce(&mut Self) -> Result<T>) -> Result<T> {
        self.counted_scope(name, false, record)
    }

    /// Records a pass like [`Self::scope`], with pipeline statistics if `counts`: at most one pass of a frame.
    pub fn counted_scope<T>(
        &mut self,
        name: &'static str,
        counts: bool,
        record: impl FnOnce(&mut Self) -> Result<T>,
    ) -> Result<T> {
        let (gpu, commands) = (self.gpu, self.commands);
        gpu.begin_label(commands, name);
        let first = self.queries.as_mut().and_then(|queries| queries.begin_scope(gpu, commands, name));
        let counted = first.is_some() && counts;
        if let (true, Some(queries)) = (counted, &mut self.queries) {
            queries.begin_counts(gpu, commands);
        }
        let result = record(self);
        if let (Some(first), Some(queries)) = (first, &mut self.queries) {
            if counted {
                queries.end_counts(gpu, commands);
            }
            stamp(gpu, commands, vk::PipelineStageFlags2::BOTTOM_OF_PIPE, queries.stamps, first + 1);
        }
        gpu.end_label(commands);
        result
    }
}

impl Slot {
    fn new(gpu: &Arc<Gpu>, measured: bool) -> Result<Self> {
        let query = |kind, count, statistics| {
            let info =
                vk::QueryPoolCreateInfo::default().query_type(kind).query_count(count).pipeline_statistics(statistics);
            // SAFETY: the device is alive.
            unsafe { gpu.raw.create_query_pool(&info, None) }
        };
        let none = vk::QueryPipelineStatisticFlags::empty();
        let counted = vk::QueryPipelineStatisticFlags::VERTEX_SHADER_INVOCATIONS
            | vk::QueryPipelineStatisticFlags::CLIPPING_PRIMITIVES
            | vk::QueryPipelineStatisticFlags::FRAGMENT_SHADER_INVOCATIONS;
        // SAFETY: the device is alive.
        unsafe {
            let info = vk::CommandPoolCreateInfo::default().queue_family_index(gpu.queue_family);
            let pool = gpu.raw.create_command_pool(&info, None)?;
            let commands = vec![command_buffer(gpu, pool)?];
            let info = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
            let fence = gpu.raw.create_fence(&info, None)?;
            let stamps = if measured {
                query(vk::QueryType::TIMESTAMP, 2 * STAMP * SCOPES, none)?
            } else {
                vk::QueryPool::null()
            };
            let statistics = if measured && gpu.has_statistics {
                query(vk::QueryType::PIPELINE_STATISTICS, 1, counted)?
            } else {
                vk::QueryPool::null()
            };
            let passed = if measured && gpu.has_statistics && gpu.counts_passed {
                query(vk::QueryType::OCCLUSION, 1, none)?
            } else {
                vk::QueryPool::null()
            };
            let (scopes, has_statistics, counts_passed) = (Vec::new(), false, false);
            Ok(Self {
                pool,
                commands,
                current: 0,
                fence,
                stamps,
                statistics,
                passed,
                counts_passed,
                scopes,
                has_statistics,
            })
        }
    }

    /// Stamps the start of a pass and returns the stamp's number, or nothing if all stamps are taken.
    fn begin_scope(&mut self, gpu: &Gpu, commands: vk::CommandBuffer, name: &'static str) -> Option<u32> {
        if self.scopes.len() as u32 >= SCOPES {
            return None;
        }
        let first = 2 * self.scopes.len() as u32;
        self.scopes.push(name);
        stamp(gpu, commands, vk::PipelineStageFlags2::TOP_OF_PIPE, self.stamps, first);
        Some(first)
    }

    fn begin_counts(&mut self, gpu: &Gpu, commands: vk::CommandBuffer) {
        if self.statistics == vk::QueryPool::null() {
            return;
        }
        self.has_statistics = true;
        // SAFETY: the command buffer is being recorded and the queries were reset at the frame's start.
        unsafe {
            gpu.raw.cmd_begin_query(commands, self.statistics, 0, vk::QueryControlFlags::empty());
            if self.counts_passed {
                gpu.raw.cmd_begin_query(commands, self.passed, 0, vk::QueryControlFlags::PRECISE);
            }
        }
    }

    fn end_counts(&mut self, gpu: &Gpu, commands: vk::CommandBuffer) {
        if self.statistics == vk::QueryPool::null() {
            return;
        }
        // SAFETY: `begin_counts` began the queries in the same command buffer.
        unsafe {
            if self.counts_passed {
                gpu.raw.cmd_end_query(commands, self.passed, 0);
            }
            gpu.raw.cmd_end_query(commands, self.statistics, 0);
        }
    }

    fn timing(&self, gpu: &Gpu) -> Result<Timing> {
        let stamps = read_stamps(gpu, self.stamps, 2 * self.scopes.len())?;
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        let ms = |from: u64, to: u64| to.wrapping_sub(from) as f64 * gpu.timestamp_ns / 1e6;
        let passes = self.scopes.iter().zip(stamps.chunks(2)).map(|(name, t)| (*name, ms(t[0], t[1]))).collect();
        let (mut counts, mut passed) = ([[0u64; 3]], [0u64]);
        let has_passed = self.has_statistics && self.counts_passed;
        // SAFETY: the frame has ended and wrote the queries that are read.
        unsafe {
            if self.has_statistics {
                gpu.raw.get_query_pool_results(self.statistics, 0, &mut counts, flags)?;
            }
            if has_passed {
                gpu.raw.get_query_pool_results(self.passed, 0, &mut passed, flags)?;
            }
        }
        let (statistics, passed) = (self.has_statistics.then_some(counts[0]), has_passed.then_some(passed[0]));
        let total_ms = ms(stamps[0], stamps[stamps.len() - 1]);
        let ticks = stamps.chunks(2).map(|t| [t[0], t[1]]).collect();
        Ok(Timing { passes, ticks, total_ms, statistics, passed })
    }
}

impl Drop for Frames {
    fn drop(&mut self) {
        // SAFETY: the device is idle before anything goes.
        unsafe {
            let _ = self.gpu.wait_idle();
            for slot in &self.slots {
                self.gpu.raw.destroy_query_pool(slot.stamps, None);
                self.gpu.raw.destroy_query_pool(slot.statistics, None);
                self.gpu.raw.destroy_query_pool(slot.passed, None);
                self.gpu.raw.destroy_fence(slot.fence, None);
                self.gpu.raw.destroy_command_pool(slot.pool, None);
            }
        }
    }
}

fn command_buffer(gpu: &Gpu, pool: vk::CommandPool) -> Result<vk::CommandBuffer> {
    let info = vk::CommandBufferAllocateInfo::default().command_pool(pool).command_buffer_count(1);
    // SAFETY: the pool is alive, and only its own thread uses it.
    let commands = unsafe { gpu.raw.allocate_command_buffers(&info)? }[0];
    gpu.name(commands, "frame");
    Ok(commands)
}

fn begin(gpu: &Gpu, commands: vk::CommandBuffer) -> Result<()> {
    let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
    // SAFETY: the slot's fence says that its commands have ended, and its pool was reset.
    unsafe { gpu.raw.begin_command_buffer(commands, &info) }.context("beginning a frame")
}

fn submit(gpu: &Gpu, commands: vk::CommandBuffer, info: vk::SubmitInfo2, fence: vk::Fence) -> Result<()> {
    let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(commands)];
    let info = [info.command_buffer_infos(&buffers)];
    // SAFETY: the command buffer was begun in its slot and nothing else uses the queue.
    unsafe {
        gpu.raw.end_command_buffer(commands)?;
        gpu.check_device_lost(|| gpu.raw.queue_submit2(gpu.queue, &info, fence)).context("submitting a frame")
    }
}

/// Writes stamp number `k` of a pool. llvmpipe takes a stamp while it rasterises the commands between it and the next
/// stamp. A second stamp, which is never read, separates the first from those commands.
pub(super) fn stamp(
    gpu: &Gpu,
    commands: vk::CommandBuffer,
    stage: vk::PipelineStageFlags2,
    pool: vk::QueryPool,
    k: u32,
) {
    for (stage, query) in [(stage, STAMP * k), (vk::PipelineStageFlags2::BOTTOM_OF_PIPE, STAMP * k + 1)] {
        // SAFETY: the command buffer is being recorded and the queries were reset.
        unsafe { gpu.raw.cmd_write_timestamp2(commands, stage, pool, query) };
    }
}

/// The first stamps of a pool, in device ticks, once their frame has finished.
pub(super) fn read_stamps(gpu: &Gpu, pool: vk::QueryPool, count: usize) -> Result<Vec<u64>> {
    let mut ticks = vec![0u64; STAMP as usize * count];
    let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
    // SAFETY: the frame has ended, so the queries it wrote are available.
    unsafe { gpu.raw.get_query_pool_results(pool, 0, &mut ticks, flags)? };
    Ok(ticks.into_iter().step_by(STAMP as usize).collect())
}

/// Records commands outside any frame, submits them and waits.
pub fn once(gpu: &Arc<Gpu>, record: impl FnOnce(&mut Recording) -> Result<()>) -> Result<()> {
    let mut frames = Frames::new(gpu, false)?;
    frames.start()?;
    record(&mut frames.resume())?;
    frames.submit(Semaphores::default())?;
    frames.finish()
}
