//! Clusters: all variants draw the same triangles, with far fewer draws than blocks.

use std::collections::BTreeSet;
use std::sync::Arc;

use cuesta::internal::bench::paths;
use cuesta::internal::draw::expand;
use cuesta::internal::draw::layout::Frame;
use cuesta::internal::draw::weights::SlotWeights;
use cuesta::internal::draw::{Draw, DrawList, Instance, Seams, Source, Submission, Topology};
use cuesta::internal::height::bounds::{Bounds, Measure};
use cuesta::internal::height::progress::Progress;
use cuesta::internal::height::synth::{Kind, synth};
use cuesta::internal::height::{Field, Holes, Samples};
use cuesta::internal::lod::Technique;
use cuesta::internal::lod::clusters::mesh::Mesh;
use cuesta::internal::measure::{geometric, watertight};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;

use super::{heights, technique};

/// Returns a deterministic number in 0..1.
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 53) as f64
}

/// Returns terrain whose roughness changes from square to square, with holes or without.
fn terrain(seed: &mut u64, size: [u32; 2]) -> Arc<Field> {
    let count = (size[0] * size[1]) as usize;
    let roughness: Vec<f64> = (0..32 * 32).map(|_| 100.0 * random(seed).powi(12)).collect();
    let square = 6 + (40.0 * random(seed)) as usize;
    let at = |k: usize| roughness[k / size[0] as usize / square * 32 + k % size[0] as usize / square];
    let heights = (0..count).map(|k| (at(k) * random(seed)) as f32).collect();
    let mut holes = Holes::none(count);
    if random(seed) < 0.3 {
        (0..count).filter(|k| k % 41 < 13).for_each(|k| holes.insert(k));
    }
    Arc::new(Field::new(Samples::F32(heights), size, [3.0, 2.0], holes))
}

/// Returns a view from within the field, or an orthographic view of all of it, where the tolerance is the same
/// everywhere.
fn random_view(field: &Field, seed: &mut u64) -> View {
    let [w, h] = field.size().map(f64::from);
    let eye = field.world_at(w * random(seed), h * random(seed), 20.0 + 300.0 * random(seed).powi(3));
    let near = View {
        eye,
        world_from_eye: View::turned(360.0 * random(seed), -90.0 * random(seed), 0.0),
        lens: Lens::Perspective { fov_x: 0.4 + 1.6 * random(seed) },
        size: [320, 200],
        near: 0.1,
        tolerance: Tolerance { px: 20.0 * random(seed) + 0.1, metric: Metric::Certified },
        time_s: 0.0,
    };
    if random(seed) < 0.5 {
        return near;
    }
    let far = View { lens: Lens::Orthographic { width: 6.0 * w.max(h) * random(seed), far: 1e5 }, ..near };
    View { eye: field.world_at(w / 2.0, h / 2.0, 0.0) - far.forward() * 2000.0, ..far }
}

/// Corners of a triangle: position, and the height as bits.
type Corners = [(i32, i32, u32); 3];

/// Returns the triangles sorted, and the list.
fn drawn(field: &Field, technique: &mut dyn Technique, view: &View) -> (Vec<Corners>, DrawList) {
    let mut list = DrawList::default();
    technique.select(view, &mut list);
    let triangles = expand::triangles(field, &Frame::placing(field, view), technique.resident(), &list);
    let canonical = |corners: Corners| {
        let [a, b, c] = corners;
        [[a, b, c], [b, c, a], [c, a, b]].into_iter().min().expect("three turns")
    };
    let mut sorted: Vec<_> =
        triangles.iter().map(|t| canonical(t.corners.map(|c| (c.x, c.z, c.y.to_bits())))).collect();
    sorted.sort_unstable();
    (sorted, list)
}

#[test]
fn all_modes_draw_the_same_triangles_within_the_tolerance() {
    let mut seed = 11;
    let (mut blocks, mut clusters, mut kinds, mut closest) = (0, 0, BTreeSet::new(), 0.0f64);
    for k in 0..60 {
        let field = terrain(&mut seed, [[97, 81], [130, 65], [70, 133], [129, 129], [17, 17]][k % 5]);
        let seams = if k < 50 { "seams=stitched" } else { "seams=skirts" };
        let settings = ["block=8", ["morph=off", "morph=on", "morph=distance"][k / 2 % 3], seams];
        let mut modes = ["clusters", "clusters:draw-per-cluster", "clusters:draw-per-block"]
            .map(|m| technique(&field, m, &settings));
        for _ in 0..20 {
            let view = random_view(&field, &mut seed);
            let [(indirect, list), (cluster, each), (block, single)] =
                modes.each_mut().map(|mode| drawn(&field, mode.as_mut(), &view));
            assert!(indirect == cluster, "draw-per-cluster draws other triangles");
            assert!(indirect == block, "draw-per-block draws other triangles");
            assert_eq!([list.submission, each.submission, single.submission], {
                [Submission::Indirect, Submission::Direct, Submission::Direct]
            });
            assert!(list.draws.len() <= 23 && list.commands() <= 1 && each.draws.len() == list.instances.len());
            if seams == "seams=stitched" {
                kinds.extend(list.draws.iter().map(|draw| draw.indices.start));
            }
            for (mode, list) in modes.iter().zip([&list, &each, &single]) {
                let proof =
                    watertight::prove_list(&field, &view, mode.pipeline_requirements().seams, mode.resident(), list);
                proof.unwrap_or_else(|why| panic!("{settings:?}: {why}"));
            }
            let errors = geometric::errors(&field, &view, modes[0].resident(), &list);
            let share = errors.screen_px.max / view.tolerance.px;
            assert!(share <= 1.0 + 1e-9, "{share} of the tolerance, {settings:?}, at {:?}", errors.screen_at);
            closest = closest.max(share);
            blocks += single.draws.len();
            clusters += each.draws.len();
        }
    }
    println!("{blocks} blocks in {clusters} clusters of {} kinds, {closest} of the tolerance", kinds.len());
    assert!(closest > 0.9, "the bound is not tight: {closest} of the tolerance");
    assert!(kinds.len() == 23, "only {} kinds of clusters occurred", kinds.len());
    assert!(clusters * 3 < blocks, "{clusters} clusters for {blocks} blocks");
}

/// Terrain so smooth that distance alone determines the levels, so that many meet in one view.
#[test]
fn morph_by_distance_is_watertight_and_within_the_tolerance() {
    let (mut seed, mut meeting) = (23, 0);
    for k in 0..4 {
        let size = [[257, 257], [257, 200], [230, 257], [129, 257]][k];
        let rough = synth(Kind::Fractal, size, 7 + k as u64);
        let heights = (0..(size[0] * size[1]) as usize).map(|k| 0.01 * rough.samples().height(k)).collect();
        let field = Arc::new(Field::new(Samples::F32(heights), size, [3.0, 2.0], Holes::none(0)));
        let settings = ["block=8", "morph=distance"];
        let mut modes = ["clusters", "clusters:draw-per-block"].map(|mode| technique(&field, mode, &settings));
        for _ in 0..20 {
            let view = random_view(&field, &mut seed);
            let [(clusters, list), (blocks, _)] = modes.each_mut().map(|mode| drawn(&field, mode.as_mut(), &view));
            assert!(clusters == blocks, "draw-per-block draws other triangles");
            let proof = watertight::prove_list(&field, &view, Seams::Shared, modes[0].resident(), &list);
            proof.unwrap_or_else(|why| panic!("{size:?}: {why}"));
            let errors = geometric::errors(&field, &view, modes[0].resident(), &list);
            assert!(errors.screen_px.max <= view.tolerance.px * (1.0 + 1e-9), "{size:?} at {:?}", errors.screen_at);
            meeting += usize::from(list.levels().iter().filter(|count| **count > 0).count() > 1);
        }
    }
    println!("levels meet in {meeting} of 80 views");
    assert!(meeting > 20, "levels meet in {meeting} of 80 views only");
}

#[test]
fn all_modes_draw_the_same_along_paths() {
    let mut field = synth(Kind::Eroded, [513, 513], 7);
    field.spacing = [25.0; 2];
    let field = Arc::new(field);
    for morph in ["morph=off", "morph=on", "morph=distance"] {
        let modes = ["clusters", "clusters:draw-per-cluster", "clusters:draw-per-block"];
        let mut modes = modes.map(|mode| technique(&field, mode, &[morph, "block=16"]));
        for path in ["skim", "circle"].map(|name| paths::find(name).expect("a named path")) {
            let tolerance = Tolerance { px: 4.0, metric: Metric::Certified };
            for (frame, view) in path.views(&field, 48, [320, 180], tolerance).iter().enumerate() {
                let [indirect, cluster, block] = modes.each_mut().map(|mode| drawn(&field, mode.as_mut(), view).0);
                let what = format!("{morph}, frame {frame} of {}", path.name);
                assert!(!indirect.is_empty() && indirect == cluster && indirect == block, "{what}");
            }
        }
    }
}

/// Returns a field that is flat except for a rough spot on each side of the squares of sixteen samples.
fn rough_spots(seed: &mut u64) -> Field {
    let (reach, along) = (2 + (*seed >> 40) as u32 % 3, 2 + (*seed >> 44) as u32 % 11);
    let spot = |a: u32, b: u32| (a + 2) % 16 < 5 && b % 16 >= along && b % 16 < along + reach;
    let rough = |k: u32| spot(k % 129, k / 129) || spot(k / 129, k % 129);
    let height = |k: u32| if rough(k) { 100.0 * random(seed) as f32 } else { 0.0 };
    Field::new(Samples::F32((0..129 * 129).map(height).collect()), [129; 2], [1.0; 2], Holes::none(129 * 129))
}

/// Checks that the four blocks in a node stay within the node's error at any morph weights.
#[test]
fn no_morph_weights_exceed_the_error() {
    let (mut seed, mut closest) = (5, [0.0f64; 4]);
    let mesh = Mesh::new(16, &[[1, 0, 0, 0]], Seams::Shared);
    for _ in 0..20 {
        let field = rough_spots(&mut seed);
        let view = random_view(&field, &mut seed);
        let bounds =
            Bounds::new(&field, Measure { cells: 8, growth: 1.0, errors: true, morph: true }, &Progress::default());
        for level in 1..4u32 {
            let nodes = 128 >> (3 + level);
            for (node, draw) in (0..nodes * nodes).flat_map(|node| (0..8).map(move |draw| (node, draw))) {
                let at = [node % nodes, node / nodes];
                // A side is beyond the next level only if the inside is morphing.
                let inside = [0, 0, 0, 63, 0, 17, 40, 63][draw];
                let sides = [
                    [0; 4],
                    [64; 4],
                    [127; 4],
                    [127; 4],
                    [90, 64, 127, 0],
                    [64, 81, 17, 70],
                    [64, 104, 90, 40],
                    [127, 64, 100, 63],
                ][draw];
                let instance = Instance {
                    origin: at.map(|n| (n * bounds.side(level)) as i32),
                    cells: 32,
                    level: level - 1,
                    shift: level as i32 - 2,
                    ..Instance::default()
                };
                let instance = instance.with_weights(SlotWeights::uniform(inside, sides));
                let indices = mesh.ranges[0].clone();
                let draws = vec![Draw {
                    source: Source::Lattice,
                    topology: Topology::Triangles,
                    indices,
                    instances: 0..1,
                    first_vertex: 0,
                }];
                let list = DrawList { draws, instances: vec![instance], ..DrawList::default() };
                let drawn = heights(&field, &view, &mesh.geometry, &list);
                let off = (0u32..).zip(&drawn).filter(|(_, y)| !y.is_nan());
                let off = off.map(|(k, y)| (y - f64::from(field.height(k % 129, k / 129))).abs()).fold(0.0, f64::max);
                let error = f64::from(bounds.square(level, at).error);
                let on_sides = level == 1;
                assert!(on_sides || off <= error, "level {level} at {at:?}, {inside} {sides:?}: {off} m of {error} m");
                closest[level as usize] = closest[level as usize].max(if on_sides { 0.0 } else { off / error });
            }
        }
    }
    // The bound must also be tight.
    assert!(closest[2..].iter().all(|&share| share > 0.97), "{closest:?} of the error");
}

/// A view straight down on terrain so steep that its error in front of the eye exceeds every finite tolerance with few
/// enough blocks. The paper's metric must be used.
#[test]
fn paper_metric_is_used_if_no_certified_tolerance_fits() {
    let field = Arc::new(synth(Kind::Checker, [4097, 1537], 1));
    let view = View {
        eye: DVec3::new(2048.0, 33_000.0, 768.0),
        world_from_eye: View::turned(0.0, -90.0, 0.0),
        lens: Lens::Perspective { fov_x: 1.2 },
        size: [640, 360],
        near: 0.1,
        tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
        time_s: 0.0,
    };
    let forms = [
        ("clusters", &["block=8"][..]),
        ("clusters:draw-per-block", &["block=8"]),
        ("clusters", &["block=8", "morph=on", "seams=skirts"]),
        ("clusters:gpu-driven", &["block=8", "morph=distance"]),
    ];
    for (name, settings) in forms {
        let mut technique = technique(&field, name, settings);
        let mut list = DrawList::default();
        technique.select(&view, &mut list);
        println!("{name} {settings:?}: {} times the tolerance, {} triangles", list.tolerance_scale, list.triangles());
        assert!(technique.limits().hold(&list.size()), "{name} {settings:?}");
        assert!(list.tolerance_scale == f64::INFINITY && list.triangles() > 100, "{name} {settings:?}");
    }
}
