//! Clusters: every way to draw them draws the same triangles, at far fewer draws.

use std::sync::Arc;

use cuesta::draw::expand;
use cuesta::draw::layout::Frame;
use cuesta::draw::{DrawList, Submission};
use cuesta::height::{Field, Holes, Samples};
use cuesta::lod::Technique;
use cuesta::view::{Lens, Metric, Tolerance, View};

use super::technique;

/// A deterministic number in 0..1.
fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 53) as f64
}

/// Land whose roughness changes from square to square, with holes or without.
fn land(seed: &mut u64, size: [u32; 2]) -> Arc<Field> {
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

fn anywhere(field: &Field, seed: &mut u64) -> View {
    let [w, h] = field.size().map(f64::from);
    let eye = field.world_at(w * random(seed), h * random(seed), 20.0 + 300.0 * random(seed).powi(3));
    View {
        eye,
        world_from_eye: View::turned(360.0 * random(seed), -90.0 * random(seed), 0.0),
        lens: Lens::Perspective { fov_x: 0.4 + 1.6 * random(seed) },
        size: [320, 200],
        near: 0.1,
        tolerance: Tolerance { px: 20.0 * random(seed) + 0.1, metric: Metric::Certified },
    }
}

/// Corners of a triangle: position and the height's bits.
type Corners = [(i32, i32, u32); 3];

/// The triangles in order, and the draws.
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
fn a_thousand_quadtrees_are_drawn_alike_in_every_mode() {
    let mut seed = 11;
    let (mut blocks, mut clusters, mut kinds) = (0, 0, std::collections::BTreeSet::new());
    for k in 0..50 {
        let field = land(&mut seed, [[97, 81], [130, 65], [70, 133], [129, 129]][k % 4]);
        let settings = ["block=8", ["morph=off", "morph=on"][k / 2 % 2]];
        let mut modes = ["clusters", "clusters:draw-per-cluster", "clusters:draw-per-block"]
            .map(|m| technique(&field, m, &settings));
        for _ in 0..20 {
            let view = anywhere(&field, &mut seed);
            let [(indirect, list), (cluster, each), (block, single)] =
                modes.each_mut().map(|mode| drawn(&field, mode.as_mut(), &view));
            assert!(indirect == cluster, "draw-per-cluster draws other triangles");
            assert!(indirect == block, "draw-per-block draws other triangles");
            assert_eq!([list.submission, each.submission, single.submission], {
                [Submission::Indirect, Submission::Direct, Submission::Direct]
            });
            assert!(list.draws.len() <= 23 && list.commands() <= 1 && each.draws.len() == list.instances.len());
            kinds.extend(list.draws.iter().map(|draw| draw.indices.start));
            blocks += single.draws.len();
            clusters += each.draws.len();
        }
    }
    println!("{blocks} blocks in {clusters} clusters of {} kinds", kinds.len());
    assert!(kinds.len() == 23, "only {} kinds of clusters occurred", kinds.len());
    assert!(clusters * 3 < blocks, "{clusters} clusters for {blocks} blocks");
}
