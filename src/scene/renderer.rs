//! The renderer of a scene: selects and draws one view after the other offscreen.

use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result};

use super::source::TechniqueSource;
use super::times::Times;
use crate::draw::layout::Frame;
use crate::draw::{DrawList, Submission};
use crate::gpu::Gpu;
use crate::gpu::frame_renderer::{FrameInput, FrameRenderer, HostSteps, SameList};
use crate::gpu::gpu_tile_cache::VirtualTextureStats;
use crate::gpu::pass::Pass;
use crate::gpu::passes::capture::Capture;
use crate::gpu::passes::shading_only::ShadingOnly;
use crate::gpu::target::{Copies, Offscreen};
use crate::gpu::terrain::SceneInput;
use crate::height::Field;
use crate::lod::Technique;
use crate::plan::{Look, ScenePlan};
use crate::view::View;

/// A field, its look, and the device that draws it.
#[derive(Clone)]
pub struct Scene<'a> {
    /// The device.
    pub gpu: &'a Arc<Gpu>,
    /// The field.
    pub field: &'a Arc<Field>,
    /// Features of the scene's pipelines and resources.
    pub plan: &'a ScenePlan,
    /// The look.
    pub look: &'a Look,
    /// A picture draped over the field.
    pub overlay: Option<&'a image::RgbaImage>,
}

/// A scene made ready on the device for one technique and one size of pictures.
pub struct SceneRenderer {
    pub(super) renderer: FrameRenderer,
    shading_only: Option<ShadingOnly>,
    pub(super) capture: Option<Capture>,
    pub(super) offscreen: Offscreen,
    pub(super) gpu: Arc<Gpu>,
    field: Arc<Field>,
    pub(super) plan: ScenePlan,
    look: Look,
    range: [f32; 2],
    /// Seconds since the sun stood where the look says.
    pub time_s: f64,
    /// Submission of all draws; `None`: as the technique says.
    pub submission: Option<Submission>,
    /// The list drawn last.
    pub list: DrawList,
}

/// One picture, its draw list and its times.
pub struct RenderResult {
    /// Colours. Alpha is 255 on terrain, half of that on a skirt, and 0 elsewhere.
    pub picture: image::RgbaImage,
    /// The list drawn last.
    pub list: DrawList,
    /// Times; medians if the view was drawn several times.
    pub times: Times,
    /// Device bytes in use during drawing.
    pub device_bytes: u64,
    /// Statistics of the virtual texture, if there is one.
    pub maps: Option<VirtualTextureStats>,
}

/// Copies of a frame to the host, made after the device's work was timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Copy {
    /// None.
    Nothing,
    /// The colours: [`SceneRenderer::picture`].
    Picture,
    /// Colours and depth: [`SceneRenderer::depth`] too.
    PictureAndDepth,
}

impl<'a> Scene<'a> {
    /// Makes the scene ready for a technique, for pictures of a size in pixels.
    ///
    /// # Errors
    /// If the scene exceeds a limit of the device, or its memory.
    pub fn renderer(&self, technique: &dyn Technique, size: [u32; 2]) -> Result<SceneRenderer> {
        let formats = Offscreen::formats(self.plan.has_depth());
        let mut offscreen = Offscreen::new(self.gpu, size)?;
        if self.plan.has_depth() {
            offscreen.add_depth(self.gpu)?;
        }
        let scene = SceneInput { plan: self.plan, field: self.field, overlay: self.overlay };
        Ok(SceneRenderer {
            renderer: FrameRenderer::new(self.gpu, scene, technique.device_geometry(), formats, size)?,
            shading_only: None,
            capture: None,
            offscreen,
            gpu: Arc::clone(self.gpu),
            field: Arc::clone(self.field),
            plan: self.plan.clone(),
            look: *self.look,
            range: self.field.range(),
            time_s: 0.0,
            submission: None,
            list: DrawList::default(),
        })
    }

    /// Draws one view `times` times; the times are medians.
    ///
    /// # Errors
    /// If the device fails.
    pub fn render(&self, technique: &mut dyn Technique, view: &View, times: u32) -> Result<RenderResult> {
        let mut renderer = self.renderer(technique, view.size)?;
        // Before anything is timed, so that the picture does not depend on the speed of loading.
        renderer.settle(technique, view)?;
        let drawn = (0..times.max(1)).map(|_| renderer.draw(technique, view, Copy::Picture)).collect::<Result<_>>()?;
        let device_bytes = self.gpu.device_bytes().values().sum();
        renderer.complete()?;
        let maps = renderer.maps();
        Ok(RenderResult {
            picture: renderer.picture(),
            maps,
            list: renderer.list,
            times: Times::median(drawn),
            device_bytes,
        })
    }
}

impl SceneRenderer {
    /// Waits until the virtual texture is as fine as a view needs.
    ///
    /// # Errors
    /// If the device fails.
    pub fn settle(&mut self, technique: &mut dyn Technique, view: &View) -> Result<()> {
        let overlay = &mut self.renderer.terrain.overlay;
        if self.plan.reads_lists() {
            TechniqueSource::select_whole(technique, view, self.submission, &mut self.list);
            overlay.see(view, technique.resident(), &self.list);
        }
        overlay.settle(&self.gpu, view)
    }

    /// Statistics of the virtual texture, if there is one.
    pub fn maps(&self) -> Option<VirtualTextureStats> {
        self.renderer.terrain.overlay.stats()
    }

    /// Selects and draws a view, and waits until the device has finished. If a selection on the device overflows its
    /// tables, the host finds the tolerance at which the list fits, and the frame is drawn again under that tolerance.
    ///
    /// # Errors
    /// If the device fails.
    pub fn draw(&mut self, technique: &mut dyn Technique, view: &View, copy: Copy) -> Result<Times> {
        let times = self.draw_once(technique, view, copy)?;
        if self.list.submission != Submission::GpuDriven || self.list.tolerance_scale == 1.0 {
            return Ok(times);
        }
        let started = Instant::now();
        self.list.clear();
        technique.select(view, &mut self.list);
        let (tolerance_scale, search_ms) = (self.list.tolerance_scale, ms(started));
        let wider = if tolerance_scale.is_finite() {
            self.draw_once(technique, &view.under_wider_tolerance(tolerance_scale), copy)?
        } else {
            // No tolerance fits, so the host selects by its own rules.
            let submission = self.submission.replace(Submission::default());
            let drawn = self.draw_once(technique, view, copy);
            self.submission = submission;
            drawn?
        };
        self.list.tolerance_scale = tolerance_scale;
        let frame_ms = times.frame_ms + search_ms + wider.frame_ms;
        Ok(Times { frame_ms, select_ms: times.select_ms + search_ms + wider.select_ms, ..wider })
    }

    fn draw_once(&mut self, technique: &mut dyn Technique, view: &View, copy: Copy) -> Result<Times> {
        let started = Instant::now();
        let has_depth = self.plan.has_depth();
        let wants_depth = copy == Copy::PictureAndDepth;
        let copies = Copies { colour: copy != Copy::Nothing, depth: wants_depth && has_depth };
        let input = FrameInput { view, uniforms: self.uniforms(view), counts_passed: wants_depth, only: None };
        let mut source = TechniqueSource::new(technique, view, self.submission);
        let mut target = self.offscreen.target(has_depth, copies);
        let steps = self.renderer.render(input, &mut source, &mut self.list, &mut target)?;
        self.read_draws();
        let times = self.times(started, steps)?;
        if wants_depth && !has_depth {
            self.draw_deep(view)?;
        }
        Ok(times)
    }

    /// Returns the uniforms of a frame at the renderer's time.
    pub(super) fn uniforms(&self, view: &View) -> Frame {
        self.look.after(self.time_s).frame(&self.field, view, self.range)
    }

    fn times(&self, started: Instant, steps: Option<HostSteps>) -> Result<Times> {
        let steps = steps.context("an offscreen picture always has an image")?;
        let of = |[start, end]: [Instant; 2]| (end - start).as_secs_f64() * 1e3;
        Ok(Times {
            frame_ms: ms(started),
            select_ms: of(steps.select),
            upload_ms: of(steps.upload),
            record_ms: of(steps.record),
            gpu: self.renderer.timing().clone(),
        })
    }

    /// Draws the last list again with a depth buffer and copies that, for a plan without depth. The picture copied
    /// before stays.
    fn draw_deep(&mut self, view: &View) -> Result<()> {
        self.offscreen.add_depth(&self.gpu)?;
        self.renderer.add_depth()?;
        let input = FrameInput { view, uniforms: self.uniforms(view), counts_passed: false, only: None };
        let mut target = self.offscreen.target(true, Copies { colour: false, depth: true });
        self.renderer.render(input, &mut SameList, &mut self.list, &mut target)?;
        Ok(())
    }

    /// Reads the draws that the device found, once the frame has finished.
    fn read_draws(&mut self) {
        if let (Submission::GpuDriven, Some(selector)) = (self.list.submission, self.renderer.terrain.gpu_selector()) {
            selector.read_draws(selector.newest(), &mut self.list);
        }
    }

    /// Completes the list: reads back the instances that the device found.
    ///
    /// # Errors
    /// If the device fails.
    pub fn complete(&mut self) -> Result<()> {
        if let (Submission::GpuDriven, Some(selector)) = (self.list.submission, self.renderer.terrain.gpu_selector()) {
            let count = self.list.draws.iter().map(|draw| draw.instances.end).max().unwrap_or(0);
            if self.list.instances.len() < count as usize {
                self.list.instances = selector.read_instances(count as usize)?;
            }
        }
        Ok(())
    }

    /// Draws the fragment work of the last frame without its triangles: one full-screen pass that reads the depth of
    /// the last frame. `view` is that frame's.
    ///
    /// # Errors
    /// If the device fails.
    pub fn draw_shading_only(&mut self, view: &View, copy: Copy) -> Result<Times> {
        if !self.plan.has_depth() {
            self.draw_deep(view)?;
        }
        let mut pass = match self.shading_only.take() {
            Some(pass) => pass,
            None => ShadingOnly::new(&self.gpu, &self.plan, &self.renderer.terrain, &self.offscreen)?,
        };
        let copies = Copies { colour: copy != Copy::Nothing, depth: false };
        let started = Instant::now();
        let steps = self.draw_only(&mut pass, view, &mut DrawList::default(), copies)?;
        let times = self.times(started, Some(steps))?;
        self.shading_only = Some(pass);
        Ok(Times { select_ms: 0.0, ..times })
    }

    /// Draws a frame of one pass, and waits until the device has finished.
    pub(super) fn draw_only(
        &mut self,
        pass: &mut dyn Pass,
        view: &View,
        list: &mut DrawList,
        copies: Copies,
    ) -> Result<HostSteps> {
        let input = FrameInput { view, uniforms: self.uniforms(view), counts_passed: false, only: Some(pass) };
        let mut target = self.offscreen.target(true, copies);
        let steps = self.renderer.render(input, &mut SameList, list, &mut target)?;
        steps.context("an offscreen picture always has an image")
    }

    /// Colours of the last frame that copied them. Alpha is 0 where there is no terrain.
    pub fn picture(&self) -> image::RgbaImage {
        self.offscreen.picture()
    }

    /// Depth of the last frame that copied it, row by row from the top. In a perspective view it is the distance of the
    /// near plane divided by the distance along the view axis; 0 where there is no terrain.
    pub fn depth(&self) -> Vec<f32> {
        self.offscreen.depth_values()
    }
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
