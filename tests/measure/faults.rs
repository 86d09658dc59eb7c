//! Faults planted in what geomipmap draws: each must be found, named, and shown.

use std::sync::Arc;

use cuesta::internal::draw::expand::Drawn;
use cuesta::internal::height::surface::{Corner, doubled_area};
use cuesta::internal::height::{Field, demo, synth};
use cuesta::internal::measure::watertight::{self, CounterExample, Kind};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};

use super::{drawn, plan, select, technique};
use crate::synth::assets::{KIND, SEED};

struct Scene {
    field: Arc<Field>,
    view: View,
    triangles: Vec<Drawn>,
}

/// Land of the demo's kind in a view that takes blocks of several levels.
fn scene() -> Scene {
    let mut field = synth::synth(KIND, [257, 257], SEED);
    field.spacing = [demo::SPACING; 2];
    let field = Arc::new(field);
    let eye = field.world_at(20.0, 230.0, f64::from(field.statistics().max) + 200.0);
    let view = View {
        eye,
        world_from_eye: View::looking_along(field.world(128, 128) - eye),
        lens: Lens::Perspective { fov_x: 1.2 },
        size: [1280, 720],
        near: 1.0,
        tolerance: Tolerance { px: 20.0, metric: Metric::Certified },
        time_s: 0.0,
    };
    let mut technique = technique(&field, "geomipmap", &["block=17"]);
    let list = select(&mut *technique, &view);
    assert!(list.levels().iter().filter(|&&n| n > 0).count() >= 3, "levels {:?}", list.levels());
    let triangles = drawn(&field, &view, &*technique, &list);
    Scene { field, view, triangles }
}

impl Scene {
    fn prove(&self, triangles: &[Drawn]) -> Result<watertight::Proof, Box<CounterExample>> {
        watertight::prove(&self.field, &self.view.frustum(), triangles, 0)
    }

    /// The fault of the triangles, which is where it was planted and can be written and drawn.
    fn found(&self, triangles: &[Drawn], kind: Kind, at: [i32; 2]) {
        let found = self.prove(triangles).expect_err("a planted fault");
        assert_eq!(found.kind, kind, "{found}");
        assert!((1..=2).contains(&found.triangles.len()), "no more than it takes: {found}");
        let touches = found.triangles.iter().any(|t| t.iter().any(|c| [c.x, c.z] == at));
        assert!(touches, "planted at {at:?}, found {found}");
        let mut ply = Vec::new();
        watertight::write_ply(&self.field, &found.triangles, 0, &mut ply).expect("memory takes anything");
        let ply = String::from_utf8(ply).expect("text");
        assert!(ply.contains(&format!("element face {}\n", found.triangles.len())), "{ply}");
        let picture = plan::picture(triangles, &found);
        let marked = picture.pixels().filter(|p| p.0[0].abs_diff(p.0[2]) > 60).count();
        let share = marked as f64 / picture.pixels().len() as f64;
        assert!((0.01..0.5).contains(&share), "{kind:?}: {share} of the picture is marked");
    }

    /// The triangle nearest the middle of the picture that has a property.
    fn middle(&self, has: impl Fn(&Drawn) -> bool) -> usize {
        let centre =
            |t: &Drawn| t.corners.iter().map(|c| self.field.world(c.x as u32, c.z as u32)).sum::<glam::DVec3>() / 3.0;
        let away = |t: &Drawn| {
            self.view.project(centre(t)).map_or(f64::INFINITY, |p| p.pixel.distance(glam::DVec2::new(640.0, 360.0)))
        };
        let candidates = (0..self.triangles.len()).filter(|&k| has(&self.triangles[k]));
        candidates
            .min_by(|&a, &b| away(&self.triangles[a]).total_cmp(&away(&self.triangles[b])))
            .expect("such a triangle")
    }

    /// Of triangle `k`: whether another triangle uses the edge after corner `n` the other way round.
    fn neighbour(&self, triangle: &Drawn, n: usize) -> Option<usize> {
        let (from, to) = (position(&triangle.corners[n]), position(&triangle.corners[(n + 1) % 3]));
        self.triangles
            .iter()
            .position(|t| (0..3).any(|m| (position(&t.corners[m]), position(&t.corners[(m + 1) % 3])) == (to, from)))
    }
}

fn position(corner: &Corner) -> [i32; 2] {
    [corner.x, corner.z]
}

fn on_field(field: &Field, [x, z]: [i32; 2]) -> Corner {
    Corner { x, z, y: field.height(x as u32, z as u32) }
}

#[test]
fn without_a_fault_it_is_proven() {
    let scene = scene();
    let proof = scene.prove(&scene.triangles).expect("one surface");
    assert_eq!(proof.triangles, scene.triangles.len());
}

#[test]
fn a_t_junction_is_found() {
    let scene = scene();
    let long = |t: &Drawn| doubled_area(&t.corners) >= 4 && (0..3).all(|n| scene.neighbour(t, n).is_some());
    let victim = scene.middle(long);
    let mut triangles = scene.triangles.clone();
    let whole = triangles.swap_remove(victim);
    let even = |n: &usize| {
        let [a, b] = [whole.corners[*n], whole.corners[(n + 1) % 3]];
        (a.x + b.x) % 2 == 0 && (a.z + b.z) % 2 == 0
    };
    let n = (0..3).find(even).expect("an edge with a sample in its middle");
    let [a, b, c] = [0, 1, 2].map(|k| whole.corners[(n + k) % 3]);
    let middle = [(a.x + b.x) / 2, (a.z + b.z) / 2];
    let m = on_field(&scene.field, middle);
    triangles.extend([[a, m, c], [m, b, c]].map(|corners| Drawn { corners, ..whole }));
    scene.found(&triangles, Kind::TJunction, middle);
}

#[test]
fn a_gap_is_found() {
    let scene = scene();
    for smallest in [1, 8] {
        let victim = scene.middle(|t| doubled_area(&t.corners) >= smallest);
        let mut triangles = scene.triangles.clone();
        let missing = triangles.swap_remove(victim);
        let found = scene.prove(&triangles).expect_err("a gap");
        // The missing triangle is one of the samples' own, inside the one taken out.
        let inner = found.triangles[0].iter().find(|c| missing.corners.iter().any(|d| position(c) == position(d)));
        let at = inner.map_or(position(&found.triangles[0][0]), position);
        let low = missing.corners.map(|c| position(&c)).into_iter().reduce(|a, b| [a[0].min(b[0]), a[1].min(b[1])]);
        let high = missing.corners.map(|c| position(&c)).into_iter().reduce(|a, b| [a[0].max(b[0]), a[1].max(b[1])]);
        let (low, high) = (low.expect("corners"), high.expect("corners"));
        assert!((0..2).all(|k| (low[k]..=high[k]).contains(&at[k])), "{found} in {missing:?}");
        scene.found(&triangles, Kind::Gap, at);
    }
}

#[test]
fn an_overlap_is_found() {
    let scene = scene();
    let victim = scene.middle(|_| true);
    let mut triangles = scene.triangles.clone();
    triangles.push(Drawn { instance: 0, ..triangles[victim] });
    scene.found(&triangles, Kind::Overlap, position(&triangles[victim].corners[0]));
    // A coarser triangle over several fine ones, with no edge of theirs.
    let corner = position(&triangles[victim].corners[0]);
    let far = [[0, 0], [1, 7], [7, 3]].map(|[x, z]| on_field(&scene.field, [corner[0] + x, corner[1] + z]));
    triangles.pop();
    triangles.push(Drawn { corners: far, instance: 0 });
    let found = scene.prove(&triangles).expect_err("an overlap");
    assert_eq!(found.kind, Kind::Overlap, "{found}");
}

/// A vertex pulled over the far side of its neighbours turns triangles over.
#[test]
fn a_fold_is_found() {
    let scene = scene();
    let victim = scene.triangles[scene.middle(|_| true)];
    let [a, b, c] = victim.corners;
    let over = [b.x + c.x - a.x, b.z + c.z - a.z];
    let moved = on_field(&scene.field, over);
    let pull = |corner: Corner| if position(&corner) == position(&a) { moved } else { corner };
    let triangles: Vec<Drawn> = scene.triangles.iter().map(|t| Drawn { corners: t.corners.map(pull), ..*t }).collect();
    scene.found(&triangles, Kind::Fold, over);
}

#[test]
fn one_ulp_between_two_blocks_is_found() {
    let scene = scene();
    let shared =
        |t: &Drawn| (0..3).any(|n| scene.neighbour(t, n).is_some_and(|m| scene.triangles[m].instance != t.instance));
    let victim = scene.middle(shared);
    let mut triangles = scene.triangles.clone();
    let own = triangles[victim];
    let n = (0..3)
        .find(|&n| scene.neighbour(&own, n).is_some_and(|m| scene.triangles[m].instance != own.instance))
        .expect("an edge between blocks");
    // All of the block agree on the new height: only along its side does it differ.
    let at = position(&own.corners[n]);
    for triangle in triangles.iter_mut().filter(|t| t.instance == own.instance) {
        for corner in triangle.corners.iter_mut().filter(|c| position(c) == at) {
            corner.y = corner.y.next_up();
        }
    }
    scene.found(&triangles, Kind::Crack, at);
}
