//! Vertices of quadrants with skirts are placed by equations 3 and 4 of Judnich & Ling.

use cuesta::internal::draw::layout::Frame;
use cuesta::internal::draw::place::placed;
use cuesta::internal::draw::skirts::{self, SKIRT};
use cuesta::internal::draw::weights::{FINER, ONE, SkirtWeights};
use cuesta::internal::draw::{Instance, Seams};
use cuesta::internal::height::surface::{Corner, doubled_area};
use cuesta::internal::height::{Field, Holes, Samples, rtin};
use cuesta::internal::lod::clusters::mesh::Mesh;
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;

fn rough() -> Field {
    let height = |k: u32| ((k.wrapping_mul(0x9e37_79b1) ^ (k << 7)).wrapping_mul(0x85eb_ca77) >> 8) as f32 / 1e5;
    Field::new(Samples::F32((0..65 * 65).map(height).collect()), [65; 2], [1.0; 2], Holes::none(65 * 65))
}

/// Returns the height of a level's surface at a sample.
fn level_height(field: &Field, level: u32, [x, z]: [i32; 2]) -> f64 {
    let last = (64 >> level) - 1;
    let [i, j] = [x, z].map(|n| (n >> level).min(last));
    let corner = |[i, j]: [i32; 2]| Corner {
        x: i << level,
        z: j << level,
        y: field.height((i << level) as u32, (j << level) as u32),
    };
    let at = Corner { x, z, y: 0.0 };
    let inside = |[a, b, c]: [Corner; 3]| {
        let parts =
            [[at, b, c], [a, at, c], [a, b, at]].map(|t| doubled_area(&t) as f64 / doubled_area(&[a, b, c]) as f64);
        let height = (0..3).map(|k| parts[k] * f64::from([a, b, c][k].y)).sum();
        parts.iter().all(|&part| part >= 0.0).then_some(height)
    };
    rtin::cell(i, j).map(|t| t.map(corner)).into_iter().find_map(inside).expect("a triangle of the cell")
}

/// Equation 4: interpolates the height functions from low to high resolution.
fn equation_4(alpha: f64, [h0, h1, h2]: [f64; 3]) -> f64 {
    let saturate = |n: f64| n.clamp(0.0, 1.0);
    let (a, b) = (saturate(2.0 * alpha), saturate(2.0 * alpha - 1.0));
    h2 * b + (h1 * a + h0 * (1.0 - a)) * (1.0 - b)
}

#[test]
fn vertices_follow_their_quadrants_alpha() {
    let (field, n) = (rough(), 8);
    let view = View {
        eye: DVec3::new(3.0, 400.0, 20.0),
        world_from_eye: View::turned(0.0, -90.0, 0.0),
        lens: Lens::Perspective { fov_x: 1.0 },
        size: [64, 64],
        near: 1.0,
        tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
        time_s: 0.0,
    };
    let frame = Frame::placing(&field, &view);
    let states = [[1, 2, 2, 1], [2, 1, 1, 2]];
    let mesh = Mesh::new(n, &states, Seams::Skirts);
    let (mut compared, mut skirt_vertex) = (0, 0);
    for (k, rotation) in (0..2).flat_map(|k| (0..4).map(move |rotation| (k, rotation))) {
        // The quadrants after rotation, and the morph weight of each towards the next coarser level.
        let state = cuesta::internal::lod::clusters::states::rotated(states[k], rotation);
        let gone = [5u32, 63, 17, 40].map(|weight| (weight + 11 * rotation) % ONE);
        let inside = [0, 1, 2, 3].map(|quadrant: usize| {
            let finer = if state[quadrant] == 2 { FINER } else { 0 };
            (gone[quadrant] | finer) as u8
        });
        let weights = SkirtWeights { inside: u32::from_le_bytes(inside), sides: 0x9c35, depth_m: 2.5 };
        let cells = skirts::cells(2 * n as u32);
        let instance = Instance { origin: [32, 0], cells, rotation, level: 1, ..Instance::default() };
        let instance = instance.with_weights(weights);
        for &index in &mesh.geometry.indices[mesh.ranges[k].start as usize..mesh.ranges[k].end as usize] {
            let position = mesh.geometry.lattice[index as usize].position;
            let found = placed(&field, &frame, &instance, position);
            let vertex =
                skirts::skirt_vertex(&instance, cuesta::internal::draw::place::turned_position(&instance, position));
            let left = 1.0 - f64::from(gone[vertex.quadrant]) / f64::from(ONE);
            // From low to normal resolution, or from normal to double.
            let alpha = if state[vertex.quadrant] == 1 { 0.5 * left } else { 0.5 + 0.5 * left };
            let expected = equation_4(alpha, [2, 1, 0].map(|level| level_height(&field, level, found.at)));
            let is_set = vertex.side.is_some_and(|side| 0x9c35 >> (4 * vertex.quadrant + side) & 1 == 1);
            let expected = expected - if is_set { 2.5 } else { 0.0 };
            assert!((f64::from(found.height) - expected).abs() < 1e-2, "{found:?}: {expected} m, {vertex:?}");
            assert_eq!(found.level & SKIRT != 0, vertex.side.is_some());
            compared += 1;
            skirt_vertex += u32::from(is_set);
        }
    }
    assert!(compared > 10_000 && skirt_vertex > 500, "{compared} vertices, {skirt_vertex} of skirts");
}
