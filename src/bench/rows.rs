//! The rows of a benchmark: the lines of `rows.jsonl`, which are also the parts of `results.json`.
//!
//! `docs/results-schema.md` contains a JSON Schema that is generated from these types and their comments. `None` and
//! empty lists mean that a value was not measured.

use std::collections::BTreeMap;
use std::fmt;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::goal::{BudgetStats, Goal};
use super::statistics::{Percentiles, Spread};
use crate::measure::economy::Economy;
use crate::measure::extended::{self, Extended};
use crate::measure::geometric::AngleBin;
use crate::measure::image::ImageError;
use crate::measure::peers::PeersError;
use crate::measure::pop::Pop;
use crate::measure::reference::Reference;
use crate::measure::summary::Summary;

/// Version of rows and results. It increases with changes that readers of older versions would misunderstand.
pub const SCHEMA: u32 = 1;

/// One line of `rows.jsonl`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "row", rename_all = "snake_case")]
pub enum Row {
    /// The first line.
    Header(Header),
    /// Times of one case in one round.
    Time(TimeRow),
    /// Errors of one case.
    Error(ErrorRow),
}

/// Properties that all rows of a folder share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Header {
    /// Version of the format.
    #[schemars(extend("const" = SCHEMA))]
    pub schema: u32,
    /// Version of the program.
    pub program: String,
    /// Git commit of the program; `null` if it was not built in a git checkout.
    pub commit: Option<String>,
    /// Start of the run, RFC 3339, UTC.
    pub date: String,
    /// Command-line arguments that determine the cases, in a fixed order and spelling.
    pub arguments: Vec<String>,
    /// Base technique: times of other techniques are divided by its times, round by round.
    pub base: String,
    /// The computer.
    pub machine: Machine,
    /// The Vulkan device.
    pub device: Device,
    /// Scene plan of each terrain.
    pub plans: Vec<Plan>,
}

/// The computer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Machine {
    /// Model of the processor, or "unknown".
    pub cpu: String,
    /// Hardware threads.
    pub cores: usize,
    /// Operating system and architecture.
    pub system: String,
}

/// The Vulkan device.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Device {
    /// Name of the device.
    pub name: String,
    /// Name and version of its driver.
    pub driver: String,
    /// True for a software device, which draws on the processor.
    pub is_cpu: bool,
}

/// Scene plan of one terrain: the features that its pipelines and buffers have.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Plan {
    /// Name of the terrain.
    pub terrain: String,
    /// Features that the scene needs.
    pub kept: Vec<Decision>,
    /// Features that it leaves out.
    pub left_out: Vec<Decision>,
}

/// One feature of a scene plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Decision {
    /// Name of the feature.
    pub feature: String,
    /// Reason for the decision.
    pub reason: String,
    /// Device memory that it uses, or that leaving it out saves, bytes.
    pub bytes: u64,
}

/// One configuration. Rows with equal cases may be compared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Case {
    /// The terrain.
    pub terrain: Terrain,
    /// `technique` or `technique:variant`.
    pub technique: String,
    /// Settings given on the command line, by key.
    pub settings: BTreeMap<String, String>,
    /// Tolerance: largest allowed screen error, pixels. With a goal, that of the first frame.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tolerance_px: f64,
    /// Target cost of every frame, if the tolerance is adjusted to reach one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub goal: Option<Goal>,
    /// Formula that converts metres of error to pixels: `certified` or `paper`.
    #[schemars(extend("enum" = ["certified", "paper"]))]
    pub metric: String,
    /// Name of the camera path.
    pub path: String,
    /// Picture size (x, y), pixels.
    pub size: [u32; 2],
    /// Number of frames on the path.
    pub frames: usize,
    /// Errors are measured at frames 0, `every`, 2 · `every`, …
    pub every: usize,
}

/// A terrain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Terrain {
    /// Name of the file without its extension, or kind and seed of a synthetic field.
    pub name: String,
    /// Number of samples (x, z).
    pub size: [u32; 2],
    /// Distance between samples (x, z), metres.
    pub spacing_m: [f64; 2],
}

/// Times of one case in one round.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct TimeRow {
    /// The case.
    pub case: Case,
    /// Times of the round.
    #[serde(flatten)]
    pub times: Times,
}

/// Times of one pass along the path, milliseconds per frame. Warm-up frames are left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = extended::non_negative)]
pub struct Times {
    /// Number of the round, from 0.
    pub round: usize,
    /// Frame time, from the start of selection until the device has finished.
    pub frame_ms: Percentiles,
    /// Host time of selecting the level of detail.
    pub select_ms: Percentiles,
    /// Host time of recording commands.
    pub record_ms: Percentiles,
    /// Device time of all passes, by timestamps.
    pub gpu_ms: Option<Percentiles>,
    /// Host time of writing data for the device and recording its uploads.
    pub upload_ms: Option<Percentiles>,
    /// Frame time of the shading-only baseline: one full-screen pass that does the same fragment work without
    /// triangles.
    pub shading_only_ms: Option<Percentiles>,
    /// Frame time of every frame, in order; `frame_ms` has their percentiles.
    #[serde(default)]
    pub frames_ms: Vec<f64>,
    /// Shading-only frame time of every frame, in order; empty if not measured.
    #[serde(default)]
    pub shading_only_frames_ms: Vec<f64>,
    /// Number of frames longer than twice the median.
    pub hitches: usize,
    /// Triangles per frame.
    pub triangles: Spread,
    /// Vertex shader invocations per frame.
    pub vertices: Option<Spread>,
    /// Draws in the draw list per frame.
    pub draws: Spread,
    /// Draw commands recorded per frame.
    pub commands: Spread,
    /// Largest factor by which a frame's tolerance was scaled so that its list fits the buffers. 1 if all lists fitted.
    #[serde(with = "extended", default = "unscaled")]
    #[schemars(with = "Extended", extend("minimum" = 1))]
    pub tolerance_scale: f64,
    /// Largest number, in any frame, of visible instances that are coarser than the tolerance allows because finer data
    /// is not on the device yet.
    #[serde(default)]
    pub pending: u64,
    /// Number of frames with such instances.
    #[serde(default)]
    pub pending_frames: usize,
    /// Deviation of the frames from the case's goal; `null` without a goal.
    #[serde(default)]
    pub budget: Option<BudgetStats>,
    /// Tolerance of every frame, pixels, in order; empty without a goal.
    #[serde(default)]
    #[schemars(extend("items" = {"type": "number", "exclusiveMinimum": 0}))]
    pub tolerances_px: Vec<f64>,
    /// Device memory in use after the last frame, by purpose, bytes.
    pub device_bytes: BTreeMap<String, u64>,
    /// Statistics of the technique after the last frame, by name.
    #[serde(default)]
    pub stats: BTreeMap<String, f64>,
    /// Peak resident memory of the process so far, bytes; `null` where the system does not report it.
    pub host_bytes: Option<u64>,
}

/// Errors of one case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct ErrorRow {
    /// The case.
    pub case: Case,
    /// Errors of the case.
    #[serde(flatten)]
    pub errors: Errors,
}

/// Errors of a case over all measured frames.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Errors {
    /// Number of frames measured.
    pub frames: usize,
    /// Screen error: distance between a sample and the drawn point above or below it, both projected, pixels.
    pub error_px: Summary,
    /// Vertical distance between a sample and the drawn surface, metres.
    pub error_m: Summary,
    /// Screen error of samples on silhouettes, where the terrain turns away from the eye, pixels.
    pub silhouette_px: Option<Summary>,
    /// Shares of frames and samples within the tolerance.
    pub within: Option<Within>,
    /// Screen error divided by the tolerance, by the angle off the view axis.
    pub by_angle: Vec<AngleBin>,
    /// Difference of the pictures from those of brute force.
    pub image: Option<ImageError>,
    /// Displacement of the surface from frame to frame when the level of detail changes.
    pub pop: Option<Pop>,
    /// True if every measured frame was proven watertight.
    pub watertight: Option<bool>,
    /// First frame that is not watertight, and the triangles at fault.
    pub counter_example: Option<String>,
    /// True if the triangles captured on the device equal those of the draw list, bit by bit, in every frame captured.
    pub as_drawn: Option<bool>,
    /// Number of pixels where the sky shows through terrain, all frames.
    pub hole_pixels: Option<u64>,
    /// Number of pixels that show a skirt, all frames.
    pub skirt_pixels: Option<u64>,
    /// Shares of small and of hidden triangles, and overdraw.
    pub economy: Option<Economy>,
    /// Near-optimal meshes with the same vertical error.
    pub reference: Option<Reference>,
    /// Error as other terrain renderers were measured, pixels.
    pub peers_px: Option<PeersError>,
    /// The frame with the largest screen error.
    pub worst: Option<Worst>,
    /// Frames with pending data.
    #[serde(default)]
    pub pending: Option<PendingFrames>,
}

/// Measured frames with instances that are too coarse because finer data is not on the device yet. Only such frames may
/// exceed a certified tolerance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PendingFrames {
    /// Number of such frames.
    pub frames: usize,
    /// Number of such frames that are within the tolerance all the same.
    pub kept: usize,
    /// Number of pixels beyond the tolerance in these frames.
    pub pixels: u64,
    /// Largest excess of the screen error over the tolerance in these frames, pixels.
    #[serde(with = "extended")]
    #[schemars(with = "Extended", extend("minimum" = 0))]
    pub excess_px: f64,
}

/// Shares within the tolerance, 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = extended::non_negative)]
pub struct Within {
    /// Share of the measured frames whose largest screen error is within the tolerance.
    pub frames: f64,
    /// Share of the samples in view whose screen error is within the tolerance.
    pub samples: f64,
}

/// The frame with the largest screen error.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Worst {
    /// Number of the frame on the path, from 0.
    pub frame: usize,
    /// Largest screen error, pixels.
    #[serde(with = "extended")]
    #[schemars(with = "Extended")]
    pub error_px: f64,
    /// File with the picture, relative to the benchmark's folder.
    pub picture: Option<String>,
    /// File with the FLIP difference from the reference picture, relative to the benchmark's folder.
    pub difference: Option<String>,
}

impl Case {
    /// Returns technique, settings, metric and goal: the label of one line in a chart.
    pub fn series(&self) -> String {
        let settings: Vec<_> = self.settings.iter().map(|(key, value)| format!(" {key}={value}")).collect();
        let metric = if self.metric == "certified" { "" } else { " (paper metric)" };
        let goal = self.goal.map_or(String::new(), |goal| format!(" held at {goal}"));
        format!("{}{}{metric}{goal}", self.technique, settings.concat())
    }

    /// Returns terrain, path, picture size and number of frames: the label of a scene. Cases of one scene differ only
    /// in how it is drawn.
    pub fn scene(&self) -> String {
        let Self { terrain, path, size: [w, h], frames, .. } = self;
        format!("{terrain}, {path}, {w}x{h}, {frames} frames")
    }
}

/// Writes the scene, the series and the tolerance, which together identify a case.
impl fmt::Display for Case {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}, {} px", self.scene(), self.series(), self.tolerance_px)
    }
}

impl fmt::Display for Terrain {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}x{}", self.name, self.size[0], self.size[1])
    }
}

/// Returns 1, the tolerance scale of lists that fit; the default for rows of older versions.
pub(super) fn unscaled() -> f64 {
    1.0
}
