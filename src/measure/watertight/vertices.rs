//! Proves properties of single triangles and vertices: triangles lie on the field and face up, vertices have one
//! height.

use rayon::prelude::*;

use super::counter_example::{CounterExample, Kind, refuted};
use super::edges;
use crate::draw::expand::Drawn;
use crate::height::Field;
use crate::height::surface::{Corner, doubled_area};

/// Proves that all corners lie on the field. Positions have `fraction_bits` fraction bits.
pub(super) fn on_the_field(field: &Field, triangles: &[Drawn], fraction_bits: u32) -> Result<(), Box<CounterExample>> {
    let [w, h] = field.size().map(|n| n as i32);
    let [last_x, last_z] = [w, h].map(|n| (n - 1) << fraction_bits);
    let outside = |c: &Corner| !(0..=last_x).contains(&c.x) || !(0..=last_z).contains(&c.z);
    match triangles.iter().position(|t| t.corners.iter().any(outside)) {
        Some(k) => refuted(Kind::Outside, triangles, [k as u32], format!("a corner outside {w} × {h} samples")),
        None => Ok(()),
    }
}

/// Proves that all triangles face up and have an area in plan view.
pub(super) fn faces_up(triangles: &[Drawn]) -> Result<(), Box<CounterExample>> {
    match triangles.iter().position(|t| doubled_area(&t.corners) <= 0) {
        Some(k) => refuted(Kind::Fold, triangles, [k as u32], "a triangle that does not face up".into()),
        None => Ok(()),
    }
}

/// Proves that each vertex has the same height, bit by bit, in all triangles that share it.
pub(super) fn one_height_a_vertex(triangles: &[Drawn]) -> Result<(), Box<CounterExample>> {
    // Position, height and triangle in one integer, which sorts fast.
    let vertex = |corner: Corner, k: u32| {
        let position = u128::from(edges::packed([corner.x, corner.z]));
        position << 64 | u128::from(corner.y.to_bits()) << 32 | u128::from(k)
    };
    let mut vertices: Vec<u128> =
        (0u32..).zip(triangles).flat_map(|(k, t)| t.corners.map(|corner| vertex(corner, k))).collect();
    vertices.par_sort_unstable();
    let differ = |[a, b]: &&[u128; 2]| a >> 64 == b >> 64 && a >> 32 != b >> 32;
    let Some(&[a, b]) = vertices.array_windows().find(differ) else { return Ok(()) };
    let [x, z] = edges::unpacked((a >> 64) as u64);
    let [low, high] = [a, b].map(|v| f32::from_bits((v >> 32) as u32));
    refuted(Kind::Crack, triangles, [a as u32, b as u32], format!("vertex ({x}, {z}) at both {low} m and {high} m"))
}
