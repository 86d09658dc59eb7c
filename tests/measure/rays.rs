//! The measured errors against an independent check: rays cast at the drawn triangles in world space, and both ends
//! projected without the crate's own matrices.

use std::sync::Arc;

use cuesta::internal::height::{Field, Holes, Samples};
use cuesta::internal::measure::geometric::{self, ANGLES, Summary};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

use super::{drawn, select, technique};

/// Largest relative difference; the two go by different roundings in f64.
const AGREEMENT: f64 = 1e-9;

struct Random(u64);

impl Random {
    /// A number in 0..1: Knuth's MMIX generator.
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }
}

fn rough_field() -> Field {
    let mut random = Random(7);
    let heights = (0..61 * 50).map(|_| 8.0 * random.next() as f32).collect();
    let mut holes = Holes::none(61 * 50);
    (0..200).for_each(|_| holes.insert((random.next() * 61.0 * 50.0) as usize));
    let mut field = Field::new(Samples::F32(heights), [61, 50], [7.0, 5.0], holes);
    field.origin = [1000.0, -2000.0];
    field
}

fn random_view(random: &mut Random) -> View {
    let eye = DVec3::new(800.0 + 800.0 * random.next(), 150.0 * random.next(), -2200.0 + 600.0 * random.next());
    let target = DVec3::new(1210.0, 20.0, -1875.0) + (DVec3::new(random.next(), 0.0, random.next()) - 0.5) * 300.0;
    let tilt = DMat3::from_rotation_z(random.next() - 0.5);
    let lens = match random.next() {
        r if r < 0.2 => Lens::Orthographic { width: 300.0, far: 1e4 },
        r => Lens::Perspective { fov_x: 0.4 + 1.6 * r },
    };
    View {
        eye,
        world_from_eye: View::looking_along(target - eye) * tilt,
        lens,
        size: [640, 400],
        near: 1.0,
        tolerance: Tolerance { px: 5.0 + 60.0 * random.next(), metric: Metric::Certified },
        time_s: 0.0,
    }
}

/// Returns the point where a vertical ray from above meets a triangle (Möller and Trumbore 1997).
fn meets(at: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let from = at.with_y(a.y.max(b.y).max(c.y) + 1.0);
    let (ab, ac) = (b - a, c - a);
    let across = DVec3::NEG_Y.cross(ac);
    let determinant = ab.dot(across);
    let away = from - a;
    let turned = away.cross(ab);
    let (u, v) = (away.dot(across) / determinant, -turned.y / determinant);
    // The ray may run along a side: rounding must not let it slip between two triangles.
    let inside = u >= -1e-9 && v >= -1e-9 && u + v <= 1.0 + 1e-9;
    inside.then(|| from.y - ac.dot(turned) / determinant)
}

/// A world point on the screen, by hand: pixel x, y, and metres along the view axis.
fn on_screen(view: &View, point: DVec3) -> [f64; 3] {
    let away = [point.x - view.eye.x, point.y - view.eye.y, point.z - view.eye.z];
    let axes = view.world_from_eye.to_cols_array_2d();
    let [right, up, back] = axes.map(|axis| axis[0] * away[0] + axis[1] * away[1] + axis[2] * away[2]);
    let px = match view.lens {
        Lens::Perspective { fov_x } => 320.0 / ((fov_x / 2.0).sin() / (fov_x / 2.0).cos()) / -back,
        Lens::Orthographic { width, .. } => 640.0 / width,
    };
    [320.0 + right * px, 200.0 - up * px, -back]
}

/// A sample in view.
struct Seen {
    vertical_m: f64,
    screen_px: f64,
    silhouette: bool,
    off_axis_degrees: f64,
}

/// Every sample in view.
fn by_rays(field: &Field, view: &View, triangles: &[[DVec3; 3]]) -> Vec<Seen> {
    let [w, h] = field.size();
    let seen = (0..w * h).into_par_iter().filter_map(|k| {
        let (i, j) = (k % w, k / w);
        let truth = field.world(i, j);
        let height = triangles.iter().find_map(|t| meets(truth, *t)).filter(|_| !field.is_hole(i, j))?;
        let point = truth.with_y(height);
        let [x, y, depth] = on_screen(view, point);
        let in_view = (0.0..=640.0).contains(&x) && (0.0..=400.0).contains(&y) && (1.0..=1e4).contains(&depth);
        let [true_x, true_y, true_depth] = on_screen(view, truth);
        let screen_px =
            if true_depth > 0.0 || is_parallel(view) { (x - true_x).hypot(y - true_y) } else { f64::INFINITY };
        let forward = view.world_from_eye * DVec3::NEG_Z;
        let angle = if is_parallel(view) { 0.0 } else { forward.angle_between(point - view.eye).to_degrees() };
        let silhouette = turns_away(field, view, i, j);
        in_view.then_some(Seen { vertical_m: (height - truth.y).abs(), screen_px, silhouette, off_axis_degrees: angle })
    });
    seen.collect()
}

fn is_parallel(view: &View) -> bool {
    matches!(view.lens, Lens::Orthographic { .. })
}

/// Returns true if, of the triangles of a sample with a neighbour along x and one along z, some face the eye and some do
/// not, by their normals.
fn turns_away(field: &Field, view: &View, i: u32, j: u32) -> bool {
    let [w, h] = field.size();
    let here = field.world(i, j);
    let to_eye = if is_parallel(view) { view.world_from_eye * DVec3::Z } else { view.eye - here };
    let beside = |n: u32, count: u32| [n.checked_sub(1), Some(n + 1).filter(|&n| n < count)].into_iter().flatten();
    let facing: Vec<bool> = beside(i, w)
        .flat_map(|x| beside(j, h).map(move |z| (x, z)))
        .map(|(x, z)| {
            let normal = (field.world(i, z) - here).cross(field.world(x, j) - here);
            normal.dot(to_eye) * normal.y.signum() > 0.0
        })
        .collect();
    facing.contains(&true) && facing.contains(&false)
}

fn agree(what: &str, (count, summary): (u64, Summary), values: impl Iterator<Item = f64>) {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    let n = values.len();
    assert_eq!(count, n as u64, "{what}: samples");
    if n == 0 {
        return;
    }
    let rms = (values.iter().map(|e| e * e).sum::<f64>() / n as f64).sqrt();
    let p999 = values[(n * 999).div_ceil(1000) - 1];
    for (a, b) in [(summary.rms, rms), (summary.p999, p999), (summary.max, values[n - 1])] {
        assert!((a - b).abs() <= AGREEMENT * b.max(1.0), "{what}: {a} against {b}");
    }
}

/// Compares in 20 random views; in how many something was wrong, and how many samples of the band there were.
fn compare(name: &str, settings: &[&str]) -> (usize, usize, f64) {
    let (field, mut random) = (Arc::new(rough_field()), Random(99));
    let mut technique = technique(&field, name, settings);
    let (mut compared, mut wrong, mut band, mut min_kept) = (0, 0, 0, 1.0f64);
    while compared < 20 {
        let view = random_view(&mut random);
        let list = select(&mut *technique, &view);
        let world = |c: cuesta::internal::height::surface::Corner| field.world_at(c.x.into(), c.z.into(), c.y.into());
        let drawn = drawn(&field, &view, &*technique, &list);
        let triangles: Vec<_> = drawn.iter().map(|t| t.corners.map(world)).collect();
        let rays = by_rays(&field, &view, &triangles);
        if rays.len() < 200 {
            continue;
        }
        let narrow = View { tolerance: Tolerance { px: view.tolerance.px / 4.0, ..view.tolerance }, ..view };
        let errors = geometric::errors(&field, &narrow, technique.resident(), &list);
        agree("m", (errors.samples, errors.vertical_m), rays.iter().map(|s| s.vertical_m));
        agree("px", (errors.samples, errors.screen_px), rays.iter().map(|s| s.screen_px));
        let in_band = rays.iter().filter(|s| s.silhouette);
        agree("band, px", (errors.silhouette_samples, errors.silhouette_px), in_band.map(|s| s.screen_px));
        for bin in 0..ANGLES {
            let in_bin = rays.iter().filter(|s| (s.off_axis_degrees / 10.0) as usize == bin);
            let found = (errors.off_axis_samples[bin], errors.off_axis[bin]);
            agree("of τ, by angle", found, in_bin.map(|s| s.screen_px / narrow.tolerance.px));
        }
        let kept = rays.iter().filter(|s| s.screen_px <= narrow.tolerance.px).count() as f64 / rays.len() as f64;
        assert!((errors.bound_kept - kept).abs() < 1e-12, "kept {} against {kept}", errors.bound_kept);
        compared += 1;
        wrong += usize::from(errors.screen_px.max > 0.1);
        band += rays.iter().filter(|s| s.silhouette).count();
        min_kept = min_kept.min(kept);
    }
    (wrong, band, min_kept)
}

#[test]
fn rays_find_the_same_errors_of_geomipmap() {
    let (wrong, band, min_kept) = compare("geomipmap", &["block=17"]);
    assert!(wrong > 10 && band > 1000 && min_kept < 0.99, "worth comparing: {wrong}, {band}, {min_kept}");
}

#[test]
fn rays_find_no_errors_of_brute_force() {
    let (wrong, band, min_kept) = compare("brute-force", &[]);
    assert!(wrong == 0 && band > 1000 && min_kept == 1.0, "{wrong}, {band}, {min_kept}");
}
