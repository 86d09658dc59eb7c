//! Small files that went wrong for other people (`shared/data/reports`), against what GDAL reads from them.

use cuesta::internal::height::{self, Loaded, Options};

use crate::height::real::shared;

fn load(file: &str, options: &Options) -> Option<Loaded> {
    Some(height::load(&shared(&format!("reports/{file}"))?, options).unwrap())
}

/// Size, type, lowest and highest height, holes.
#[track_caller]
fn holds(loaded: &Loaded, sample_type: &str, size: [u32; 2], range: [f32; 2], holes: u64) {
    let statistics = loaded.field.statistics();
    assert_eq!(loaded.field.size(), size);
    assert_eq!((loaded.sample_type.as_str(), [statistics.min, statistics.max]), (sample_type, range));
    assert_eq!(loaded.field.holes().count(), holes);
}

#[test]
fn an_internal_mask() {
    let Some(loaded) = load("nodata/mask.tif", &Options::default()) else { return };
    holds(&loaded, "f32", [80, 60], [80.020905, 397.20108], 100);
}

#[test]
fn nodata_that_is_no_number() {
    let Some(loaded) = load("nodata/none.tif", &Options::default()) else { return };
    holds(&loaded, "f32", [80, 60], [80.020905, 397.20108], 0);
    assert!(loaded.warnings.iter().any(|w| w.contains("GDAL_NODATA is \"none\"")), "{:?}", loaded.warnings);
    let lowest = f64::from(loaded.field.statistics().min);
    let loaded = load("nodata/none.tif", &Options { nodata: Some(lowest), ..Options::default() }).unwrap();
    assert_eq!(loaded.field.holes().count(), 1);
    assert!(!loaded.warnings.iter().any(|w| w.contains("GDAL_NODATA")), "{:?}", loaded.warnings);
}

#[test]
fn undeclared_lowest_floats() {
    for (file, holes) in [("nodata/one.tif", 1), ("nodata/un_block.tif", 100)] {
        let Some(loaded) = load(file, &Options::default()) else { return };
        holds(&loaded, "f32", [80, 60], [80.020905, 397.20108], holes);
        let named = |w: &String| w.contains("-3.4028234663852886e38") && w.contains("--nodata");
        assert!(loaded.warnings.iter().any(named), "{file}: {:?}", loaded.warnings);
        // As gdalinfo prints it.
        let nodata = height::number("-3.4028234663852886e+38");
        let loaded = load(file, &Options { nodata, ..Options::default() }).unwrap();
        holds(&loaded, "f32", [80, 60], [80.020905, 397.20108], holes);
        assert!(!loaded.warnings.iter().any(named), "{file}: {:?}", loaded.warnings);
    }
}

#[test]
fn floats_of_16_bits() {
    let Some(loaded) = load("float16/fp16.tif", &Options::default()) else { return };
    holds(&loaded, "f16", [80, 60], [80.0, 397.25], 0);
}

#[test]
fn lzw_that_ends_at_a_code_width_switch() {
    let Some(loaded) = load("lzw/lzw_right_tile.tif", &Options::default()) else { return };
    holds(&loaded, "i16", [137, 128], [1099.0, 1790.0], 0);
    assert!((loaded.field.statistics().mean - 1_419.674_27).abs() < 1e-6);
}
