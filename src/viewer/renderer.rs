//! Everything of one window on the device, and how a frame is made of it.

use std::sync::Arc;
use std::time::Instant;

use anyhow::Result;

use super::Setup;
use super::hud::Painted;
use crate::draw::{DrawList, Submission};
use crate::gpu::frames::Frames;
use crate::gpu::hud::Hud;
use crate::gpu::swapchain::{Surface, Swapchain, Window};
use crate::gpu::terrain::Terrain;
use crate::gpu::{Gpu, Instance, target};
use crate::lod::{Entry, Settings, Technique};
use crate::plan::{Look, ScenePlan};
use crate::texture::virtual_overlay;
use crate::view::View;

/// Device, window target, terrain and technique.
pub struct WindowRenderer {
    terrain: Terrain,
    hud: Hud,
    frames: Frames,
    swapchain: Swapchain,
    gpu: Arc<Gpu>,
    technique: Box<dyn Technique>,
    list: DrawList,
    range: [f32; 2],
    /// Whether lists are looked at on the host before they are drawn.
    reads_lists: bool,
    /// What the last frame took and held.
    pub stats: FrameStats,
}

/// Figures of one frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameStats {
    /// Selection, milliseconds.
    pub select_ms: f64,
    /// Recording, milliseconds.
    pub record_ms: f64,
    /// The device, milliseconds; of a frame before.
    pub gpu_ms: f64,
    /// Triangles.
    pub triangles: u64,
    /// Draws.
    pub draws: usize,
    /// What the tolerance was multiplied by: 1 where it was kept.
    pub tolerance_scale: f64,
    /// Error allowed, pixels.
    pub tolerance_px: f64,
    /// The texels laid over in parts, if any are.
    pub maps: Option<virtual_overlay::VirtualTextureStats>,
}

/// What a frame shows.
pub struct FrameRequest<'a> {
    /// From where.
    pub view: &'a View,
    /// How.
    pub look: &'a Look,
    /// Whether the last selection stays.
    pub frozen: bool,
    /// Whether a copy is wanted.
    pub wants_copy: bool,
}

/// A frame that was shown.
pub struct Shown {
    /// Its copy, if one was wanted and the window's pictures can be copied.
    pub copy: Option<image::RgbaImage>,
}

/// What the scene needs.
fn plan(gpu: &Gpu, setup: &Setup, look: &Look, technique: &dyn Technique) -> Result<ScenePlan> {
    let (limits, picture) = (gpu.device_limits(), setup.overlay.as_ref().map(|picture| picture.dimensions().into()));
    let plan = ScenePlan::builder(&setup.field, look, &limits).overlay(picture).windowed();
    plan.requirements(technique.pipeline_requirements()).build().map_err(anyhow::Error::msg)
}

impl WindowRenderer {
    /// Makes everything for a window.
    pub fn new(setup: &Setup, instance: &Arc<Instance>, window: Arc<dyn Window>) -> Result<Self> {
        let surface = Surface::new(instance, window)?;
        let gpu = Gpu::for_window(instance, &setup.choice, |candidate| surface.is_shown_by(candidate))?;
        let mut swapchain = Swapchain::new(&gpu, surface, setup.vsync)?;
        let (entry, settings) = &setup.technique;
        let technique = entry.prepare(&setup.field, settings).map_err(anyhow::Error::msg)?;
        let plan = plan(&gpu, setup, &setup.look, technique.as_ref())?;
        swapchain.set_depth(plan.has_depth())?;
        let formats = swapchain.formats();
        Ok(Self {
            terrain: Terrain::new(
                &gpu,
                &plan,
                &setup.field,
                setup.overlay.as_ref(),
                technique.device_geometry(),
                formats,
            )?,
            hud: Hud::new(&gpu, formats)?,
            frames: Frames::new(&gpu, plan.measured)?,
            swapchain,
            technique,
            list: DrawList::default(),
            range: setup.field.range(),
            reads_lists: plan.reads_lists(),
            stats: FrameStats::default(),
            gpu,
        })
    }

    /// The device's name.
    pub fn device(&self) -> &str {
        &self.gpu.candidate.name
    }

    /// Changes the look: pipelines, and what is laid over in parts.
    pub fn set_look(&mut self, setup: &Setup, look: &Look) -> Result<()> {
        let plan = plan(&self.gpu, setup, look, self.technique.as_ref())?;
        let before = self.swapchain.formats();
        self.swapchain.set_depth(plan.has_depth())?;
        let formats = self.swapchain.formats();
        if formats != before {
            self.hud.reformat(formats)?;
        }
        self.reads_lists = plan.reads_lists();
        self.terrain.replan(&plan, &setup.field, setup.overlay.as_ref(), formats)
    }

    /// Changes the technique: its geometry, the slots' room, and pipelines for what it needs.
    pub fn set_technique(&mut self, setup: &Setup, look: &Look, entry: &Entry, settings: &Settings) -> Result<()> {
        self.technique = entry.prepare(&setup.field, settings).map_err(anyhow::Error::msg)?;
        self.list.clear();
        self.terrain.retarget(self.technique.device_geometry())?;
        self.set_look(setup, look)
    }

    /// The size of the next frame in a window of this size; `None` while it is minimised.
    pub fn fit(&mut self, window: [u32; 2]) -> Result<Option<[u32; 2]>> {
        self.swapchain.fit(window)
    }

    /// Draws and shows a frame; `overlay` lays out what lies over it, from its figures. `None`: the window could
    /// not take it, and the frame was dropped before anything was selected.
    pub fn show(
        &mut self,
        setup: &Setup,
        request: &FrameRequest,
        overlay: impl FnOnce(&FrameStats) -> Painted,
    ) -> Result<Option<Shown>> {
        let copy = if request.wants_copy { self.swapchain.screenshot().ok() } else { None };
        let mut recording = self.frames.begin()?;
        let slot = recording.slot;
        let Some(image) = self.swapchain.acquire(recording.slot)? else { return Ok(None) };
        let started = Instant::now();
        if request.frozen {
            // They were made when the list was drawn first.
            self.list.uploads.clear();
        } else {
            // Where there is too much for the device the host widens the tolerance until it fits.
            let selects_on_gpu =
                self.terrain.gpu_selector().is_some() && self.list.tolerance_scale == 1.0 && !self.reads_lists;
            self.list.clear();
            let select = if selects_on_gpu { <dyn Technique>::select_on_gpu } else { <dyn Technique>::select };
            select(self.technique.as_mut(), request.view, &mut self.list);
        }
        self.terrain.overlay.see(request.view, self.technique.resident(), &self.list);
        self.stats.select_ms = ms(started);
        // Draws that the device finds are those of a frame before, which has finished.
        if let (Submission::GpuDriven, Some(gpu_selector)) = (self.list.submission, self.terrain.gpu_selector()) {
            gpu_selector.read_draws(slot, &mut self.list);
        }
        let list = &self.list;
        (self.stats.triangles, self.stats.draws) = (list.triangles(), list.draws.len());
        (self.stats.tolerance_scale, self.stats.tolerance_px) = (list.tolerance_scale, request.view.tolerance.px);
        let mut overlay = overlay(&self.stats);
        self.hud.update(std::mem::take(&mut overlay.textures))?;
        let started = Instant::now();
        self.terrain.overlay.look(&mut recording, request.view)?;
        self.stats.maps = self.terrain.overlay.stats();
        let frame = request.look.frame(&setup.field, request.view, self.range);
        self.terrain.prepare(&mut recording, &frame, &self.list)?;
        self.terrain.select(&mut recording, &self.list)?;
        target::begin(&recording, image.attachment, self.swapchain.depth());
        self.terrain.draw(&mut recording, &self.list)?;
        let Painted { primitives, pixels_per_point, .. } = &mut overlay;
        self.hud.draw(&mut recording, request.view.size, *pixels_per_point, primitives)?;
        target::end(&recording);
        self.swapchain.finish(&recording, &image, copy.as_ref());
        self.stats.record_ms = ms(started);
        self.frames.submit(Some(image.wait), Some(image.signal))?;
        self.swapchain.present(&image)?;
        self.stats.gpu_ms = self.frames.timing.total_ms;
        if copy.is_some() {
            self.frames.finish()?;
        }
        Ok(Some(Shown { copy: copy.map(|copy| copy.picture()) }))
    }
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
