//! Frames in parts: what was selected first is drawn while the rest is being selected.

use std::time::Instant;

use anyhow::Result;

use super::{SceneRenderer, deep, ms};
use crate::draw::{DrawList, Limits};
use crate::gpu::slot::Part;
use crate::gpu::target;
use crate::lod::Technique;
use crate::view::View;

impl SceneRenderer {
    /// Selects, and submits what is ready before all is; how much of the list that was.
    pub(super) fn select_in_parts(&mut self, technique: &mut dyn Technique, view: &View) -> Result<Limits> {
        if self.submission.is_some() || self.terrain.gpu_selector().is_some() || self.plan.reads_lists() {
            self.select(technique, view);
            return Ok(Limits::default());
        }
        let (mut before, mut submitted) = (Limits::default(), Ok(()));
        let mut list = std::mem::take(&mut self.list);
        list.clear();
        technique.select_in_parts(view, &mut list, &mut |list| {
            if submitted.is_ok() {
                submitted = self.submit_part(view, list, &Part { before, is_last: false });
                before = list.size();
            }
        });
        self.list = list;
        submitted.map(|()| before)
    }

    fn submit_part(&mut self, view: &View, list: &DrawList, part: &Part) -> Result<()> {
        self.record_part(view, list, part)?;
        self.frames.submit_part()
    }

    /// Records a part of a list, or all of it, from the frame's begin on if it is the first one. How long it took to write its
    /// data for the device and to record its uploads, milliseconds, and when the recording of commands began after that.
    pub(super) fn record_part(&mut self, view: &View, list: &DrawList, part: &Part) -> Result<(f64, Instant)> {
        let frame = self.look.after(self.time_s).frame(&self.field, view, self.range);
        let (colour, depth) = (self.offscreen.attachment(), deep::attachment(&self.plan, &self.offscreen));
        let mut recording = if part.is_first() { self.frames.begin()? } else { self.frames.resume() };
        let started = Instant::now();
        if part.is_first() {
            self.terrain.overlay.look(&mut recording, view)?;
        }
        self.terrain.prepare_part(&mut recording, &frame, list, part)?;
        let (upload_ms, recorded) = (ms(started), Instant::now());
        self.terrain.select(&mut recording, list)?;
        if part.is_first() {
            target::begin(&recording, colour, depth);
        } else {
            target::go_on(&recording, colour, depth);
        }
        self.terrain.draw_part(&mut recording, list, part)?;
        target::end(&recording);
        Ok((upload_ms, recorded))
    }
}
