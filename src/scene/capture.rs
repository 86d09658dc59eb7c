//! The as-drawn mesh: triangles captured on the device.

use anyhow::Result;

use super::renderer::SceneRenderer;
use crate::draw::expand::{self, Drawn};
use crate::draw::layout::Captured;
use crate::draw::{DrawList, Geometry, Submission};
use crate::gpu::passes::capture::{Capture, Part};
use crate::gpu::target::Copies;
use crate::height::surface::{Corner, doubled_area};
use crate::lod::Technique;
use crate::view::View;

/// A captured triangle: its corners, and the positions that the rasteriser was given.
#[derive(Clone, Copy, Debug)]
pub struct AsDrawn {
    /// The triangle, in the form that [`expand`] gives it.
    pub drawn: Drawn,
    /// Corners relative to the eye, metres.
    pub relative: [[f32; 3]; 3],
}

impl SceneRenderer {
    /// Returns true if the device can capture.
    pub fn captures(&self) -> bool {
        self.gpu.captures
    }

    /// Captures every triangle of the last list: those of the surface, and those of skirts.
    ///
    /// # Errors
    /// If the device cannot capture, or fails.
    pub fn capture(&mut self, technique: &dyn Technique, view: &View) -> Result<[Vec<AsDrawn>; 2]> {
        let mut found = [Vec::new(), Vec::new()];
        let resident = technique.resident();
        self.each_batch(resident, view, |capture, batch, list| {
            let records = capture.records();
            for part in batch {
                triangles(resident, list, part, records, |drawn, corners| {
                    let relative = corners.map(|k| records[k as usize].relative);
                    found[usize::from(expand::is_upright(&drawn))].push(AsDrawn { drawn, relative });
                });
            }
        })?;
        Ok(found)
    }

    /// Captures the last list batch by batch.
    fn each_batch(
        &mut self,
        resident: &Geometry,
        view: &View,
        mut visit: impl FnMut(&Capture, &[Part], &DrawList),
    ) -> Result<()> {
        let mut capture = match self.capture.take() {
            Some(capture) => capture,
            None => Capture::new(&self.gpu, &self.plan, self.renderer.terrain.set_layout())?,
        };
        self.complete()?;
        let mut list = std::mem::take(&mut self.list);
        // The instances that the device found are in the list now.
        let submission = std::mem::replace(&mut list.submission, Submission::Direct);
        // The uploads were made when the list was drawn.
        list.uploads.clear();
        let visited = Capture::batches(resident, &list).and_then(|batches| {
            batches.iter().try_for_each(|batch| {
                capture.clear();
                self.draw_only(&mut capture.batch(batch), view, &mut list, Copies::default())?;
                visit(&capture, batch, &list);
                Ok(())
            })
        });
        self.list = DrawList { submission, ..list };
        self.capture = Some(capture);
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
