//! The rows of a profile: the lines of `passes.csv`, `draws.csv` and `modes.csv`, and the parts of `profile.json`.
//!
//! Times are in microseconds. They are medians over the measured frames, with 95 % confidence intervals. Counts are
//! empty if the device has no pipeline statistics.
//!
//! Frames are measured in two ways. *Probed* frames have queries around every draw, which slow them down. *Plain*
//! frames have none.

use serde::{Deserialize, Serialize};

use super::estimate::Estimate;

/// Version of the rows. It increases with changes that readers of older versions would misunderstand.
pub const SCHEMA: u32 = 1;

/// A step of the host in probed frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StepRow {
    /// `select`, `upload`, `record`, `submit` or `wait`.
    pub step: String,
    /// Host time.
    pub cpu_us: f64,
    /// Lower end of its interval.
    pub cpu_us_low: f64,
    /// Upper end of its interval.
    pub cpu_us_high: f64,
}

/// A pass on the device in probed frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PassRow {
    /// Name of the pass.
    pub pass: String,
    /// Device time. Where two passes overlap, the time counts for the earlier one.
    pub gpu_us: f64,
    /// Lower end of its interval.
    pub gpu_us_low: f64,
    /// Upper end of its interval.
    pub gpu_us_high: f64,
    /// Number of rows of `draws.csv` that belong to this pass. The counts below are their sums.
    pub draws: usize,
    /// Vertex shader invocations.
    pub vertices_run: Option<u64>,
    /// Primitives that reached clipping.
    pub clipping_invocations: Option<u64>,
    /// Primitives that left clipping: those kept, and those made by cutting.
    pub clipping_primitives: Option<u64>,
    /// Fragment shader invocations.
    pub fragments_run: Option<u64>,
}

/// A draw on the device in probed frames. Beyond a number of draws with queries of their own, the remaining draws of a
/// pipeline share one row.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct DrawRow {
    /// Technique, pipeline, levels and batch.
    pub label: String,
    /// Name of the pass.
    pub pass: String,
    /// Vertex source and topology.
    pub pipeline: String,
    /// Number of the first draw in the draw list, from 0. `--colour batch` shows it.
    pub batch: usize,
    /// Number of draws of the draw list in this row.
    pub draws: usize,
    /// Finest level among the instances; 0 is the finest of all.
    pub level_min: Option<u32>,
    /// Coarsest level among the instances.
    pub level_max: Option<u32>,
    /// Number of instances.
    pub instances: u64,
    /// Vertices submitted: number of indices, times instances.
    pub vertices: u64,
    /// Triangles submitted, degenerate ones included.
    pub triangles: u64,
    /// Device time from the end of all earlier draws to the end of this one.
    pub gpu_us: f64,
    /// Lower end of its interval.
    pub gpu_us_low: f64,
    /// Upper end of its interval.
    pub gpu_us_high: f64,
    /// Vertex shader invocations.
    pub vertices_run: Option<u64>,
    /// Primitives that reached clipping.
    pub clipping_invocations: Option<u64>,
    /// Primitives that left clipping: those kept, and those made by cutting.
    pub clipping_primitives: Option<u64>,
    /// Fragment shader invocations.
    pub fragments_run: Option<u64>,
}

/// A submission mode: a variant of the technique and a way to submit its draws. Measured in plain frames.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ModeRow {
    /// `technique` or `technique:variant`.
    pub form: String,
    /// `direct`: one recorded command per draw. `indirect`: one per pipeline. `driven`: the device selects the draws.
    pub submission: String,
    /// Draw commands that the host records.
    pub commands: usize,
    /// Draws in the draw list.
    pub draws: usize,
    /// Triangles submitted, degenerate ones included.
    pub triangles: u64,
    /// Host time of selecting the level of detail.
    pub select_us: f64,
    /// Host time of writing the frame's data for the device, indirect commands included.
    pub upload_us: f64,
    /// Host time of recording commands.
    pub record_us: f64,
    /// Lower end of its interval.
    pub record_us_low: f64,
    /// Upper end of its interval.
    pub record_us_high: f64,
    /// Recording time divided by the number of draws.
    pub record_us_per_draw: f64,
    /// Recording time divided by that of the first mode, frame by frame.
    pub record_ratio: f64,
    /// Lower end of its interval.
    pub record_ratio_low: f64,
    /// Upper end of its interval.
    pub record_ratio_high: f64,
    /// Device time of all passes.
    pub gpu_us: f64,
    /// Lower end of its interval.
    pub gpu_us_low: f64,
    /// Upper end of its interval.
    pub gpu_us_high: f64,
    /// Device time divided by the number of draws.
    pub gpu_us_per_draw: f64,
    /// Device time divided by that of the first mode, frame by frame.
    pub gpu_ratio: f64,
    /// Lower end of its interval.
    pub gpu_ratio_low: f64,
    /// Upper end of its interval.
    pub gpu_ratio_high: f64,
    /// Frame time, from the start of selection until the device has finished.
    pub frame_us: f64,
}

/// All rows of a profile.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Profile {
    /// Number of frames behind each median.
    pub frames: u32,
    /// Relation of the device's clock to the host's: `calibrated`, or `aligned, not calibrated`.
    pub clock: String,
    /// Largest error of the device's times against the host's in the trace.
    pub clock_deviation_us: f64,
    /// Steps of the host.
    pub steps: Vec<StepRow>,
    /// Passes on the device.
    pub passes: Vec<PassRow>,
    /// Draws on the device.
    pub draws: Vec<DrawRow>,
    /// Submission modes of the same view.
    pub modes: Vec<ModeRow>,
}

impl StepRow {
    /// Makes the row of a step.
    pub fn new(step: &str, cpu_us: Estimate) -> Self {
        let Estimate { median, low, high } = cpu_us.rounded();
        Self { step: step.to_string(), cpu_us: median, cpu_us_low: low, cpu_us_high: high }
    }
}

impl PassRow {
    /// Makes the row of a pass, with the sums over those of `draws` that belong to it.
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
