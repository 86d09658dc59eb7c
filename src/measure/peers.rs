//! The error metric under which other terrain renderers ("peers") were measured, from the depth buffer of a frame.
//!
//! The depth of a covered pixel gives the world point P that its centre shows. The error is
//! |P.y − h(P.x, P.z)| · f / |eye − P| pixels. Here h is the bilinear interpolation of the field, and f is the focal
//! length in pixels (869.117 at 1280 × 720 and a vertical field of view of 45°). All pixels of all frames have the same
//! weight.
//!
//! Differences from the exact screen error of [`geometric`](super::geometric): vertical distances count as if seen at a
//! right angle. The far side of a ridge is not measured. A mesh of all samples does not score 0, as the two triangles
//! of a cell differ from its bilinear patch.

use glam::DVec3;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::extended;
use crate::height::Field;
use crate::view::{Lens, View};

/// Errors of all pixels of the frames so far. Needs four bytes per pixel.
#[derive(Clone, Debug, Default)]
pub struct Pool {
    errors_px: Vec<f32>,
    /// Number of covered pixels that show a point without terrain above or below it, due to rounding at borders and holes.
    /// They have no error.
    beside: u64,
}

/// Error of the drawn pixels as other terrain renderers were measured, over all measured frames, pixels.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = extended::non_negative)]
pub struct PeersError {
    /// Mean.
    pub mean: f64,
    /// Root mean square.
    pub rms: f64,
    /// 95th percentile.
    pub p95: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Largest value.
    pub max: f64,
}

impl Pool {
    /// Adds a frame. `depth` is reversed (1 at the near plane, 0 where nothing is drawn), row by row from the top.
    ///
    /// # Panics
    /// If the number of depths is not that of the view's pixels.
    pub fn add(&mut self, field: &Field, view: &View, depth: &[f32]) {
        let [width, height] = view.size.map(|n| n as usize);
        assert_eq!(depth.len(), width * height, "a depth for each pixel");
        let error =
            |(k, &depth): (usize, &f32)| (depth > 0.0).then(|| error_px(field, view, [k % width, k / width], depth));
        let covered: Vec<Option<f32>> = depth.par_iter().enumerate().filter_map(error).collect();
        self.beside += covered.iter().filter(|error| error.is_none()).count() as u64;
        self.errors_px.extend(covered.into_iter().flatten());
    }

    /// Returns the number of covered pixels.
    pub fn pixels(&self) -> u64 {
        self.errors_px.len() as u64 + self.beside
    }

    /// Returns the statistics of all errors so far; zeros without errors. Percentiles are exact, by nearest rank.
    pub fn summary(&self) -> PeersError {
        let mut sorted = self.errors_px.clone();
        sorted.par_sort_unstable_by(f32::total_cmp);
        let n = sorted.len();
        if n == 0 {
            return PeersError::default();
        }
        // Summing in ascending order gives the same result on every machine, and rounds least.
        let sum = |power: i32| sorted.iter().map(|&e| f64::from(e).powi(power)).sum::<f64>() / n as f64;
        let percentile = |percent: usize| f64::from(sorted[(n * percent).div_ceil(100) - 1]);
        PeersError {
            mean: sum(1),
            rms: sum(2).sqrt(),
            p95: percentile(95),
            p99: percentile(99),
            max: f64::from(sorted[n - 1]),
        }
    }
}

/// Returns the error of a pixel (column, row), pixels; `None` without terrain above or below the point that it shows.
fn error_px(field: &Field, view: &View, pixel: [usize; 2], depth: f32) -> Option<f32> {
    let point = shown(view, pixel, depth);
    let scale = match view.lens {
        Lens::Perspective { .. } => view.focal_px() / point.distance(view.eye),
        // The scale of an orthographic view does not depend on the distance.
        Lens::Orthographic { .. } => view.focal_px(),
    };
    field.height_at(point.x, point.z).map(|height| ((point.y - height).abs() * scale) as f32)
}

/// Returns the world point that the centre of a pixel (column, row) shows at a reversed depth above 0. Inverts
/// [`View::clip_from_relative`].
pub fn shown(view: &View, pixel: [usize; 2], depth: f32) -> DVec3 {
    let aside = |k: usize| (pixel[k] as f64 + 0.5 - f64::from(view.size[k]) / 2.0) / view.focal_px();
    let (right, down) = (aside(0), aside(1));
    let in_eye = match view.lens {
        Lens::Perspective { .. } => DVec3::new(right, -down, -1.0) * (view.near / f64::from(depth)),
        Lens::Orthographic { far, .. } => DVec3::new(right, -down, (far - view.near) * f64::from(depth) - far),
    };
    view.eye + view.world_from_eye * in_eye
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::{Holes, Samples, rtin};
    use crate::view::{Metric, Tolerance};

    const SIDE: u32 = 33;

    fn field(height: impl Fn(u32, u32) -> f32) -> Field {
        let heights = (0..SIDE * SIDE).map(|k| height(k % SIDE, k / SIDE)).collect();
        Field::new(Samples::F32(heights), [SIDE; 2], [3.0, 2.0], Holes::none((SIDE * SIDE) as usize))
    }

    fn rough(i: u32, j: u32) -> f32 {
        ((i * 7 + j * j * 3) % 11) as f32 + (i as f32 / 6.0).sin() * 9.0
    }

    fn view(lens: Lens) -> View {
        View {
            eye: DVec3::new(20.0, 45.0, 90.0),
            world_from_eye: View::turned(-70.0, -30.0, 10.0),
            lens,
            size: [96, 54],
            near: 0.1,
            tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
            time_s: 0.0,
        }
    }

    fn lenses() -> [Lens; 2] {
        [Lens::Perspective { fov_x: 1.2 }, Lens::Orthographic { width: 70.0, far: 400.0 }]
    }

    /// Returns the triangles of the samples' surface, raised by `lift` metres.
    fn surface(field: &Field, lift: f64) -> Vec<[DVec3; 3]> {
        let last = SIDE as i32 - 1;
        let cells = (0..last).flat_map(|j| (0..last).map(move |i| (i, j)));
        let world = |[x, z]: [i32; 2]| field.world(x as u32, z as u32) + DVec3::Y * lift;
        cells.flat_map(|(i, j)| rtin::cell(i, j)).map(|t| t.map(world)).collect()
    }

    /// Returns the distance at which a ray meets a triangle (Möller and Trumbore 1997), in lengths of its direction.
    fn meets(from: DVec3, direction: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
        let (ab, ac) = (b - a, c - a);
        let across = direction.cross(ac);
        let determinant = ab.dot(across);
        let away = from - a;
        let u = away.dot(across) / determinant;
        let turned = away.cross(ab);
        let (v, t) = (direction.dot(turned) / determinant, ac.dot(turned) / determinant);
        (u >= -1e-9 && v >= -1e-9 && u + v <= 1.0 + 1e-9 && t > 0.0).then_some(t)
    }

    /// Returns the first hit of a pixel's ray, and its depth by the clip matrix.
    fn cast(view: &View, triangles: &[[DVec3; 3]], pixel: [usize; 2]) -> Option<(DVec3, f32)> {
        let clip = |k: usize| 2.0 * (pixel[k] as f64 + 0.5) / f64::from(view.size[k]) - 1.0;
        let world_from_clip = view.clip_from_relative().inverse();
        let [near, beyond] =
            [1.0, 0.5].map(|depth| world_from_clip.project_point3(DVec3::new(clip(0), clip(1), depth)));
        let direction = beyond - near;
        let nearest = triangles.iter().filter_map(|t| meets(view.eye + near, direction, *t)).min_by(f64::total_cmp)?;
        let hit = near + direction * nearest;
        let shown = view.clip_from_relative().project_point3(hit);
        Some((view.eye + hit, shown.z as f32))
    }

    fn pixels(view: &View) -> impl Iterator<Item = [usize; 2]> + use<> {
        let [w, h] = view.size.map(|n| n as usize);
        (0..h).flat_map(move |y| (0..w).map(move |x| [x, y]))
    }

    #[test]
    fn points_come_back_from_their_depth() {
        let field = field(rough);
        let triangles = surface(&field, 0.0);
        for lens in lenses() {
            let view = view(lens);
            let hits: Vec<_> = pixels(&view).filter_map(|p| Some((p, cast(&view, &triangles, p)?))).collect();
            assert!(hits.len() > 1000, "{}", hits.len());
            for (pixel, (hit, depth)) in hits {
                assert!(shown(&view, pixel, depth).distance(hit) < 1e-3, "{pixel:?} {lens:?}");
            }
        }
    }

    #[test]
    fn errors_are_those_of_the_rays() {
        let field = field(rough);
        for (lens, lift) in lenses().into_iter().flat_map(|lens| [(lens, 0.0), (lens, 1.5)]) {
            let view = view(lens);
            let triangles = surface(&field, lift);
            let (mut depths, mut expected) = (Vec::new(), Vec::new());
            for pixel in pixels(&view) {
                let hit = cast(&view, &triangles, pixel);
                depths.push(hit.map_or(0.0, |(_, depth)| depth));
                let Some((hit, _)) = hit else { continue };
                let Some(height) = field.height_at(hit.x, hit.z) else { continue };
                let scale = match lens {
                    Lens::Perspective { .. } => 48.0 / 0.6f64.tan() / hit.distance(view.eye),
                    Lens::Orthographic { .. } => 96.0 / 70.0,
                };
                expected.push((hit.y - height).abs() * scale);
            }
            let mut pool = Pool::default();
            pool.add(&field, &view, &depths);
            let found = pool.summary();
            expected.sort_by(f64::total_cmp);
            let n = expected.len();
            assert!(pool.pixels() - pool.beside >= n as u64 - 2 && pool.beside < 20, "{pool:?}");
            let mean = expected.iter().sum::<f64>() / n as f64;
            let rms = (expected.iter().map(|e| e * e).sum::<f64>() / n as f64).sqrt();
            let [p95, p99] = [95, 99].map(|percent| expected[n * percent / 100]);
            let pairs = [
                (found.mean, mean),
                (found.rms, rms),
                (found.p95, p95),
                (found.p99, p99),
                (found.max, expected[n - 1]),
            ];
            for (a, b) in pairs {
                assert!((a - b).abs() < 2e-3 * b, "{lens:?} lifted {lift}: {a} and {b} of {found:?}");
            }
            assert!(mean > 0.1, "an error worth comparing: {mean}");
        }
    }

    #[test]
    fn a_plane_has_no_error_and_frames_pool() {
        let field = field(|i, j| 2.0 * i as f32 - j as f32);
        let view = view(lenses()[0]);
        let depths = |lift: f64| -> Vec<f32> {
            let triangles = surface(&field, lift);
            pixels(&view).map(|p| cast(&view, &triangles, p).map_or(0.0, |(_, depth)| depth)).collect()
        };
        let mut pool = Pool::default();
        assert_eq!(pool.summary(), PeersError::default());
        pool.add(&field, &view, &depths(0.0));
        let (one, max) = (pool.clone(), pool.summary().max);
        assert!(one.pixels() > 1000 && max < 1e-3, "{max} px");
        let lifted = depths(2.0);
        let mut alone = Pool::default();
        alone.add(&field, &view, &lifted);
        pool.add(&field, &view, &lifted);
        assert_eq!(pool.pixels(), one.pixels() + alone.pixels());
        let share = (alone.pixels() - alone.beside) as f64 / (pool.pixels() - pool.beside) as f64;
        let (alone, both) = (alone.summary(), pool.summary());
        assert!(alone.mean > 0.5, "{alone:?}");
        assert!((both.mean - alone.mean * share).abs() < 1e-3 && both.max == alone.max, "{both:?}, {alone:?}");
    }

    #[test]
    fn the_published_constant() {
        let mut view = view(lenses()[0]);
        view.size = [1280, 720];
        view.lens = Lens::Perspective { fov_x: 2.0 * ((22.5f64).to_radians().tan() * 1280.0 / 720.0).atan() };
        assert!((view.focal_px() - 869.117).abs() < 1e-3, "{}", view.focal_px());
    }
}
