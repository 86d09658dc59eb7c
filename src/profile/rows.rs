//! The rows of a profile: `passes.csv`, `draws.csv`, `modes.csv`, and together `profile.json`.
//!
//! Times are microseconds, medians over the frames with their 95 % intervals. Counts that a device cannot take are
//! left empty.

use serde::{Deserialize, Serialize};

use super::estimate::Estimate;

/// Version of the rows. It grows when a reader of the old ones would misread the new ones.
pub const SCHEMA: u32 = 1;

/// A step of the host, in the frames whose draws were measured one by one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepRow {
    /// select, upload, record, submit or wait.
    pub step: String,
    /// Host time.
    pub cpu_us: f64,
    /// Lower end of its interval.
    pub cpu_us_low: f64,
    /// Upper end of its interval.
    pub cpu_us_high: f64,
}

/// A pass on the device, in the frames whose draws were measured one by one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PassRow {
    /// Its label.
    pub pass: String,
    /// Device time; where two passes overlap, it belongs to the earlier one.
    pub gpu_us: f64,
    /// Lower end of its interval.
    pub gpu_us_low: f64,
    /// Upper end of its interval.
    pub gpu_us_high: f64,
    /// Rows of `draws.csv` in it.
    pub draws: usize,
    /// Vertex programs run by those.
    pub vertices_run: Option<u64>,
    /// Primitives of those that reached clipping.
    pub clipping_invocations: Option<u64>,
    /// Primitives that clipping let through or made.
    pub clipping_primitives: Option<u64>,
    /// Fragment programs run by those.
    pub fragments_run: Option<u64>,
}

/// A draw on the device, or the rest of a pipeline's draws beyond the number that has queries of their own.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DrawRow {
    /// Its label: technique, pipeline, levels, batch.
    pub label: String,
    /// The pass it is in.
    pub pass: String,
    /// Vertex source and topology.
    pub pipeline: String,
    /// Its number in the list: what the colour `batch` shows; of the first, if it is several.
    pub batch: usize,
    /// Draws of the list in it: 1, or the rest.
    pub draws: usize,
    /// Finest level among its instances.
    pub level_min: Option<u32>,
    /// Coarsest level among its instances.
    pub level_max: Option<u32>,
    /// Instances.
    pub instances: u64,
    /// Vertices submitted: indices of all instances.
    pub vertices: u64,
    /// Triangles submitted, degenerate ones included.
    pub triangles: u64,
    /// Device time from the end of all before it to its own end.
    pub gpu_us: f64,
    /// Lower end of its interval.
    pub gpu_us_low: f64,
    /// Upper end of its interval.
    pub gpu_us_high: f64,
    /// Vertex programs run.
    pub vertices_run: Option<u64>,
    /// Primitives that reached clipping.
    pub clipping_invocations: Option<u64>,
    /// Primitives that clipping let through or made.
    pub clipping_primitives: Option<u64>,
    /// Fragment programs run.
    pub fragments_run: Option<u64>,
}

/// A way to submit the land, in plain frames: without queries around draws.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModeRow {
    /// Technique, or technique:variant.
    pub form: String,
    /// direct: a recorded call a draw; indirect: one call a pipeline.
    pub submission: String,
    /// Calls that the host records.
    pub commands: usize,
    /// Draws of the list.
    pub draws: usize,
    /// Triangles submitted, degenerate ones included.
    pub triangles: u64,
    /// Host time of selection.
    pub select_us: f64,
    /// Host time of writing the frame's data, indirect commands among it.
    pub upload_us: f64,
    /// Host time of recording.
    pub record_us: f64,
    /// Lower end of its interval.
    pub record_us_low: f64,
    /// Upper end of its interval.
    pub record_us_high: f64,
    /// Host time of recording over draws.
    pub record_us_per_draw: f64,
    /// Host time of recording over that of the first mode, frame by frame.
    pub record_ratio: f64,
    /// Lower end of its interval.
    pub record_ratio_low: f64,
    /// Upper end of its interval.
    pub record_ratio_high: f64,
    /// Device time.
    pub gpu_us: f64,
    /// Lower end of its interval.
    pub gpu_us_low: f64,
    /// Upper end of its interval.
    pub gpu_us_high: f64,
    /// Device time over draws.
    pub gpu_us_per_draw: f64,
    /// Device time over that of the first mode, frame by frame.
    pub gpu_ratio: f64,
    /// Lower end of its interval.
    pub gpu_ratio_low: f64,
    /// Upper end of its interval.
    pub gpu_ratio_high: f64,
    /// From the start of selection until the device has finished.
    pub frame_us: f64,
}

/// Everything measured, as rows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    /// Frames behind each median.
    pub frames: u32,
    /// Relation of the device's clock to the host's: `calibrated`, or `aligned, not calibrated`.
    pub clock: String,
    /// Microseconds by which the device's times in the trace may be shifted against the host's.
    pub clock_deviation_us: f64,
    /// The host's steps.
    pub steps: Vec<StepRow>,
    /// The passes.
    pub passes: Vec<PassRow>,
    /// The draws.
    pub draws: Vec<DrawRow>,
    /// Ways to submit the same land.
    pub modes: Vec<ModeRow>,
}

impl StepRow {
    /// A step with its time.
    pub fn new(step: &str, cpu_us: Estimate) -> Self {
        let Estimate { median, low, high } = cpu_us.rounded();
        Self { step: step.to_string(), cpu_us: median, cpu_us_low: low, cpu_us_high: high }
    }
}

impl PassRow {
    /// A pass with its time and the draws in it.
    pub fn new(pass: &str, gpu_us: Estimate, draws: &[DrawRow]) -> Self {
        let own: Vec<_> = draws.iter().filter(|draw| draw.pass == pass).collect();
        let sum = |of: fn(&DrawRow) -> Option<u64>| {
            own.iter().map(|draw| of(draw)).sum::<Option<u64>>().filter(|_| !own.is_empty())
        };
        let Estimate { median, low, high } = gpu_us.rounded();
        Self {
            pass: pass.to_string(),
            gpu_us: median,
            gpu_us_low: low,
            gpu_us_high: high,
            draws: own.len(),
            vertices_run: sum(|draw| draw.vertices_run),
            clipping_invocations: sum(|draw| draw.clipping_invocations),
            clipping_primitives: sum(|draw| draw.clipping_primitives),
            fragments_run: sum(|draw| draw.fragments_run),
        }
    }
}
