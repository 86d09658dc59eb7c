//! Measures a profile. Each round draws one frame with queries around every draw, and one plain frame per submission
//! mode.

use anyhow::{Result, ensure};
use serde_json::{Value, json};

use super::estimate::{Estimate, rounded};
use super::rows::{DrawRow, ModeRow, PassRow, Profile, StepRow};
use super::{timeline, trace};
use crate::draw::{DrawList, Submission};
use crate::gpu::probe;
use crate::gpu::renderdoc::RenderDoc;
use crate::lod::Technique;
use crate::scene::probed::{self, ProbedDraw, ProbedFrame, Span};
use crate::scene::{Copy, Scene, SceneRenderer, Times};
use crate::view::View;

/// First rounds that are not counted, while caches fill and clock rates rise.
const WARM_UP: u32 = 2;

/// A prepared technique, or a variant of it.
pub struct Form {
    /// `technique` or `technique:variant`, as on the command line.
    pub name: String,
    /// The technique.
    pub technique: Box<dyn Technique>,
}

/// Results of a profile, and the renderers to draw its modes again.
pub struct Measured {
    /// The rows.
    pub profile: Profile,
    /// Trace of the frame with the median device time.
    pub trace: Value,
    forms: Vec<Form>,
    /// One renderer per form.
    renderers: Vec<SceneRenderer>,
    modes: Vec<Mode>,
    view: View,
}

/// A form under one kind of submission, with its counts and times.
struct Mode {
    /// Number of the form.
    form: usize,
    submission: Submission,
    commands: usize,
    draws: usize,
    triangles: u64,
    times: Vec<Times>,
}

/// Measures the first form draw by draw, and every form under two kinds of submission, in `frames` alternating rounds.
/// `progress` is called with the number of finished rounds and of all rounds, warm-up included.
///
/// # Errors
/// If the device fails or has no timestamps, or the technique returns different lists for the same view.
pub fn run(
    scene: &Scene,
    view: &View,
    mut forms: Vec<Form>,
    frames: u32,
    progress: impl Fn(u32, u32),
) -> Result<Measured> {
    let mut renderers = forms.iter().map(|form| renderer(scene, form, view)).collect::<Result<Vec<_>>>()?;
    let mut modes = Vec::new();
    for (k, (form, renderer)) in forms.iter_mut().zip(&mut renderers).enumerate() {
        modes.extend(both_ways(k, form, renderer, view)?);
    }
    let mut probed = Vec::new();
    for round in 0..WARM_UP + frames {
        progress(round, WARM_UP + frames);
        renderers[0].submission = None;
        let Form { name, technique } = &mut forms[0];
        let frame = renderers[0].draw_probed(technique.as_mut(), name, view)?;
        // The order rotates, so that no mode always follows the probed frame.
        let turn = round as usize % modes.len();
        for k in (turn..modes.len()).chain(0..turn) {
            let mode = &mut modes[k];
            let renderer = &mut renderers[mode.form];
            renderer.submission = Some(mode.submission);
            let times = renderer.draw(forms[mode.form].technique.as_mut(), view, Copy::Nothing)?;
            let list = &renderer.list;
            (mode.commands, mode.draws, mode.triangles) = (list.commands(), list.draws.len(), list.triangles());
            if round >= WARM_UP {
                mode.times.push(times);
            }
        }
        if round >= WARM_UP {
            probed.push(frame);
        }
    }
    renderers[0].complete()?;
    let (profile, trace) = summary(&renderers[0].list, probed, &modes, &forms)?;
    Ok(Measured { profile, trace, forms, renderers, modes, view: *view })
}

/// Makes a renderer with the pipelines that a form requires.
fn renderer(scene: &Scene, form: &Form, view: &View) -> Result<SceneRenderer> {
    let plan = scene.plan.clone().with_requirements(form.technique.pipeline_requirements());
    Scene { plan: &plan, ..scene.clone() }.renderer(form.technique.as_ref(), view.size)
}

/// Returns the modes of a form: the submission that it chooses itself, and indirect submission, or direct if it is
/// already indirect.
fn both_ways(k: usize, form: &mut Form, renderer: &mut SceneRenderer, view: &View) -> Result<[Mode; 2]> {
    renderer.draw(form.technique.as_mut(), view, Copy::Nothing)?;
    let own = renderer.list.submission;
    // For a GPU-driven form, the host selects in the other mode.
    let other = if own == Submission::Indirect { Submission::Direct } else { Submission::Indirect };
    let mode = |submission| Mode { form: k, submission, commands: 0, draws: 0, triangles: 0, times: Vec::new() };
    Ok([own, other].map(mode))
}

impl Measured {
    /// Returns the rows and the trace, and frees the renderers.
    pub fn finish(self) -> (Profile, Value) {
        (self.profile, self.trace)
    }

    /// Captures a frame of the slowest mode with RenderDoc. Returns the capture's file and the name of the mode.
    ///
    /// # Errors
    /// If drawing or the capture fails.
    pub fn capture_worst(&mut self, renderdoc: &RenderDoc) -> Result<(std::path::PathBuf, String)> {
        let rows = self.profile.modes.iter().zip(&self.modes);
        let (row, mode) = rows.max_by(|a, b| a.0.frame_us.total_cmp(&b.0.frame_us)).expect("a form has two modes");
        let renderer = &mut self.renderers[mode.form];
        renderer.submission = Some(mode.submission);
        let technique = self.forms[mode.form].technique.as_mut();
        let (_, path) = renderdoc.capture(|| renderer.draw(technique, &self.view, Copy::Nothing))?;
        Ok((path, format!("{} {}", row.form, row.submission)))
    }
}

/// Summarises all frames as rows and a trace. `list` is the draw list of all probed frames.
fn summary(list: &DrawList, mut probed: Vec<ProbedFrame>, modes: &[Mode], forms: &[Form]) -> Result<(Profile, Value)> {
    for frame in &probed {
        let same = frame.draws.iter().map(|d| &d.piece).eq(probed[0].draws.iter().map(|d| &d.piece));
        ensure!(same, "{}: the technique draws different lists for the same view", forms[0].name);
    }
    let draws: Vec<_> = (0..probed[0].draws.len()).map(|k| draw_row(list, &probed, k)).collect();
    let names = probed[0].passes.iter().map(|(pass, _)| *pass);
    let passes = names.enumerate().map(|(k, pass)| {
        let us = |frame: &ProbedFrame| frame.passes.get(k).map_or(0.0, |(_, span)| span.us());
        PassRow::new(pass, Estimate::of(probed.iter().map(us)), &draws)
    });
    let names = probed[0].steps.iter().map(|(step, _)| *step);
    let steps = names
        .enumerate()
        .map(|(k, step)| StepRow::new(step, Estimate::of(probed.iter().map(|frame| frame.steps[k].1.us()))));
    let (passes, steps) = (passes.collect(), steps.collect());
    let device_us = |frame: &ProbedFrame| frame.passes.iter().map(|(_, span): &(_, Span)| span.us()).sum::<f64>();
    probed.sort_by(|a, b| device_us(a).total_cmp(&device_us(b)));
    let median = &probed[(probed.len() - 1) / 2];
    let clock = if median.is_calibrated { "calibrated" } else { "aligned, not calibrated" }.to_string();
    let clock_deviation_us = rounded(median.deviation_us);
    let facts = json!({ "clock": clock, "clock_deviation_us": clock_deviation_us });
    let trace = trace::document(&timeline::tracks(median, &draws), &timeline::counters(median, &draws), facts);
    let frames = probed.len() as u32;
    let modes = modes.iter().map(|mode| mode_row(mode, &modes[0], &forms[mode.form].name)).collect();
    Ok((Profile { frames, clock, clock_deviation_us, steps, passes, draws, modes }, trace))
}

/// Makes the row of the `k`-th measured piece of the draw list.
fn draw_row(list: &DrawList, probed: &[ProbedFrame], k: usize) -> DrawRow {
    let ProbedDraw { piece, counts, .. } = &probed[0].draws[k];
    let draws = &list.draws[piece.draws.clone()];
    let levels = probed::levels(list, draws);
    let of_all = |of: fn(&crate::draw::Draw) -> usize| draws.iter().map(|d| of(d) as u64).sum();
    let time = Estimate::of(probed.iter().map(|frame| frame.draws[k].span.us())).rounded();
    DrawRow {
        label: piece.label.clone(),
        pass: "terrain".to_string(),
        pipeline: probe::pipeline_name(draws[0].source, draws[0].topology).to_string(),
        batch: piece.draws.start,
        draws: draws.len(),
        level_min: levels.map(|[low, _]| low),
        level_max: levels.map(|[_, high]| high),
        instances: of_all(|d| d.instances.len()),
        vertices: of_all(|d| d.indices.len() * d.instances.len()),
        triangles: of_all(|d| d.topology.triangles(d.indices.len()) * d.instances.len()),
        gpu_us: time.median,
        gpu_us_low: time.low,
        gpu_us_high: time.high,
        vertices_run: counts.map(|c| c.vertices),
        clipping_invocations: counts.map(|c| c.clipped),
        clipping_primitives: counts.map(|c| c.primitives),
        fragments_run: counts.map(|c| c.fragments),
    }
}

fn submission_name(submission: Submission) -> &'static str {
    match submission {
        Submission::Direct => "direct",
        Submission::Indirect => "indirect",
        Submission::GpuDriven => "driven",
    }
}

/// Makes the row of a mode; ratios are relative to `base`.
fn mode_row(mode: &Mode, base: &Mode, form: &str) -> ModeRow {
    let us = |of: fn(&Times) -> f64| Estimate::of(mode.times.iter().map(|t| 1e3 * of(t))).rounded();
    let ratio = |of: fn(&Times) -> f64| {
        let pairs = mode.times.iter().zip(&base.times);
        Estimate::of(pairs.map(|(own, base)| of(own) / of(base).max(f64::MIN_POSITIVE))).rounded()
    };
    let (record, gpu) = (us(|t| t.record_ms), us(|t| t.gpu.total_ms));
    let (record_ratio, gpu_ratio) = (ratio(|t| t.record_ms), ratio(|t| t.gpu.total_ms));
    let a_draw = |us: f64| rounded(us / mode.draws.max(1) as f64);
    ModeRow {
        form: form.to_string(),
        submission: submission_name(mode.submission).to_string(),
        commands: mode.commands,
        draws: mode.draws,
        triangles: mode.triangles,
        select_us: us(|t| t.select_ms).median,
        upload_us: us(|t| t.upload_ms).median,
        record_us: record.median,
        record_us_low: record.low,
        record_us_high: record.high,
        record_us_per_draw: a_draw(record.median),
        record_ratio: record_ratio.median,
        record_ratio_low: record_ratio.low,
        record_ratio_high: record_ratio.high,
        gpu_us: gpu.median,
        gpu_us_low: gpu.low,
        gpu_us_high: gpu.high,
        gpu_us_per_draw: a_draw(gpu.median),
        gpu_ratio: gpu_ratio.median,
        gpu_ratio_low: gpu_ratio.low,
        gpu_ratio_high: gpu_ratio.high,
        frame_us: us(|t| t.frame_ms).median,
    }
}
