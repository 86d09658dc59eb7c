//! What a stage really drew: its triangles captured on the device, and their error found there.

use anyhow::Result;

use super::SceneRenderer;
use crate::draw::expand::{self, Drawn};
use crate::draw::layout::Captured;
use crate::draw::{DrawList, Geometry, Submission};
use crate::gpu::capture::{Capture, Part};
use crate::gpu::error_pass::{self, ErrorPass, Summary};
use crate::height::surface::{Corner, doubled_area};
use crate::lod::Technique;
use crate::view::View;

/// A captured triangle: where it lies, and the positions that the rasteriser was given.
#[derive(Clone, Copy, Debug)]
pub struct AsDrawn {
    /// The triangle, as [`expand`] says it.
    pub drawn: Drawn,
    /// Corners relative to the eye, metres.
    pub relative: [[f32; 3]; 3],
}

impl SceneRenderer {
    /// Whether the device can capture.
    pub fn captures(&self) -> bool {
        self.gpu.captures
    }

    /// Every triangle of the last list's surface, and of its skirts, captured on the device for this view.
    pub fn capture(&mut self, technique: &dyn Technique, view: &View) -> Result<[Vec<AsDrawn>; 2]> {
        let mut found = [Vec::new(), Vec::new()];
        let resident = technique.resident();
        self.each_batch(resident, view, |_, batch, list, records| {
            for part in batch {
                triangles(resident, list, part, records, |drawn, corners| {
                    let relative = corners.map(|k| records[k as usize].relative);
                    found[usize::from(expand::is_upright(&drawn))].push(AsDrawn { drawn, relative });
                });
            }
            Ok(())
        })?;
        Ok(found)
    }

    /// Vertical errors in metres and screen errors in pixels of the last list, captured and measured on the device:
    /// single precision, for what is too big for [`crate::measure::geometric::errors`].
    pub fn errors(&mut self, technique: &dyn Technique, view: &View) -> Result<[Summary; 2]> {
        let resident = technique.resident();
        let mut error_pass: Option<ErrorPass> = None;
        self.each_batch(resident, view, |renderer, batch, list, records| {
            if error_pass.is_none() {
                let capture = renderer.capture.as_ref().expect("made before its first batch");
                error_pass =
                    Some(ErrorPass::new(&renderer.gpu, &renderer.plan, renderer.terrain.set_layout(), capture)?);
            }
            let error_pass = error_pass.as_mut().expect("just made");
            let mut surface = Vec::new();
            for part in batch {
                triangles(resident, list, part, records, |drawn, corners| {
                    // Skirts are no part of the surface.
                    if doubled_area(&drawn.corners) != 0 {
                        surface.push(corners);
                    }
                });
            }
            let frame = renderer.look.frame(&renderer.field, view, renderer.range);
            for some in surface.chunks(error_pass::TRIANGLES) {
                let mut recording = renderer.frames.begin()?;
                let nothing = DrawList {
                    fraction_bits: list.fraction_bits,
                    height_base: list.height_base,
                    ..DrawList::default()
                };
                renderer.terrain.prepare(&mut recording, &frame, &nothing)?;
                let scene = renderer.terrain.scene_set(&recording);
                error_pass.record(&mut recording, scene, view.size, some)?;
                renderer.frames.submit(None, None)?;
                renderer.frames.finish()?;
                error_pass.collect(some.len());
            }
            Ok(())
        })?;
        Ok(error_pass.map_or([Summary::default(); 2], |error_pass| error_pass.summaries()))
    }

    /// Captures the last list batch by batch.
    fn each_batch(
        &mut self,
        resident: &Geometry,
        view: &View,
        mut visit: impl FnMut(&mut SceneRenderer, &[Part], &DrawList, &[Captured]) -> Result<()>,
    ) -> Result<()> {
        if self.capture.is_none() {
            self.capture = Some(Capture::new(&self.gpu, &self.plan, self.terrain.set_layout())?);
        }
        self.complete()?;
        let mut list = std::mem::take(&mut self.list);
        // Instances that the device found are in the list now.
        let submission = std::mem::replace(&mut list.submission, Submission::Direct);
        // They were made when the list was drawn.
        list.uploads.clear();
        let frame = self.look.frame(&self.field, view, self.range);
        let batches = Capture::batches(resident, &list)?;
        let visited = batches.iter().try_for_each(|batch| {
            let capture = self.capture.as_mut().expect("made above");
            capture.clear();
            let mut recording = self.frames.begin()?;
            self.terrain.prepare(&mut recording, &frame, &list)?;
            capture.record(&mut recording, &self.terrain, batch)?;
            self.frames.submit(None, None)?;
            self.frames.finish()?;
            let records = self.capture.as_ref().expect("made above").records().to_vec();
            visit(self, batch, &list, &records)
        });
        self.list = DrawList { submission, ..list };
        visited
    }
}

/// Calls `visit` for every triangle of a part, of its surface or of its skirts, with the records of its corners.
fn triangles(
    resident: &Geometry,
    list: &DrawList,
    part: &Part,
    records: &[Captured],
    mut visit: impl FnMut(Drawn, [u32; 3]),
) {
    let geometry = expand::geometry(part.draw.source, resident, list);
    let corner = |instance: u32, index: u32| {
        let k = part.record(instance, index);
        let Captured { position: [x, z], height, .. } = records[k];
        (Corner { x, z, y: list.absolute_height(height) }, k as u32)
    };
    expand::assemble(geometry, &part.draw, corner, |instance, corners: [(Corner, u32); 3]| {
        let drawn = Drawn { corners: corners.map(|(corner, _)| corner), instance };
        if doubled_area(&drawn.corners) != 0 || expand::is_upright(&drawn) {
            visit(drawn, corners.map(|(_, k)| k));
        }
    });
}
