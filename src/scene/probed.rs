//! One frame of a stage with queries around every draw, and the host's steps on the same line of time.

use std::time::Instant;

use anyhow::{Context, Result};

use super::{Copy, SceneRenderer, deep};
use crate::draw::{Draw, DrawList, Submission};
use crate::gpu::clock::Clock;
use crate::gpu::probe::{self, Counts, Measured, Piece, Probe};
use crate::gpu::target;
use crate::lod::Technique;
use crate::view::View;

/// A stretch of time: microseconds from the start of selection.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Span {
    /// When it began.
    pub start_us: f64,
    /// When it ended.
    pub end_us: f64,
}

/// A draw of the list, or the rest of them, as the device ran it.
#[derive(Clone, Debug)]
pub struct ProbedDraw {
    /// Which draws, and their name.
    pub piece: Piece,
    /// When.
    pub span: Span,
    /// The programs run, where the device has statistics.
    pub counts: Option<Counts>,
}

/// What is known of one frame.
#[derive(Clone, Debug)]
pub struct ProbedFrame {
    /// What the host did, in order.
    pub steps: Vec<(&'static str, Span)>,
    /// The passes on the device, in order; where two overlapped, the time belongs to the earlier one.
    pub passes: Vec<(&'static str, Span)>,
    /// The draws of the pass `terrain`, in order.
    pub draws: Vec<ProbedDraw>,
    /// Whether the driver read its clock beside the host's; else the device's work lies where its submission and
    /// its end allow.
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

/// The name of a draw: technique, what its indices address and make, levels, and its number in the list.
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

/// The finest and the coarsest level among the instances of some draws.
pub fn levels(list: &DrawList, draws: &[Draw]) -> Option<[u32; 2]> {
    let instances = draws.iter().flat_map(|draw| draw.instances.clone()).map(|k| list.instances[k as usize].level);
    instances.fold(None, |range: Option<[u32; 2]>, level| {
        Some(range.map_or([level; 2], |[low, high]| [low.min(level), high.max(level)]))
    })
}

/// The host's steps while a frame goes on.
struct Steps {
    origin: Instant,
    done: Vec<(&'static str, [Instant; 2])>,
}

impl Steps {
    fn time<T>(&mut self, name: &'static str, step: impl FnOnce() -> T) -> T {
        let started = Instant::now();
        let result = step();
        self.done.push((name, [started, Instant::now()]));
        result
    }

    fn instants(&self, name: &str) -> [Instant; 2] {
        self.done.iter().find(|(done, _)| *done == name).map_or([self.origin; 2], |(_, instants)| *instants)
    }
}

impl SceneRenderer {
    /// Selects and draws a view with queries around every draw, up to [`probe::DRAWS`] of them, and waits until the
    /// device has finished. `name` is the technique's. Where the device finds the draws itself, a frame before tells
    /// which there are.
    pub fn draw_probed(&mut self, technique: &mut dyn Technique, name: &str, view: &View) -> Result<ProbedFrame> {
        if self.probe.is_none() {
            self.probe = Some(Probe::new(&self.gpu)?);
        }
        self.find_draws(technique, view)?;
        let probe = self.probe.take().expect("just made");
        let found = std::mem::take(&mut self.list);
        let mut steps = Steps { origin: Instant::now(), done: Vec::new() };
        steps.time("select", || self.select(technique, view));
        if self.list.submission == Submission::GpuDriven {
            (self.list.draws, self.list.instances) = (found.draws, found.instances);
        }
        let cut = probe::pieces(&self.list.draws, probe::DRAWS);
        let pieces: Vec<_> =
            cut.into_iter().map(|draws| Piece { label: label(name, &self.list, draws.clone()), draws }).collect();
        let clock = Clock::calibrated(&self.gpu, steps.origin)?;
        self.submit_probed(&mut steps, view, &probe, &pieces)?;
        let measured = probe.read(pieces.len())?;
        self.probe = Some(probe);
        let passes = &self.frames.timing.ticks;
        let (first, last) = (passes.first().context("no pass")?[0], passes.last().context("no pass")?[1]);
        let clock = clock.unwrap_or_else(|| {
            let (submitted, finished) = (steps.instants("submit")[0], steps.instants("wait")[1]);
            Clock::aligned(&self.gpu, steps.origin, [first, last], [submitted, finished])
        });
        Ok(self.probed_frame(&steps, pieces, &measured, &clock))
    }

    fn find_draws(&mut self, technique: &mut dyn Technique, view: &View) -> Result<()> {
        if self.terrain.gpu_selector().is_some() {
            self.draw(technique, view, Copy::Nothing)?;
            self.complete()?;
        }
        Ok(())
    }

    fn submit_probed(&mut self, steps: &mut Steps, view: &View, probe: &Probe, pieces: &[Piece]) -> Result<()> {
        let frame = self.look.frame(&self.field, view, self.range);
        let mut recording = self.frames.begin()?;
        steps.time("upload", || {
            self.terrain.overlay.look(&mut recording, view)?;
            self.terrain.prepare(&mut recording, &frame, &self.list)
        })?;
        steps.time("record", || {
            self.terrain.select(&mut recording, &self.list)?;
            target::begin(&recording, self.offscreen.attachment(), deep::attachment(&self.plan, &self.offscreen));
            self.terrain.draw_probed(&mut recording, &self.list, probe, pieces)?;
            target::end(&recording);
            self.offscreen.read_back(&recording);
            anyhow::Ok(())
        })?;
        steps.time("submit", || self.frames.submit(None, None))?;
        steps.time("wait", || self.frames.finish()).context("drawing")
    }

    fn probed_frame(&self, steps: &Steps, pieces: Vec<Piece>, measured: &[Measured], clock: &Clock) -> ProbedFrame {
        let span = |[start, end]: [u64; 2]| Span { start_us: clock.us(start), end_us: clock.us(end) };
        let host = |[start, end]: [Instant; 2]| Span { start_us: clock.host_us(start), end_us: clock.host_us(end) };
        let timing = &self.frames.timing;
        let mut before = f64::NEG_INFINITY;
        let passes = timing.passes.iter().zip(&timing.ticks).map(|((name, _), &ticks)| {
            let Span { start_us, end_us } = span(ticks);
            let start_us = start_us.max(before);
            before = end_us.max(start_us);
            (*name, Span { start_us, end_us: before })
        });
        let draws = pieces.into_iter().zip(measured);
        ProbedFrame {
            steps: steps.done.iter().map(|(name, instants)| (*name, host(*instants))).collect(),
            passes: passes.collect(),
            draws: draws.map(|(piece, m)| ProbedDraw { piece, span: span(m.ticks), counts: m.counts }).collect(),
            is_calibrated: clock.is_calibrated,
            deviation_us: clock.deviation_us,
        }
    }
}
