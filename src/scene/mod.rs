//! One field with one look on one device, drawn offscreen: pictures, draw lists and times for those who measure.

pub mod capture;
mod deep;
pub mod holes;
mod parts;
pub mod picture;
pub mod probed;
pub mod savings;

use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result};

use crate::draw::{DrawList, Submission};
use crate::gpu::frames::{Frames, Timing};
use crate::gpu::gpu_tile_cache::VirtualTextureStats;
use crate::gpu::pipelines::Pipelines;
use crate::gpu::slot::Part;
use crate::gpu::target::Offscreen;
use crate::gpu::terrain::Terrain;
use crate::gpu::{Gpu, capture::Capture, probe::Probe, shading_only::ShadingOnly};
use crate::height::Field;
use crate::lod::Technique;
use crate::plan::{Look, ScenePlan};
use crate::view::View;

/// What is drawn, and on what.
#[derive(Clone)]
pub struct Scene<'a> {
    /// The device.
    pub gpu: &'a Arc<Gpu>,
    /// The field.
    pub field: &'a Arc<Field>,
    /// What the scene needs.
    pub plan: &'a ScenePlan,
    /// How it looks.
    pub look: &'a Look,
    /// The picture laid over it.
    pub overlay: Option<&'a image::RgbaImage>,
}

/// A scene made ready on the device for one technique and one size of pictures.
pub struct SceneRenderer {
    frames: Frames,
    terrain: Terrain,
    shading_only: Option<ShadingOnly>,
    capture: Option<Capture>,
    probe: Option<Probe>,
    offscreen: Offscreen,
    /// What draws with depth where the plan has none.
    deep: Option<Pipelines>,
    gpu: Arc<Gpu>,
    field: Arc<Field>,
    plan: ScenePlan,
    look: Look,
    range: [f32; 2],
    /// Seconds since the sun stood where the look says.
    pub time_s: f64,
    /// How draws reach the device, if not as the technique says.
    pub submission: Option<Submission>,
    /// What was drawn last.
    pub list: DrawList,
}

/// What one frame took, milliseconds.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Times {
    /// From the start of selection until the device has finished.
    pub frame_ms: f64,
    /// Selection.
    pub select_ms: f64,
    /// Writing the frame's data for the device and recording its uploads.
    pub upload_ms: f64,
    /// Recording the commands, those of a selection on the device included.
    pub record_ms: f64,
    /// The device, pass by pass.
    pub gpu: Timing,
}

/// One picture and how it came about.
pub struct RenderResult {
    /// Colours; alpha says where land was drawn, half of it where a skirt was.
    pub picture: image::RgbaImage,
    /// What was drawn.
    pub list: DrawList,
    /// What it took; medians if it was drawn several times.
    pub times: Times,
    /// Device bytes in use while it was drawn.
    pub device_bytes: u64,
    /// The texels laid over in parts, if any are.
    pub maps: Option<VirtualTextureStats>,
}

/// What a frame copies back to the host after the device's work was timed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Copy {
    /// Nothing.
    Nothing,
    /// The colours: [`SceneRenderer::picture`].
    Picture,
    /// Colours and depth: [`SceneRenderer::depth`] too.
    PictureAndDepth,
}

impl<'a> Scene<'a> {
    /// Makes it ready for a technique.
    pub fn renderer(&self, technique: &dyn Technique, size: [u32; 2]) -> Result<SceneRenderer> {
        let kept = technique.device_geometry();
        let formats = Offscreen::formats(self.plan.has_depth());
        let mut offscreen = Offscreen::new(self.gpu, size)?;
        if self.plan.has_depth() {
            offscreen.add_depth(self.gpu)?;
        }
        Ok(SceneRenderer {
            frames: Frames::new(self.gpu, self.plan.measured)?,
            terrain: Terrain::new(self.gpu, self.plan, self.field, self.overlay, kept, formats)?,
            shading_only: None,
            capture: None,
            probe: None,
            offscreen,
            deep: None,
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
    pub fn render(&self, technique: &mut dyn Technique, view: &View, times: u32) -> Result<RenderResult> {
        let mut renderer = self.renderer(technique, view.size)?;
        // Before anything is timed: a picture does not depend on how fast maps are made.
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
    /// Waits until the texels laid over in parts are as fine as a view needs.
    pub fn settle(&mut self, technique: &mut dyn Technique, view: &View) -> Result<()> {
        if self.plan.reads_lists() {
            self.select(technique, view);
        }
        self.terrain.overlay.settle(&self.gpu, view)
    }

    /// What is held of the texels laid over in parts, if any are.
    pub fn maps(&self) -> Option<VirtualTextureStats> {
        self.terrain.overlay.stats()
    }

    /// Selects and draws a view, and waits until the device has finished. Where a selection on the device finds more than
    /// its tables hold, the host finds the tolerance at which it fits, and the frame is drawn again under that.
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
            // No tolerance says what the host selects then.
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
        self.frames.counts_passed = copy == Copy::PictureAndDepth;
        let before = self.select_in_parts(technique, view)?;
        let select_ms = ms(started);
        let list = std::mem::take(&mut self.list);
        let last = self.record_part(view, &list, &Part { before, is_last: true });
        self.list = list;
        let (upload_ms, recorded) = last?;
        let recording = self.frames.resume();
        if copy != Copy::Nothing {
            self.offscreen.read_back(&recording);
        }
        if copy == Copy::PictureAndDepth && self.plan.has_depth() {
            self.offscreen.read_back_depth(&recording);
        }
        let record_ms = ms(recorded);
        self.frames.submit(None, None)?;
        self.frames.finish().context("drawing")?;
        self.read_draws();
        let (frame_ms, gpu) = (ms(started), self.frames.timing.clone());
        if copy == Copy::PictureAndDepth && !self.plan.has_depth() {
            self.draw_deep(view)?;
        }
        Ok(Times { frame_ms, select_ms, upload_ms, record_ms, gpu })
    }

    /// Selects on the device if that can and nothing else is asked for; and shows the list to what is laid over in parts.
    fn select(&mut self, technique: &mut dyn Technique, view: &View) {
        self.list.clear();
        let own = self.submission.unwrap_or(Submission::GpuDriven);
        if own == Submission::GpuDriven && self.terrain.gpu_selector().is_some() && !self.plan.reads_lists() {
            technique.select_on_gpu(view, &mut self.list);
        } else {
            technique.select(view, &mut self.list);
            self.list.submission = self.submission.unwrap_or(self.list.submission);
        }
        self.terrain.overlay.see(view, technique.resident(), &self.list);
    }

    /// The draws that the device found itself, once the frame has finished.
    fn read_draws(&mut self) {
        if let (Submission::GpuDriven, Some(gpu_selector)) = (self.list.submission, self.terrain.gpu_selector()) {
            gpu_selector.read_draws(gpu_selector.newest(), &mut self.list);
        }
    }

    /// Makes the list whole: instances that the device found itself are read back.
    pub fn complete(&mut self) -> Result<()> {
        if let (Submission::GpuDriven, Some(gpu_selector)) = (self.list.submission, self.terrain.gpu_selector()) {
            let count = self.list.draws.iter().map(|draw| draw.instances.end).max().unwrap_or(0);
            if self.list.instances.len() < count as usize {
                self.list.instances = gpu_selector.read_instances(count as usize)?;
            }
        }
        Ok(())
    }

    /// The same fragment work as the last frame's without its triangles: one pass over the whole picture, fed
    /// the depth that the last frame left. `view` is that frame's.
    pub fn draw_shading_only(&mut self, view: &View, copy: Copy) -> Result<Times> {
        if !self.plan.has_depth() {
            self.draw_deep(view)?;
        }
        if self.shading_only.is_none() {
            let layout = self.terrain.set_layout();
            self.shading_only = Some(ShadingOnly::new(&self.gpu, &self.plan, layout, &self.offscreen)?);
        }
        let shading_only = self.shading_only.as_ref().expect("just made");
        let frame = self.look.after(self.time_s).frame(&self.field, view, self.range);
        let started = Instant::now();
        let mut recording = self.frames.begin()?;
        self.terrain.overlay.look(&mut recording, view)?;
        self.terrain.prepare(&mut recording, &frame, &DrawList::default())?;
        let upload_ms = ms(started);
        let recorded = Instant::now();
        let scene = self.terrain.scene_set(&recording);
        shading_only.draw(&mut recording, &self.offscreen, scene)?;
        if copy != Copy::Nothing {
            self.offscreen.read_back(&recording);
        }
        let record_ms = ms(recorded);
        self.frames.submit(None, None)?;
        self.frames.finish().context("drawing the shading-only baseline")?;
        Ok(Times { frame_ms: ms(started), select_ms: 0.0, upload_ms, record_ms, gpu: self.frames.timing.clone() })
    }

    /// The last frame's colours, if it copied them; alpha says where land was drawn.
    pub fn picture(&self) -> image::RgbaImage {
        self.offscreen.picture()
    }

    /// The last frame's depth, row by row from the top, if it copied it: near plane distance over distance along
    /// the view axis in a perspective view, 0 where there is no land.
    pub fn depth(&self) -> Vec<f32> {
        self.offscreen.depth_values()
    }
}

impl Times {
    /// Each time's median; the passes are those of the frame with the median device time.
    ///
    /// # Panics
    /// If there are none.
    pub fn median(mut frames: Vec<Times>) -> Times {
        frames.sort_by(|a, b| a.gpu.total_ms.total_cmp(&b.gpu.total_ms));
        let of = |time: fn(&Times) -> f64| median(frames.iter().map(time).collect());
        Times {
            frame_ms: of(|t| t.frame_ms),
            select_ms: of(|t| t.select_ms),
            upload_ms: of(|t| t.upload_ms),
            record_ms: of(|t| t.record_ms),
            gpu: frames[frames.len() / 2].gpu.clone(),
        }
    }
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
