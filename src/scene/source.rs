//! A technique as the source of a frame's draw list.

use crate::draw::{DrawList, Geometry, Submission};
use crate::gpu::frame_renderer::{Allowed, DrawSource};
use crate::lod::Technique;
use crate::view::View;

/// Selects a view: on the device where possible, else in parts where the technique can.
pub(super) struct TechniqueSource<'a> {
    technique: &'a mut dyn Technique,
    view: &'a View,
    /// Submission of all draws; `None`: as the technique says.
    submission: Option<Submission>,
}

impl<'a> TechniqueSource<'a> {
    pub fn new(technique: &'a mut dyn Technique, view: &'a View, submission: Option<Submission>) -> Self {
        Self { technique, view, submission }
    }

    /// Selects on the host, the whole list at once.
    pub fn select_whole(
        technique: &mut dyn Technique,
        view: &View,
        submission: Option<Submission>,
        list: &mut DrawList,
    ) {
        list.clear();
        technique.select(view, list);
        list.submission = submission.unwrap_or(list.submission);
    }
}

impl DrawSource for TechniqueSource<'_> {
    fn select(&mut self, allowed: Allowed, list: &mut DrawList, ready: &mut dyn FnMut(&DrawList)) {
        let of_device = matches!(self.submission, None | Some(Submission::GpuDriven));
        if allowed.on_gpu && of_device {
            list.clear();
            self.technique.select_on_gpu(self.view, list);
        } else if allowed.in_parts && self.submission.is_none() {
            list.clear();
            self.technique.select_in_parts(self.view, list, ready);
        } else {
            Self::select_whole(self.technique, self.view, self.submission, list);
        }
    }

    fn resident(&self) -> Option<&Geometry> {
        Some(self.technique.resident())
    }
}
