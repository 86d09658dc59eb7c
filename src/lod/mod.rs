//! Level-of-detail techniques: each a module that implements [`Technique`] and has a row in [`TECHNIQUES`].
//!
//! Pure computation without devices, files or clocks. Techniques never use each other.

pub mod brute_force;
pub mod budget;
pub mod clusters;
pub mod geomipmap;
pub mod registry;
pub mod settings;
pub mod smooth_tiles;
pub mod sorted_strips;
pub mod sphere_tree;

use std::sync::Arc;

use crate::draw::{DeviceGeometry, DrawList, Geometry, GpuSelection, Limits, PipelineRequirements, Submission};
use crate::height::Field;
use crate::view::{Metric, Tolerance, View};
pub use registry::{TechniqueSpec, Techniques};
pub use settings::{Need, Setting, Settings, Values};

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

/// A named form of a technique, chosen as `technique:variant`.
#[derive(Clone, Copy, Debug)]
pub struct Variant {
    /// Its name.
    pub name: &'static str,
    /// One line.
    pub about: &'static str,
}

/// One row of the table of techniques.
#[derive(Clone, Debug)]
pub struct Entry {
    /// Its name on the command line.
    pub name: &'static str,
    /// One line.
    pub about: &'static str,
    /// Publication it implements.
    pub paper: &'static str,
    /// Forms beside the default one.
    pub variants: &'static [Variant],
    /// Settings with their defaults.
    pub settings: &'static [Setting],
    /// Settings that have no effect beside some values of others.
    pub needs: &'static [Need],
    /// Maximum number of samples of a field, tiling included. Memory or time per frame grow with it.
    pub max_samples: u64,
    /// Maximum number of samples along a side of a field, tiling included.
    pub max_side: u32,
    /// True if it can draw terrain without samples ([`Field::procedural`]).
    pub takes_endless: bool,
    /// Prepares the technique for a field within these limits.
    pub build: fn(Arc<Field>, &Settings) -> Box<dyn Technique>,
}

impl Entry {
    /// Prepares the technique for a field.
    ///
    /// # Errors
    /// If the technique cannot draw the field.
    pub fn prepare(&self, field: &Arc<Field>, settings: &Settings) -> Result<Box<dyn Technique>, String> {
        let [w, h] = field.size().map(u64::from);
        let Self { name, max_samples, .. } = self;
        if field.procedural().is_some() && !self.takes_endless {
            let able: Vec<_> = TECHNIQUES.iter().filter(|entry| entry.takes_endless).map(|entry| entry.name).collect();
            return Err(format!("{name}: it needs samples, and this land has none: try {}", able.join(", ")));
        }
        if field.procedural().is_none() && w * h > self.max_samples {
            return Err(format!("{name}: {w} x {h} samples, and it goes through them all: at most {max_samples}"));
        }
        if field.procedural().is_none() && field.size().iter().any(|&n| n > self.max_side) {
            return Err(format!("{name}: {w} x {h} samples: expected at most {} a side", self.max_side));
        }
        if field.ceiling().is_some() {
            sorted_strips::cave::can_draw(self.name, settings)?;
        }
        Ok((self.build)(Arc::clone(field), settings))
    }
}

/// All techniques. The table feeds the command line, the viewer's keys, the invariants, the golden pictures, the
/// benchmarks and the reports.
pub const TECHNIQUES: &[Entry] = &[
    brute_force::ENTRY,
    geomipmap::ENTRY,
    smooth_tiles::ENTRY,
    sorted_strips::ENTRY,
    sphere_tree::ENTRY,
    clusters::ENTRY,
];

/// Factor by which a tolerance grows until a list fits.
const SCALE_STEP: f64 = 1.5;

/// Retries `select` with a growing tolerance until its list fits. Returns the result and the scale of the tolerance.
///
/// A wider tolerance never draws more. The search doubles its steps, then bisects, because the view's tolerance may be
/// a hundred powers of ten too fine. The last call of `select` is that of the result. If no finite tolerance fits under
/// the certified metric, the paper's metric is tried; the scale is infinite then.
///
/// # Panics
/// If `select` makes nothing under an infinite tolerance.
pub(crate) fn select_within_limits<T>(view: &View, mut select: impl FnMut(&View) -> Option<T>) -> (T, f64) {
    if let Some(found) = first_that_fits(view, &mut select) {
        return found;
    }
    let under = |tolerance: Tolerance| View { tolerance, ..*view };
    let paper = under(Tolerance { metric: Metric::Paper, ..view.tolerance });
    let found = first_that_fits(&paper, &mut select).map(|(selected, _)| selected);
    let without = under(Tolerance { px: f64::INFINITY, ..view.tolerance });
    let selected = found.or_else(|| select(&without));
    (selected.expect("nothing is too much where no tolerance is kept"), f64::INFINITY)
}

/// Searches the finite tolerances of the view's metric. `None` if none fits.
fn first_that_fits<T>(view: &View, select: &mut impl FnMut(&View) -> Option<T>) -> Option<(T, f64)> {
    if let Some(selected) = select(view) {
        return Some((selected, 1.0));
    }
    let factor = |steps: i32| SCALE_STEP.powi(steps);
    let px_at = |steps: i32| (view.tolerance.px.max(f64::MIN_POSITIVE) * factor(steps)).min(f64::MAX);
    let mut under = |px: f64| select(&View { tolerance: Tolerance { px, ..view.tolerance }, ..*view });
    let [mut below, mut above] = [0, 1];
    let mut selected = under(px_at(above));
    while selected.is_none() && px_at(above) < f64::MAX {
        (below, above) = (above, 2 * above);
        selected = under(px_at(above));
    }
    let mut is_last = true;
    while selected.is_some() && above - below > 1 {
        let middle = below.midpoint(above);
        let finer = under(px_at(middle));
        is_last = finer.is_some();
        match finer {
            Some(finer) => (above, selected) = (middle, Some(finer)),
            None => below = middle,
        }
    }
    // Callers keep state: the last call must be that of the result.
    let selected = if is_last { selected } else { under(px_at(above)) };
    selected.map(|selected| (selected, factor(above)))
}

/// The row with this name.
pub fn find(name: &str) -> Option<&'static Entry> {
    TECHNIQUES.iter().find(|entry| entry.name == name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DMat3, DVec3};

    use crate::view::Lens;

    fn view(px: f64) -> View {
        let tolerance = Tolerance { px, metric: Metric::Certified };
        let (eye, world_from_eye) = (DVec3::ZERO, DMat3::IDENTITY);
        View {
            eye,
            world_from_eye,
            lens: Lens::Perspective { fov_x: 1.0 },
            size: [9, 9],
            near: 0.1,
            tolerance,
            time_s: 0.0,
        }
    }

    #[test]
    fn the_first_tolerance_that_fits_is_found_soon_from_any_below() {
        for steps in (0..40).chain([300, 1700]) {
            let fits_from = 1.5f64.powi(steps) * (1.0 - 1e-9);
            for scale in [1.0, 1e-3, 1e-290] {
                let mut asked = Vec::new();
                let select = |view: &View| {
                    asked.push(view.tolerance.px);
                    (view.tolerance.px >= scale * fits_from).then_some(view.tolerance.px)
                };
                let (px, tolerance_scale) = select_within_limits(&view(scale), select);
                assert_eq!(asked.last(), Some(&px), "what was selected last is the answer");
                assert!(
                    (px / scale / fits_from - 1.0).abs() < 1e-6 && (tolerance_scale * scale / px - 1.0).abs() < 1e-9
                );
                assert!(
                    asked.len() <= 24 && (steps > 1 || asked.len() as i32 == steps + 1),
                    "{steps}: {}",
                    asked.len()
                );
            }
        }
        assert!(select_within_limits(&view(1e-320), |view| (view.tolerance.px > 1.0).then_some(())).1 > 1e300);
        let keeps_nothing = |view: &View| (view.tolerance.px == f64::INFINITY).then_some(());
        assert_eq!(select_within_limits(&view(1.0), keeps_nothing).1, f64::INFINITY);
    }
}
