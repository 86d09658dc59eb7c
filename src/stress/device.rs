//! Checks the images that a GPU draws: no sky through terrain, exactly the triangles of the list, and equal bytes for
//! equal frames.

use std::sync::Arc;

use anyhow::{Context, Result};

use super::case::{Case, Flight, Kind, StressTerrain};
use super::finding::Finding;
use super::forms::TechniqueConfig;
use super::image_checker::ImageChecker;
use super::invariants::Violation;
use crate::draw::layout::Frame;
use crate::draw::{PipelineRequirements, expand};
use crate::gpu::Gpu;
use crate::height::Field;
use crate::lod::Technique;
use crate::plan::{Look, ScenePlan};
use crate::scene::holes::Truth;
use crate::scene::{self, Copy, Scene, SceneRenderer};
use crate::view::View;

/// Frames of a flight that are drawn.
const FRAMES: usize = 8;

/// Maximum width and height of an image, pixels. Larger views are drawn at this size with the same lens.
const MAX_PX: u32 = 128;

/// An [`ImageChecker`] that draws with Vulkan.
pub struct DeviceImageChecker {
    gpu: Arc<Gpu>,
    look: Look,
}

/// Results of the views drawn so far.
struct ImageResults {
    holes: usize,
    holes_at: Option<Violation>,
    drawn: Result<(), Violation>,
    again: Result<(), Violation>,
}

impl DeviceImageChecker {
    /// Creates a checker that draws with a device.
    pub fn new(gpu: Arc<Gpu>) -> Self {
        Self { gpu, look: Look::default() }
    }

    /// Closes the device and returns its validation messages.
    pub fn close(self) -> Vec<String> {
        Gpu::close(self.gpu)
    }

    fn plan(&self, field: &Field, requirements: PipelineRequirements) -> Result<ScenePlan> {
        scene::plan(&self.gpu, field, &self.look, None, requirements)
    }

    fn renderer(&self, field: &Arc<Field>, technique: &dyn Technique, size: [u32; 2]) -> Result<SceneRenderer> {
        let plan = self.plan(field, technique.pipeline_requirements())?;
        self.scene(field, &plan).renderer(technique, size)
    }

    fn scene<'a>(&'a self, field: &'a Arc<Field>, plan: &'a ScenePlan) -> Scene<'a> {
        Scene { gpu: &self.gpu, field, plan, look: &self.look, overlay: None }
    }

    /// Draws views in order and checks each.
    fn check_views(
        &self,
        field: &Arc<Field>,
        config: &TechniqueConfig,
        views: &[(&'static str, View)],
    ) -> Result<Vec<Finding>> {
        let mut technique = config.entry.prepare(field, &config.settings).map_err(anyhow::Error::msg)?;
        let mut results = ImageResults { holes: 0, holes_at: None, drawn: Ok(()), again: Ok(()) };
        let mut renderer: Option<(SceneRenderer, [u32; 2])> = None;
        for (name, view) in views {
            let view = View { size: view.size.map(|side| side.min(MAX_PX)), ..*view };
            if renderer.as_ref().is_none_or(|(_, size)| *size != view.size) {
                renderer = Some((self.renderer(field, technique.as_ref(), view.size)?, view.size));
            }
            let Some((renderer, _)) = &mut renderer else { continue };
            self.check_frame(field, technique.as_mut(), renderer, (name, view), &mut results).context(*name)?;
        }
        Ok(results.findings())
    }

    fn check_frame(
        &self,
        field: &Arc<Field>,
        technique: &mut dyn Technique,
        renderer: &mut SceneRenderer,
        named: (&'static str, View),
        results: &mut ImageResults,
    ) -> Result<()> {
        let view = &named.1;
        let violation = |why: &str| Err(Violation::new(named, why));
        renderer.draw(technique, view, Copy::PictureAndDepth)?;
        renderer.complete()?;
        let picture = renderer.picture();
        let plan = self.plan(field, PipelineRequirements::default())?;
        let scene = self.scene(field, &plan);
        let holes = Truth::new(&scene, view)?.hole_pixels(&scene, view, &picture)?.len();
        if holes > 0 && results.holes_at.is_none() {
            results.holes_at = Some(Violation::new(named, format!("{holes} pixels of sky where terrain is")));
        }
        results.holes += holes;
        if renderer.captures() && !is_as_listed(field, technique, renderer, view)? {
            results.drawn =
                results.drawn.clone().and(violation("the device draws other triangles than the list contains"));
        }
        if technique.is_settled() {
            renderer.draw(technique, view, Copy::PictureAndDepth)?;
            renderer.complete()?;
            if technique.is_settled() && renderer.picture() != picture {
                results.again = results.again.clone().and(violation("the same frame gives another image"));
            }
        }
        Ok(())
    }
}

/// Returns true if the triangles captured on the device equal those of the list, to the bit.
fn is_as_listed(field: &Field, technique: &dyn Technique, renderer: &mut SceneRenderer, view: &View) -> Result<bool> {
    let placing = Frame::placing(field, view);
    let expanded = [
        expand::triangles(field, &placing, technique.resident(), &renderer.list),
        expand::skirts(field, &placing, technique.resident(), &renderer.list),
    ];
    let captured = renderer.capture(technique, view)?;
    Ok(captured.iter().zip(&expanded).all(|(there, here)| there.iter().map(|t| t.drawn).eq(here.iter().copied())))
}

impl ImageResults {
    fn findings(self) -> Vec<Finding> {
        let holes = Finding::within("pixels of sky through terrain", self.holes as f64, 0.0);
        vec![
            Finding { violation: self.holes_at, ..holes },
            Finding::holds("the device draws the list", self.drawn),
            Finding::holds("same frame twice, same picture", self.again),
        ]
    }
}

impl ImageChecker for DeviceImageChecker {
    fn check(&mut self, case: &Case, config: &TechniqueConfig) -> Vec<Finding> {
        let (field, views) = match &case.kind {
            Kind::Terrain(terrain) => {
                let StressTerrain { field, views } = terrain();
                (field, views)
            }
            Kind::Flight(flight) => {
                let Flight { field, views } = flight();
                (field, views.into_iter().take(FRAMES).map(|view| ("a frame", view)).collect())
            }
            Kind::PerTechnique(_) | Kind::Standalone(..) => return Vec::new(),
        };
        let findings = self.check_views(&field, config, &views);
        findings.unwrap_or_else(|e| vec![Finding::within("drawn", 1.0, 0.0).with_reason(Some(format!("{e:#}")))])
    }

    fn device_loss(&self) -> Option<String> {
        self.gpu.is_lost().then(|| self.gpu.loss())
    }

    fn picture(&mut self, field: &Arc<Field>, config: &TechniqueConfig, view: &View) -> Option<image::RgbaImage> {
        let mut technique = config.entry.prepare(field, &config.settings).ok()?;
        let view = View { size: view.size.map(|side| side.clamp(MAX_PX / 2, 4 * MAX_PX)), ..*view };
        let mut renderer = self.renderer(field, technique.as_ref(), view.size).ok()?;
        renderer.draw(technique.as_mut(), &view, Copy::PictureAndDepth).ok()?;
        renderer.complete().ok()?;
        Some(renderer.picture())
    }
}
