//! Sorted strips: one surface whatever the level function, and triangles in the order of sight.

use cuesta::draw::expand::Drawn;
use cuesta::height::surface::Corner;
use cuesta::height::{Field, Holes, Samples};
use cuesta::lod::sorted_strips::pages::{Gaze, Grid, Pages};
use cuesta::lod::sorted_strips::shapes::Shapes;
use cuesta::lod::sorted_strips::splits::{Levels, Splits};
use cuesta::lod::sorted_strips::walk::Ground;
use cuesta::measure::watertight;
use cuesta::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;
use rayon::prelude::*;

/// Deterministic random numbers.
struct Dice(u64);

impl Dice {
    /// 0..1.
    fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// 0..n.
    fn below(&mut self, n: i32) -> i32 {
        (self.share() * f64::from(n)) as i32
    }

    fn sign(&mut self) -> i32 {
        if self.share() < 0.5 { -1 } else { 1 }
    }
}

/// A field, pages of it and a level function, all at random, and where it is looked at from.
struct Scene {
    field: Field,
    pages: Pages,
    splits: Splits,
    gaze: Gaze,
}

impl Scene {
    fn random(seed: u64) -> Self {
        let mut dice = Dice(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15));
        let size = [0; 2].map(|_| 2 + dice.below(120) as u32);
        let heights = (0..size[0] * size[1]).map(|_| dice.share() as f32).collect();
        let field = Field::new(Samples::F32(heights), size, [1.0; 2], Holes::none((size[0] * size[1]) as usize));
        let grid = Grid::new(&field, 1 + dice.below(6) as u32, 1 << 16);
        let mut pages = Pages::none(grid);
        let all = (0..grid.count[1]).flat_map(|z| (0..grid.count[0]).map(move |x| [x as i32, z as i32]));
        let part = if dice.share() < 0.5 { 1.0 } else { dice.share() };
        pages.set(all.filter(|_| dice.share() <= part).collect::<Vec<_>>());
        let mut splits = Splits::new(grid);
        for _ in 0..dice.below(1 + (grid.count[0] * grid.count[1]) as i32 * 3) {
            let level = 1 + dice.below(grid.level as i32) as u32;
            let at = grid.count.map(|n| dice.below((n << (grid.level - level)) as i32));
            splits.insert(&pages, level, at);
        }
        splits.close(&pages);
        let eye = size.map(|n| f64::from(n) * (2.0 * dice.share() - 0.5));
        let gaze = Gaze { major: dice.below(2) as usize, eye, ahead: [dice.sign(), dice.sign()] };
        Self { field, pages, splits, gaze }
    }

    fn triangles(&self) -> Vec<Drawn> {
        let shapes = Shapes::default();
        let (major, eye) = (self.gaze.major, self.gaze.eye);
        let ground =
            Ground { field: &self.field, pages: &self.pages, levels: &self.splits, shapes: &shapes, major, eye };
        let streams = self.pages.rows(&self.gaze).into_iter().map(|row| ground.walk(&row));
        streams
            .flat_map(|stream| {
                let corner = |k: u32| {
                    let vertex = stream.vertices[k as usize];
                    Corner { x: vertex.position[0], z: vertex.position[1], y: vertex.height }
                };
                let triangle = |t: &[u32]| Drawn { corners: [corner(t[0]), corner(t[1]), corner(t[2])], instance: 0 };
                stream.indices.chunks_exact(3).map(triangle).collect::<Vec<_>>()
            })
            .collect()
    }

    /// Twice the area of the pages drawn, samples².
    fn doubled_area(&self) -> i64 {
        let Grid { last, .. } = self.pages.grid;
        let side = self.pages.grid.side();
        let length = |at: i32, last: i32| i64::from(((at + 1) * side).min(last) - at * side);
        self.pages.list().iter().map(|at| 2 * length(at[0], last[0]) * length(at[1], last[1])).sum()
    }
}

/// A view of nothing.
fn nothing() -> View {
    View {
        eye: DVec3::new(1e7, 0.0, 0.0),
        world_from_eye: View::turned(0.0, 0.0, 0.0),
        lens: Lens::Perspective { fov_x: 0.1 },
        size: [100, 100],
        near: 1.0,
        tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
    }
}

#[test]
fn ten_thousand_level_functions_give_one_surface_each() {
    let frustum = nothing().frustum();
    let proofs: Vec<_> = (0..12_000u64)
        .into_par_iter()
        .map(|seed| {
            let scene = Scene::random(seed);
            let triangles = scene.triangles();
            let proof = watertight::prove(&scene.field, &frustum, &triangles)
                .unwrap_or_else(|why| panic!("seed {seed}, {:?}, {:?}: {why}", scene.pages.grid, scene.gaze));
            assert_eq!(proof.doubled_area, scene.doubled_area(), "seed {seed}");
            (proof.triangles, (1..7).filter(|&l| is_any_split(&scene, l)).count())
        })
        .collect();
    let (triangles, levels): (Vec<_>, Vec<_>) = proofs.into_iter().unzip();
    println!("{} triangles in {} surfaces", triangles.iter().sum::<usize>(), triangles.len());
    assert!(levels.iter().filter(|&&levels| levels > 2).count() > 3000, "most have several levels");
}

fn is_any_split(scene: &Scene, level: u32) -> bool {
    let Grid { level: page, count, .. } = scene.pages.grid;
    let count = count.map(|n| if level > page { 0 } else { n << (page - level) } as i32);
    (0..count[1]).any(|z| (0..count[0]).any(|x| scene.splits.is_split(level, [x, z])))
}

/// In plan: rays from the eye, away from its own row and column of pages on their far sides, meet triangles in the
/// order in which they come.
#[test]
fn rays_meet_triangles_in_order() {
    let met: usize = (0..600u64).into_par_iter().map(|seed| meet_in_order(seed, &Scene::random(seed))).sum();
    println!("{met} triangles met");
    assert!(met > 10_000);
}

fn meet_in_order(seed: u64, scene: &Scene) -> usize {
    let mut dice = Dice(seed);
    let triangles = scene.triangles();
    let (eye, ahead) = (scene.gaze.eye, scene.gaze.ahead);
    let mut met_in_all = 0;
    for _ in 0..20 {
        let towards = [0, 1].map(|k| f64::from(ahead[k]) * dice.share());
        let mut met: Vec<(f64, usize)> =
            triangles.iter().enumerate().filter_map(|(k, t)| Some((middle_inside(t, eye, towards)?, k))).collect();
        met.sort_by(|a, b| a.0.total_cmp(&b.0));
        assert!(met.is_sorted_by_key(|m| m.1), "seed {seed}: from {eye:?} towards {towards:?}: {met:?}");
        met_in_all += met.len();
    }
    met_in_all
}

/// How far along a ray the middle of its part in a triangle is, if it has such a part in front of the eye.
fn middle_inside(triangle: &Drawn, eye: [f64; 2], towards: [f64; 2]) -> Option<f64> {
    let (mut first, mut last) = (0.0f64, f64::INFINITY);
    for k in 0..3 {
        let [p, q] = [triangle.corners[k], triangle.corners[(k + 1) % 3]].map(|c| [f64::from(c.x), f64::from(c.z)]);
        let side = [q[0] - p[0], q[1] - p[1]];
        // Inside: not to the left, seen from above with z south.
        let value = side[1] * (eye[0] - p[0]) - side[0] * (eye[1] - p[1]);
        let slope = side[1] * towards[0] - side[0] * towards[1];
        let at = -value / slope;
        if slope > 0.0 {
            first = first.max(at);
        } else if slope < 0.0 {
            last = last.min(at);
        } else if value < 0.0 {
            return None;
        }
    }
    (last - first > 1e-9).then_some((first + last) / 2.0)
}
