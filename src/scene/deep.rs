//! Depths of frames that are drawn without a depth buffer: the last list drawn once more with one, for those who
//! measure.

use anyhow::{Context, Result};

use super::SceneRenderer;
use crate::gpu::pipelines::Pipelines;
use crate::gpu::target::{self, Depth, Offscreen};
use crate::plan::ScenePlan;
use crate::view::View;

/// What frames of a plan are drawn with, if they need a depth buffer.
pub(super) fn attachment<'a>(plan: &ScenePlan, offscreen: &'a Offscreen) -> Option<Depth<'a>> {
    if plan.has_depth() { offscreen.kept_depth() } else { None }
}

impl SceneRenderer {
    /// Draws the last list again with a depth buffer and copies that; the picture copied before stays. Nobody times it.
    pub(super) fn draw_deep(&mut self, view: &View) -> Result<()> {
        self.offscreen.add_depth(&self.gpu)?;
        let mut pipelines = match self.deep.take() {
            Some(pipelines) => pipelines,
            None => Pipelines::new(&self.gpu, &self.plan, Offscreen::formats(true))?,
        };
        self.terrain.exchange(&mut pipelines);
        let drawn = self.submit_deep(view);
        self.terrain.exchange(&mut pipelines);
        self.deep = Some(pipelines);
        drawn
    }

    fn submit_deep(&mut self, view: &View) -> Result<()> {
        let frame = self.look.after(self.time_s).frame(&self.field, view, self.range);
        let mut recording = self.frames.begin()?;
        self.terrain.overlay.look(&mut recording, view)?;
        self.terrain.prepare(&mut recording, &frame, &self.list)?;
        target::begin(&recording, self.offscreen.attachment(), self.offscreen.kept_depth());
        self.terrain.draw(&mut recording, &self.list)?;
        target::end(&recording);
        self.offscreen.read_back_depth(&recording);
        self.frames.submit(None, None)?;
        self.frames.finish().context("drawing with depth")
    }
}
