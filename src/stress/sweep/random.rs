//! Derives sweep cases from a seed and a number. Lengths and tolerances are distributed evenly over their logarithms.

use fastrand::Rng;

use super::case::SweepCase;
use super::terrain::{Terrain, Voids};
use super::viewpoint::{CaseLens, Direction, Viewpoint};
use crate::height::synth::KINDS;
use crate::lod::{Entry, Setting, Values};

/// Maximum side, samples.
const MAX_SIDE: u32 = 1300;
/// Maximum numbers of samples of 70 %, the next 22 % and the next 7 % of cases; 1 % are unlimited. Many small cases
/// find more failures than few large ones.
const MAX_SAMPLES: [u64; 3] = [3_000, 12_000, 100_000];

/// Returns the case with a number, of one technique. `variant`: `None` for any, `Some(None)` for the default.
pub fn case(seed: u64, number: u64, entry: &Entry, variant: Option<Option<&str>>) -> SweepCase {
    let mut random =
        Rng::with_seed(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ number.wrapping_mul(0xd1b5_4a32_d192_ed03));
    let random = &mut random;
    let any_variant = random.usize(0..=entry.variants.len());
    let variant = variant.unwrap_or_else(|| entry.variants.get(any_variant).map(|variant| variant.name));
    SweepCase {
        technique: entry.name.to_string(),
        variant: variant.map(str::to_string),
        settings: entry.settings.iter().filter_map(|setting| value(random, setting)).collect(),
        terrain: terrain(random),
        view: viewpoint(random),
        tolerance_px: match random.u32(0..20) {
            0 => log_uniform(random, 0.01, 0.25),
            1..4 => log_uniform(random, 128.0, 1e6),
            _ => log_uniform(random, 0.25, 128.0),
        },
        paper_metric: random.u32(0..6) == 0,
    }
}

/// Returns a random number, uniform in its logarithm, with three digits.
fn log_uniform(random: &mut Rng, low: f64, high: f64) -> f64 {
    three_digits(low * (high / low).powf(random.f64()))
}

/// Rounds to three significant digits.
fn three_digits(number: f64) -> f64 {
    format!("{number:.2e}").parse().expect("a number")
}

/// Returns a uniform random number, rounded to 1/1000.
fn uniform(random: &mut Rng, low: f64, high: f64) -> f64 {
    ((low + (high - low) * random.f64()) * 1e3).round() / 1e3
}

/// Returns a random value of a setting; `None` (the default) half of the time.
fn value(random: &mut Rng, setting: &Setting) -> Option<(String, String)> {
    if random.bool() {
        return None;
    }
    let value = match setting.values {
        Values::Words(words) => words[random.usize(..words.len())].to_string(),
        Values::Number(low, high) => {
            let default: f64 = setting.default.parse().expect("a number");
            let usual = if default > 0.0 { default } else { 3.0 };
            log_uniform(random, usual / 100.0, usual * 30.0).clamp(low, high).to_string()
        }
    };
    Some((setting.key.to_string(), value))
}

fn terrain(random: &mut Rng) -> Terrain {
    let kinds: Vec<_> = KINDS.iter().filter(|kind| !kind.name.starts_with("cave")).collect();
    let max = match random.u32(0..100) {
        0..70 => MAX_SAMPLES[0],
        70..92 => MAX_SAMPLES[1],
        92..99 => MAX_SAMPLES[2],
        _ => u64::MAX,
    };
    let mut terrain = Terrain {
        kind: kinds[random.usize(..kinds.len())].name.to_string(),
        size: [2, 2],
        seed: random.u64(0..1000),
        spacing: [10.0, 10.0],
        voids: if random.u32(0..5) == 0 { Voids::ALL[random.usize(1..5)] } else { Voids::None },
        tiles: [1, 1],
        origin: [0.0, 0.0],
    };
    if random.u32(0..10) == 0 {
        terrain.tiles = [0, 1].map(|_| random.u32(1..5));
    }
    if random.bool() {
        terrain.spacing = [0, 1].map(|_| log_uniform(random, 0.25, 40.0));
    }
    if random.u32(0..5) == 0 {
        terrain.origin = [0, 1].map(|_| uniform(random, -5e6, 5e6));
    }
    loop {
        terrain.size = [0, 1].map(|_| side(random));
        if terrain.samples() <= max {
            return terrain;
        }
    }
}

/// Returns a random side in samples; every fourth is a power of two or adjacent to one.
fn side(random: &mut Rng) -> u32 {
    if random.u32(0..4) == 0 {
        return ((1 << random.u32(1..11)) + random.u32(0..3) - 1).max(2);
    }
    log_uniform(random, 2.0, f64::from(MAX_SIDE)) as u32
}

fn viewpoint(random: &mut Rng) -> Viewpoint {
    let position = |random: &mut Rng| match random.u32(0..8) {
        0 => uniform(random, -8.0, 8.0),
        1 => f64::from(random.u32(0..2)),
        2..4 => uniform(random, -0.5, 1.5),
        _ => uniform(random, 0.0, 1.0),
    };
    let at = [0, 1].map(|_| position(random));
    let above = match random.u32(0..10) {
        0 => 0.0,
        1 => -log_uniform(random, 1e-3, 3.0),
        _ => log_uniform(random, 1e-3, 3.0),
    };
    let direction = if random.bool() {
        Direction::Towards([0, 1].map(|_| uniform(random, 0.0, 1.0)))
    } else {
        let pitch = match random.u32(0..5) {
            0 => -90.0,
            1..3 => uniform(random, -4.0, 4.0),
            _ => uniform(random, -90.0, 90.0),
        };
        Direction::Turned([uniform(random, 0.0, 360.0), pitch])
    };
    let lens = match random.u32(0..8) {
        0 => CaseLens::Parallel(log_uniform(random, 0.02, 4.0)),
        1 => CaseLens::Degrees(log_uniform(random, 0.5, 20.0)),
        2 => CaseLens::Degrees(uniform(random, 120.0, 175.0)),
        _ => CaseLens::Degrees(uniform(random, 20.0, 120.0)),
    };
    Viewpoint {
        at,
        above,
        direction,
        roll: if random.u32(0..4) == 0 { uniform(random, 0.0, 360.0) } else { 0.0 },
        lens,
        size: [[320, 180], [640, 360], [64, 64], [1, 1], [1000, 30], [40, 700]][random.usize(..6)],
        near: log_uniform(random, 1e-6, 1e-2),
    }
}
