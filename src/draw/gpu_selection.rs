//! Selection by compute shaders, as plain data: tables, programs and the order in which they run.
//!
//! The programs read a resident table and the frame's [`parameters`](super::DrawList::parameters), and work in a scratch
//! buffer. They write [`Instance`](super::Instance)s, a [`Tally`](super::layout::Tally) and indexed indirect commands.
//! Table, parameters, scratch, instances and commands are storage buffers at bindings 0 to 4 of set 0.

use std::ops::Range;

use super::layout::Instance;

/// A selection that runs on the device. All its draws are triangles of [`Source::Lattice`](super::Source::Lattice).
#[derive(Clone, Debug)]
pub struct GpuSelection {
    /// File names of the compute programs.
    pub programs: &'static [&'static str],
    /// Words of the table, which stays in device-local memory.
    pub table: Vec<u32>,
    /// Number of words of parameters a frame.
    pub parameters: usize,
    /// Number of words of scratch.
    pub scratch: usize,
    /// Steps of a frame, in order. Each step sees everything that earlier ones wrote.
    pub steps: Vec<Step>,
    /// Maximum number of commands.
    pub draws: usize,
    /// Maximum number of instances.
    pub instances: usize,
}

/// One step of a selection.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// Sets words of the scratch to a value.
    Fill(Range<usize>, u32),
    /// Runs a program with one word of push constants.
    Run {
        /// Index into the programs.
        program: usize,
        /// Number of workgroups.
        groups: Groups,
        /// Push constant.
        argument: u32,
    },
}

/// Number of workgroups of a dispatch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Groups {
    /// One.
    One,
    /// An indirect dispatch whose size is three words of the scratch, from this one on.
    Counted(usize),
}

/// Size of a storage buffer that every device supports (the required `maxStorageBufferRange`), bytes.
pub const MAX_BYTES: usize = 1 << 27;

impl GpuSelection {
    /// Returns true if every device can bind its buffers.
    pub fn fits(&self) -> bool {
        let instances = self.instances * size_of::<Instance>();
        [4 * self.table.len(), 4 * self.scratch, instances].iter().all(|&bytes| bytes <= MAX_BYTES)
    }
}
