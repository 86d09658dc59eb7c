//! How a device finds draws and instances by itself: tables, programs and their order, as plain data.
//!
//! The programs read the resident table and the frame's [`parameters`](super::DrawList::parameters), work in a scratch
//! of their own, and write [`Instance`](super::Instance)s, a [`Tally`](super::layout::Tally) and indexed indirect
//! commands: storage buffers at bindings 0 to 4 of set 0, in this order.

use std::ops::Range;

/// A selection that runs on the device. All its draws are triangles of [`Source::Lattice`](super::Source::Lattice).
#[derive(Clone, Debug)]
pub struct GpuSelection {
    /// File names of the compute programs.
    pub programs: &'static [&'static str],
    /// What stays in device-local memory: words.
    pub table: Vec<u32>,
    /// Words of parameters a frame.
    pub parameters: usize,
    /// Words of scratch.
    pub scratch: usize,
    /// What is done each frame, in order; each step sees all that those before it wrote.
    pub steps: Vec<Step>,
    /// The most commands it writes.
    pub draws: usize,
    /// The most instances it writes.
    pub instances: usize,
}

/// One step.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Step {
    /// Words of the scratch take this value.
    Fill(Range<usize>, u32),
    /// A program runs; it is pushed the argument, one word.
    Run {
        /// Its number.
        program: usize,
        /// In how many groups.
        groups: Groups,
        /// What it is pushed.
        argument: u32,
    },
}

/// How many groups of a program run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Groups {
    /// One.
    One,
    /// As three words of the scratch say, from this one on.
    Counted(usize),
}

/// Bytes that every device lets a program address at once (`maxStorageBufferRange`).
pub const MAX_BYTES: usize = 1 << 27;

impl GpuSelection {
    /// Whether its buffers are such that every device lets programs address them.
    pub fn fits(&self) -> bool {
        let instances = self.instances * size_of::<super::Instance>();
        [4 * self.table.len(), 4 * self.scratch, instances].iter().all(|&bytes| bytes <= MAX_BYTES)
    }
}
