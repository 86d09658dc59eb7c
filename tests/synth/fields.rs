//! Properties of each kind of synthetic field, and hashes of their bytes.

use std::str::FromStr;

use cuesta::internal::height::synth::{KINDS, Kind, synth};
use cuesta::internal::height::{Field, Samples};
use sha2::{Digest, Sha256};

/// Returns the SHA-256 of the samples in memory, little-endian, in hexadecimal.
pub fn hash(samples: &Samples) -> String {
    let bytes: Vec<u8> = match samples {
        Samples::F32(heights) => heights.iter().flat_map(|h| h.to_le_bytes()).collect(),
        Samples::Coded { codes, .. } => codes.iter().flat_map(|c| c.to_le_bytes()).collect(),
    };
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

fn make(kind: Kind, size: [u32; 2], seed: u64) -> Field {
    let field = synth(kind, size, seed);
    assert_eq!(field.size(), size, "{kind}");
    field
}

fn heights(field: &Field) -> impl Iterator<Item = f32> + '_ {
    (0..field.samples().len()).map(|k| field.samples().height(k))
}

#[test]
fn names_and_kinds_are_the_same_list() {
    for (index, entry) in KINDS.iter().enumerate() {
        assert_eq!(entry.kind as usize, index);
        assert_eq!(Kind::from_str(entry.name), Ok(entry.kind));
        assert_eq!(entry.kind.to_string(), entry.name);
    }
    assert!(Kind::from_str("hilly").unwrap_err().contains("eroded"));
}

/// A change here changes fields that users have saved, and the embedded terrain: run `make_assets`.
#[test]
fn same_seed_same_bytes() {
    let pinned = [
        (Kind::Flat, "b9d300b8468671d6"),
        (Kind::Ramp, "c7df64ba02d4af56"),
        (Kind::Fractal, "cfdabf1e29017353"),
        (Kind::Eroded, "16283a06343389e3"),
        (Kind::Checker, "8d0748ee5661b011"),
        (Kind::Cliff, "0830e4d134dd4b3d"),
        (Kind::Spike, "9eeefd93b8897602"),
        (Kind::Ridge, "858d48eb4afd4442"),
        (Kind::Peers, "8384a453c5ccaf01"),
        (Kind::CaveFloor, "538f498b956dd835"),
        (Kind::CaveCeiling, "fe68efcc5cf5be87"),
    ];
    let found = pinned.map(|(kind, _)| (kind, hash(make(kind, [65, 33], 7).samples())[..16].to_string()));
    assert_eq!(found, pinned.map(|(kind, hash)| (kind, hash.to_string())));
}

#[test]
fn another_seed_another_field() {
    for kind in [Kind::Fractal, Kind::Eroded, Kind::Spike, Kind::Peers, Kind::CaveFloor, Kind::CaveCeiling] {
        let [a, b, c] = [1, 2, 1 << 40].map(|seed| make(kind, [65, 33], seed));
        assert_ne!(a.samples(), b.samples(), "{kind}");
        assert_ne!(a.samples(), c.samples(), "{kind}: the upper half of the seed counts");
    }
}

#[test]
fn every_size_is_finite() {
    for entry in KINDS {
        for size in [[2, 2], [2, 9], [9, 2], [65, 33]] {
            assert!(heights(&make(entry.kind, size, 3)).all(f32::is_finite), "{} {size:?}", entry.name);
        }
    }
}

#[test]
fn extremes_are_what_they_say() {
    let checker = make(Kind::Checker, [9, 6], 0);
    for (i, j) in (0..6).flat_map(|j| (0..8).map(move |i| (i, j))) {
        assert_eq!((checker.height(i, j) - checker.height(i + 1, j)).abs(), 65535.0);
    }
    let spike = make(Kind::Spike, [33, 17], 4);
    assert_eq!(heights(&spike).filter(|&h| h == 1e5).count(), 1);
    assert_eq!(heights(&spike).filter(|&h| h == 0.0).count(), 33 * 17 - 1);
    let cliff = make(Kind::Cliff, [33, 17], 0);
    for j in 0..17 {
        let steps = (0..32).filter(|&i| cliff.height(i, j) != cliff.height(i + 1, j)).count();
        assert_eq!((steps, cliff.height(0, j), cliff.height(32, j)), (1, 0.0, 1000.0));
    }
    let ridge = make(Kind::Ridge, [33, 17], 0);
    assert!((0..17).all(|j| (0..33).filter(|&i| ridge.height(i, j) != 0.0).count() == 1));
    assert_eq!(make(Kind::Flat, [9, 9], 0).statistics().max, 100.0);
    assert_eq!(make(Kind::Ramp, [33, 17], 0).cell_ambiguity(), 0.0);
}

/// The hash is of the field that other renderers were measured on.
#[test]
fn peers_are_bit_exact() {
    let field = make(Kind::Peers, [513, 513], 1);
    assert_eq!(hash(field.samples()), "45b81349c9dc5296acc79404d0bc23ce09fb383f50e645eaac1d8c7b1b48374b");
    assert_eq!((field.spacing, field.holes().count()), ([1.0; 2], 0));
}

#[test]
#[ignore = "4 million samples"]
fn large_peers_are_bit_exact() {
    let field = make(Kind::Peers, [2049, 2049], 1);
    assert_eq!(hash(field.samples()), "0730a6bd19e8b1d0a5391572e360d33db7c0ae619f4e2a8f91fa73fcf0188089");
}

/// Water drains off the terrain: no inner sample lies below all its neighbours.
#[test]
fn eroded_terrain_has_no_pits() {
    let field = make(Kind::Eroded, [129, 97], 5);
    for (i, j) in (1..96).flat_map(|j| (1..128).map(move |i| (i, j))) {
        let around = (j - 1..=j + 1).flat_map(|b| (i - 1..=i + 1).map(move |a| (a, b))).filter(|&at| at != (i, j));
        let lowest = around.map(|(a, b)| field.height(a, b)).fold(f32::INFINITY, f32::min);
        assert!(lowest <= field.height(i, j), "({i}, {j})");
    }
}

/// Passages and rock both take a large part of a cave.
#[test]
fn a_cave_has_a_floor_a_ceiling_and_rock() {
    let [floor, ceiling] = [Kind::CaveFloor, Kind::CaveCeiling].map(|kind| make(kind, [257, 257], 2));
    let open = heights(&floor).zip(heights(&ceiling)).filter(|(low, high)| high > low).count() as f64;
    let highest = heights(&floor).zip(heights(&ceiling)).map(|(low, high)| high - low).fold(0.0, f32::max);
    assert!((0.2..0.7).contains(&(open / 257.0 / 257.0)), "{open} samples are open");
    assert!((8.0..20.0).contains(&highest), "{highest} m high");
}
