//! Benchmark of each technique's selection, without a GPU: `cargo bench --no-default-features --features bench -- FILE
//! [technique[:variant] …]`.
//!
//! Every frame of a path is selected once to warm up and then several times. Other memory is read between selections,
//! as drawing would do, so that caches are cold.

use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use cuesta::internal::bench::paths;
use cuesta::internal::bench::statistics::Percentiles;
use cuesta::internal::draw::DrawList;
use cuesta::internal::height::{self, Field, Options};
use cuesta::internal::lod::{self, Settings, Technique};
use cuesta::internal::view::{Metric, Tolerance, View};

/// Frames of a path.
const FRAMES: usize = 48;
/// Timed selections per frame.
const ROUNDS: usize = 5;
/// Bytes read between two selections: more than the caches hold.
const CACHES: usize = 64 << 20;
/// Camera paths.
const PATHS: [&str; 2] = ["circle", "skim"];

fn main() {
    // Cargo adds `--bench`.
    let arguments: Vec<String> = std::env::args().skip(1).filter(|argument| !argument.starts_with("--")).collect();
    let Some((file, names)) = arguments.split_first() else {
        println!("skipped: no height file was given");
        return;
    };
    let field = Arc::new(height::load(Path::new(file), &Options::default()).expect("a height file").field);
    let all: Vec<String> = lod::TECHNIQUES.iter().map(|entry| entry.name.to_string()).collect();
    for name in if names.is_empty() { &all[..] } else { names } {
        let mut technique = technique(&field, name);
        for path in PATHS {
            let tolerance = Tolerance { px: 1.0, metric: Metric::Certified };
            let path = paths::find(path).expect("a path of the table");
            let views = path.views(&field, FRAMES, [1280, 720], tolerance);
            measure(&format!("{name}, {}", path.name), technique.as_mut(), &views);
        }
    }
}

fn technique(field: &Arc<Field>, name: &str) -> Box<dyn Technique> {
    let (name, variant) = name.split_once(':').map_or((name, None), |(name, variant)| (name, Some(variant)));
    let entry = lod::find(name).expect("a technique of the table");
    (entry.build)(Arc::clone(field), &Settings::new(entry, variant, &[]).expect("a variant of the technique"))
}

fn measure(what: &str, technique: &mut dyn Technique, views: &[View]) {
    let mut list = DrawList::default();
    let other = vec![1u8; CACHES];
    let mut times_us = Vec::new();
    let (mut triangles, mut instances) = (0, 0);
    for round in 0..=ROUNDS {
        for view in views {
            std::hint::black_box(other.iter().step_by(64).map(|&byte| u64::from(byte)).sum::<u64>());
            let start = Instant::now();
            list.clear();
            technique.select(view, &mut list);
            if round > 0 {
                times_us.push(start.elapsed().as_secs_f64() * 1e6);
            }
            (triangles, instances) = (triangles.max(list.triangles()), instances.max(list.instances.len()));
        }
    }
    let Percentiles { p50, p95, max, .. } = Percentiles::of(times_us);
    println!("{what}: {p50:.1} µs, p95 {p95:.1}, max {max:.1}; at most {triangles} triangles, {instances} instances");
}
