//! Sphere tree over procedural terrain: checks the error bound against the terrain itself, at heights from 400 km to
//! less than a metre.

use std::collections::HashSet;
use std::sync::Arc;

use cuesta::internal::draw::expand::{self, Drawn};
use cuesta::internal::draw::layout::Frame;
use cuesta::internal::draw::place::explicit_height;
use cuesta::internal::draw::{DrawList, ExplicitVertex};
use cuesta::internal::height::Field;
use cuesta::internal::height::bezier::{Bezier, LAYERS, SIDE_M, SPACING_M};
use cuesta::internal::lod::Technique;
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::{DVec2, DVec3};

const TOLERANCE_PX: f64 = 8.0;

fn terrain() -> Arc<Field> {
    Arc::new(Field::endless(Arc::new(Bezier::new(1, LAYERS))))
}

/// Returns a view from this height above a fixed place.
fn view(field: &Field, above_m: f64, yaw: f64) -> View {
    let at = DVec3::new(0.43, 0.0, 0.37) * SIDE_M;
    let ground = field.height_at(at.x, at.z).expect("over the land");
    View {
        eye: DVec3::new(at.x, ground + above_m, at.z),
        // High above, the terrain is below; nearer to it, the horizon is in the picture.
        world_from_eye: View::turned(yaw, if above_m > 1e5 { -75.0 } else { -15.0 }, 0.0),
        lens: Lens::Perspective { fov_x: 1.0 },
        size: [320, 200],
        near: 0.1 * above_m.min(1.0),
        tolerance: Tolerance { px: TOLERANCE_PX, metric: Metric::Certified },
        time_s: 0.0,
    }
}

fn selected(technique: &mut dyn Technique, view: &View) -> DrawList {
    let mut list = DrawList::default();
    technique.select(view, &mut list);
    assert_eq!(list.tolerance_scale, 1.0);
    assert!(technique.limits().hold(&list.size()));
    assert_eq!(list.streamed.normals.len(), list.streamed.vertices.len());
    list
}

fn drawn(field: &Field, technique: &mut dyn Technique, view: &View) -> Vec<Drawn> {
    let list = selected(technique, view);
    expand::triangles(field, &Frame::placing(field, view), technique.resident(), &list)
}

/// Returns the list's triangles in world coordinates, at the precision that reaches the device.
fn world(list: &DrawList) -> Vec<[DVec3; 3]> {
    let corner = |vertex: &ExplicitVertex| {
        let [x, z] = vertex.position.map(|n| f64::from(n) * SPACING_M);
        let height = explicit_height(&list.instances[0], vertex);
        DVec3::new(x, f64::from(list.height_base) + f64::from(height), z)
    };
    let [draw] = &list.draws[..] else { panic!("{} draws", list.draws.len()) };
    let indices = &list.streamed.indices[draw.indices.start as usize..draw.indices.end as usize];
    let corners = |t: &[u32; 3]| t.map(|k| corner(&list.streamed.vertices[(k + draw.first_vertex) as usize]));
    indices.as_chunks().0.iter().map(corners).collect()
}

/// Heights of the eye above the terrain, metres.
fn zoom() -> impl Iterator<Item = f64> {
    (0..13).map(|k| 4e5 * 0.3f64.powi(k))
}

#[test]
fn tolerance_is_kept_at_all_heights() {
    let field = terrain();
    let bezier = Arc::clone(field.procedural().expect("endless"));
    for morph in ["morph=off", "morph=on"] {
        let mut technique = super::technique(&field, "sphere-tree", &[morph]);
        let mut dice = fastrand::Rng::with_seed(3);
        for above_m in zoom() {
            let view = view(&field, above_m, 40.0);
            let triangles = world(&selected(&mut *technique, &view));
            let (worst, seen) = worst_px(&bezier, &view, &triangles, &mut dice);
            println!("{morph}, {above_m:9.3} m: {} triangles, {worst:.3} px at {seen} places", triangles.len());
            assert!(worst <= TOLERANCE_PX, "{above_m} m: {worst} px");
            assert!(worst > 0.05 * TOLERANCE_PX && seen > 500, "{above_m} m: {worst} px at {seen} places");
        }
    }
}

/// Returns the largest error at random places of visible triangles, pixels, and the number of places.
fn worst_px(terrain: &Bezier, view: &View, triangles: &[[DVec3; 3]], dice: &mut fastrand::Rng) -> (f64, usize) {
    let (mut worst, mut seen) = (0.0f64, 0);
    for &[a, b, c] in triangles {
        for _ in 0..6 {
            let (mut u, mut v) = (dice.f64(), dice.f64());
            if u + v > 1.0 {
                (u, v) = (1.0 - u, 1.0 - v);
            }
            let drawn = a + (b - a) * u + (c - a) * v;
            let truth = DVec3::new(drawn.x, terrain.height([drawn.x, drawn.z]), drawn.z);
            if [drawn, truth].iter().any(|&at| view.project(at).is_some_and(|at| view.in_picture(&at))) {
                worst = worst.max(view.displacement_px(drawn, truth));
                seen += 1;
            }
        }
    }
    (worst, seen)
}

/// Less than half a millimetre above terrain that is thousands of metres high. Single precision of absolute heights
/// would cause errors of pixels, but heights are relative to the eye's.
#[test]
fn tolerance_is_kept_below_single_precision_of_heights() {
    let field = terrain();
    let bezier = Arc::clone(field.procedural().expect("endless"));
    for morph in ["morph=off", "morph=on"] {
        let mut technique = super::technique(&field, "sphere-tree", &[morph]);
        let mut dice = fastrand::Rng::with_seed(3);
        let (size, tolerance) = ([40, 25], Tolerance { px: 1.0, metric: Metric::Certified });
        let view = View { size, tolerance, ..view(&field, 0.0004, 40.0) };
        let triangles = world(&selected(&mut *technique, &view));
        let (worst, seen) = worst_px(&bezier, &view, &triangles, &mut dice);
        let rounded: Vec<_> =
            triangles.iter().map(|t| t.map(|at| DVec3::new(at.x, f64::from(at.y as f32), at.z))).collect();
        let (worst_rounded, _) = worst_px(&bezier, &view, &rounded, &mut dice);
        println!("{morph}: {worst:.3} px at {seen} places; {worst_rounded:.3} px with rounded heights");
        assert!(worst <= 1.0 && seen > 500 && worst_rounded > 1.0, "{morph}: {worst} px, {worst_rounded} px rounded");
    }
}

/// Checks that no vertex lies within a side of a triangle, and that all visible terrain is drawn.
#[test]
fn mesh_conforms_and_covers_the_view() {
    let field = terrain();
    let mut technique = super::technique(&field, "sphere-tree", &[]);
    let mut dice = fastrand::Rng::with_seed(5);
    for above_m in zoom() {
        let view = view(&field, above_m, 130.0);
        let triangles = drawn(&field, &mut *technique, &view);
        let vertices: HashSet<[i32; 2]> = triangles.iter().flat_map(|t| t.corners.map(|c| [c.x, c.z])).collect();
        for corners in triangles.iter().map(|t| t.corners.map(|c| [c.x, c.z])) {
            for (a, b) in [(0, 1), (1, 2), (2, 0)].map(|(a, b)| (corners[a], corners[b])) {
                let sum = [0, 1].map(|k| a[k] + b[k]);
                let is_vertex = sum.iter().all(|n| n % 2 == 0) && vertices.contains(&sum.map(|n| n / 2));
                assert!(!is_vertex, "{above_m} m: a vertex within {a:?} to {b:?}");
            }
        }
        let mut seen = 0;
        for _ in 0..4000 {
            // Dense around the eye, and out to the horizon.
            let (turn, far_m) = (dice.f64() * std::f64::consts::TAU, above_m * 10f64.powf(4.0 * dice.f64() - 1.0));
            let [x, z] = [view.eye.x + far_m * turn.cos(), view.eye.z + far_m * turn.sin()];
            let Some(y) = field.height_at(x, z) else { continue };
            if view.project(DVec3::new(x, y, z)).is_some_and(|at| view.in_picture(&at)) {
                let at = DVec2::new(x, z) / SPACING_M;
                assert!(triangles.iter().any(|t| covers(t, at)), "{above_m} m: nothing is drawn at {x}, {z}");
                seen += 1;
            }
        }
        assert!(seen > 50, "{above_m} m: {seen} places");
    }
}

fn covers(triangle: &Drawn, at: DVec2) -> bool {
    let [a, b, c] = triangle.corners.map(|c| DVec2::new(f64::from(c.x), f64::from(c.z)) - at);
    let areas = [a.perp_dot(b), b.perp_dot(c), c.perp_dot(a)];
    areas.iter().all(|&n| n <= 0.0) || areas.iter().all(|&n| n >= 0.0)
}

#[test]
fn all_criteria_draw_the_same_on_procedural_terrain() {
    let field = terrain();
    let criteria = ["criterion=spheres", "criterion=covers", "criterion=roam", "criterion=plain"];
    let mut techniques = criteria.map(|criterion| super::technique(&field, "sphere-tree", &[criterion]));
    let mut dice = fastrand::Rng::with_seed(8);
    let mut view = view(&field, 40.0, 10.0);
    for step in 0..60 {
        let fall = if step == 30 { 3000.0 } else { 3.0 };
        view.eye += DVec3::new(dice.f64() - 0.5, dice.f64() - 0.5, dice.f64() - 0.5) * fall;
        let lists = techniques.each_mut().map(|technique| {
            let mut list = DrawList::default();
            technique.select(&view, &mut list);
            list
        });
        for list in &lists {
            let bytes = |list: &DrawList| bytemuck::cast_slice::<_, u8>(&list.streamed.vertices).to_vec();
            assert!(
                list.streamed.indices == lists[3].streamed.indices && bytes(list) == bytes(&lists[3]),
                "step {step}"
            );
        }
    }
}
