//! What a device draws in the suite: no sky through land, the triangles that the list says, the same bytes twice.

use std::sync::Arc;

use anyhow::{Context, Result};

use super::invariants::Violation;
use super::{Case, Finding, Flight, Form, ImageChecker, Kind, StressTerrain};
use crate::draw::expand;
use crate::draw::layout::Frame;
use crate::gpu::Gpu;
use crate::height::Field;
use crate::lod::Technique;
use crate::plan::{Look, ScenePlan};
use crate::scene::holes::Truth;
use crate::scene::{Copy, Scene, SceneRenderer};
use crate::view::View;

/// Of a flight so many frames are drawn.
const FRAMES: usize = 8;

/// Pictures are at most so many pixels wide and high: larger views are drawn smaller, with the same lens.
const MAX_PX: u32 = 128;

/// Looks through a device.
pub struct DeviceImageChecker {
    gpu: Arc<Gpu>,
    look: Look,
}

/// What was seen so far.
struct Seen {
    holes: usize,
    holes_at: Option<Violation>,
    drawn: Result<(), Violation>,
    again: Result<(), Violation>,
}

impl DeviceImageChecker {
    /// Through this one.
    pub fn new(gpu: Arc<Gpu>) -> Self {
        Self { gpu, look: Look::default() }
    }

    /// Hands the device back; validation messages.
    pub fn close(self) -> Vec<String> {
        Gpu::close(self.gpu)
    }

    fn plan(&self, field: &Field, technique: &dyn Technique) -> Result<ScenePlan> {
        let plan = ScenePlan::builder(field, &self.look, &self.gpu.device_limits());
        plan.requirements(technique.pipeline_requirements()).build().map_err(anyhow::Error::msg)
    }

    fn renderer(&self, field: &Arc<Field>, technique: &dyn Technique, size: [u32; 2]) -> Result<SceneRenderer> {
        let plan = self.plan(field, technique)?;
        self.scene(field, &plan).renderer(technique, size)
    }

    fn scene<'a>(&'a self, field: &'a Arc<Field>, plan: &'a ScenePlan) -> Scene<'a> {
        Scene { gpu: &self.gpu, field, plan, look: &self.look, overlay: None }
    }

    /// Draws views in turn and looks at each.
    fn look_at(&self, field: &Arc<Field>, form: &Form, views: &[(&'static str, View)]) -> Result<Vec<Finding>> {
        let mut technique = form.entry.prepare(field, &form.settings).map_err(anyhow::Error::msg)?;
        let mut seen = Seen { holes: 0, holes_at: None, drawn: Ok(()), again: Ok(()) };
        let mut renderer: Option<(SceneRenderer, [u32; 2])> = None;
        for (name, view) in views {
            let view = View { size: view.size.map(|side| side.min(MAX_PX)), ..*view };
            if renderer.as_ref().is_none_or(|(_, size)| *size != view.size) {
                renderer = Some((self.renderer(field, technique.as_ref(), view.size)?, view.size));
            }
            let Some((renderer, _)) = &mut renderer else { continue };
            self.frame(field, technique.as_mut(), renderer, (name, view), &mut seen).context(*name)?;
        }
        Ok(seen.findings())
    }

    fn frame(
        &self,
        field: &Arc<Field>,
        technique: &mut dyn Technique,
        renderer: &mut SceneRenderer,
        named: (&'static str, View),
        seen: &mut Seen,
    ) -> Result<()> {
        let view = &named.1;
        let violation = |why: &str| Err(Violation::new(named, why));
        renderer.draw(technique, view, Copy::PictureAndDepth)?;
        renderer.complete()?;
        let picture = renderer.picture();
        let plan =
            ScenePlan::builder(field, &self.look, &self.gpu.device_limits()).build().map_err(anyhow::Error::msg)?;
        let scene = self.scene(field, &plan);
        let holes = Truth::new(&scene, view)?.hole_pixels(&scene, view, &picture)?.len();
        if holes > 0 && seen.holes_at.is_none() {
            seen.holes_at = Some(Violation::new(named, format!("{holes} pixels of sky where land is")));
        }
        seen.holes += holes;
        if renderer.captures() && !is_as_listed(field, technique, renderer, view)? {
            seen.drawn = seen.drawn.clone().and(violation("the device draws other triangles than the list says"));
        }
        if technique.is_settled() {
            renderer.draw(technique, view, Copy::PictureAndDepth)?;
            renderer.complete()?;
            if technique.is_settled() && renderer.picture() != picture {
                seen.again = seen.again.clone().and(violation("the same frame has another picture"));
            }
        }
        Ok(())
    }
}

/// Whether the triangles captured on the device are those of the list, to the bit.
fn is_as_listed(field: &Field, technique: &dyn Technique, renderer: &mut SceneRenderer, view: &View) -> Result<bool> {
    let placing = Frame::placing(field, view);
    let expanded = [
        expand::triangles(field, &placing, technique.resident(), &renderer.list),
        expand::skirts(field, &placing, technique.resident(), &renderer.list),
    ];
    let captured = renderer.capture(technique, view)?;
    Ok(captured.iter().zip(&expanded).all(|(there, here)| there.iter().map(|t| t.drawn).eq(here.iter().copied())))
}

impl Seen {
    fn findings(self) -> Vec<Finding> {
        let holes = Finding::within("pixels of sky through land", self.holes as f64, 0.0);
        vec![
            Finding { violation: self.holes_at, ..holes },
            Finding::holds("the device draws the list", self.drawn),
            Finding::holds("same frame twice, same picture", self.again),
        ]
    }
}

impl ImageChecker for DeviceImageChecker {
    fn look(&mut self, case: &Case, form: &Form) -> Vec<Finding> {
        let (field, views) = match &case.kind {
            Kind::Terrain(terrain) => {
                let StressTerrain { field, views } = terrain();
                (field, views)
            }
            Kind::Flight(flight) => {
                let Flight { field, views } = flight();
                (field, views.into_iter().take(FRAMES).map(|view| ("a frame", view)).collect())
            }
            Kind::Each(_) | Kind::Alone(..) => return Vec::new(),
        };
        let looked = self.look_at(&field, form, &views);
        looked.unwrap_or_else(|e| vec![Finding::within("drawn", 1.0, 0.0).because(Some(format!("{e:#}")))])
    }

    fn is_blind(&self) -> Option<String> {
        self.gpu.is_lost().then(|| self.gpu.loss())
    }

    fn picture(&mut self, field: &Arc<Field>, form: &Form, view: &View) -> Option<image::RgbaImage> {
        let mut technique = form.entry.prepare(field, &form.settings).ok()?;
        let view = View { size: view.size.map(|side| side.clamp(MAX_PX / 2, 4 * MAX_PX)), ..*view };
        let mut renderer = self.renderer(field, technique.as_ref(), view.size).ok()?;
        renderer.draw(technique.as_mut(), &view, Copy::PictureAndDepth).ok()?;
        renderer.complete().ok()?;
        Some(renderer.picture())
    }
}
