//! Runs all cases of a benchmark and writes their rows.
//!
//! The cases of a scene alternate (A B A B …), one round after the other. A temporary slowdown of the machine then
//! affects all of them. Warm-up frames are not counted. Each row is on the disk before the next one is measured.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use anyhow::{Context, Result, ensure};

use super::goal::{BudgetStats, Goal};
use super::journal::Journal;
use super::machine::host_bytes;
use super::paths::{self, Pose};
use super::results;
use super::rows::{Case, Device, ErrorRow, Errors, Header, Plan, Row, Terrain, TimeRow, Times};
use super::sample::FrameSample;
use super::statistics::{Percentiles, Spread};
use crate::height::Field;
use crate::view::{Metric, Tolerance, View};

/// A frame longer than this many medians is a hitch.
const HITCH: f64 = 2.0;

/// One case for a backend to draw.
pub struct BenchScene<'a> {
    /// The case.
    pub case: &'a Case,
    /// The field.
    pub field: &'a Arc<Field>,
    /// One view per frame, in order, with the case's tolerance. If the case has a goal, the backend adjusts the
    /// tolerance with a [`ToleranceController`](super::controller::ToleranceController).
    pub views: &'a [View],
    /// Folder for pictures. File names in [`Errors`] are relative to it.
    pub folder: &'a Path,
}

/// Measurements of one pass along a path.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Timed {
    /// One sample per view, in order.
    pub frames: Vec<FrameSample>,
    /// Device memory in use after the last frame, by purpose, bytes.
    pub device_bytes: BTreeMap<String, u64>,
    /// Statistics of the technique after the last frame, by name.
    pub stats: BTreeMap<String, f64>,
}

/// A renderer to measure. All cases of a scene are passed to it before the next scene, so it may cache data of a scene.
pub trait BenchBackend {
    /// Describes the device, and the plan of each terrain's scene.
    fn describe(&mut self, fields: &[(Terrain, Arc<Field>)]) -> Result<(Device, Vec<Plan>)>;

    /// Draws every view once, in order, starting with a freshly prepared technique.
    fn time(&mut self, scene: &BenchScene) -> Result<Timed>;

    /// Draws every view once, in order, and measures the frames 0, [`Case::every`], 2 · [`Case::every`], …
    fn measure(&mut self, scene: &BenchScene) -> Result<Errors>;

    /// Closes the backend and returns the messages of the validation layers, if they are on.
    fn close(self: Box<Self>) -> Vec<String> {
        Vec::new()
    }
}

/// A benchmark run: its cases and the way to measure them.
pub struct Run<'a> {
    /// Folder for rows, results and pictures.
    pub folder: &'a Path,
    /// The cases. Those of one scene alternate in this order.
    pub cases: Vec<Case>,
    /// The fields of the cases.
    pub fields: Vec<(Terrain, Arc<Field>)>,
    /// Number of times that each case is timed.
    pub rounds: usize,
    /// Frames drawn at the first pose before each path. They are not counted.
    pub warm_up: usize,
    /// Set to true, ends the run after the current row.
    pub stop: &'a AtomicBool,
}

/// Progress of a run.
pub struct Step<'a> {
    /// Rows before the next one, and rows of the whole run.
    pub done: [usize; 2],
    /// The case that is measured next.
    pub case: &'a Case,
}

/// Outcome of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ended {
    /// All rows are written.
    Complete,
    /// Stopped early. The same command resumes the run.
    Stopped,
}

/// One row to measure.
#[derive(Clone, Copy)]
struct Task<'a> {
    case: &'a Case,
    /// Number of the round to time; `None` to measure errors.
    round: Option<usize>,
}

impl Run<'_> {
    /// Measures the rows that the folder lacks, then writes the results. Results are also written if the run is
    /// stopped or a case fails. `at` is called before each row.
    ///
    /// # Errors
    /// If the folder holds another run, a file cannot be written, or the backend fails.
    pub fn run(&self, backend: &mut dyn BenchBackend, header: Header, at: &mut dyn FnMut(Step)) -> Result<Ended> {
        let mut journal = Journal::open(self.folder, header)?;
        let ended = self.missing_rows(backend, &mut journal, at);
        let written = results::write(self.folder);
        // Reports the first failure.
        let ended = ended?;
        written?;
        Ok(ended)
    }

    fn missing_rows(
        &self,
        backend: &mut dyn BenchBackend,
        journal: &mut Journal,
        at: &mut dyn FnMut(Step),
    ) -> Result<Ended> {
        let tasks = self.tasks();
        let mut flights = Flights::default();
        for (k, task) in tasks.iter().enumerate() {
            if journal.rows().iter().any(|row| task.is_done_by(row)) {
                continue;
            }
            if self.stop.load(Ordering::Relaxed) {
                return Ok(Ended::Stopped);
            }
            at(Step { done: [k, tasks.len()], case: task.case });
            let row = self.row(backend, &mut flights, *task);
            let row = row.with_context(|| format!("{}: {}", self.kept(journal), task.case))?;
            journal.append(row).with_context(|| self.kept(journal))?;
        }
        Ok(Ended::Complete)
    }

    /// Tells the user, if a row fails, that earlier rows are kept and how to resume.
    fn kept(&self, journal: &Journal) -> String {
        let rows = journal.rows().len();
        format!("{}: {rows} rows are kept, the same command resumes the run", self.folder.display())
    }

    /// Lists all rows in the order of measurement. For each scene: one time row per case in every round, then the
    /// error rows.
    fn tasks(&self) -> Vec<Task<'_>> {
        let mut scenes: Vec<String> = self.cases.iter().map(Case::scene).collect();
        let mut seen = std::collections::BTreeSet::new();
        scenes.retain(|scene| seen.insert(scene.clone()));
        let rounds: Vec<_> = (0..self.rounds).map(Some).chain([None]).collect();
        let of_scene = |scene: &String| {
            let cases: Vec<_> = self.cases.iter().filter(|case| case.scene() == *scene).collect();
            rounds.iter().flat_map(|&round| cases.iter().map(move |&case| Task { case, round })).collect::<Vec<_>>()
        };
        scenes.iter().flat_map(of_scene).collect()
    }

    /// Measures one row.
    fn row(&self, backend: &mut dyn BenchBackend, flights: &mut Flights, task: Task) -> Result<Row> {
        let case = task.case;
        let (_, field) = self.fields.iter().find(|(terrain, _)| *terrain == case.terrain).context("no such terrain")?;
        let views = flights.views(case, field)?;
        let Some(round) = task.round else {
            let scene = BenchScene { case, field, views: &views, folder: self.folder };
            return Ok(Row::Error(ErrorRow { case: case.clone(), errors: backend.measure(&scene)? }));
        };
        let first = views.first().context("a path has at least one frame")?;
        let views: Vec<View> = std::iter::repeat_n(*first, self.warm_up).chain(views.iter().copied()).collect();
        let scene = BenchScene { case, field, views: &views, folder: self.folder };
        let mut timed = backend.time(&scene)?;
        let (found, expected) = (timed.frames.len(), views.len());
        ensure!(found == expected, "{found} frames were timed of {expected}");
        timed.frames.drain(..self.warm_up);
        Ok(Row::Time(TimeRow { case: case.clone(), times: Times::of(round, timed, case.goal) }))
    }
}

impl Task<'_> {
    /// Returns true if `row` is the result of this task.
    fn is_done_by(&self, row: &Row) -> bool {
        match row {
            Row::Header(_) => false,
            Row::Time(row) => Some(row.times.round) == self.round && row.case == *self.case,
            Row::Error(row) => self.round.is_none() && row.case == *self.case,
        }
    }
}

/// Caches the poses of one scene's path, which all its cases share.
#[derive(Default)]
struct Flights {
    scene: String,
    poses: Vec<Pose>,
    near: f64,
}

impl Flights {
    /// Returns the views of a case, one per frame.
    fn views(&mut self, case: &Case, field: &Field) -> Result<Vec<View>> {
        if self.scene != case.scene() {
            let path = paths::find(&case.path).with_context(|| format!("no path {}", case.path))?;
            (self.scene, self.poses, self.near) = (case.scene(), path.poses(field, case.frames), paths::near(field));
        }
        Ok(paths::views(&self.poses, self.near, case.size, case.tolerance()))
    }
}

impl Case {
    /// Returns the tolerance and its metric.
    pub fn tolerance(&self) -> Tolerance {
        let metric = if self.metric == "paper" { Metric::Paper } else { Metric::Certified };
        Tolerance { px: self.tolerance_px, metric }
    }
}

/// Rounds milliseconds to whole microseconds, which keeps the rows short.
fn whole_us(ms: f64) -> f64 {
    (ms * 1e3).round() / 1e3
}

impl Times {
    /// Summarises the frames of one round.
    pub fn of(round: usize, timed: Timed, goal: Option<Goal>) -> Self {
        let frames = &timed.frames;
        let times = |of: fn(&FrameSample) -> f64| Percentiles::of(frames.iter().map(of));
        let measured = |of: fn(&FrameSample) -> Option<f64>| -> Option<Percentiles> {
            frames.iter().map(of).collect::<Option<Vec<_>>>().map(Percentiles::of)
        };
        let counts = |of: fn(&FrameSample) -> u64| Spread::of(frames.iter().map(|frame| of(frame) as f64));
        let frame_ms = times(|frame| frame.frame_ms);
        let vertices: Option<Vec<f64>> = frames.iter().map(|frame| frame.vertices.map(|n| n as f64)).collect();
        Self {
            round,
            frame_ms,
            select_ms: times(|frame| frame.select_ms),
            record_ms: times(|frame| frame.record_ms),
            gpu_ms: measured(|frame| frame.gpu_ms),
            upload_ms: measured(|frame| frame.upload_ms),
            shading_only_ms: measured(|frame| frame.shading_only_ms),
            frames_ms: frames.iter().map(|frame| whole_us(frame.frame_ms)).collect(),
            shading_only_frames_ms: frames.iter().filter_map(|frame| frame.shading_only_ms).map(whole_us).collect(),
            hitches: frames.iter().filter(|frame| frame.frame_ms > HITCH * frame_ms.p50).count(),
            triangles: counts(|frame| frame.triangles),
            vertices: vertices.map(Spread::of),
            draws: counts(|frame| frame.draws),
            commands: counts(|frame| frame.commands),
            tolerance_scale: frames.iter().map(|frame| frame.tolerance_scale).fold(1.0, f64::max),
            pending: frames.iter().map(|frame| frame.pending).max().unwrap_or(0),
            pending_frames: frames.iter().filter(|frame| frame.pending > 0).count(),
            budget: goal.map(|goal| BudgetStats::of(goal, frames)),
            tolerances_px: frames.iter().filter(|_| goal.is_some()).map(|frame| frame.tolerance_px).collect(),
            device_bytes: timed.device_bytes,
            stats: timed.stats,
            host_bytes: host_bytes(),
        }
    }
}
