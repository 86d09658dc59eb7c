//! The renderer of one window: device, swapchain, HUD and technique.

use std::sync::Arc;

use anyhow::Result;

use super::setup::Setup;
use crate::draw::{DrawList, Geometry, Submission};
use crate::gpu::frame_renderer::{Allowed, DrawSource, FrameInput, FrameRenderer};
use crate::gpu::passes::hud::{Hud, Painted};
use crate::gpu::swapchain::{Surface, Swapchain, Window};
use crate::gpu::target::Selected;
use crate::gpu::terrain::SceneInput;
use crate::gpu::window_target::WindowTarget;
use crate::gpu::{Gpu, Instance};
use crate::lod::{Entry, Settings, Technique};
use crate::plan::{Look, ScenePlan};
use crate::texture::virtual_overlay;
use crate::view::View;

/// Device, swapchain, HUD and technique of one window.
pub struct WindowRenderer {
    renderer: FrameRenderer,
    hud: Hud,
    swapchain: Swapchain,
    gpu: Arc<Gpu>,
    technique: Box<dyn Technique>,
    list: DrawList,
    range: [f32; 2],
    /// Times and counts of the last frame.
    pub stats: FrameStats,
}

/// Times and counts of one frame.
#[derive(Clone, Copy, Debug, Default)]
pub struct FrameStats {
    /// Selection, milliseconds.
    pub select_ms: f64,
    /// Uploads and recording, milliseconds.
    pub record_ms: f64,
    /// Device time of an earlier frame, milliseconds.
    pub gpu_ms: f64,
    /// Triangles.
    pub triangles: u64,
    /// Draws.
    pub draws: usize,
    /// Factor by which the tolerance was increased; 1 if it was kept.
    pub tolerance_scale: f64,
    /// Tolerance, pixels.
    pub tolerance_px: f64,
    /// Statistics of the virtual texture, if there is one.
    pub maps: Option<virtual_overlay::VirtualTextureStats>,
}

/// A frame to show.
pub struct FrameRequest<'a> {
    /// The view.
    pub view: &'a View,
    /// The look.
    pub look: &'a Look,
    /// True if the last list is drawn again.
    pub frozen: bool,
    /// True if the frame is copied.
    pub wants_copy: bool,
}

/// A frame that was shown.
pub struct Shown {
    /// The copy of the frame, if one was wanted and the window's images can be copied.
    pub copy: Option<image::RgbaImage>,
}

/// Makes the plan of the scene.
fn plan(gpu: &Gpu, setup: &Setup, look: &Look, technique: &dyn Technique) -> Result<ScenePlan> {
    let (limits, picture) = (gpu.device_limits(), setup.overlay.as_ref().map(|picture| picture.dimensions().into()));
    let plan = ScenePlan::builder(&setup.field, look, &limits).overlay(picture).windowed();
    plan.requirements(technique.pipeline_requirements()).build().map_err(anyhow::Error::msg)
}

fn scene<'a>(setup: &'a Setup, plan: &'a ScenePlan) -> SceneInput<'a> {
    SceneInput { plan, field: &setup.field, overlay: setup.overlay.as_ref() }
}

impl WindowRenderer {
    /// Makes device, swapchain, HUD and technique for a window.
    ///
    /// # Errors
    /// If no device can present to the window, or the scene exceeds its limits.
    pub fn new(setup: &Setup, instance: &Arc<Instance>, window: Arc<dyn Window>) -> Result<Self> {
        let surface = Surface::new(instance, window)?;
        let gpu = Gpu::for_window(instance, &setup.choice, |candidate| surface.is_shown_by(candidate))?;
        let mut swapchain = Swapchain::new(&gpu, surface, setup.vsync)?;
        let (entry, settings) = &setup.technique;
        let technique = entry.prepare(&setup.field, settings).map_err(anyhow::Error::msg)?;
        (setup.on_prepared)();
        let plan = plan(&gpu, setup, &setup.look, technique.as_ref())?;
        swapchain.set_depth(plan.has_depth())?;
        let (formats, size) = (swapchain.formats(), setup.view.size);
        let renderer = FrameRenderer::new(&gpu, scene(setup, &plan), technique.device_geometry(), formats, size)?;
        Ok(Self {
            hud: Hud::new(&gpu, renderer.overlay_formats())?,
            renderer,
            swapchain,
            technique,
            list: DrawList::default(),
            range: setup.field.range(),
            stats: FrameStats::default(),
            gpu,
        })
    }

    /// Name of the device.
    pub fn device(&self) -> &str {
        &self.gpu.candidate.name
    }

    /// Changes the look. Waits for the device.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn set_look(&mut self, setup: &Setup, look: &Look) -> Result<()> {
        let plan = plan(&self.gpu, setup, look, self.technique.as_ref())?;
        let before = self.renderer.overlay_formats();
        self.swapchain.set_depth(plan.has_depth())?;
        self.renderer.replan(scene(setup, &plan), self.swapchain.formats())?;
        let formats = self.renderer.overlay_formats();
        if formats != before { self.hud.reformat(formats) } else { Ok(()) }
    }

    /// Changes the technique: its geometry, the sizes of the frame buffers, and the pipelines. Waits for the device.
    ///
    /// # Errors
    /// If the technique does not fit the field or the device.
    pub fn set_technique(&mut self, setup: &Setup, look: &Look, entry: &Entry, settings: &Settings) -> Result<()> {
        self.technique = entry.prepare(&setup.field, settings).map_err(anyhow::Error::msg)?;
        self.list.clear();
        self.renderer.retarget(self.technique.device_geometry())?;
        self.set_look(setup, look)
    }

    /// Returns the size of the next frame in a window of this size, pixels; `None` while it is minimised.
    ///
    /// # Errors
    /// If the device fails.
    pub fn fit(&mut self, window: [u32; 2]) -> Result<Option<[u32; 2]>> {
        let size = self.swapchain.fit(window)?;
        size.map(|size| self.renderer.fit(size)).transpose()?;
        Ok(size)
    }

    /// Draws and shows a frame. `overlay` lays out the HUD from the frame's numbers. Returns `None` if the window could not
    /// take the frame, which was dropped before selection.
    ///
    /// # Errors
    /// If the device fails.
    pub fn show(
        &mut self,
        setup: &Setup,
        request: &FrameRequest,
        overlay: impl FnOnce(&FrameStats) -> Painted,
    ) -> Result<Option<Shown>> {
        let Self { renderer, hud, swapchain, technique, list, stats, .. } = self;
        let copy = if request.wants_copy { swapchain.screenshot().ok() } else { None };
        let (view, mut overlay) = (request.view, Some(overlay));
        let mut source = ShownSource { technique: technique.as_mut(), request };
        let lay_out = |frame: &Selected, list: &mut DrawList| {
            stats.select(frame, list, view);
            overlay.take().map_or_else(Painted::default, |overlay| overlay(stats))
        };
        let mut target = WindowTarget::new(swapchain, hud, copy.as_ref(), lay_out);
        let uniforms = request.look.frame(&setup.field, view, self.range);
        let input = FrameInput { view, uniforms, counts_passed: false, only: None };
        let Some(steps) = renderer.render(input, &mut source, list, &mut target)? else { return Ok(None) };
        stats.record_ms = (steps.record[1] - steps.upload[0]).as_secs_f64() * 1e3;
        stats.gpu_ms = renderer.timing().total_ms;
        stats.maps = renderer.terrain.overlay.stats();
        Ok(Some(Shown { copy: copy.map(|copy| copy.picture()) }))
    }
}

impl FrameStats {
    /// Takes over the numbers of a frame that was selected.
    fn select(&mut self, frame: &Selected, list: &mut DrawList, view: &View) {
        self.select_ms = frame.select_ms;
        // The draws that the device finds are those of an earlier frame, which has finished.
        if let (Submission::GpuDriven, Some(selector)) = (list.submission, frame.terrain.gpu_selector()) {
            selector.read_draws(frame.slot, list);
        }
        (self.triangles, self.draws) = (list.triangles(), list.draws.len());
        (self.tolerance_scale, self.tolerance_px) = (list.tolerance_scale, view.tolerance.px);
    }
}

/// Selects the view of a request, or keeps the last list of a frozen one.
struct ShownSource<'a> {
    technique: &'a mut dyn Technique,
    request: &'a FrameRequest<'a>,
}

impl DrawSource for ShownSource<'_> {
    fn select(&mut self, allowed: Allowed, list: &mut DrawList, _: &mut dyn FnMut(&DrawList)) {
        if self.request.frozen {
            // The uploads were made when the list was drawn first.
            list.uploads.clear();
            return;
        }
        // After an overflow on the device the host finds a tolerance that fits.
        let on_gpu = allowed.on_gpu && list.tolerance_scale == 1.0;
        list.clear();
        if on_gpu {
            self.technique.select_on_gpu(self.request.view, list);
        } else {
            self.technique.select(self.request.view, list);
        }
    }

    fn resident(&self) -> Option<&Geometry> {
        Some(self.technique.resident())
    }
}
