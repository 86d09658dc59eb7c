//! The rows of a benchmark: one line of `rows.jsonl` each, and the parts of `results.json`. Documented, with a JSON
//! Schema, in `docs/results-schema.md`; what is `None` or empty was not measured.

use std::collections::BTreeMap;
use std::fmt;

use serde::{Deserialize, Serialize};

use super::goal::{BudgetStats, Goal};
use super::statistics::{Percentiles, Spread};

/// Version of rows and results. It grows when a reader of the old ones would misread the new ones.
pub const SCHEMA: u32 = 1;

/// One line of `rows.jsonl`.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "row", rename_all = "snake_case")]
pub enum Row {
    /// The first line.
    Header(Header),
    /// One case drawn once along its path.
    Time(TimeRow),
    /// The errors of one case.
    Error(ErrorRow),
}

/// What all rows of a directory have in common.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Header {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Version of the program.
    pub program: String,
    /// Git commit that it was built from, where it was built in a clone.
    pub commit: Option<String>,
    /// When the first row was begun, RFC 3339, UTC.
    pub date: String,
    /// What was asked for.
    pub arguments: Vec<String>,
    /// Technique that the others' times are divided by, pair by pair.
    pub base: String,
    /// Where it ran.
    pub machine: Machine,
    /// What drew.
    pub device: Device,
    /// What each scene needed and what was left out of it.
    pub plans: Vec<Plan>,
}

/// The computer.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Machine {
    /// Model of the processor.
    pub cpu: String,
    /// Threads that run at once.
    pub cores: usize,
    /// Operating system and architecture.
    pub system: String,
}

/// The Vulkan device.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Device {
    /// Its name.
    pub name: String,
    /// Name and version of its driver.
    pub driver: String,
    /// Whether it is a software device.
    pub is_cpu: bool,
}

/// The plan of one terrain's scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    /// Name of the terrain.
    pub terrain: String,
    /// What the scene needed.
    pub kept: Vec<Decision>,
    /// What it did without.
    pub left_out: Vec<Decision>,
}

/// One feature of a plan.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Decision {
    /// What it is.
    pub feature: String,
    /// Why it was kept or left out.
    pub reason: String,
    /// Device bytes that it takes, or that leaving it out saved.
    pub bytes: u64,
}

/// What is drawn and how: rows with equal cases may be compared.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Case {
    /// The field.
    pub terrain: Terrain,
    /// `technique` or `technique:variant`.
    pub technique: String,
    /// Settings put over the technique's defaults.
    pub settings: BTreeMap<String, String>,
    /// Error allowed, pixels; where there is a goal, at the start.
    pub tolerance_px: f64,
    /// What every frame is to cost, by moving the tolerance.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub goal: Option<Goal>,
    /// `certified` or `paper`.
    pub metric: String,
    /// Name of the path.
    pub path: String,
    /// Pixels (x, y).
    pub size: [u32; 2],
    /// Frames of the path.
    pub frames: usize,
    /// Errors are measured at every so many frames, the first included.
    pub every: usize,
}

/// A field, by name.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Terrain {
    /// Name of the file, or of the synthetic field with its seed.
    pub name: String,
    /// Samples (x, z).
    pub size: [u32; 2],
    /// Distance of neighbouring samples, metres.
    pub spacing_m: [f64; 2],
}

/// One round of one case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimeRow {
    /// What was drawn.
    pub case: Case,
    /// What it took.
    #[serde(flatten)]
    pub times: Times,
}

/// What drawing the path once took. Milliseconds a frame, warm-up left out.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Times {
    /// Rounds before this one.
    pub round: usize,
    /// From the start of selection until the picture is done.
    pub frame_ms: Percentiles,
    /// Selection.
    pub select_ms: Percentiles,
    /// Recording of commands.
    pub record_ms: Percentiles,
    /// The device, by timestamps.
    pub gpu_ms: Option<Percentiles>,
    /// Copying to the device.
    pub upload_ms: Option<Percentiles>,
    /// The same pose with the same fragment work in one full-screen pass.
    pub shading_only_ms: Option<Percentiles>,
    /// Every frame of the path in order, milliseconds: the times of which `frame_ms` tells.
    #[serde(default)]
    pub frames_ms: Vec<f64>,
    /// The floors of the same frames; empty if they were not measured.
    #[serde(default)]
    pub shading_only_frames_ms: Vec<f64>,
    /// Frames of more than twice the median.
    pub hitches: usize,
    /// Triangles drawn a frame.
    pub triangles: Spread,
    /// Vertices run a frame.
    pub vertices: Option<Spread>,
    /// Draws of the list a frame.
    pub draws: Spread,
    /// Draw commands recorded a frame.
    pub commands: Spread,
    /// What the tolerance was multiplied by because there was too much to draw, the most of any frame: 1 where it was
    /// kept.
    #[serde(with = "extended", default = "kept")]
    pub tolerance_scale: f64,
    /// Instances in sight that were coarser than the tolerance allows because what is finer was not there yet, the most
    /// of any frame.
    #[serde(default)]
    pub pending: u64,
    /// Frames with such instances.
    #[serde(default)]
    pub pending_frames: usize,
    /// How well the goal was held, if there is one.
    #[serde(default)]
    pub budget: Option<BudgetStats>,
    /// The tolerances of the frames, pixels, if there is a goal.
    #[serde(default)]
    pub tolerances_px: Vec<f64>,
    /// Device bytes by purpose, the most of any frame.
    pub device_bytes: BTreeMap<String, u64>,
    /// What the technique told of itself after the last frame, by name.
    #[serde(default)]
    pub stats: BTreeMap<String, f64>,
    /// The most memory that the process has held, bytes.
    pub host_bytes: Option<u64>,
}

/// The errors of one case.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ErrorRow {
    /// What was drawn.
    pub case: Case,
    /// What was wrong with it.
    #[serde(flatten)]
    pub errors: Errors,
}

/// What a laboratory measures of a case. All frames measured are pooled.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Errors {
    /// Frames measured.
    pub frames: usize,
    /// Exact screen error.
    pub error_px: Summary,
    /// Vertical error, metres.
    pub error_m: Summary,
    /// Screen error in the silhouette band.
    pub silhouette_px: Option<Summary>,
    /// How often the tolerance was kept.
    pub within: Option<Within>,
    /// Screen error over the tolerance, by the angle off the view axis.
    pub by_angle: Vec<AngleBin>,
    /// Picture against brute force's: means over the frames.
    pub image: Option<ImageError>,
    /// Displacement when the level of detail changes.
    pub pop: Option<Pop>,
    /// Whether every frame was proven watertight.
    pub watertight: Option<bool>,
    /// What was wrong where it was not.
    pub counter_example: Option<String>,
    /// Whether the triangles captured on the device were those that the lists say, to the bit, in every frame.
    pub as_drawn: Option<bool>,
    /// Pixels where the sky shines through land, all frames.
    pub hole_pixels: Option<u64>,
    /// Pixels that show a skirt, all frames.
    pub skirt_pixels: Option<u64>,
    /// What the triangles were spent on.
    pub economy: Option<Economy>,
    /// Near-optimal meshes of the same vertical error.
    pub reference: Option<Reference>,
    /// The peers' metric.
    pub peers_px: Option<PeersError>,
    /// The frame with the largest screen error.
    pub worst: Option<Worst>,
    /// What is beyond the tolerance because something finer was not there yet.
    #[serde(default)]
    pub pending: Option<PendingFrames>,
}

/// Frames in which a refinement waited, counted apart: only there may a certified bound be exceeded.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PendingFrames {
    /// Such frames, of those measured.
    pub frames: usize,
    /// Those of them that kept the tolerance all the same.
    pub kept: usize,
    /// Their pixels beyond the tolerance.
    pub pixels: u64,
    /// How far beyond it the largest screen error of them is, pixels.
    #[serde(with = "extended")]
    pub excess_px: f64,
}

/// A quantity over all samples in view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Summary {
    /// Root of the mean square.
    #[serde(with = "extended")]
    pub rms: f64,
    /// 99.9 % are no larger, in every frame.
    #[serde(with = "extended")]
    pub p999: f64,
    /// Largest.
    #[serde(with = "extended")]
    pub max: f64,
}

/// Shares, 0 to 1, of what kept the tolerance.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Within {
    /// Of the frames.
    pub frames: f64,
    /// Of the samples in view.
    pub samples: f64,
}

/// Screen error over the tolerance in one range of angles off the view axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct AngleBin {
    /// Degrees, inclusive.
    pub from_deg: f64,
    /// Degrees, exclusive.
    pub to_deg: f64,
    /// 99.9 % are no larger.
    #[serde(with = "extended")]
    pub p999: f64,
    /// Largest.
    #[serde(with = "extended")]
    pub max: f64,
}

/// A picture against the truth's.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct ImageError {
    /// Root of the mean square difference, of a channel's full range.
    pub rmse: f64,
    /// Decibel; infinite for equal pictures.
    #[serde(with = "extended")]
    pub psnr: f64,
    /// Structural similarity; 1 for equal pictures.
    pub ssim: f64,
    /// Mean FLIP; 0 for equal pictures.
    pub flip: f64,
}

/// Screen displacement of the surface from one frame's level of detail to the next one's, pixels.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Pop {
    /// 99 % are no larger, in every frame.
    #[serde(with = "extended")]
    pub p99_px: f64,
    /// 99.9 % are no larger, in every frame.
    #[serde(with = "extended", default)]
    pub p999_px: f64,
    /// Largest.
    #[serde(with = "extended")]
    pub max_px: f64,
    /// Samples by displacement in pixels.
    pub histogram: Vec<Bin>,
}

/// One class of a histogram.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Bin {
    /// Lower end, inclusive.
    pub from: f64,
    /// Upper end, exclusive.
    #[serde(with = "extended")]
    pub to: f64,
    /// How many.
    pub count: u64,
}

/// What triangles are spent on.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Economy {
    /// Triangles in view by their area in pixels.
    pub pixels_per_triangle: Vec<Bin>,
    /// Share, 0 to 1, of triangles in view that land in front hides.
    #[serde(default)]
    pub hidden_share: f64,
    /// Share, 0 to 1, of triangles below one pixel.
    pub subpixel_share: f64,
    /// Fragments run per covered pixel, as the driver counts them: software devices count whole blocks of pixels.
    pub overdraw: Option<f64>,
    /// Fragments that passed the depth test per covered pixel: 1 if nothing is drawn over.
    #[serde(default)]
    pub passed: Option<f64>,
}

/// Near-optimal meshes of the whole field at a case's largest vertical error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Reference {
    /// The true largest vertical error that both meshes keep, metres.
    pub error_m: f64,
    /// Triangles by greedy insertion, Delaunay.
    pub delaunay: Option<u64>,
    /// Triangles of the right-triangulated irregular network.
    pub rtin: Option<u64>,
    /// The technique's triangles over the greedy mesh's, both over the land in view.
    pub multiple: Option<f64>,
}

/// The peers' metric, pixels, pooled over the frames.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct PeersError {
    /// Mean.
    pub mean: f64,
    /// Root of the mean square.
    pub rms: f64,
    /// 95 % are no larger.
    pub p95: f64,
    /// 99 % are no larger.
    pub p99: f64,
    /// Largest.
    pub max: f64,
}

/// The frame with the largest screen error.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Worst {
    /// Its number on the path.
    pub frame: usize,
    /// Its largest screen error, pixels.
    #[serde(with = "extended")]
    pub error_px: f64,
    /// File with its picture, relative to the directory.
    pub picture: Option<String>,
    /// File with the difference from the truth's picture.
    pub difference: Option<String>,
}

impl Case {
    /// Technique, settings and metric: what one line of a plot stands for.
    pub fn series(&self) -> String {
        let settings: Vec<_> = self.settings.iter().map(|(key, value)| format!(" {key}={value}")).collect();
        let metric = if self.metric == "certified" { "" } else { " (paper metric)" };
        let goal = self.goal.map_or(String::new(), |goal| format!(" held at {goal}"));
        format!("{}{}{metric}{goal}", self.technique, settings.concat())
    }

    /// What is looked at: cases of one scene differ in how it is drawn only.
    pub fn scene(&self) -> String {
        let Self { terrain, path, size: [w, h], frames, .. } = self;
        format!("{terrain}, {path}, {w}x{h}, {frames} frames")
    }
}

/// The case in words, different for different cases.
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

/// The factor of a tolerance that was kept: rows of older versions do not say it.
pub(crate) fn kept() -> f64 {
    1.0
}

/// Numbers that may be infinite, which JSON has no number for: they are written as the word "infinite".
pub(crate) mod extended {
    use serde::{Deserialize, Deserializer, Serialize, Serializer};

    #[derive(Serialize, Deserialize)]
    #[serde(rename_all = "lowercase")]
    enum Word {
        Infinite,
    }

    #[derive(Serialize, Deserialize)]
    #[serde(untagged)]
    enum Number {
        Finite(f64),
        Infinite(Word),
    }

    pub fn serialize<S: Serializer>(value: &f64, serializer: S) -> Result<S::Ok, S::Error> {
        let number = if value.is_finite() { Number::Finite(*value) } else { Number::Infinite(Word::Infinite) };
        number.serialize(serializer)
    }

    pub fn deserialize<'de, D: Deserializer<'de>>(deserializer: D) -> Result<f64, D::Error> {
        Ok(match Number::deserialize(deserializer)? {
            Number::Finite(value) => value,
            Number::Infinite(Word::Infinite) => f64::INFINITY,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn infinite_errors_come_back() {
        let summary = Summary { rms: 0.1, p999: f64::INFINITY, max: f64::INFINITY };
        let text = serde_json::to_string(&summary).unwrap();
        assert_eq!(text, r#"{"rms":0.1,"p999":"infinite","max":"infinite"}"#);
        assert_eq!(serde_json::from_str::<Summary>(&text).unwrap(), summary);
        assert!(serde_json::from_str::<Summary>(&text.replace("infinite", "nan")).is_err());
    }
}
