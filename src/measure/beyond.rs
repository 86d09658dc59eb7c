//! Counts the pixels whose screen error exceeds the tolerance, from the depth buffer of a frame.
//!
//! The depth of a pixel gives the world point that its centre shows. Its error is the distance on the screen from the
//! point above or below it on the surface of the samples, both projected exactly. Coarser meshes are flat on each
//! triangle of that surface, so no pixel has a larger error than the samples around it have
//! ([`geometric`](super::geometric)).

use rayon::prelude::*;

use super::peers::shown;
use crate::height::Field;
use crate::height::surface;
use crate::view::View;

/// Returns the number of pixels whose error exceeds the view's tolerance. `depth` is reversed (0 where nothing is
/// drawn), row by row from the top. Pixels that show a point without terrain above or below it are not counted.
pub fn pixels(field: &Field, view: &View, depth: &[f32]) -> u64 {
    let width = view.size[0] as usize;
    let is_beyond = |k: usize, depth: f32| {
        let point = shown(view, [k % width, k / width], depth);
        let at = [0, 1].map(|axis| (point[2 * axis] - field.origin[axis]) / field.spacing[axis]);
        let truth = surface::height_at(field, at).map(|y| glam::DVec3::new(point.x, y, point.z));
        truth.is_some_and(|truth| view.displacement_px(point, truth) > view.tolerance.px)
    };
    depth.par_iter().enumerate().filter(|&(k, &depth)| depth > 0.0 && is_beyond(k, depth)).count() as u64
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::{Holes, Samples};
    use crate::view::{Lens, Metric, Tolerance};
    use glam::DVec3;

    /// Returns the depth at which a pixel shows the level plane at height `y`.
    fn depth_at(view: &View, pixel: [usize; 2], y: f64) -> f32 {
        let [low, high] = [0.0, 1.0].map(|depth| shown(view, pixel, depth).y);
        ((y - low) / (high - low)) as f32
    }

    #[test]
    fn pixels_lifted_by_more_than_the_tolerance_are_counted() {
        let field = Field::new(Samples::F32(vec![0.0; 41 * 41]), [41; 2], [1.0; 2], Holes::none(41 * 41));
        let view = View {
            eye: DVec3::new(20.0, 30.0, 50.0),
            world_from_eye: View::turned(-90.0, -45.0, 0.0),
            lens: Lens::Orthographic { width: 10.0, far: 100.0 },
            size: [40, 20],
            near: 0.1,
            tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
            time_s: 0.0,
        };
        // Four pixels a metre, seen at 45°: a pixel is 0.354 m of height.
        for (lift_m, is_beyond) in [(0.0, false), (0.35, false), (0.36, true), (-0.36, true)] {
            let depth: Vec<f32> = (0..800).map(|k| depth_at(&view, [k % 40, k / 40], lift_m)).collect();
            assert_eq!(pixels(&field, &view, &depth), if is_beyond { 800 } else { 0 }, "{lift_m} m");
        }
        let half: Vec<f32> =
            (0..800).map(|k| if k < 400 { depth_at(&view, [k % 40, k / 40], 1.0) } else { 0.0 }).collect();
        assert_eq!(pixels(&field, &view, &half), 400, "where nothing is drawn, nothing is beyond");
    }
}
