//! Morphing: a morph ends exactly at the next level, and nothing jumps during it.

use std::sync::Arc;

use cuesta::internal::draw::weights::{ONE, SlotWeights};
use cuesta::internal::draw::{Draw, DrawList, Geometry, Instance, Source, Topology};
use cuesta::internal::height::{Field, synth};
use cuesta::internal::lod::geomipmap::mesh::{BlockMesh, Masks};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;

use super::{heights, technique};

/// Returns terrain that consists of whole blocks, because partial ones do not morph inside.
fn terrain() -> Arc<Field> {
    let mut field = synth::synth(synth::Kind::Fractal, [257, 257], 5);
    field.spacing = [20.0, 20.0];
    Arc::new(field)
}

fn view(eye: DVec3, target: DVec3, px: f64) -> View {
    View {
        eye,
        world_from_eye: View::looking_along(target - eye),
        lens: Lens::Perspective { fov_x: 60f64.to_radians() },
        size: [1280, 720],
        near: 1.0,
        tolerance: Tolerance { px, metric: Metric::Certified },
        time_s: 0.0,
    }
}

/// Returns a block of 16 cells at a level with these morph weights.
fn block(mesh: &BlockMesh, origin: [i32; 2], level: u32, morph: f32, edge_morph: [f32; 4]) -> DrawList {
    let mask: u8 = (0..4).filter(|&k| edge_morph[k] >= 1.0).map(|k| 1 << k).sum();
    let rotation = u32::from(16 >> level == 1 && (origin[0] + origin[1]) / 16 % 2 == 1);
    let weight = |w: f32| (w * ONE as f32) as u32;
    let weights = SlotWeights::uniform(weight(morph), edge_morph.map(weight));
    let instance = Instance { origin, cells: 16, rotation, level, ..Instance::default() }.with_weights(weights);
    let ranges = [&mesh.borders[level as usize][usize::from(mask)], &mesh.centres[level as usize]];
    let draws = ranges.map(|indices| Draw {
        source: Source::Lattice,
        topology: Topology::Triangles,
        indices: indices.clone(),
        instances: 0..1,
        first_vertex: 0,
    });
    DrawList { draws: draws.into(), instances: vec![instance], ..DrawList::default() }
}

#[test]
fn morph_ends_at_the_next_level() {
    let (field, mesh) = (terrain(), BlockMesh::new(16, Masks::Sixteen));
    let anywhere = view(DVec3::ZERO, DVec3::X, 1.0);
    let surface = |list: &DrawList| heights(&field, &anywhere, &mesh.geometry, list);
    for origin in [[0, 0], [16, 0], [32, 48], [80, 128]] {
        for level in 0..4 {
            // The last level has no sides beyond it.
            let beyond = if level == 3 { 0.0 } else { 1.0 };
            for sides in [[0.0; 4], [1.0, 0.25, 0.0, 0.5], [0.75, 0.0, 1.0, 0.125], [0.5; 4]] {
                let sides = sides.map(|e: f32| e * beyond * 0.9999);
                let end = surface(&block(&mesh, origin, level, 1.0, sides.map(|e| 1.0 + e)));
                let next = surface(&block(&mesh, origin, level + 1, 0.0, sides));
                let largest = (end.iter().zip(&next)).filter(|(a, _)| !a.is_nan()).map(|(a, b)| (a - b).abs());
                let largest = largest.fold(0.0, |a, b| if b.is_nan() { b } else { f64::max(a, b) });
                assert!(largest < 2e-3, "level {level} at {origin:?}, {sides:?}: {largest} m");
            }
            let start = surface(&block(&mesh, origin, level, 0.0, [0.0; 4]));
            let end = surface(&block(&mesh, origin, level, 1.0, [1.0; 4]));
            assert!((start.iter().zip(&end)).any(|(a, b)| (a - b).abs() > 0.1), "it moves");
        }
    }
}

/// Returns the largest displacement on the screen, pixels, that changes of levels cause while the eye slowly
/// approaches.
fn largest_jump(field: &Arc<Field>, name: &str, settings: &[&str]) -> f64 {
    let mut technique = technique(field, name, settings);
    let target = field.world_at(128.0, 128.0, 500.0);
    let mut frame = |k: u32| {
        // Half a per cent nearer per frame.
        let away = 9000.0 * 0.995f64.powi(k as i32);
        let view = view(target + DVec3::new(-0.7, 0.5, 0.6) * away, target, 2.0);
        let mut list = DrawList::default();
        technique.select(&view, &mut list);
        (view, heights(field, &view, technique.resident() as &Geometry, &list))
    };
    let (mut last, mut largest) = (frame(0).1, 0.0f64);
    for k in 1..200 {
        let (view, now) = frame(k);
        for (n, (a, b)) in (0u32..).zip(last.iter().zip(&now)).filter(|(_, (a, b))| a != b) {
            let at = |y: f64| field.world_at(f64::from(n % 257), f64::from(n / 257), y);
            let seen = |y: &f64| !y.is_nan() && view.project(at(*y)).is_some_and(|p| view.in_picture(&p));
            if seen(a) && seen(b) {
                largest = largest.max(view.displacement_px(at(*a), at(*b)));
            }
        }
        last = now;
    }
    largest
}

/// Maximum displacement, pixels, at a tolerance of 2 px.
const JUMP_PX: f64 = 0.15;

#[test]
fn geomipmap_does_not_jump() {
    let field = terrain();
    for distance in ["error", "linear", "exponential"] {
        let settings = ["block=17", "base=60", &format!("distance={distance}"), "morph=off"];
        let off = largest_jump(&field, "geomipmap", &settings);
        let on = largest_jump(&field, "geomipmap", &[&settings[..3], &["morph=on"]].concat());
        println!("{distance}: {off:.3} px at once, {on:.3} px morphing");
        let limit = if distance == "error" { JUMP_PX } else { off / 4.0 };
        assert!(on < limit && limit < off, "{distance}: {on} px morphing, {off} px at once");
    }
}

#[test]
fn clusters_do_not_jump() {
    let field = terrain();
    for (block, seams) in [("block=8", "stitched"), ("block=16", "stitched"), ("block=8", "skirts")] {
        let seams = format!("seams={seams}");
        let [off, on] =
            ["morph=off", "morph=on"].map(|morph| largest_jump(&field, "clusters", &[block, morph, &seams]));
        println!("clusters, {block} {seams}: {off:.3} px at once, {on:.3} px morphing");
        assert!(on < JUMP_PX && JUMP_PX < off, "{block} {seams}: {on} px morphing, {off} px at once");
    }
    for block in ["block=8", "block=16"] {
        let on = largest_jump(&field, "clusters", &[block, "morph=distance"]);
        println!("clusters, {block} by distance: {on:.3} px morphing");
        assert!(on < JUMP_PX, "{block}: {on} px morphing by distance");
    }
}

#[test]
fn smooth_tiles_do_not_jump() {
    let field = terrain();
    for clock in ["clock=speed", "clock=time", "clock=frames"] {
        let [off, on] =
            ["morph=off", "morph=on"].map(|morph| largest_jump(&field, "smooth-tiles", &["tile=17", morph, clock]));
        println!("smooth tiles, {clock}: {off:.3} px at once, {on:.3} px morphing");
        assert!(on < JUMP_PX && JUMP_PX < off, "{clock}: {on} px morphing, {off} px at once");
    }
}
