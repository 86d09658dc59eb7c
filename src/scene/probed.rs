//! One frame with queries around every draw, and the host's steps on the same time line.

use std::time::Instant;

use anyhow::{Context, Result};

use super::renderer::{Copy, SceneRenderer};
use super::source::TechniqueSource;
use crate::draw::{Draw, DrawList, Geometry, Submission};
use crate::gpu::clock::Clock;
use crate::gpu::frame_renderer::{Allowed, DrawSource, FrameInput, HostSteps};
use crate::gpu::frames::Timing;
use crate::gpu::probe::{self, Counts, Measured, Piece};
use crate::gpu::target::Copies;
use crate::lod::Technique;
use crate::view::View;

/// A time span, microseconds from the start of selection.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Span {
    /// Start.
    pub start_us: f64,
    /// End.
    pub end_us: f64,
}

/// A draw of the list, or several together, as the device ran it.
#[derive(Clone, Debug)]
pub struct ProbedDraw {
    /// The draws and their name.
    pub piece: Piece,
    /// Time on the device.
    pub span: Span,
    /// Shader invocations and primitives, if the device has pipeline statistics.
    pub counts: Option<Counts>,
}

/// Times and counts of one frame.
#[derive(Clone, Debug)]
pub struct ProbedFrame {
    /// Steps of the host, in order.
    pub steps: Vec<(&'static str, Span)>,
    /// The passes on the device, in order; where two overlapped, the time belongs to the earlier one.
    pub passes: Vec<(&'static str, Span)>,
    /// The draws of the pass `terrain`, in order.
    pub draws: Vec<ProbedDraw>,
    /// True if the driver read its clock together with the host's. Otherwise the device's work is placed between its
    /// submission and its end.
    pub is_calibrated: bool,
    /// Microseconds by which the device's times may be shifted against the host's.
    pub deviation_us: f64,
}

impl Span {
    /// Its length, microseconds.
    pub fn us(&self) -> f64 {
        self.end_us - self.start_us
    }
}

/// Returns the name of draws: technique, pipeline, levels, and number in the list.
fn label(technique: &str, list: &DrawList, draws: std::ops::Range<usize>) -> String {
    let first = &list.draws[draws.start];
    let pipeline = probe::pipeline_name(first.source, first.topology);
    let batch = if draws.len() == 1 {
        format!("batch {}", draws.start)
    } else {
        format!("batches {} to {}", draws.start, draws.end - 1)
    };
    let level = match levels(list, &list.draws[draws]) {
        None => "no instance".to_string(),
        Some([low, high]) if low == high => format!("level {low}"),
        Some([low, high]) => format!("levels {low} to {high}"),
    };
    format!("{technique} {pipeline} {level} {batch}")
}

/// Returns the lowest and the highest level among the instances of some draws.
pub fn levels(list: &DrawList, draws: &[Draw]) -> Option<[u32; 2]> {
    let instances = draws.iter().flat_map(|draw| draw.instances.clone()).map(|k| list.instances[k as usize].level);
    instances.fold(None, |range: Option<[u32; 2]>, level| {
        Some(range.map_or([level; 2], |[low, high]| [low.min(level), high.max(level)]))
    })
}

/// A technique whose draws are measured one by one.
struct ProbedSource<'a> {
    inner: TechniqueSource<'a>,
    technique: &'a str,
    /// The draws and instances of an earlier frame, for a list that the device fills.
    found: DrawList,
    pieces: Vec<Piece>,
}

impl DrawSource for ProbedSource<'_> {
    fn select(&mut self, allowed: Allowed, list: &mut DrawList, ready: &mut dyn FnMut(&DrawList)) {
        self.inner.select(Allowed { in_parts: false, ..allowed }, list, ready);
    }

    fn resident(&self) -> Option<&Geometry> {
        self.inner.resident()
    }

    fn pieces(&mut self, list: &mut DrawList) -> Option<&[Piece]> {
        if list.submission == Submission::GpuDriven {
            let DrawList { draws, instances, .. } = std::mem::take(&mut self.found);
            (list.draws, list.instances) = (draws, instances);
        }
        let cut = probe::pieces(&list.draws, probe::DRAWS).into_iter();
        self.pieces = cut.map(|draws| Piece { label: label(self.technique, list, draws.clone()), draws }).collect();
        Some(&self.pieces)
    }
}

impl SceneRenderer {
    /// Selects and draws a view with queries around every draw, up to [`probe::DRAWS`] of them, and waits until the
    /// device has finished. `name` is the technique's. If the device finds the draws, an earlier frame tells their number.
    ///
    /// # Errors
    /// If the device has no timestamps, or fails.
    pub fn draw_probed(&mut self, technique: &mut dyn Technique, name: &str, view: &View) -> Result<ProbedFrame> {
        self.renderer.add_probe()?;
        if self.renderer.terrain.gpu_selector().is_some() {
            self.draw(technique, view, Copy::Nothing)?;
            self.complete()?;
        }
        let found = std::mem::take(&mut self.list);
        let inner = TechniqueSource::new(technique, view, self.submission);
        let mut source = ProbedSource { inner, technique: name, found, pieces: Vec::new() };
        let input = FrameInput { view, uniforms: self.uniforms(view), counts_passed: false, only: None };
        let mut target = self.offscreen.target(self.plan.has_depth(), Copies { colour: true, depth: false });
        let steps = self.renderer.render(input, &mut source, &mut self.list, &mut target)?;
        let steps = steps.context("an offscreen picture always has an image")?;
        let measured = self.renderer.measured(source.pieces.len())?;
        let timing = self.renderer.timing();
        let (first, last) = (timing.ticks.first().context("no pass")?[0], timing.ticks.last().context("no pass")?[1]);
        let origin = steps.select[0];
        let clock = Clock::calibrated(&self.gpu, origin)?
            .unwrap_or_else(|| Clock::aligned(&self.gpu, origin, [first, last], [steps.submit[0], steps.wait[1]]));
        Ok(probed_frame(&steps, timing, source.pieces, &measured, &clock))
    }
}

fn probed_frame(
    steps: &HostSteps,
    timing: &Timing,
    pieces: Vec<Piece>,
    measured: &[Measured],
    clock: &Clock,
) -> ProbedFrame {
    let span = |[start, end]: [u64; 2]| Span { start_us: clock.us(start), end_us: clock.us(end) };
    let host = |[start, end]: [Instant; 2]| Span { start_us: clock.host_us(start), end_us: clock.host_us(end) };
    let mut before = f64::NEG_INFINITY;
    let passes = timing.passes.iter().zip(&timing.ticks).map(|((name, _), &ticks)| {
        let Span { start_us, end_us } = span(ticks);
        let start_us = start_us.max(before);
        before = end_us.max(start_us);
        (*name, Span { start_us, end_us: before })
    });
    let HostSteps { select, upload, record, submit, wait } = *steps;
    let steps = [("select", select), ("upload", upload), ("record", record), ("submit", submit), ("wait", wait)];
    let draws = pieces.into_iter().zip(measured);
    ProbedFrame {
        steps: steps.map(|(name, instants)| (name, host(instants))).to_vec(),
        passes: passes.collect(),
        draws: draws.map(|(piece, m)| ProbedDraw { piece, span: span(m.ticks), counts: m.counts }).collect(),
        is_calibrated: clock.is_calibrated,
        deviation_us: clock.deviation_us,
    }
}
