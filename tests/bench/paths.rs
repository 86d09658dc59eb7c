//! The peers' paths against the poses that other renderers flew.

use std::path::PathBuf;

use cuesta::internal::bench::paths;
use cuesta::internal::height::synth::{Kind, synth};
use cuesta::internal::view::{Lens, Metric, Tolerance};

/// A file of poses: x, y, z, yaw, pitch as printed; `None`, said aloud, where there is none.
fn printed(file: &str) -> Option<Vec<[String; 5]>> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/peers").join(file);
    let Ok(text) = std::fs::read_to_string(&path) else {
        eprintln!("skipped: {} is absent", path.display());
        return None;
    };
    let row = |line: &str| line.split(',').map(str::to_string).collect::<Vec<_>>().try_into().expect("five values");
    Some(text.lines().map(row).collect())
}

#[test]
fn the_peers_paths_are_the_peers_to_the_printed_digits() {
    for (name, file) in [("fly", "poses_fly.csv"), ("high", "poses_high.csv")] {
        let Some(expected) = printed(file) else { return };
        assert_eq!(expected.len(), 120);
        // The landscape has no end: a larger field begins with the smaller one.
        for side in [2049, 4097] {
            let field = synth(Kind::Peers, [side; 2], 1);
            let poses = paths::find(name).unwrap().poses(&field, 120);
            for (k, (pose, expected)) in poses.iter().zip(&expected).enumerate() {
                let height = if name == "fly" { format!("{:.4}", pose.eye.y) } else { format!("{}", pose.eye.y) };
                let [x, z] = [pose.eye.x, pose.eye.z].map(|v| format!("{v:.4}"));
                let found = [x, height, z, format!("{:.5}", pose.yaw), format!("{}", pose.pitch)];
                assert_eq!(found, *expected, "{name}, {side}: pose {k}");
            }
        }
    }
}

#[test]
fn the_peers_views_have_the_peers_focal_length() {
    let field = synth(Kind::Peers, [513; 2], 1);
    let tolerance = Tolerance { px: 1.0, metric: Metric::Certified };
    let views = paths::find("fly").unwrap().views(&field, 120, [1280, 720], tolerance);
    assert_eq!(views.len(), 120);
    for view in views {
        assert!((view.focal_px() - 869.117).abs() < 1e-3 && view.near == 0.1);
        assert!(matches!(view.lens, Lens::Perspective { .. }));
    }
}
