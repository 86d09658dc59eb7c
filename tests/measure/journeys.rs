//! Along every named path over real land: each frame is proven watertight, and its certified bound holds.

use std::path::PathBuf;
use std::sync::Arc;

use cuesta::internal::bench::paths::PATHS;
use cuesta::internal::height::{self, Field, Options};
use cuesta::internal::measure::{geometric, watertight};
use cuesta::internal::view::{Metric, Tolerance};

use super::{drawn, select, technique};

/// Rough land with voids, mountains of odd size, and gentle hills at 1 m.
const FILES: [&str; 3] = ["N42E001.hgt", "bigtujunga.tif", "gabilan_lidar1m_921x859_f32_cog_deflate_pred3.tif"];

/// Errors allowed, pixels, frame by frame in turn.
const TOLERANCES: [f64; 4] = [1.0, 4.0, 2.0, 8.0];

fn real(file: &str) -> Option<Arc<Field>> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(file);
    if !path.is_file() {
        eprintln!("skipped: {} is absent", path.display());
        return None;
    }
    Some(Arc::new(height::load(&path, &Options::default()).expect("a file that other tests read").field))
}

/// Flies every path over every field. Returns the number of frames and triangles, and the largest error over the
/// tolerance.
fn fly(frames: usize, name: &str, settings: &[&str]) -> (usize, usize, f64) {
    let (mut proven, mut triangles, mut largest) = (0, 0, 0.0f64);
    for (file, field) in FILES.iter().filter_map(|file| Some((file, real(file)?))) {
        let mut technique = technique(&field, name, settings);
        for path in PATHS {
            let tolerance = Tolerance { px: 1.0, metric: Metric::Certified };
            for (k, mut view) in path.views(&field, frames, [320, 180], tolerance).into_iter().enumerate() {
                view.tolerance.px = TOLERANCES[k % TOLERANCES.len()];
                let what = format!("{name} {settings:?}, {file}, {}, frame {k} of {frames}", path.name);
                let list = select(&mut *technique, &view);
                let drawn = drawn(&field, &view, &*technique, &list);
                let proof = watertight::prove(&field, &view.frustum(), &drawn, 0);
                let proof = proof.unwrap_or_else(|why| panic!("{what}: {why}"));
                let errors = geometric::errors(&field, &view, technique.resident(), &list);
                let share = errors.screen_px.max / view.tolerance.px;
                assert!(share <= 1.0 && errors.bound_kept == 1.0, "{what}: {errors:?}");
                (proven, triangles, largest) = (proven + 1, triangles + proof.triangles, largest.max(share));
            }
        }
    }
    println!("{name} {settings:?}: {proven} frames, {triangles} triangles, largest error / tolerance {largest:.3}");
    (proven, triangles, largest)
}

#[test]
fn a_few_frames_of_each_path_are_watertight_and_within_the_tolerance() {
    for technique in ["geomipmap", "clusters"] {
        let (proven, triangles, largest) = fly(2, technique, &[]);
        assert!(proven == 0 || triangles > 500 * proven && largest > 0.5, "{triangles} triangles, {largest}");
    }
}

/// Takes minutes: `cargo test --release -- --ignored journeys`.
#[test]
#[ignore = "takes minutes"]
fn three_hundred_frames_of_each_path_are_watertight_and_within_the_tolerance() {
    fly(300, "geomipmap", &[]);
    fly(300, "geomipmap", &["morph=on", "block=33"]);
    fly(300, "clusters", &[]);
    fly(300, "clusters", &["morph=on", "block=16"]);
}
