//! The renderer of frames: the only place that begins one.
//!
//! A frame goes through the same steps for every target: begin, acquire the images, select, record the [passes],
//! submit, present, wait. A [`DrawSource`] fills the draw list, a [`Target`] brings the images.
//!
//! [passes]: super::passes

use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result};

use super::device::Gpu;
use super::formats::{DEPTH, Formats};
use super::frames::{Frames, Timing};
use super::pass::{Pass, PassInput};
use super::pass_list::{PassList, draw_only, scene_formats};
use super::pipelines::Pipelines;
use super::probe::{Measured, Piece, Probe};
use super::slot::Part;
use super::target::{Selected, Target};
use super::terrain::{SceneInput, Terrain};
use crate::draw::layout::Frame;
use crate::draw::{DepthMode, DeviceGeometry, DrawList, Geometry, Limits};
use crate::plan::ScenePlan;
use crate::view::View;

/// Frames of one scene, drawn by one technique at a time.
pub struct FrameRenderer {
    frames: Frames,
    /// The scene's resources.
    pub terrain: Terrain,
    passes: PassList,
    /// Passes and pipelines with depth, for a plan without it.
    with_depth: Option<(PassList, Pipelines)>,
    probe: Option<Probe>,
    plan: ScenePlan,
    formats: Formats,
    size: [u32; 2],
    gpu: Arc<Gpu>,
}

/// One frame to draw.
pub struct FrameInput<'a> {
    /// The view.
    pub view: &'a View,
    /// Uniforms of the view.
    pub uniforms: Frame,
    /// Counts the fragments that pass the depth test, where the device can. It costs time.
    pub counts_passed: bool,
    /// The only pass to draw, with the uploads that it reads; `None`: all passes of the scene.
    pub only: Option<&'a mut dyn Pass>,
}

/// Ways of selection that the device and the plan allow.
#[derive(Clone, Copy, Debug)]
pub struct Allowed {
    /// The device can find the draws.
    pub on_gpu: bool,
    /// The beginning of a list may be drawn while the rest is selected.
    pub in_parts: bool,
}

/// Fills the draw lists of frames.
pub trait DrawSource {
    /// Fills the list, which holds that of the last frame before. If parts are allowed, `ready` draws the draws that are
    /// in the list by then: they must stay.
    fn select(&mut self, allowed: Allowed, list: &mut DrawList, ready: &mut dyn FnMut(&DrawList));

    /// Resident geometry of the list, if the list is a new one.
    fn resident(&self) -> Option<&Geometry>;

    /// Cuts the list into pieces that are measured one by one. Called once a frame, after selection.
    fn pieces(&mut self, _list: &mut DrawList) -> Option<&[Piece]> {
        None
    }
}

/// The list of an earlier frame, drawn again.
pub struct SameList;

impl DrawSource for SameList {
    fn select(&mut self, _: Allowed, _: &mut DrawList, _: &mut dyn FnMut(&DrawList)) {}

    fn resident(&self) -> Option<&Geometry> {
        None
    }
}

/// Steps of the host in one frame: start and end of each.
#[derive(Clone, Copy, Debug)]
pub struct HostSteps {
    /// Selection, with recording and submission of all parts but the last.
    pub select: [Instant; 2],
    /// Writing the frame's data for the device and recording the uploads.
    pub upload: [Instant; 2],
    /// Recording the other commands.
    pub record: [Instant; 2],
    /// Submission and presentation.
    pub submit: [Instant; 2],
    /// Waiting for the device, if the target waits.
    pub wait: [Instant; 2],
}

impl FrameRenderer {
    /// Makes the resources of a scene for a technique with this geometry, and the passes that the plan needs, for targets
    /// of these formats and this size in pixels.
    ///
    /// # Errors
    /// If the scene exceeds a limit of the device, or its memory.
    pub fn new(
        gpu: &Arc<Gpu>,
        scene: SceneInput,
        geometry: DeviceGeometry,
        formats: Formats,
        size: [u32; 2],
    ) -> Result<Self> {
        let plan = scene.plan;
        let frames = Frames::new(gpu, plan.measured)?;
        let terrain = Terrain::new(gpu, scene, geometry, scene_formats(plan, formats))?;
        let passes = PassList::new(gpu, plan, &terrain, formats, size)?;
        let (plan, gpu) = (plan.clone(), Arc::clone(gpu));
        Ok(Self { frames, terrain, passes, with_depth: None, probe: None, plan, formats, size, gpu })
    }

    /// Changes the look: the plan, and the formats of the target. Waits for the device. Field and picture are those that
    /// the renderer was made with.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn replan(&mut self, scene: SceneInput, formats: Formats) -> Result<()> {
        let plan = scene.plan;
        self.terrain.replan(scene, scene_formats(plan, formats))?;
        (self.plan, self.formats, self.with_depth) = (plan.clone(), formats, None);
        self.passes = PassList::new(&self.gpu, plan, &self.terrain, formats, self.size)?;
        Ok(())
    }

    /// Changes the technique. Waits for the device.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn retarget(&mut self, geometry: DeviceGeometry) -> Result<()> {
        self.terrain.retarget(geometry)
    }

    /// Changes the size of the target, pixels. Waits for the device if passes depend on it.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn fit(&mut self, size: [u32; 2]) -> Result<()> {
        self.size = size;
        if !self.passes.fits(size) {
            self.gpu.wait_idle()?;
            self.passes = PassList::new(&self.gpu, &self.plan, &self.terrain, self.formats, size)?;
            self.with_depth = None;
        }
        Ok(())
    }

    /// Makes what frames with depth need, for a plan without depth.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn add_depth(&mut self) -> Result<()> {
        if self.plan.has_depth() || self.with_depth.is_some() {
            return Ok(());
        }
        let (mut plan, formats) = (self.plan.clone(), Formats { depth: Some(DEPTH), ..self.formats });
        plan.requirements.depth_mode = DepthMode::Buffer;
        let pipelines = Pipelines::new(&self.gpu, &plan, scene_formats(&plan, formats))?;
        let passes = PassList::new(&self.gpu, &plan, &self.terrain, formats, self.size)?;
        self.with_depth = Some((passes, pipelines));
        Ok(())
    }

    /// Makes the queries of frames whose source has pieces.
    ///
    /// # Errors
    /// If the device has no timestamps.
    pub fn add_probe(&mut self) -> Result<()> {
        if self.probe.is_none() {
            self.probe = Some(Probe::new(&self.gpu)?);
        }
        Ok(())
    }

    /// Device times of the newest frame that has finished.
    pub fn timing(&self) -> &Timing {
        &self.frames.timing
    }

    /// Returns times and counts of the pieces of the last frame, once that has finished.
    ///
    /// # Errors
    /// If no probe was added, or the device fails.
    pub fn measured(&self, pieces: usize) -> Result<Vec<Measured>> {
        self.probe.as_ref().context("no queries of draws")?.read(pieces)
    }

    /// Formats of the attachments of a target's overlay.
    pub fn overlay_formats(&self) -> Formats {
        self.passes.overlay_formats()
    }

    /// Draws a frame. `list` is filled by the source; between frames it holds the draws of the last one. Returns `None`
    /// if the target has no images now: then the frame is dropped before selection.
    ///
    /// # Errors
    /// If the device fails, or a pass does.
    ///
    /// # Panics
    /// If the list exceeds the limits of its technique.
    pub fn render(
        &mut self,
        input: FrameInput,
        source: &mut dyn DrawSource,
        list: &mut DrawList,
        target: &mut dyn Target,
    ) -> Result<Option<HostSteps>> {
        self.frames.counts_passed = input.counts_passed;
        let slot = self.frames.begin()?.slot;
        if !target.acquire(slot)? {
            return Ok(None);
        }
        let is_deep = target.attachments().depth.is_some() && !self.plan.has_depth() && input.only.is_none();
        if is_deep {
            self.exchange_depth();
        }
        let drawn = self.draw(input, slot, source, list, target);
        if is_deep {
            self.exchange_depth();
        }
        drawn.map(Some)
    }

    fn draw(
        &mut self,
        mut input: FrameInput,
        slot: usize,
        source: &mut dyn DrawSource,
        list: &mut DrawList,
        target: &mut dyn Target,
    ) -> Result<HostSteps> {
        let mut instants = [Instant::now(); 5];
        let before = self.select(&mut input, source, list, target)?;
        let selected = Instant::now();
        let select_ms = (selected - instants[0]).as_secs_f64() * 1e3;
        target.selected(&Selected { terrain: &self.terrain, slot, select_ms }, list)?;
        let pieces = source.pieces(list);
        instants[1] = Instant::now();
        instants[2] = self.record(&mut input, list, &Part { before, is_last: true }, pieces, target)?;
        target.finish(&self.frames.resume());
        instants[3] = Instant::now();
        self.frames.submit(target.semaphores())?;
        target.present()?;
        instants[4] = Instant::now();
        if target.waits() {
            self.frames.finish().context("drawing")?;
        }
        let [select, upload, record, submit, wait] = instants;
        Ok(HostSteps {
            select: [select, selected],
            upload: [upload, record],
            record: [record, submit],
            submit: [submit, wait],
            wait: [wait, Instant::now()],
        })
    }

    /// Selects, and submits the parts that are ready before the whole list is. Returns their size.
    fn select(
        &mut self,
        input: &mut FrameInput,
        source: &mut dyn DrawSource,
        list: &mut DrawList,
        target: &mut dyn Target,
    ) -> Result<Limits> {
        let is_whole = self.plan.reads_lists();
        let on_gpu = self.terrain.gpu_selector().is_some();
        let allowed = Allowed { on_gpu: on_gpu && !is_whole, in_parts: !on_gpu && !is_whole };
        let (mut before, mut submitted) = (Limits::default(), Ok(()));
        source.select(allowed, list, &mut |list| {
            if submitted.is_ok() {
                let part = Part { before, is_last: false };
                submitted = self.record(input, list, &part, None, target).and_then(|_| self.frames.submit_part());
                before = list.size();
            }
        });
        submitted?;
        if let Some(resident) = source.resident() {
            self.terrain.overlay.see(input.view, resident, list);
        }
        Ok(before)
    }

    /// Records a part of a list. Returns the instant between the uploads and the other passes.
    fn record(
        &mut self,
        input: &mut FrameInput,
        list: &DrawList,
        part: &Part,
        pieces: Option<&[Piece]>,
        target: &mut dyn Target,
    ) -> Result<Instant> {
        let probe =
            pieces.map(|pieces| self.probe.as_ref().context("no queries of draws").map(|probe| (probe, pieces)));
        let (view, uniforms, attachments) = (input.view, &input.uniforms, target.attachments());
        let of_pass = PassInput { view, uniforms, list, part: *part, probe: probe.transpose()? };
        let (mut recording, scene) = (self.frames.resume(), &mut self.terrain);
        self.passes.upload(&mut recording, scene, &of_pass, input.only.as_deref())?;
        let uploaded = Instant::now();
        match &mut input.only {
            Some(pass) => draw_only(&mut **pass, &mut recording, scene, &of_pass, attachments)?,
            None => self.passes.draw(&mut recording, scene, &of_pass, attachments, target.overlay())?,
        }
        Ok(uploaded)
    }

    /// Swaps the passes and pipelines of the plan with those that have depth.
    fn exchange_depth(&mut self) {
        if let Some((passes, pipelines)) = &mut self.with_depth {
            std::mem::swap(&mut self.passes, passes);
            self.terrain.exchange(pipelines);
        }
    }
}
