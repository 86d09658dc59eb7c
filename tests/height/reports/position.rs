//! Inputs of public reports about position, units and scale (`shared/data/reports/INDEX.md`).

use std::path::PathBuf;

use cuesta::internal::height::{self, Field, Loaded, Options};

fn load(file: &str) -> Option<Loaded> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data/reports");
    if !folder.is_dir() {
        eprintln!("skipped: {} is absent", folder.display());
        return None;
    }
    Some(height::load(&folder.join(file), &Options::default()).unwrap())
}

fn check_range(field: &Field, range: [f64; 2]) {
    let found = [field.statistics().min, field.statistics().max].map(f64::from);
    assert!((0..2).all(|k| (found[k] - range[k]).abs() < 1e-3), "{found:?}");
}

fn check(field: &Field, spacing: f64, range: [f64; 2]) {
    assert!(field.spacing.iter().all(|step| (step - spacing).abs() < 1e-6), "{:?}", field.spacing);
    check_range(field, range);
}

#[test]
fn compound_code_in_feet() {
    let Some(loaded) = load("feet/2263+6360.tif") else { return };
    check(&loaded.field, 3.0480061, [24.390145, 121.0668]);
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
}

#[test]
fn code_in_feet_without_unit_keys() {
    let Some(loaded) = load("feet/2263-geotiff11.tif") else { return };
    check(&loaded.field, 3.0480061, [80.0209, 397.2011]);
    assert!(loaded.warnings[0].contains("--height-scale"), "{:?}", loaded.warnings);
}

#[test]
fn unit_of_the_band_in_feet() {
    let Some(loaded) = load("feet/unit_usft.tif") else { return };
    check_range(&loaded.field, [24.390, 121.067]);
}

#[test]
fn world_files() {
    let Some(tiff) = load("world-file/d.tif") else { return };
    assert!(tiff.field.spacing.iter().all(|step| (step - 1.5240030).abs() < 1e-6), "{:?}", tiff.field.spacing);
    assert!((tiff.field.origin[0] - 500_002.5 * 1200.0 / 3937.0).abs() < 1e-6);
    let png = load("world-file/p.png").unwrap();
    assert_eq!((png.field.spacing, png.field.origin), ([5.0, 5.0], [500_002.5, -5_199_997.5]));
}

#[test]
fn scale_of_the_band() {
    let Some(loaded) = load("scale/scale.tif") else { return };
    check_range(&loaded.field, [80.0, 397.2]);
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);
}

/// The high peak is north-west.
#[test]
fn columns_that_run_west() {
    let Some(loaded) = load("mirrored/westleft.tif") else { return };
    let field = &loaded.field;
    assert_eq!(field.origin, [500_005.0, -5_199_995.0]);
    let [w, h] = field.size();
    let all = (0..h).flat_map(|j| (0..w).map(move |i| [i, j]));
    let peak = all.max_by(|a, b| field.height(a[0], a[1]).total_cmp(&field.height(b[0], b[1]))).unwrap();
    assert!(peak[0] < w / 2 && peak[1] < h / 2, "{peak:?}");
}

#[test]
fn picture_without_spacing_or_scale() {
    let Some(loaded) = load("png-scale/heightmap16.png") else { return };
    let [warning] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
    assert!(warning.contains("--spacing") && warning.contains("--height-scale"), "{warning}");
    let field = &loaded.field;
    let longer = f64::from(field.size().into_iter().max().unwrap() - 1);
    let relief = f64::from(field.statistics().max - field.statistics().min);
    assert!((relief / longer - 0.2).abs() < 0.002, "{relief} m of {longer} m");
}
