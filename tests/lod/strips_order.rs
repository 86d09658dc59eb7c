//! Sorted strips on the screen: checks the order of triangles along the ray of every pixel, and the picture of the
//! painter's algorithm without a depth buffer.

use std::sync::Arc;

use cuesta::internal::bench::paths;
use cuesta::internal::draw::expand::{self, Drawn};
use cuesta::internal::draw::layout::Frame;
use cuesta::internal::draw::{DepthMode, DrawList, Geometry};
use cuesta::internal::height::{Field, surface, synth};
use cuesta::internal::lod::Technique;
use cuesta::internal::measure::watertight;
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::technique;

/// Size of a small picture, pixels.
pub(super) const SIZE: [u32; 2] = [48, 32];

/// Results of following the rays of a picture's pixels.
#[derive(Debug, Default, Clone, Copy)]
pub(super) struct RayCounts {
    /// Pixels with terrain.
    terrain: usize,
    /// Pixels whose ray meets several triangles.
    pub(super) several: usize,
    /// Of these, pixels whose triangles are not in front-to-back order.
    pub(super) unsorted: usize,
    /// Pixels that show another triangle when drawn back to front without a depth buffer.
    wrong: usize,
}

impl RayCounts {
    fn plus(self, other: RayCounts) -> RayCounts {
        let [a, b] = [self, other];
        let (terrain, several) = (a.terrain + b.terrain, a.several + b.several);
        RayCounts { terrain, several, unsorted: a.unsorted + b.unsorted, wrong: a.wrong + b.wrong }
    }
}

fn drawn(field: &Field, technique: &mut dyn Technique, view: &View) -> Vec<Drawn> {
    triangles(field, view, &list(technique, view))
}

fn list(technique: &mut dyn Technique, view: &View) -> DrawList {
    let mut list = DrawList::default();
    technique.select(view, &mut list);
    list
}

fn triangles(field: &Field, view: &View, list: &DrawList) -> Vec<Drawn> {
    expand::triangles(field, &Frame::placing(field, view), &Geometry::default(), list)
}

/// Returns the origin and the direction of a pixel's ray.
fn ray(view: &View, pixel: DVec2) -> (DVec3, DVec3) {
    let offset = (pixel - DVec2::new(f64::from(SIZE[0]), f64::from(SIZE[1])) / 2.0) / view.focal_px();
    let across = view.world_from_eye * DVec3::new(offset.x, -offset.y, 0.0);
    match view.lens {
        Lens::Perspective { .. } => (view.eye, view.forward() + across),
        Lens::Orthographic { .. } => (view.eye + across, view.forward()),
    }
}

/// Returns the distance along a ray to a triangle; `None` if it misses.
fn distance(corners: &[DVec3; 3], (from, towards): (DVec3, DVec3)) -> Option<f64> {
    let [a, b, c] = corners;
    let (side, other) = (*b - *a, *c - *a);
    let across = towards.cross(other);
    let scale = side.dot(across);
    let offset = from - *a;
    let u = offset.dot(across) / scale;
    let turned = offset.cross(side);
    let v = towards.dot(turned) / scale;
    let inside = u >= 0.0 && v >= 0.0 && u + v <= 1.0;
    inside.then(|| other.dot(turned) / scale)
}

/// Follows the ray of every pixel through triangles that should be nearest first.
pub(super) fn follow(field: &Field, view: &View, triangles: &[Drawn]) -> RayCounts {
    follow_between(field, view, triangles, 0)
}

/// The same for corners with `fraction_bits` fractional bits.
fn follow_between(field: &Field, view: &View, triangles: &[Drawn], fraction_bits: u32) -> RayCounts {
    let at = |corner: &surface::Corner| surface::world(field, corner, fraction_bits);
    let corners: Vec<[DVec3; 3]> = triangles.iter().map(|t| t.corners.each_ref().map(at)).collect();
    let pixels = (0..SIZE[0] * SIZE[1]).into_par_iter();
    let of_pixel = |k: u32| {
        let centre = DVec2::new(f64::from(k % SIZE[0]) + 0.5, f64::from(k / SIZE[0]) + 0.5);
        let ray = ray(view, centre);
        let met: Vec<f64> = corners.iter().filter_map(|c| distance(c, ray)).filter(|&t| t > view.near).collect();
        let Some(nearest) = met.iter().copied().reduce(f64::min) else { return RayCounts::default() };
        // Two triangles are equally distant on a common edge.
        let slack = 1e-9 * nearest.abs();
        let unsorted = met.windows(2).any(|pair| pair[0] > pair[1] + slack);
        let wrong = met[0] > nearest + slack;
        RayCounts { terrain: 1, several: usize::from(met.len() > 1), unsorted: unsorted.into(), wrong: wrong.into() }
    };
    pixels.map(of_pixel).reduce(RayCounts::default, RayCounts::plus)
}

fn view(eye: DVec3, rotation: glam::DMat3, lens: Lens) -> View {
    let tolerance = Tolerance { px: 0.7, metric: Metric::Certified };
    View { eye, world_from_eye: rotation, lens, size: SIZE, near: 1.0, tolerance, time_s: 0.0 }
}

fn terrain() -> Arc<Field> {
    let mut field = synth::synth(synth::Kind::Fractal, [201, 170], 3);
    field.spacing = [20.0, 20.0];
    Arc::new(field)
}

/// Returns perspective and orthographic views from beyond the field's corners. No row or column of pages has terrain on
/// two sides of the eye.
fn from_outside(field: &Field) -> Vec<View> {
    let [w, h] = field.size().map(|n| f64::from(n - 1));
    let range = field.statistics();
    let (middle, extent) = (field.world_at(w / 2.0, h / 2.0, range.mean), 20.0 * w.hypot(h));
    let height = f64::from(range.max - range.min);
    let around = (0..12).flat_map(|k| {
        let (sin, cos) = f64::from(90 * (k % 4) + 40 + 3 * (k / 4)).to_radians().sin_cos();
        let away = |part: f64| middle + DVec3::new(cos * extent * part, height * 0.7, sin * extent * part);
        let towards = View::looking_along(middle - away(1.0));
        let parallel = Lens::Orthographic { width: extent * 0.7, far: 1e6 };
        [view(away(0.62), towards, Lens::Perspective { fov_x: 1.0 }), view(away(1.0), towards, parallel)]
    });
    around.collect()
}

/// Returns views from within the field, low above it in all directions, and steeply down with roll.
fn from_inside(field: &Field) -> Vec<View> {
    let at = |x: u32, z: u32, above: f64| field.world(x, z) + DVec3::Y * above;
    let lens = Lens::Perspective { fov_x: 1.4 };
    let around = (0..24).map(|k| {
        let (x, z) = (20 + k * 37 % 160, 20 + k * 53 % 130);
        view(at(x, z, 25.0), View::turned(f64::from(k) * 15.0, -8.0, 0.0), lens)
    });
    let down = (0..6).map(|k| view(at(70, 90, 300.0), View::turned(f64::from(k) * 60.0, -75.0, 30.0), lens));
    around.chain(down).collect()
}

fn met(field: &Arc<Field>, views: &[View], settings: &[&str]) -> RayCounts {
    let mut strips = technique(field, "sorted-strips", settings);
    let of_view = |view: &View| {
        let list = list(strips.as_mut(), view);
        watertight::prove_list(field, view, strips.pipeline_requirements().seams, strips.resident(), &list).unwrap();
        follow_between(field, view, &triangles(field, view, &list), list.fraction_bits)
    };
    views.iter().map(of_view).fold(RayCounts::default(), RayCounts::plus)
}

#[test]
fn from_outside_every_ray_meets_triangles_in_order() {
    let field = terrain();
    for settings in [["level=certified", "page=16"], ["level=certified", "page=64"], ["level=uniform", "page=64"]] {
        let met = met(&field, &from_outside(&field), &settings);
        println!("{settings:?}: {met:?}");
        assert!(met.several > 500, "rays meet several triangles: {met:?}");
        assert_eq!((met.unsorted, met.wrong), (0, 0), "{settings:?}");
    }
}

#[test]
fn from_inside_every_ray_meets_triangles_in_order() {
    let field = terrain();
    for settings in [["level=certified", "page=16"], ["level=certified", "page=64"], ["level=uniform", "page=64"]] {
        let met = met(&field, &from_inside(&field), &settings);
        println!("{settings:?}: {met:?}");
        assert!(met.several > 500, "rays meet several triangles: {met:?}");
        assert_eq!((met.unsorted, met.wrong), (0, 0), "{settings:?}");
    }
}

/// Checks every named path, so that the painter's algorithm draws no pixel wrong.
#[test]
fn on_every_named_path_every_ray_meets_triangles_in_order() {
    let field = terrain();
    let tolerance = Tolerance { px: 0.7, metric: Metric::Certified };
    let views =
        |path: &paths::Path| path.views(&field, 200, SIZE, tolerance).into_iter().step_by(19).collect::<Vec<_>>();
    for settings in [["level=certified", "page=64"], ["level=uniform", "page=16"]] {
        let mut all = RayCounts::default();
        for path in paths::PATHS {
            let met = met(&field, &views(path), &settings);
            println!("{settings:?} {}: {met:?}", path.name);
            assert!(met.terrain > 0 && (met.unsorted, met.wrong) == (0, 0), "{settings:?} {}: {met:?}", path.name);
            all = all.plus(met);
        }
        assert!(all.several > 1000, "rays meet several triangles: {all:?}");
    }
}

/// Sliding vertices move the lines between quads, but the walk orders quads by their unmorphed positions, so a few rays
/// are out of order.
#[test]
fn few_rays_are_unsorted_with_sliding_vertices() {
    let field = terrain();
    let views = [from_outside(&field), from_inside(&field)].concat();
    let [still, sliding] =
        ["blend=height", "blend=end"].map(|blend| met(&field, &views, &["level=uniform", "edge=8", "page=64", blend]));
    println!("{still:?} {sliding:?}");
    assert_eq!((still.unsorted, still.wrong), (0, 0));
    assert!(sliding.several > 500 && sliding.wrong > 0 && 50 * sliding.wrong < sliding.terrain, "{sliding:?}");
    // The painter's algorithm is therefore replaced by a depth buffer.
    let depth_mode = |blend: &str| {
        technique(&field, "sorted-strips", &["level=uniform", "order=painter", blend])
            .pipeline_requirements()
            .depth_mode
    };
    assert_eq!(["blend=height", "blend=end"].map(depth_mode), [DepthMode::Painter, DepthMode::Buffer]);
}

/// Compares the list with its reverse: the same triangles, the last one first.
#[test]
fn back_to_front_is_the_reversed_list() {
    let field = terrain();
    for view in from_inside(&field).iter().step_by(3) {
        let [front, mut back] = ["order=front", "order=back"]
            .map(|order| drawn(&field, technique(&field, "sorted-strips", &[order]).as_mut(), view));
        back.reverse();
        let corners = |drawn: &[Drawn]| drawn.iter().map(|t| t.corners.map(|c| (c.x, c.z))).collect::<Vec<_>>();
        let turned = |t: &[(i32, i32); 3]| [*t, [t[1], t[2], t[0]], [t[2], t[0], t[1]]].into_iter().min();
        let sets = [&front, &back].map(|drawn| corners(drawn).iter().map(turned).collect::<Vec<_>>());
        assert!(!front.is_empty() && sets[0] == sets[1]);
    }
}

#[test]
fn serial_walk_gives_the_same_list() {
    let field = terrain();
    let (mut rows, mut parallel_rows) = (0, 0);
    for level in ["level=certified", "level=uniform"] {
        for view in from_inside(&field) {
            let [parallel, serial] = ["sorted-strips", "sorted-strips:serial"].map(|name| {
                let mut strips = technique(&field, name, &[level, "page=16"]);
                let all = View { tolerance: Tolerance { px: 1e-6, ..view.tolerance }, ..view };
                // The frame after a large one is walked on all cores.
                [all, view, view].map(|view| {
                    let mut list = DrawList::default();
                    strips.select(&view, &mut list);
                    list
                })
            });
            let parallel_after = |k: usize| parallel[k - 1].triangles() >= 20_000;
            parallel_rows += (1..3).filter(|&k| parallel_after(k)).map(|k| parallel[k].draws.len()).sum::<usize>();
            for (parallel, serial) in parallel.iter().zip(&serial) {
                assert!(parallel.draws == serial.draws);
                assert!(parallel.streamed.indices == serial.streamed.indices, "{level}");
                assert!(parallel.streamed.vertices == serial.streamed.vertices, "{level}");
                rows += parallel.draws.len();
            }
        }
    }
    println!("{rows} rows of pages, {parallel_rows} of them walked in parallel");
    assert!(parallel_rows >= 100 && rows > 2 * parallel_rows, "{rows} rows of pages, {parallel_rows} in parallel");
}
