//! Surfaces with one planted fault each.

use super::*;
use crate::height::surface::Corner;
use crate::height::{Holes, Samples, rtin};
use crate::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;

const SIDE: u32 = 9;

fn field(holes: &[usize]) -> Field {
    let count = (SIDE * SIDE) as usize;
    let mut missing = Holes::none(count);
    holes.iter().for_each(|&k| missing.insert(k));
    let heights = (0..count).map(|k| (k % 5) as f32).collect();
    Field::new(Samples::F32(heights), [SIDE, SIDE], [1.0, 1.0], missing)
}

/// A square of land, `width` metres, seen from above.
fn above(x: f64, z: f64, width: f64) -> Frustum {
    let view = View {
        eye: DVec3::new(x, 100.0, z),
        world_from_eye: View::turned(-90.0, -90.0, 0.0),
        lens: Lens::Orthographic { width, far: 1e3 },
        size: [100, 100],
        near: 1.0,
        tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
        time_s: 0.0,
    };
    view.frustum()
}

fn everything() -> Frustum {
    above(4.0, 4.0, 100.0)
}

fn drawn(field: &Field, triangle: [[i32; 2]; 3]) -> Drawn {
    let corners = triangle.map(|[x, z]| Corner { x, z, y: field.height(x as u32, z as u32) });
    Drawn { corners, instance: 0 }
}

fn samples_surface(field: &Field) -> Vec<Drawn> {
    let last = SIDE as i32 - 1;
    let cells = (0..last).flat_map(|j| (0..last).map(move |i| (i, j)));
    cells.flat_map(|(i, j)| rtin::cell(i, j)).map(|t| drawn(field, t)).collect()
}

fn fault(field: &Field, frustum: &Frustum, triangles: &[Drawn]) -> Kind {
    prove(field, frustum, triangles, 0).unwrap_err().kind
}

#[test]
fn the_samples_own_surface_is_proven() {
    let field = field(&[]);
    let proof = prove(&field, &everything(), &samples_surface(&field), 0).unwrap();
    assert_eq!(proof, Proof { triangles: 128, doubled_area: 128, border_edges: 32 });
}

#[test]
fn a_flipped_triangle_is_a_fold() {
    let field = field(&[]);
    let mut triangles = samples_surface(&field);
    triangles[50].corners.swap(0, 1);
    assert_eq!(fault(&field, &everything(), &triangles), Kind::Fold);
}

#[test]
fn one_ulp_is_a_crack() {
    let field = field(&[]);
    let mut triangles = samples_surface(&field);
    let y = &mut triangles[50].corners[2].y;
    *y = y.next_up();
    assert_eq!(fault(&field, &everything(), &triangles), Kind::Crack);
}

#[test]
fn a_doubled_triangle_overlaps() {
    let field = field(&[]);
    let mut triangles = samples_surface(&field);
    triangles.push(triangles[50]);
    assert_eq!(fault(&field, &everything(), &triangles), Kind::Overlap);
}

/// Two triangles that cross without sharing a vertex or a row.
#[test]
fn crossing_triangles_overlap() {
    let field = field(&[]);
    let mut triangles = vec![drawn(&field, [[1, 1], [2, 8], [4, 1]]), drawn(&field, [[0, 2], [3, 5], [8, 4]])];
    let nothing = above(1e6, 0.0, 1.0);
    assert_eq!(fault(&field, &nothing, &triangles), Kind::Overlap);
    // The second inside the first, touching nothing.
    triangles = vec![drawn(&field, [[0, 0], [0, 8], [8, 0]]), drawn(&field, [[1, 1], [1, 2], [2, 1]])];
    assert_eq!(fault(&field, &nothing, &triangles), Kind::Overlap);
    triangles.pop();
    prove(&field, &nothing, &triangles, 0).unwrap();
}

#[test]
fn a_halved_neighbour_is_a_t_junction() {
    let field = field(&[]);
    let triangles = [[[0, 0], [0, 8], [8, 0]], [[8, 0], [4, 4], [8, 8]], [[8, 8], [4, 4], [0, 8]]];
    let triangles = triangles.map(|t| drawn(&field, t));
    assert_eq!(fault(&field, &everything(), &triangles), Kind::TJunction);
}

#[test]
fn missing_terrain_is_a_gap_if_it_may_be_seen_and_has_data() {
    let whole = field(&[]);
    let mut triangles = samples_surface(&whole);
    // Cell (4, 3): both its triangles.
    triangles.drain(2 * (3 * 8 + 4)..2 * (3 * 8 + 5));
    assert_eq!(fault(&whole, &everything(), &triangles), Kind::Gap);
    assert_eq!(fault(&whole, &above(4.5, 3.5, 0.5), &triangles), Kind::Gap);
    let proof = prove(&whole, &above(1.5, 1.5, 1.0), &triangles, 0).unwrap();
    assert_eq!((proof.doubled_area, proof.border_edges), (126, 36));
    // One corner without data at each of the cell's triangles: its diagonal's end.
    let holed = field(&[3 * 9 + 5]);
    prove(&holed, &everything(), &triangles, 0).unwrap();
    let other = field(&[3 * 9 + 4]);
    assert_eq!(fault(&other, &everything(), &triangles), Kind::Gap);
}

#[test]
fn corners_outside_are_found() {
    let field = field(&[]);
    let mut triangles = samples_surface(&field);
    triangles[0].corners[0].x = -1;
    assert_eq!(fault(&field, &everything(), &triangles), Kind::Outside);
}

#[test]
fn ply_has_the_triangles() {
    let field = field(&[]);
    let mut text = Vec::new();
    write_ply(&field, &[samples_surface(&field)[3].corners], 0, &mut text).unwrap();
    let text = String::from_utf8(text).unwrap();
    assert!(text.contains("element vertex 3\n") && text.ends_with("\n3 0 1 2\n"), "{text}");
}

/// The samples' triangles, those of the east half two metres up, and walls along the seam, `down` metres from the
/// upper edge and facing west.
fn step(field: &Field, down: f32) -> [Vec<Drawn>; 2] {
    let mut triangles = samples_surface(field);
    for triangle in &mut triangles {
        let is_east = triangle.corners.iter().all(|c| c.x >= 4);
        triangle.corners.iter_mut().for_each(|c| c.y = if is_east { 2.0 } else { 0.0 });
    }
    let wall = |z: i32| {
        let at = |z: i32, y: f32| Corner { x: 4, z, y };
        let (from, to, under_from, under_to) = (at(z, 2.0), at(z + 1, 2.0), at(z, 2.0 - down), at(z + 1, 2.0 - down));
        [[under_from, to, from], [under_from, under_to, to]].map(|corners| Drawn { corners, instance: 0 })
    };
    [triangles, (0..SIDE as i32 - 1).flat_map(wall).collect()]
}

#[test]
fn a_step_needs_walls_that_reach_down_and_face_the_lower_side() {
    let (field, all) = (field(&[]), everything());
    let found = |[triangles, walls]: &[Vec<Drawn>; 2]| {
        prove_with_skirts(&field, &all, triangles, walls).map(|proof| proof.doubled_area).map_err(|why| why.kind)
    };
    for down in [2.0, 2.5, 50.0] {
        assert_eq!(found(&step(&field, down)), Ok(128), "{down} m");
    }
    assert_eq!(found(&step(&field, 1.999)), Err(Kind::Seam));
    assert_eq!(found(&[step(&field, 3.0)[0].clone(), Vec::new()]), Err(Kind::Seam));
    let mut missing = step(&field, 3.0);
    missing[1].remove(9);
    assert_eq!(found(&missing), Err(Kind::Seam));
    let mut turned = step(&field, 3.0);
    turned[1].iter_mut().for_each(|wall| wall.corners.swap(0, 1));
    assert_eq!(found(&turned), Err(Kind::Seam));
    let mut lower = step(&field, 3.0);
    lower[1].iter_mut().flat_map(|wall| &mut wall.corners).for_each(|corner| corner.y -= 0.5);
    assert_eq!(found(&lower), Err(Kind::Seam), "they hang half a metre below the edge");
    assert_eq!(prove(&field, &all, &step(&field, 3.0)[0], 0).unwrap_err().kind, Kind::Crack);
}

#[test]
fn a_coarser_edge_is_held_against_a_finer_one_sample_by_sample() {
    let field = field(&[]);
    // The west in two triangles, its edge straight; the east in cells.
    let [triangles, walls] = step(&field, 2.5);
    let mut triangles: Vec<_> = triangles.into_iter().filter(|t| t.corners.iter().all(|c| c.x >= 4)).collect();
    let low = |x: i32, z: i32| Corner { x, z, y: 1.0 };
    let west = [[low(0, 0), low(0, 8), low(4, 8)], [low(0, 0), low(4, 8), low(4, 0)]];
    triangles.extend(west.map(|corners| Drawn { corners, instance: 1 }));
    prove_with_skirts(&field, &everything(), &triangles, &walls).unwrap();
    // One of the finer vertices far down: there the coarser edge is the upper one, and has no walls.
    let dip = |c: &mut Corner| {
        if (c.x, c.z) == (4, 3) {
            c.y = 0.0
        }
    };
    triangles.iter_mut().flat_map(|t| &mut t.corners).for_each(dip);
    let why = prove_with_skirts(&field, &everything(), &triangles, &walls).unwrap_err();
    assert_eq!(why.kind, Kind::Seam, "{why}");
}

#[test]
fn a_seam_without_data_may_gape() {
    let column: Vec<usize> = (0..SIDE as usize).map(|z| z * SIDE as usize + 4).collect();
    let field = field(&column);
    let [triangles, _] = step(&field, 3.0);
    prove_with_skirts(&field, &everything(), &triangles, &[]).unwrap();
}
