//! Geomipmap is proven watertight in every frame of moving paths over real land.

use std::path::PathBuf;
use std::sync::Arc;

use cuesta::height::{self, Field, Options};
use cuesta::measure::watertight;
use cuesta::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;

use super::{drawn, select, technique};

/// Rough land with voids, mountains of odd size, and gentle hills at 1 m.
const FILES: [&str; 3] = ["N42E001.hgt", "bigtujunga.tif", "gabilan_lidar1m_921x859_f32_cog_deflate_pred3.tif"];

fn real(file: &str) -> Option<Arc<Field>> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data").join(file);
    if !path.is_file() {
        eprintln!("skipped: {} is absent", path.display());
        return None;
    }
    Some(Arc::new(height::load(&path, &Options::default()).expect("a file that other tests read").field))
}

/// A place at (u, v) of the field, 0 to 1, some height above the ground.
fn over(field: &Field, u: f64, v: f64, above_m: f64) -> DVec3 {
    let [w, h] = field.size();
    let at = |t: f64, n: u32| ((f64::from(n) - 1.0) * t.clamp(0.0, 1.0)).round() as u32;
    field.world(at(u, w), at(v, h)) + DVec3::Y * above_m
}

/// Where the eye is and where it looks at a time from 0 to 1.
type Path = fn(&Field, f64) -> (DVec3, DVec3);

/// Once round the middle, looking ahead and inwards.
fn circle(field: &Field, t: f64) -> (DVec3, DVec3) {
    let place = |t: f64, radius: f64| {
        let (sin, cos) = (t * std::f64::consts::TAU).sin_cos();
        over(field, 0.5 + radius * cos, 0.5 + radius * sin, 60.0 * field.spacing[0].min(5.0))
    };
    (place(t, 0.35), place(t + 0.2, 0.2))
}

/// From one corner to the other, low over the ground.
fn corner(field: &Field, t: f64) -> (DVec3, DVec3) {
    (over(field, t, t, 10.0 * field.spacing[0]), over(field, t + 0.3, t + 0.25, 0.0))
}

/// On the spot, all round and from high to low.
fn spin(field: &Field, t: f64) -> (DVec3, DVec3) {
    let eye = over(field, 0.6, 0.4, 20.0 * field.spacing[0]);
    let (sin, cos) = (3.0 * t * std::f64::consts::TAU).sin_cos();
    (eye, eye + DVec3::new(cos, 0.5 - t * 1.3, sin))
}

const PATHS: [(&str, Path); 3] = [("circle", circle), ("corner", corner), ("spin", spin)];

fn view((eye, target): (DVec3, DVec3)) -> View {
    View {
        eye,
        world_from_eye: View::looking_along(target - eye),
        lens: Lens::Perspective { fov_x: 70f64.to_radians() },
        size: [640, 360],
        near: 0.5,
        tolerance: Tolerance { px: 3.0, metric: Metric::Certified },
    }
}

/// Proves so many frames of each path on each field; the number proven, and of triangles in all.
fn prove_all(frames: u32, settings: &[(&str, &str)]) -> (u32, usize) {
    let (mut proven, mut triangles) = (0, 0);
    for (file, field) in FILES.iter().filter_map(|file| Some((file, real(file)?))) {
        let mut technique = technique(&field, "geomipmap", settings);
        for (name, path) in PATHS {
            for k in 0..frames {
                let view = view(path(&field, f64::from(k) / f64::from(frames)));
                let list = select(&mut *technique, &view);
                let drawn = drawn(&field, &view, &*technique, &list);
                let proof = watertight::prove(&field, &view.frustum(), &drawn);
                let proof = proof.unwrap_or_else(|why| panic!("{file}, {name}, frame {k} of {frames}: {why}"));
                triangles += proof.triangles;
                proven += 1;
            }
        }
    }
    println!("{proven} frames, {triangles} triangles {settings:?}");
    (proven, triangles)
}

#[test]
fn a_few_frames_of_each_path_are_watertight() {
    let (proven, triangles) = prove_all(6, &[]);
    assert!(proven == 0 || triangles > 500 * proven as usize, "{triangles} triangles in {proven} frames");
}

/// Takes minutes: `cargo test --release -- --ignored journeys`.
#[test]
#[ignore = "takes minutes"]
fn three_hundred_frames_of_each_path_are_watertight() {
    prove_all(300, &[]);
    prove_all(300, &[("morph", "on"), ("block", "33")]);
}
