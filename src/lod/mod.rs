//! The techniques: each a room behind the one door [`Technique`], all in the one table [`TECHNIQUES`].
//!
//! Pure computation: no device, no file, no clock. Rooms never use each other.

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

/// A way to choose what is drawn.
pub trait Technique: Send {
    /// Geometry that stays in device-local memory.
    fn resident(&self) -> &Geometry;

    /// The most that any list of this technique holds.
    fn limits(&self) -> Limits;

    /// Fills the (empty) list with what this view needs.
    fn select(&mut self, view: &View, list: &mut DrawList);

    /// Fills the (empty) list as [`Self::select`] does, and calls `ready` each time more draws of it may be drawn while
    /// the rest is being selected: what stands in the list stays there as it is.
    fn select_in_parts(&mut self, view: &View, list: &mut DrawList, _ready: &mut dyn FnMut(&DrawList)) {
        self.select(view, list);
    }

    /// How the device finds the draws itself, if it can: the same draws and instances as [`Self::select`], in any
    /// order.
    fn gpu_selection(&self) -> Option<&GpuSelection> {
        None
    }

    /// What the device is told of a view ([`DrawList::parameters`]), where there is a driver. Its time does not
    /// depend on what is drawn.
    fn parameters(&self, _view: &View, _words: &mut Vec<u32>) {}

    /// Fills the (empty) list with what the device is told of a view.
    ///
    /// # Panics
    /// If the technique has no driver.
    fn select_on_gpu(&mut self, view: &View, list: &mut DrawList) {
        assert!(self.gpu_selection().is_some(), "a technique with a driver");
        list.submission = Submission::GpuDriven;
        self.parameters(view, &mut list.parameters);
    }

    /// What stays on the device.
    fn device_geometry(&self) -> DeviceGeometry<'_> {
        DeviceGeometry { geometry: self.resident(), limits: self.limits(), gpu_selection: self.gpu_selection() }
    }

    /// Whether the lists keep the view's tolerance under its metric.
    fn keeps_tolerance(&self) -> bool;

    /// Whether another selection in the view of the last one gives the same list: nothing goes on gradually, and nothing
    /// waits.
    fn is_settled(&self) -> bool {
        true
    }

    /// What its lists ask of the programs that draw them.
    fn pipeline_requirements(&self) -> PipelineRequirements {
        PipelineRequirements::default()
    }

    /// What it could have prepared and did not, as this field makes no use of it.
    fn omitted(&self) -> Vec<Omitted> {
        Vec::new()
    }

    /// What is worth knowing about the data it prepared: name, value, unit.
    fn stats(&self) -> Vec<(&'static str, f64, &'static str)> {
        Vec::new()
    }
}

/// Something that a technique did not prepare.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Omitted {
    /// What it is.
    pub what: &'static str,
    /// Why nothing uses it.
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
    /// Where it was published.
    pub paper: &'static str,
    /// Forms beside the default one.
    pub variants: &'static [Variant],
    /// What can be set, with defaults.
    pub settings: &'static [Setting],
    /// Which of them do nothing beside some words of others.
    pub needs: &'static [Need],
    /// The most samples of a field, tiling included: it keeps something of each of them, or goes through them in a frame.
    pub max_samples: u64,
    /// The most samples along a side of a field, tiling included.
    pub max_side: u32,
    /// Whether it takes a land without samples ([`Field::procedural`]).
    pub takes_endless: bool,
    /// Prepares the technique for a field of at most so many.
    pub build: fn(Arc<Field>, &Settings) -> Box<dyn Technique>,
}

impl Entry {
    /// The technique prepared for a field, or why not.
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

/// Every technique. The table feeds the command line, the viewer's keys, the laws, the golden pictures, the
/// benchmarks and the reports.
pub const TECHNIQUES: &[Entry] = &[
    brute_force::ENTRY,
    geomipmap::ENTRY,
    smooth_tiles::ENTRY,
    sorted_strips::ENTRY,
    sphere_tree::ENTRY,
    clusters::ENTRY,
];

/// What a tolerance is multiplied by until a list fits.
const SCALE_STEP: f64 = 1.5;

/// Retries `select` with a growing tolerance until its list fits. Returns the result and the scale of the tolerance.
///
/// A wider tolerance never draws more, so that the search skips steps: the view's tolerance may be a hundred powers of ten
/// too fine. The last call is that of the result. Under the certified metric terrain stays in front of the eye at any
/// finite tolerance, which may always be too much: then the scale is infinite, and the paper's metric decides.
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

/// The same among finite tolerances of the view's metric; `None` if none fits.
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
