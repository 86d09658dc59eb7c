//! Queries of every draw: the draws of a frame are recorded one by one, each with two timestamps and its own statistics.
//!
//! A draw's time starts when all work before it has finished and ends when the draw has finished. The times of the draws
//! therefore add up to that of their pass. Where two draws overlap on the device, the later one counts only its own end.

use std::ops::Range;
use std::sync::Arc;

use anyhow::{Result, bail};
use ash::vk;

use super::device::Gpu;
use super::frames::{Recording, STAMP, read_stamps, stamp};
use super::terrain::Terrain;
use crate::draw::{Draw, DrawList, Source, Topology};

/// Most draws with their own queries; the others share one query per pipeline.
pub const DRAWS: usize = 4096;
/// Most pipelines of a list: three sources times two topologies.
const PIPELINES: usize = 6;

/// Query pools of one frame.
pub struct Probe {
    gpu: Arc<Gpu>,
    stamps: vk::QueryPool,
    statistics: Option<vk::QueryPool>,
}

/// Draws measured together: a single draw, or all that remain of a pipeline.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Piece {
    /// Range of the list's draws.
    pub draws: Range<usize>,
    /// Its name in every tool.
    pub label: String,
}

/// Shader invocations and primitives of a piece.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Vertex shader invocations.
    pub vertices: u64,
    /// Primitives that reached clipping.
    pub clipped: u64,
    /// Primitives after clipping.
    pub primitives: u64,
    /// Fragment shader invocations.
    pub fragments: u64,
}

/// Times and counts of a piece.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Measured {
    /// Device ticks at its start and its end.
    pub ticks: [u64; 2],
    /// Counts, if the device has pipeline statistics.
    pub counts: Option<Counts>,
}

/// Cuts a list's draws for measuring: one by one up to `max`, the rest of each pipeline together.
pub fn pieces(draws: &[Draw], max: usize) -> Vec<Range<usize>> {
    let mut pieces = Vec::new();
    let mut first = 0;
    for run in draws.chunk_by(|a, b| (a.source, a.topology) == (b.source, b.topology)) {
        let last = first + run.len();
        let own = max.clamp(first, last);
        pieces.extend((first..own).map(|k| k..k + 1));
        if own < last {
            pieces.push(own..last);
        }
        first = last;
    }
    pieces
}

/// Returns the name of a pipeline.
pub fn pipeline_name(source: Source, topology: Topology) -> &'static str {
    match (source, topology) {
        (Source::Lattice, Topology::Triangles) => "lattice triangles",
        (Source::Lattice, Topology::Strip) => "lattice strip",
        (Source::Resident, Topology::Triangles) => "resident triangles",
        (Source::Resident, Topology::Strip) => "resident strip",
        (Source::Streamed, Topology::Triangles) => "streamed triangles",
        (Source::Streamed, Topology::Strip) => "streamed strip",
    }
}

impl Probe {
    /// Makes pools for [`DRAWS`] draws.
    ///
    /// # Errors
    /// If the queue has no timestamps.
    pub fn new(gpu: &Arc<Gpu>) -> Result<Self> {
        if gpu.timestamp_ns == 0.0 {
            bail!("{}: its queue has no timestamps: nothing can be profiled", gpu.candidate.name);
        }
        let pool = |name, info: vk::QueryPoolCreateInfo| -> Result<_> {
            // SAFETY: the device is alive; Drop destroys the pool.
            let pool = unsafe { gpu.raw.create_query_pool(&info, None) }?;
            gpu.name(pool, name);
            Ok(pool)
        };
        let pieces = (DRAWS + PIPELINES) as u32;
        let info = vk::QueryPoolCreateInfo::default();
        let stamps = info.query_type(vk::QueryType::TIMESTAMP).query_count(STAMP * (pieces + 1));
        let statistics = info
            .query_type(vk::QueryType::PIPELINE_STATISTICS)
            .query_count(pieces)
            .pipeline_statistics(Counts::QUERIED);
        let mut probe = Self { gpu: Arc::clone(gpu), stamps: pool("draw timestamps", stamps)?, statistics: None };
        if gpu.has_statistics {
            probe.statistics = Some(pool("draw statistics", statistics)?);
        }
        Ok(probe)
    }

    /// Resets the queries and stamps the start of the first piece. No frame in flight uses them.
    fn begin(&self, r: &Recording, pieces: usize) {
        // SAFETY: the frame that used the queries last has finished.
        unsafe {
            self.gpu.raw.reset_query_pool(self.stamps, 0, STAMP * (pieces as u32 + 1));
            if let Some(statistics) = self.statistics {
                self.gpu.raw.reset_query_pool(statistics, 0, pieces.max(1) as u32);
            }
        }
        self.stamp(r, 0);
    }

    /// Stamps the end of all earlier work.
    fn stamp(&self, r: &Recording, k: usize) {
        stamp(&self.gpu, r.commands, vk::PipelineStageFlags2::BOTTOM_OF_PIPE, self.stamps, k as u32);
    }

    /// Records piece number `k` under its label and queries.
    fn around(&self, r: &Recording, k: usize, label: &str, record: impl FnOnce()) {
        self.gpu.begin_label(r.commands, label);
        let (raw, query) = (&self.gpu.raw, k as u32);
        if let Some(statistics) = self.statistics {
            // SAFETY: the command buffer is being recorded, `begin` reset the query, and no other is active.
            unsafe { raw.cmd_begin_query(r.commands, statistics, query, vk::QueryControlFlags::empty()) };
        }
        record();
        if let Some(statistics) = self.statistics {
            // SAFETY: begun above in the same command buffer.
            unsafe { raw.cmd_end_query(r.commands, statistics, query) };
        }
        self.stamp(r, k + 1);
        self.gpu.end_label(r.commands);
    }

    /// Returns times and counts of the pieces of the last frame, once that has finished.
    ///
    /// # Errors
    /// If the device fails.
    pub fn read(&self, pieces: usize) -> Result<Vec<Measured>> {
        let flags = vk::QueryResultFlags::TYPE_64 | vk::QueryResultFlags::WAIT;
        let stamps = read_stamps(&self.gpu, self.stamps, pieces + 1)?;
        let mut counts = vec![[0u64; 4]; pieces];
        if let (Some(statistics), 1..) = (self.statistics, pieces) {
            // SAFETY: the frame wrote these queries and has finished.
            unsafe { self.gpu.raw.get_query_pool_results(statistics, 0, &mut counts, flags)? };
        }
        let counts = counts.into_iter().map(|c| self.statistics.map(|_| Counts::from(c)));
        let ticks = stamps.windows(2).map(|t| [t[0], t[1]]);
        Ok(ticks.zip(counts).map(|(ticks, counts)| Measured { ticks, counts }).collect())
    }
}

impl Counts {
    /// In the order of their bits, which is the order of the results.
    const QUERIED: vk::QueryPipelineStatisticFlags = vk::QueryPipelineStatisticFlags::from_raw(
        vk::QueryPipelineStatisticFlags::VERTEX_SHADER_INVOCATIONS.as_raw()
            | vk::QueryPipelineStatisticFlags::CLIPPING_INVOCATIONS.as_raw()
            | vk::QueryPipelineStatisticFlags::CLIPPING_PRIMITIVES.as_raw()
            | vk::QueryPipelineStatisticFlags::FRAGMENT_SHADER_INVOCATIONS.as_raw(),
    );
}

impl From<[u64; 4]> for Counts {
    fn from([vertices, clipped, primitives, fragments]: [u64; 4]) -> Self {
        Self { vertices, clipped, primitives, fragments }
    }
}

impl Terrain {
    /// Records a list piece by piece. `pieces` are those of the list, cut by [`pieces`] at [`DRAWS`].
    ///
    /// # Errors
    /// If a list changes its pipeline too often for the pools.
    pub(super) fn draw_probed(
        &self,
        recording: &Recording,
        list: &DrawList,
        probe: &Probe,
        pieces: &[Piece],
    ) -> Result<()> {
        if pieces.len() > DRAWS + PIPELINES {
            bail!("profile: {} pieces, at most {} can be measured", pieces.len(), DRAWS + PIPELINES);
        }
        probe.begin(recording, pieces.len());
        let mut next = 0;
        self.each_run(recording, list, 0, |r, run| {
            let first = &list.draws[run.start];
            r.gpu.begin_label(r.commands, pipeline_name(first.source, first.topology));
            while let Some(piece) = pieces.get(next).filter(|piece| run.contains(&piece.draws.start)) {
                probe.around(r, next, &piece.label, || self.submit(r, list, piece.draws.clone()));
                next += 1;
            }
            r.gpu.end_label(r.commands);
        });
        Ok(())
    }
}

impl Drop for Probe {
    fn drop(&mut self) {
        // SAFETY: nothing is in use once the device is idle.
        unsafe {
            let _ = self.gpu.raw.device_wait_idle();
            self.gpu.raw.destroy_query_pool(self.stamps, None);
            self.gpu.raw.destroy_query_pool(self.statistics.unwrap_or_default(), None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_are_the_draws_in_order_and_the_rest_by_pipeline() {
        let draw =
            |source| Draw { source, topology: Topology::Triangles, indices: 0..3, instances: 0..1, first_vertex: 0 };
        let mut draws = vec![draw(Source::Lattice); 5];
        draws.extend(vec![draw(Source::Streamed); 3]);
        assert_eq!(pieces(&draws, 100).len(), 8);
        assert_eq!(pieces(&draws, 3), [0..1, 1..2, 2..3, 3..5, 5..8]);
        assert_eq!(pieces(&draws, 6), [0..1, 1..2, 2..3, 3..4, 4..5, 5..6, 6..8]);
        assert_eq!(pieces(&draws, 0), [0..5, 5..8]);
        assert!(pieces(&[], 3).is_empty());
    }
}
