//! The two meshes against what can be known of them another way.

use super::*;
use crate::height::synth::{self, Kind};

fn field([w, h]: [u32; 2], height: impl Fn(u32, u32) -> f32) -> Field {
    let heights = (0..w * h).map(|k| height(k % w, k / w)).collect();
    Field::new(Samples::F32(heights), [w, h], [1.0, 1.0], Holes::none((w * h) as usize))
}

fn rough(i: u32, j: u32) -> f32 {
    20.0 * ((i as f32 / 9.0).sin() + (j as f32 / 7.0).cos()) + ((i * i * 3 + j * 5 + i * j) % 13) as f32 / 4.0
}

#[test]
fn a_plane_takes_two_triangles() {
    for size in [[2, 2], [2, 3], [33, 33], [129, 129]] {
        let plane = field(size, |i, j| 0.5 * i as f32 - 3.0 * j as f32);
        let mesh = greedy(&plane, 1e-3).unwrap();
        assert_eq!((mesh.triangles, mesh.tiles), (2, [1, 1]), "{size:?}");
        assert!(mesh.max_error_m <= 1e-3);
    }
    assert_eq!(rtin(&field([65, 65], |i, j| i as f32 - j as f32), 1e-3).unwrap().triangles, 2);
}

#[test]
fn the_true_error_is_kept_and_more_error_takes_fewer_triangles() {
    for size in [[65, 65], [70, 41], [3, 130]] {
        let terrain = field(size, rough);
        for mesh in [greedy, rtin] {
            let counts: Vec<u64> = [0.01, 0.1, 1.0, 4.0, 30.0]
                .map(|tolerance_m| {
                    let mesh = mesh(&terrain, tolerance_m).unwrap();
                    assert!(mesh.max_error_m <= tolerance_m, "{mesh:?} for {tolerance_m} m");
                    mesh.triangles
                })
                .into();
            assert!(counts.is_sorted_by(|a, b| a > b || *a < 100), "{size:?}: {counts:?}");
            assert!(counts[0] <= 2 * u64::from((size[0] - 1) * (size[1] - 1)) && counts[0] > 4 * counts[3]);
        }
    }
}

/// Of all meshes of the hierarchy on 5 × 5 samples, tried one by one, none within the error is smaller.
#[test]
fn no_mesh_of_right_triangles_is_coarser() {
    let inner: Vec<u32> = (0..25).filter(|k| [k % 5, k / 5].iter().any(|n| n % 4 != 0)).collect();
    let subset = |chosen: u32| (0..).zip(&inner).filter(|&(n, _)| chosen >> n & 1 == 1).map(|(_, at)| 1 << at).sum();
    let mut between = 0;
    // Noise, and single spikes: these need splits that no error asks for.
    let noise = |seed: u32| field([5, 5], |i, j| ((i * 31 + j * 17 + seed * 7 + 3).pow(3) >> 4 & 15) as f32);
    let spike = |at: [u32; 2]| field([5, 5], |i, j| if [i, j] == at { 12.0 } else { 0.0 });
    let terrains = [noise(0), noise(1), spike([1, 0]), spike([3, 2]), spike([3, 3]), spike([0, 3])];
    for (k, terrain) in terrains.into_iter().enumerate() {
        for tolerance_m in [4.0, 7.0] {
            let meshes = (0..1u32 << inner.len()).into_par_iter().map(subset);
            let smallest = meshes.filter_map(|splits: u32| conforming_within(&terrain, splits, tolerance_m)).min();
            let found = rtin(&terrain, tolerance_m).unwrap().triangles;
            assert_eq!(Some(found), smallest, "land {k}, {tolerance_m} m");
            between += usize::from(found > 2 && found < 32);
        }
    }
    assert!(between > 5, "{between} meshes between all and nothing");
}

/// Triangles of the mesh that is split at the positions x + 5·z of a set; `None` if it is beyond the error, if a
/// position is not reached, or if one is reached from one side only.
fn conforming_within(terrain: &Field, splits: u32, tolerance_m: f64) -> Option<u64> {
    let mut open = vec![[[0, 4], [4, 4], [0, 0]], [[4, 0], [0, 0], [4, 4]]];
    let (mut whole, mut reached) = (Vec::new(), [0; 25]);
    while let Some([apex, a, b]) = open.pop() {
        let sum = [a[0] + b[0], a[1] + b[1]];
        let middle = sum.map(|n| n / 2);
        let index = (middle[0] + 5 * middle[1]) as usize;
        if sum.iter().all(|n| n % 2 == 0) && splits >> index & 1 == 1 {
            reached[index] += 1;
            open.extend([[middle, apex, a], [middle, b, apex]]);
        } else {
            whole.push([apex, a, b]);
        }
    }
    let on_border = |k: usize| [k % 5, k / 5].iter().any(|n| n % 4 == 0);
    let expected = |k: usize| {
        if splits >> k & 1 == 0 {
            0
        } else if on_border(k) {
            1
        } else {
            2
        }
    };
    let corner = |[x, z]: [i32; 2]| Corner { x, z, y: terrain.height(x as u32, z as u32) };
    let error = |t: &[[i32; 2]; 3]| f64::from(surface::deviation(terrain, &facing_up(&t.map(corner))));
    let fits = (0..25).all(|k| reached[k] == expected(k)) && whole.iter().all(|t| error(t) <= tolerance_m);
    fits.then_some(whole.len() as u64)
}

/// The published counts (see the module `synth::peers`): greedy Delaunay triangles of 1025² samples, 400 m of
/// relief, by true largest error.
#[test]
fn the_published_counts_of_the_peers_field() {
    let terrain = synth::synth(Kind::Peers, [1025, 1025], 1);
    for (tolerance_m, published) in [(4.0, 1260.0), (2.0, 3400.0), (1.0, 9900.0)] {
        let greedy = greedy(&terrain, tolerance_m).unwrap();
        let rtin = rtin(&terrain, tolerance_m).unwrap();
        println!("{tolerance_m} m: greedy {greedy:?}, rtin {rtin:?}");
        let ratio = greedy.triangles as f64 / published;
        assert!((0.96..1.04).contains(&ratio), "{tolerance_m} m: {ratio} times the published count");
        let ratio = rtin.triangles as f64 / greedy.triangles as f64;
        assert!((1.5..5.0).contains(&ratio), "{tolerance_m} m: RTIN has {ratio} times the triangles");
    }
}

#[test]
fn tiles_cost_a_few_per_cent() {
    let terrain = synth::synth(Kind::Peers, [1025 + 512, 1025], 1);
    assert_eq!(
        (seams(1024), seams(1025), seams(4096)),
        (vec![0, 1024], vec![0, 512, 1025], vec![0, 1024, 2048, 3072, 4096])
    );
    let tiled = greedy(&terrain, 2.0).unwrap();
    assert_eq!(tiled.tiles, [2, 1]);
    let whole = Tile { field: &terrain, first: [0, 0], last: [1536, 1024] }.greedy(2.0).unwrap();
    let ratio = tiled.triangles as f64 / whole.0 as f64;
    println!("{} triangles in tiles, {} as one: {ratio}", tiled.triangles, whole.0);
    assert!((0.99..1.06).contains(&ratio) && tiled.max_error_m <= 2.0, "{ratio}");
}

#[test]
fn holes_are_meshed_as_filled() {
    let mut holes = Holes::none(33 * 33);
    (0..33 * 33).filter(|k| k % 33 > 20).for_each(|k| holes.insert(k));
    let heights = Samples::F32((0..33 * 33).map(|k| rough(k % 33, k / 33)).collect());
    let holed = Field::new(heights, [33, 33], [1.0, 1.0], holes);
    let filled = holed.clone().without_holes();
    for mesh in [greedy, rtin] {
        assert_eq!(mesh(&holed, 0.5).unwrap(), mesh(&filled, 0.5).unwrap());
    }
}

#[test]
fn errors_that_cannot_be_are_refused() {
    let terrain = field([9, 9], rough);
    for tolerance_m in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        for mesh in [greedy, rtin] {
            let text = mesh(&terrain, tolerance_m).unwrap_err().to_string();
            assert!(text.contains("vertical error: expected more than 0 m") && !text.contains('\n'), "{text}");
        }
    }
}

/// A mesh that does not cover its tile is found.
#[test]
fn a_broken_mesh_has_no_error() {
    let terrain = field([3, 3], |_, _| 0.0);
    let corner = |x, z| Corner { x, z, y: 0.0 };
    let half = [corner(0, 0), corner(0, 2), corner(2, 2)];
    let other = [corner(0, 0), corner(2, 2), corner(2, 0)];
    assert_eq!(true_error(&terrain, &[half, other]), Some(0.0));
    assert_eq!(true_error(&terrain, &[half]), None);
    assert_eq!(true_error(&terrain, &[half, [other[0], other[2], other[1]]]), None);
}
