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
use crate::texture::picture_maps;
use crate::view::View;

/// Device, window target, terrain and technique.
pub struct Stage {
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
    pub figures: Figures,
}

/// Figures of one frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct Figures {
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
    pub widening: f64,
    /// Error allowed, pixels.
    pub tolerance_px: f64,
    /// The texels laid over in parts, if any are.
    pub maps: Option<picture_maps::Figures>,
}

/// What a frame shows.
pub struct Shot<'a> {
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
    let plan = ScenePlan::new(&setup.field, look, &limits).map_err(anyhow::Error::msg)?;
    let plan = plan.with_overlay(&setup.field, look, &limits, picture).map_err(anyhow::Error::msg)?;
    Ok(ScenePlan { windowed: true, ..plan.with_manner(technique.manner()) })
}

impl Stage {
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
            terrain: Terrain::new(&gpu, &plan, &setup.field, setup.overlay.as_ref(), technique.kept(), formats)?,
            hud: Hud::new(&gpu, formats)?,
            frames: Frames::new(&gpu, plan.measured)?,
            swapchain,
            technique,
            list: DrawList::default(),
            range: setup.field.range(),
            reads_lists: plan.reads_lists(),
            figures: Figures::default(),
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
        self.terrain.retarget(self.technique.kept())?;
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
        shot: &Shot,
        overlay: impl FnOnce(&Figures) -> Painted,
    ) -> Result<Option<Shown>> {
        let copy = if shot.wants_copy { self.swapchain.screenshot().ok() } else { None };
        let mut recording = self.frames.begin()?;
        let slot = recording.slot;
        let Some(image) = self.swapchain.acquire(recording.slot)? else { return Ok(None) };
        let started = Instant::now();
        if shot.frozen {
            // They were made when the list was drawn first.
            self.list.uploads.clear();
        } else {
            // Where there is too much for the device the host widens the tolerance until it fits.
            let is_driven = self.terrain.driven().is_some() && self.list.widening == 1.0 && !self.reads_lists;
            self.list.clear();
            let select = if is_driven { <dyn Technique>::drive } else { <dyn Technique>::select };
            select(self.technique.as_mut(), shot.view, &mut self.list);
        }
        self.terrain.overlay.see(shot.view, self.technique.resident(), &self.list);
        self.figures.select_ms = ms(started);
        // Draws that the device finds are those of a frame before, which has finished.
        if let (Submission::Driven, Some(driven)) = (self.list.submission, self.terrain.driven()) {
            driven.read_draws(slot, &mut self.list);
        }
        let list = &self.list;
        (self.figures.triangles, self.figures.draws) = (list.triangles(), list.draws.len());
        (self.figures.widening, self.figures.tolerance_px) = (list.widening, shot.view.tolerance.px);
        let mut overlay = overlay(&self.figures);
        self.hud.update(std::mem::take(&mut overlay.textures))?;
        let started = Instant::now();
        self.terrain.overlay.look(&mut recording, shot.view)?;
        self.figures.maps = self.terrain.overlay.figures();
        let frame = shot.look.frame(&setup.field, shot.view, self.range);
        self.terrain.prepare(&mut recording, &frame, &self.list)?;
        self.terrain.select(&mut recording, &self.list)?;
        target::begin(&recording, image.attachment, self.swapchain.depth());
        self.terrain.draw(&mut recording, &self.list)?;
        let Painted { primitives, pixels_per_point, .. } = &mut overlay;
        self.hud.draw(&mut recording, shot.view.size, *pixels_per_point, primitives)?;
        target::end(&recording);
        self.swapchain.finish(&recording, &image, copy.as_ref());
        self.figures.record_ms = ms(started);
        self.frames.submit(Some(image.wait), Some(image.signal))?;
        self.swapchain.present(&image)?;
        self.figures.gpu_ms = self.frames.timing.total_ms;
        if copy.is_some() {
            self.frames.finish()?;
        }
        Ok(Some(Shown { copy: copy.map(|copy| copy.picture()) }))
    }
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}
