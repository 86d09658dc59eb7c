//! The oracle against a check written another way: rays cast at the drawn triangles in world space.

use std::sync::Arc;

use cuesta::draw::DrawList;
use cuesta::draw::expand;
use cuesta::draw::layout::Frame;
use cuesta::height::{Field, Holes, Samples};
use cuesta::lod::{self, Settings};
use cuesta::measure::geometric;
use cuesta::view::{Lens, Metric, Tolerance, View};
use glam::{DMat3, DVec3};
use rayon::prelude::*;

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
    }
}

/// Where the vertical line through a point meets a triangle: two sides and the line as a base of space.
fn meets(at: DVec3, [a, b, c]: [DVec3; 3]) -> Option<f64> {
    let base = DMat3::from_cols(b - a, c - a, DVec3::Y);
    let weights = base.inverse() * (at - a);
    // The line may run along a side: rounding must not let it slip between two triangles.
    let inside = weights.x >= -1e-9 && weights.y >= -1e-9 && weights.x + weights.y <= 1.0 + 1e-9;
    inside.then_some(at.y - weights.z)
}

/// A world point on the screen by the clip matrix: pixel x, y and depth.
fn on_screen(view: &View, point: DVec3) -> [f64; 3] {
    let clip = view.clip_from_relative() * (point - view.eye).extend(1.0);
    let size = view.size.map(f64::from);
    [(clip.x / clip.w + 1.0) / 2.0 * size[0], (clip.y / clip.w + 1.0) / 2.0 * size[1], clip.z / clip.w]
}

/// Vertical and screen error of every sample in view.
fn by_rays(field: &Field, view: &View, triangles: &[[DVec3; 3]]) -> Vec<(f64, f64)> {
    let [w, h] = field.size();
    let errors = (0..w * h).into_par_iter().filter_map(|k| {
        let truth = field.world(k % w, k / w);
        let height = triangles.iter().find_map(|t| meets(truth, *t)).filter(|_| !field.is_hole(k % w, k / w))?;
        let [x, y, depth] = on_screen(view, truth.with_y(height));
        let size = view.size.map(f64::from);
        let seen = (0.0..=size[0]).contains(&x) && (0.0..=size[1]).contains(&y) && (0.0..=1.0).contains(&depth);
        let true_pixel = on_screen(view, truth);
        seen.then(|| ((height - truth.y).abs(), (x - true_pixel[0]).hypot(y - true_pixel[1])))
    });
    errors.collect()
}

#[test]
fn rays_find_the_same_errors() {
    let (field, mut random) = (Arc::new(rough_field()), Random(99));
    let entry = lod::find("geomipmap").expect("a row of the table");
    let settings = Settings::new(entry, None, &[("block".into(), "17".into())]).expect("a block's size");
    let mut technique = (entry.build)(Arc::clone(&field), &settings);
    let (mut compared, mut wrong) = (0, 0);
    while compared < 20 {
        let view = random_view(&mut random);
        let mut list = DrawList::default();
        technique.select(&view, &mut list);
        let drawn = expand::triangles(&field, &Frame::placing(&field, &view), technique.resident(), &list);
        let world = |c: cuesta::height::surface::Corner| field.world_at(c.x.into(), c.z.into(), c.y.into());
        let triangles: Vec<_> = drawn.iter().map(|t| t.corners.map(world)).collect();
        let rays = by_rays(&field, &view, &triangles);
        if rays.len() < 200 {
            continue;
        }
        let (errors, k) = (geometric::errors(&field, &view, technique.resident(), &list), compared);
        let agree = |name: &str, summary: geometric::Summary, mut values: Vec<f64>| {
            values.sort_by(f64::total_cmp);
            let n = values.len();
            assert_eq!(summary.count, n as u64, "view {k}: samples in view");
            let rms = (values.iter().map(|e| e * e).sum::<f64>() / n as f64).sqrt();
            let p999 = values[(n * 999).div_ceil(1000) - 1];
            for (a, b) in [(summary.rms, rms), (summary.p999, p999), (summary.max, values[n - 1])] {
                assert!((a - b).abs() <= AGREEMENT * b.max(1.0), "view {k}, {name}: {a} against {b}");
            }
        };
        agree("m", errors.vertical_m, rays.iter().map(|e| e.0).collect());
        agree("px", errors.screen_px, rays.iter().map(|e| e.1).collect());
        compared += 1;
        wrong += usize::from(errors.screen_px.max > 0.1);
    }
    assert!(wrong > 10, "views with an error worth comparing: {wrong}");
}
