//! The search for the smallest tolerance under which a list fits its limits.

use crate::view::{Metric, Tolerance, View};

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
pub fn select_within_limits<T>(view: &View, mut select: impl FnMut(&View) -> Option<T>) -> (T, f64) {
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
