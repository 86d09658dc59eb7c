//! Height fields that are hard to draw.

use std::sync::Arc;

use super::case::{Case, Kind, StressTerrain};
use super::views;
use crate::height::synth::{self, noise};
use crate::height::{Field, Holes, Options, Samples, load_bytes};

const fn case(name: &'static str, terrain: fn() -> StressTerrain) -> Case {
    Case { family: "data", name, kind: Kind::Terrain(terrain) }
}

/// The family `data`.
pub const CASES: &[Case] = &[
    case("flat", || of_kind(synth::Kind::Flat, [65, 65])),
    case("one spike of 1e5 m", || of_kind(synth::Kind::Spike, [97, 81])),
    case("checkerboard of the full range of 16 bits", || of_kind(synth::Kind::Checker, [65, 65])),
    case("vertical cliff", || of_kind(synth::Kind::Cliff, [97, 97])),
    case("ridge of one sample", || of_kind(synth::Kind::Ridge, [81, 90])),
    case("NaN, infinity and nodata islands", || with_views(islands())),
    case("2 x 2", || with_views(from_heights([2, 2], [1.0; 2], |i, j| (i * j) as f32))),
    case("2 x 77", || with_views(hills([2, 77], [1.0; 2], 20.0))),
    case("1025 x 3", || with_views(hills([1025, 3], [10.0; 2], 100.0))),
    case("prime sides, 131 x 67", || with_views(hills([131, 67], [30.0; 2], 900.0))),
    case("samples 1 mm apart", || with_views(hills([81, 66], [1e-3; 2], 0.02))),
    case("samples 100 km apart", || with_views(hills([81, 66], [1e5; 2], 9000.0))),
    case("samples 0.25 m and 40 m apart", || with_views(hills([70, 100], [0.25, 40.0], 60.0))),
    case("heights of 1e-6 m", || with_views(hills([81, 66], [1.0; 2], 1e-6))),
    case("heights of 1e7 m", || with_views(hills([81, 66], [1e6; 2], 1e7))),
    case("all below sea level", || with_views(lowered(hills([81, 66], [10.0; 2], 300.0), 4000.0))),
];

/// Returns a synthetic field with the common views.
fn of_kind(kind: synth::Kind, size: [u32; 2]) -> StressTerrain {
    with_views(synth::synth(kind, size, 3))
}

/// Returns a field with the views that invariants are checked in.
pub fn with_views(field: Field) -> StressTerrain {
    let field = Arc::new(field);
    StressTerrain { views: views::views(&field), field }
}

/// Returns a field of `w` × `h` samples with heights in metres from a function of (column, row).
fn from_heights([w, h]: [u32; 2], spacing: [f64; 2], height: impl Fn(u32, u32) -> f32) -> Field {
    let heights = (0..w * h).map(|k| height(k % w, k / w)).collect();
    Field::new(Samples::F32(heights), [w, h], spacing, Holes::none((w * h) as usize))
}

/// Returns fractal hills with heights of about 0 to `height_m`, metres. `spacing` is metres between samples along (x,
/// z).
pub fn hills(size: [u32; 2], spacing: [f64; 2], height_m: f64) -> Field {
    from_heights(size, spacing, |i, j| {
        let at = [f64::from(i) / 24.0, f64::from(j) / 24.0];
        (height_m * (0.5 + 0.5 * noise::fractal(at, 6, 3))) as f32
    })
}

/// Returns hills whose first sample lies at (`origin_m`, −`origin_m`), metres.
pub fn hills_at(origin_m: f64) -> Field {
    let mut field = hills([97, 81], [10.0; 2], 300.0);
    field.origin = [origin_m, -origin_m];
    field
}

/// Returns a field lowered by `by_m` metres.
fn lowered(field: Field, by_m: f32) -> Field {
    let heights = (0..field.samples().len()).map(|k| field.samples().height(k) - by_m).collect();
    Field::new(Samples::F32(heights), field.size(), field.spacing, Holes::none(field.samples().len()))
}

/// Loads a raw file with NaN, infinite and nodata samples, which must become holes.
fn islands() -> Field {
    let size = [99u32, 70];
    let terrain = hills(size, [10.0; 2], 300.0);
    let sample = |k: u32| {
        let [i, j] = [k % size[0], k / size[0]].map(f64::from);
        match k {
            _ if (i - 30.0).hypot(j - 30.0) < 14.0 => f32::NAN,
            _ if i > 80.0 + j / 9.0 => -9999.0,
            _ if noise::white(k.into(), 5, 7) > 0.98 => f32::INFINITY,
            _ => terrain.samples().height(k as usize),
        }
    };
    let bytes: Vec<u8> = (0..size[0] * size[1]).flat_map(|k| sample(k).to_le_bytes()).collect();
    let raw = Some("99x70:f32le".parse().expect("a layout"));
    let options = Options { raw, nodata: Some(-9999.0), spacing: Some([10.0; 2]), ..Options::default() };
    load_bytes("islands.raw", &bytes, &options).expect("bytes of its layout").field
}
