//! Rows of a benchmark: one line of `rows.jsonl` each, and the parts of `results.json`.
//!
//! `docs/results-schema.md` documents them with a JSON Schema that is generated from these types. A value that is
//! `None`, or an empty list, was not measured.

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

/// Version of rows and results. It grows when a reader of older versions would misread the new ones.
pub const SCHEMA: u32 = 1;

/// One line of `rows.jsonl`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(tag = "row", rename_all = "snake_case")]
pub enum Row {
    /// The first line.
    Header(Header),
    /// The times of one case in one round.
    Time(TimeRow),
    /// The errors of one case.
    Error(ErrorRow),
}

/// Properties that all rows of a directory share.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct Header {
    /// Version of the format.
    #[schemars(extend("const" = SCHEMA))]
    pub schema: u32,
    /// Version of the program.
    pub program: String,
    /// Git commit of the program, if it was built in a clone.
    pub commit: Option<String>,
    /// Start of the first row, RFC 3339, UTC.
    pub date: String,
    /// Command-line arguments.
    pub arguments: Vec<String>,
    /// Technique by whose times the others' are divided, round by round.
    pub base: String,
    /// The computer.
    pub machine: Machine,
    /// The Vulkan device.
    pub device: Device,
    /// The plan of each terrain's scene.
    pub plans: Vec<Plan>,
}

/// The computer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Machine {
    /// Model of the processor.
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
    /// True for a software device.
    pub is_cpu: bool,
}

/// The plan of one terrain's scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Plan {
    /// Name of the terrain.
    pub terrain: String,
    /// Features that the scene needed.
    pub kept: Vec<Decision>,
    /// Features that were left out.
    pub left_out: Vec<Decision>,
}

/// One feature of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Decision {
    /// Name of the feature.
    pub feature: String,
    /// Reason for the decision.
    pub reason: String,
    /// Device bytes used, or saved by leaving it out.
    pub bytes: u64,
}

/// One configuration: rows with equal cases may be compared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Case {
    /// The terrain.
    pub terrain: Terrain,
    /// `technique` or `technique:variant`.
    pub technique: String,
    /// Settings that differ from the technique's defaults.
    pub settings: BTreeMap<String, String>,
    /// Allowed screen error, pixels; with a goal, that of the first frame.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub tolerance_px: f64,
    /// Cost that every frame is held at by moving the tolerance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub goal: Option<Goal>,
    /// `certified` or `paper`.
    #[schemars(extend("enum" = ["certified", "paper"]))]
    pub metric: String,
    /// Name of the camera path.
    pub path: String,
    /// Picture size (x, y), pixels.
    pub size: [u32; 2],
    /// Frames of the path.
    pub frames: usize,
    /// Distance of measured frames: errors are measured at frame 0 and every `every`th one after it.
    pub every: usize,
}

/// A terrain by name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Terrain {
    /// Name of the file, or of the synthetic field with its seed.
    pub name: String,
    /// Samples (x, z).
    pub size: [u32; 2],
    /// Distance of neighbouring samples (x, z), metres.
    pub spacing_m: [f64; 2],
}

/// One round of one case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct TimeRow {
    /// The case.
    pub case: Case,
    /// Its times.
    #[serde(flatten)]
    pub times: Times,
}

/// Times of one pass along the path, milliseconds a frame. Warm-up frames are left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = extended::non_negative)]
pub struct Times {
    /// Number of the round, from 0.
    pub round: usize,
    /// From the start of selection until the picture is done.
    pub frame_ms: Percentiles,
    /// Selection.
    pub select_ms: Percentiles,
    /// Recording of commands.
    pub record_ms: Percentiles,
    /// Device time, by timestamps.
    pub gpu_ms: Option<Percentiles>,
    /// Copying to the device.
    pub upload_ms: Option<Percentiles>,
    /// The same view with the same fragment work in one full-screen pass.
    pub shading_only_ms: Option<Percentiles>,
    /// Time of every frame in order; `frame_ms` are their percentiles.
    #[serde(default)]
    pub frames_ms: Vec<f64>,
    /// The `shading_only` time of every frame; empty if not measured.
    #[serde(default)]
    pub shading_only_frames_ms: Vec<f64>,
    /// Frames longer than twice the median.
    pub hitches: usize,
    /// Triangles drawn a frame.
    pub triangles: Spread,
    /// Vertex shader invocations a frame.
    pub vertices: Option<Spread>,
    /// Draws in the draw list a frame.
    pub draws: Spread,
    /// Draw commands recorded a frame.
    pub commands: Spread,
    /// Largest factor by which a frame's tolerance grew because its list did not fit the buffers: 1 if none did.
    #[serde(with = "extended", default = "unscaled")]
    #[schemars(with = "Extended", extend("minimum" = 1))]
    pub tolerance_scale: f64,
    /// Largest number, of any frame, of visible instances coarser than the tolerance because a refinement was not on
    /// the device yet.
    #[serde(default)]
    pub pending: u64,
    /// Frames with such instances.
    #[serde(default)]
    pub pending_frames: usize,
    /// Deviation from the goal, if there is one.
    #[serde(default)]
    pub budget: Option<BudgetStats>,
    /// Tolerance of every frame, pixels, if there is a goal.
    #[serde(default)]
    #[schemars(extend("items" = {"type": "number", "exclusiveMinimum": 0}))]
    pub tolerances_px: Vec<f64>,
    /// Device bytes by purpose, the largest of any frame.
    pub device_bytes: BTreeMap<String, u64>,
    /// Statistics of the technique after the last frame, by name.
    #[serde(default)]
    pub stats: BTreeMap<String, f64>,
    /// Peak memory of the process, bytes.
    pub host_bytes: Option<u64>,
}

/// The errors of one case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(inline)]
pub struct ErrorRow {
    /// The case.
    pub case: Case,
    /// Its errors.
    #[serde(flatten)]
    pub errors: Errors,
}

/// Errors of a case, pooled over all measured frames.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Errors {
    /// Frames measured.
    pub frames: usize,
    /// Exact screen error, pixels.
    pub error_px: Summary,
    /// Vertical error, metres.
    pub error_m: Summary,
    /// Screen error in the silhouette band, pixels.
    pub silhouette_px: Option<Summary>,
    /// Share of frames and samples within the tolerance.
    pub within: Option<Within>,
    /// Screen error divided by the tolerance, by the angle off the view axis.
    pub by_angle: Vec<AngleBin>,
    /// Pictures against those of brute force.
    pub image: Option<ImageError>,
    /// Displacement when the level of detail changes.
    pub pop: Option<Pop>,
    /// True if every frame was proven watertight.
    pub watertight: Option<bool>,
    /// The first violation where one was not.
    pub counter_example: Option<String>,
    /// True if the triangles captured on the device equal those of the draw list, bit by bit, in every frame.
    pub as_drawn: Option<bool>,
    /// Pixels where the sky shines through terrain, all frames.
    pub hole_pixels: Option<u64>,
    /// Pixels that show a skirt, all frames.
    pub skirt_pixels: Option<u64>,
    /// Share of triangles that are small or hidden, and overdraw.
    pub economy: Option<Economy>,
    /// Near-optimal meshes of the same vertical error.
    pub reference: Option<Reference>,
    /// The peers' metric.
    pub peers_px: Option<PeersError>,
    /// The frame with the largest screen error.
    pub worst: Option<Worst>,
    /// Frames with pending refinements.
    #[serde(default)]
    pub pending: Option<PendingFrames>,
}

/// Frames with pending refinements: only these may exceed a certified bound.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PendingFrames {
    /// Such frames, of those measured.
    pub frames: usize,
    /// Such frames that kept the tolerance.
    pub kept: usize,
    /// Their pixels beyond the tolerance.
    pub pixels: u64,
    /// Largest excess of their screen error over the tolerance, pixels.
    #[serde(with = "extended")]
    #[schemars(with = "Extended", extend("minimum" = 0))]
    pub excess_px: f64,
}

/// Shares within the tolerance, 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = extended::non_negative)]
pub struct Within {
    /// Share of the frames.
    pub frames: f64,
    /// Share of the samples in view.
    pub samples: f64,
}

/// The frame with the largest screen error.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Worst {
    /// Its number on the path.
    pub frame: usize,
    /// Its largest screen error, pixels.
    #[serde(with = "extended")]
    #[schemars(with = "Extended")]
    pub error_px: f64,
    /// File of its picture, relative to the directory.
    pub picture: Option<String>,
    /// File of the difference from the reference picture.
    pub difference: Option<String>,
}

impl Case {
    /// Returns technique, settings, metric and goal: the label of one line of a plot.
    pub fn series(&self) -> String {
        let settings: Vec<_> = self.settings.iter().map(|(key, value)| format!(" {key}={value}")).collect();
        let metric = if self.metric == "certified" { "" } else { " (paper metric)" };
        let goal = self.goal.map_or(String::new(), |goal| format!(" held at {goal}"));
        format!("{}{}{metric}{goal}", self.technique, settings.concat())
    }

    /// Returns terrain, path, picture size and frames: cases of one scene differ only in how it is drawn.
    pub fn scene(&self) -> String {
        let Self { terrain, path, size: [w, h], frames, .. } = self;
        format!("{terrain}, {path}, {w}x{h}, {frames} frames")
    }
}

/// The case in words; different cases have different words.
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

/// The scale of a tolerance that was kept; the default for rows of older versions.
pub(super) fn unscaled() -> f64 {
    1.0
}
