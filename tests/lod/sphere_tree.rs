//! Sphere tree: all criteria draw the same triangles, independent of the path to a view.

use std::sync::Arc;

use cuesta::internal::draw::layout::Frame;
use cuesta::internal::draw::{DrawList, ExplicitVertex, Geometry, Source, Upload, expand};
use cuesta::internal::height::progress::Progress;
use cuesta::internal::height::synth::{self, Kind};
use cuesta::internal::height::{Field, Holes, Samples};
use cuesta::internal::lod::sphere_tree::bounding_spheres::BoundingSpheres;
use cuesta::internal::lod::sphere_tree::covers::Covers;
use cuesta::internal::lod::sphere_tree::diamond_info::DiamondInfo;
use cuesta::internal::lod::sphere_tree::front::{CrossingTracker, Follower};
use cuesta::internal::lod::sphere_tree::lattice::Place;
use cuesta::internal::lod::sphere_tree::measure::Measured;
use cuesta::internal::lod::sphere_tree::reach::{Reach, Viewpoint};
use cuesta::internal::lod::sphere_tree::roam::Queues;
use cuesta::internal::lod::sphere_tree::splits::{Found, Splits};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;

/// Deterministic random numbers.
struct Dice(u64);

impl Dice {
    /// Returns a number in 0..1.
    fn share(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    /// Returns a point in a cube about 0 of side 2.
    fn direction(&mut self) -> DVec3 {
        DVec3::new(self.share(), self.share(), self.share()) * 2.0 - 1.0
    }
}

fn terrain(size: [u32; 2]) -> Arc<Field> {
    let mut field = synth::synth(Kind::Fractal, size, 3);
    field.spacing = [10.0, 12.0];
    Arc::new(field)
}

/// Returns a field without correlation of neighbouring samples.
fn noise(size: [u32; 2]) -> Arc<Field> {
    let mut dice = Dice(9);
    let heights = (0..size[0] * size[1]).map(|_| 50.0 * dice.share() as f32).collect();
    Arc::new(Field::new(Samples::F32(heights), size, [3.0, 3.0], Holes::none((size[0] * size[1]) as usize)))
}

/// Returns smooth terrain over 1280 m, of a size without partial diamonds.
fn hills() -> Arc<Field> {
    let height = |x: f32, z: f32| 40.0 * (x / 9.0).sin() + 30.0 * (z / 7.0).cos() + 2.0 * (1.3 * x + z).sin();
    let heights = (0..129 * 129).map(|k| height((k % 129) as f32, (k / 129) as f32)).collect();
    Arc::new(Field::new(Samples::F32(heights), [129, 129], [10.0, 10.0], Holes::none(129 * 129)))
}

fn view(eye: DVec3, px: f64) -> View {
    View {
        eye,
        world_from_eye: View::turned(30.0, -20.0, 0.0),
        lens: Lens::Perspective { fov_x: 1.2 },
        size: [640, 360],
        near: 0.1,
        tolerance: Tolerance { px, metric: Metric::Certified },
        time_s: 0.0,
    }
}

fn viewpoint(measured: &Measured, eye: DVec3, px: f64) -> Viewpoint {
    Viewpoint { eye: measured.relative(eye), reach: Reach::new(&view(eye, px)), band: 1.0, hold: 1.0 }
}

/// Returns all diamonds.
fn diamonds(measured: &Measured) -> Vec<DiamondInfo> {
    let of_level = |level: u32| {
        let [x_count, z_count] = measured.lattice.count(level);
        let places = (0..z_count).flat_map(move |j| (0..x_count).map(move |i| (i, j)));
        places.filter(|(i, j)| (i | j) & 1 == 1).map(move |(i, j)| [i << level, j << level])
    };
    let diamond = |at: Place| measured.diamond(at, measured.lattice.index(at).expect("a diamond"));
    (0..measured.lattice.levels()).flat_map(of_level).map(diamond).collect()
}

/// Returns a path at various speeds with teleports and changes of the tolerance.
fn walk(field: &Field, steps: usize, seed: u64) -> Vec<(DVec3, f64)> {
    let mut dice = Dice(seed);
    let [w, h] = field.size().map(f64::from);
    let extent = field.world_at(w, h, 0.0);
    let ground = DVec3::Y * f64::from(field.height((w / 2.0) as u32, (h / 2.0) as u32));
    let (mut eye, mut px) = (extent * 0.5 + ground + DVec3::Y * 100.0, 30.0);
    let mut walk = Vec::new();
    for _ in 0..steps {
        let speed = 10f64.powf(4.0 * dice.share() - 2.0);
        match dice.share() {
            s if s < 0.03 => eye = extent * (0.5 + dice.direction()) + ground + DVec3::Y * 500.0 * dice.share(),
            s if s < 0.05 => px = [3.0, 10.0, 30.0, 100.0][(4.0 * dice.share()) as usize],
            s if s < 0.15 => (),
            _ => eye += dice.direction() * speed,
        }
        walk.push((eye, px));
    }
    walk
}

/// Compares the set with its definition: each sphere checked on its own.
#[test]
fn split_diamonds_are_those_whose_spheres_contain_the_eye() {
    for field in [terrain([100, 140]), noise([40, 33])] {
        let measured = Measured::new(Arc::clone(&field), 1.0, &Progress::default());
        let (all, mut found) = (diamonds(&measured), Found::default());
        let (mut splits, mut min, mut max) = (Splits::none(&measured), usize::MAX, 0);
        for (eye, px) in walk(&field, 60, 4) {
            let from = viewpoint(&measured, eye, px);
            assert!(splits.refill(&measured, &from, &mut found, usize::MAX));
            for diamond in &all {
                let is_inside = diamond.centre.distance(from.eye) < from.reach.radius(diamond);
                assert_eq!(splits.contains(diamond.index), is_inside, "{diamond:?}");
            }
            (min, max) = (min.min(splits.count()), max.max(splits.count()));
        }
        assert!(max > 3 * min + 100, "{min} to {max} split");
    }
}

fn follows<W: CrossingTracker>(field: &Arc<Field>, band: f64, hold: f64, seed: u64) {
    let measured = Measured::new(Arc::clone(field), band as f32, &Progress::default());
    let (mut follower, mut found) = (Follower::<W>::new(&measured), Found::default());
    let (mut splits, mut saved) = (Splits::none(&measured), 0);
    for (step, (eye, px)) in walk(field, 1500, seed).into_iter().enumerate() {
        let from = Viewpoint { band, hold, ..viewpoint(&measured, eye, px) };
        assert!(splits.refill(&measured, &from, &mut found, usize::MAX));
        assert!(follower.follow(&measured, &from, usize::MAX));
        for &(at, index) in &found.split {
            assert!(follower.splits().contains(index), "step {step}: {at:?} has not split");
        }
        assert_eq!(follower.splits().count(), splits.count(), "step {step}");
        saved += usize::from(follower.visited() * 2 < found.visited);
    }
    assert!(saved > 300, "checked fewer in {saved} steps only");
}

#[test]
fn bounding_spheres_find_all_crossings() {
    follows::<BoundingSpheres>(&terrain([100, 140]), 1.0, 1.0, 1);
    follows::<BoundingSpheres>(&noise([70, 33]), 1.3, 1.0, 2);
    follows::<BoundingSpheres>(&terrain([129, 129]), 1.0, 1.1, 3);
}

#[test]
fn nested_spheres_find_all_crossings() {
    follows::<Covers>(&terrain([100, 140]), 1.0, 1.0, 1);
    follows::<Covers>(&noise([70, 33]), 1.3, 1.0, 2);
    follows::<Covers>(&terrain([129, 129]), 1.0, 1.1, 3);
}

#[test]
fn roam_queues_find_all_crossings() {
    follows::<Queues>(&terrain([100, 140]), 1.0, 1.0, 5);
    follows::<Queues>(&noise([70, 33]), 1.3, 1.0, 6);
    follows::<Queues>(&terrain([129, 129]), 1.0, 1.1, 7);
}

#[test]
fn follower_stops_at_its_limit_and_recovers() {
    let field = terrain([100, 140]);
    let measured = Measured::new(Arc::clone(&field), 1.0, &Progress::default());
    let (mut follower, mut found) = (Follower::<BoundingSpheres>::new(&measured), Found::default());
    let mut splits = Splits::none(&measured);
    let views: Vec<_> = walk(&field, 400, 8).iter().map(|&(eye, px)| viewpoint(&measured, eye, px)).collect();
    let count = |from: &Viewpoint| {
        assert!(splits.refill(&measured, from, &mut found, usize::MAX));
        splits.count()
    };
    let counts: Vec<_> = views.iter().map(count).collect();
    let mut sorted = counts.clone();
    sorted.sort_unstable();
    let (limit, mut gave_up) = (sorted[sorted.len() / 2], 0);
    for (from, count) in views.iter().zip(counts) {
        let follows = follower.follow(&measured, from, limit);
        assert_eq!(follows, count <= limit);
        assert!(!follows || follower.splits().count() == count);
        gave_up += usize::from(!follows);
    }
    assert!(gave_up > 20, "stopped {gave_up} times");
}

/// Compares the lists of all criteria along a path, byte by byte.
#[test]
fn all_criteria_draw_the_same() {
    let field = terrain([150, 111]);
    for morph in ["morph=off", "morph=on"] {
        let criteria = ["criterion=spheres", "criterion=covers", "criterion=roam", "criterion=plain"];
        let mut techniques = criteria.map(|criterion| super::technique(&field, "sphere-tree", &[criterion, morph]));
        let mut triangles = 0;
        for (eye, px) in walk(&field, 200, 11) {
            let lists = techniques.each_mut().map(|technique| {
                let mut list = DrawList::default();
                technique.select(&view(eye, px), &mut list);
                (list.draws, list.streamed.indices, bytemuck::cast_slice::<_, u8>(&list.streamed.vertices).to_vec())
            });
            assert!(lists.iter().all(|list| *list == lists[0]), "at {eye}");
            triangles += lists[0].1.len() / 3;
        }
        assert!(triangles > 100_000, "{triangles} triangles in all");
    }
}

/// Returns the largest change of a drawn height at a sample between steps of a flight, in metres per metre, and how
/// often wedges split or merged.
fn change(field: &Arc<Field>, settings: &[&str]) -> (f64, usize) {
    let mut technique = super::technique(field, "sphere-tree", settings);
    let (mut last, mut largest, mut switches) = (None::<(Vec<f64>, u64)>, 0.0f64, 0);
    for step in 0..150 {
        let at = DVec3::new(400.0, 120.0, 300.0) + DVec3::new(0.6, 0.0, 0.8) * f64::from(step) * STEP_M;
        let (view, mut list) = (view(at, 10.0), DrawList::default());
        technique.select(&view, &mut list);
        let heights = super::heights(field, &view, technique.resident(), &list);
        if let Some((before, triangles)) = &last {
            let changes = heights.iter().zip(before).map(|(a, b)| (a - b).abs()).filter(|change| change.is_finite());
            largest = largest.max(changes.fold(0.0, f64::max) / STEP_M);
            switches += usize::from(*triangles != list.triangles());
        }
        last = Some((heights, list.triangles()));
    }
    (largest, switches)
}

/// Length of a step, metres.
const STEP_M: f64 = 0.5;

#[test]
fn fading_vertices_do_not_pop() {
    let field = hills();
    let (pop, switches) = change(&field, &["morph=off"]);
    let (fade, fading_switches) = change(&field, &["morph=on"]);
    println!("changes of {pop} and {fade} m a metre, {switches} and {fading_switches} switches");
    assert!(switches > 50 && fading_switches > 50);
    assert!(pop > 100.0 * fade, "{pop} m a metre without fading, {fade} with it");
}

/// With `hold=on`, a wedge that has just split stays split until the eye is slightly further away.
#[test]
fn hold_prevents_oscillation() {
    let field = hills();
    let switches = |hold: &str| {
        let mut technique = super::technique(&field, "sphere-tree", &[hold]);
        let counts = (0..40).map(|step| {
            let mut list = DrawList::default();
            technique.select(&view(DVec3::new(500.0 + 3.0 * f64::from(step % 2), 120.0, 600.0), 10.0), &mut list);
            list.triangles()
        });
        let counts: Vec<_> = counts.collect();
        counts.windows(2).filter(|pair| pair[0] != pair[1]).count()
    };
    assert!(switches("hold=off") > 30);
    assert!(switches("hold=on") <= 1);
}

/// Applies uploads as the device would.
fn apply(uploads: &[Upload], device: &mut Geometry) {
    for upload in uploads {
        match upload {
            Upload::Vertices(first, v) => device.vertices[*first as usize..][..v.len()].copy_from_slice(v),
            Upload::Normals(first, n) => device.normals[*first as usize..][..n.len()].copy_from_slice(n),
            Upload::Indices(first, i) => device.indices[*first as usize..][..i.len()].copy_from_slice(i),
        }
    }
}

/// Returns the triangles that a device draws after all uploads so far, and the bytes sent for them.
fn drawn_on(device: &mut Geometry, field: &Field, view: &View, list: &DrawList) -> (Vec<[[i64; 3]; 3]>, usize) {
    apply(&list.uploads, device);
    let triangles = expand::triangles(field, &Frame::placing(field, view), device, list);
    let corners = |t: &expand::Drawn| t.corners.map(|c| [i64::from(c.x), i64::from(c.z), i64::from(c.y.to_bits())]);
    let mut corners: Vec<_> = triangles.iter().map(corners).collect();
    corners.sort_unstable();
    let size = list.size();
    (corners, size.upload_bytes + size.vertices * size_of::<ExplicitVertex>() + size.indices * 4)
}

/// Compares resident patches with streamed triangles at every step of a path.
#[test]
fn resident_patches_match_streamed_triangles() {
    let field = terrain([300, 260]);
    for (morph, min_saving) in [("morph=off", 3.0), ("morph=on", 0.9)] {
        let mut techniques = ["patches=streamed", "patches=resident"]
            .map(|patches| super::technique(&field, "sphere-tree", &[morph, patches]));
        let mut devices = techniques.each_ref().map(|technique| technique.resident().clone());
        let (mut sent, mut resident_draws) = ([0; 2], 0);
        for (eye, px) in walk(&field, 300, 17) {
            let view = view(eye, px);
            let drawn = [0, 1].map(|k| {
                let mut list = DrawList::default();
                techniques[k].select(&view, &mut list);
                let (triangles, bytes) = drawn_on(&mut devices[k], &field, &view, &list);
                sent[k] += bytes;
                resident_draws += list.draws.iter().filter(|draw| draw.source == Source::Resident).count();
                triangles
            });
            assert!(drawn[0] == drawn[1], "{morph} at {eye}");
        }
        println!("{morph}: {} B streamed, {} B for patches in {resident_draws} draws", sent[0], sent[1]);
        assert!(resident_draws > 1000);
        assert!(sent[0] as f64 > min_saving * sent[1] as f64, "{morph}: {sent:?} bytes");
    }
}
