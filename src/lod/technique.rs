//! The trait of all techniques, and the traits of what only some of them can do.

use crate::draw::{DeviceGeometry, DrawList, Geometry, GpuSelection, Limits, PipelineRequirements, Submission};
use crate::view::View;

/// A level-of-detail algorithm, prepared for one field.
///
/// These are the methods that every technique has. What only some can do is a trait of its own, which the technique
/// returns from the method of the same name: [`SelectInParts`], [`SelectOnGpu`], [`Gradual`], [`Diagnostics`].
pub trait Technique: Send {
    /// Geometry that stays in device-local memory.
    fn resident(&self) -> &Geometry;

    /// Upper bounds of the lists of this technique.
    fn limits(&self) -> Limits;

    /// Fills the (empty) list with the draws of a view.
    fn select(&mut self, view: &View, list: &mut DrawList);

    /// True if the lists keep the view's tolerance under its metric.
    fn keeps_tolerance(&self) -> bool;

    /// The pipelines that its lists need.
    fn pipeline_requirements(&self) -> PipelineRequirements {
        PipelineRequirements::default()
    }

    /// Selection whose first draws are ready before the last ones.
    fn in_parts(&mut self) -> Option<&mut dyn SelectInParts> {
        None
    }

    /// Selection by compute shaders.
    fn on_gpu(&self) -> Option<&dyn SelectOnGpu> {
        None
    }

    /// Selection that takes several frames to reach its final state.
    fn gradual(&self) -> Option<&dyn Gradual> {
        None
    }

    /// Facts about the prepared data.
    fn diagnostics(&self) -> Option<&dyn Diagnostics> {
        None
    }
}

/// A technique that hands out draws while it still selects others.
pub trait SelectInParts {
    /// Fills the (empty) list as [`Technique::select`] does. Calls `ready` whenever more draws are final: entries that
    /// the list holds then do not change any more.
    fn select_in_parts(&mut self, view: &View, list: &mut DrawList, ready: &mut dyn FnMut(&DrawList));
}

/// A technique whose selection runs on the device too.
pub trait SelectOnGpu {
    /// Tables and compute programs. They find the draws and instances of [`Technique::select`], in any order.
    fn selection(&self) -> &GpuSelection;

    /// Appends the shader parameters of a view ([`DrawList::parameters`]). Its time does not depend on the number of
    /// draws.
    fn parameters(&self, view: &View, words: &mut Vec<u32>);
}

/// A technique that changes levels over several frames.
pub trait Gradual {
    /// True if another selection in the last view gives the same list: no transition is running and no change is
    /// queued.
    fn is_settled(&self) -> bool;
}

/// A technique that reports on the data it prepared.
pub trait Diagnostics {
    /// Data that it left out because this field makes no use of it.
    fn omitted(&self) -> Vec<Omitted> {
        Vec::new()
    }

    /// Statistics: name, value, unit.
    fn stats(&self) -> Vec<(&'static str, f64, &'static str)>;
}

impl dyn Technique + '_ {
    /// Fills the (empty) list, in parts where the technique can. See [`SelectInParts::select_in_parts`].
    pub fn select_in_parts(&mut self, view: &View, list: &mut DrawList, ready: &mut dyn FnMut(&DrawList)) {
        match self.in_parts() {
            Some(parts) => parts.select_in_parts(view, list, ready),
            None => self.select(view, list),
        }
    }

    /// Fills the (empty) list with the parameters of a selection on the device.
    ///
    /// # Panics
    /// If the technique cannot select there.
    pub fn select_on_gpu(&mut self, view: &View, list: &mut DrawList) {
        list.submission = Submission::GpuDriven;
        self.on_gpu().expect("a technique that selects on the GPU").parameters(view, &mut list.parameters);
    }

    /// The data that stays on the device.
    pub fn device_geometry(&self) -> DeviceGeometry<'_> {
        let gpu_selection = self.on_gpu().map(SelectOnGpu::selection);
        DeviceGeometry { geometry: self.resident(), limits: self.limits(), gpu_selection }
    }

    /// True unless a gradual technique is still changing levels. See [`Gradual::is_settled`].
    pub fn is_settled(&self) -> bool {
        self.gradual().is_none_or(Gradual::is_settled)
    }

    /// See [`Diagnostics::omitted`].
    pub fn omitted(&self) -> Vec<Omitted> {
        self.diagnostics().map(Diagnostics::omitted).unwrap_or_default()
    }

    /// See [`Diagnostics::stats`].
    pub fn stats(&self) -> Vec<(&'static str, f64, &'static str)> {
        self.diagnostics().map(Diagnostics::stats).unwrap_or_default()
    }
}

/// Something that a technique did not prepare.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Omitted {
    /// Its name.
    pub what: &'static str,
    /// The reason why nothing uses it.
    pub reason: String,
    /// Device bytes that it would have taken.
    pub bytes: u64,
}
