//! Real files against what another program reads from them (`shared/data/INDEX.md`).

use std::path::PathBuf;

use cuesta::internal::height::{self, Encoding, Loaded, Options};

/// Returns the path of a shared data file; `None`, with a message, if the files are absent.
pub fn shared(file: &str) -> Option<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    if !folder.is_dir() {
        eprintln!("skipped: {} is absent", folder.display());
        return None;
    }
    Some(folder.join(file))
}

fn load(file: &str, options: &Options) -> Option<Loaded> {
    Some(height::load(&shared(file)?, options).unwrap())
}

/// The expected content of a file.
struct Expected {
    file: &'static str,
    format: &'static str,
    size: [u32; 2],
    /// Lowest and highest height, metres.
    range: [f32; 2],
    holes: u64,
    /// Metres, to a thousandth.
    spacing: [f64; 2],
    crs: Option<&'static str>,
    exact_in_16_bit: bool,
}

/// Holes and mean spacing were counted and computed apart from this crate.
const FILES: [Expected; 16] = [
    Expected {
        file: "taiwan_north_8193x8193_i16_tiled512_deflate_pred2.tif",
        format: "GeoTIFF",
        size: [8193, 8193],
        range: [-33.0, 3880.0],
        holes: 0,
        spacing: [19.961, 19.961],
        crs: Some("EPSG:3857"),
        exact_in_16_bit: true,
    },
    Expected {
        file: "taiwan_xueshan_2049x2049_u16_metres.png",
        format: "PNG",
        size: [2049, 2049],
        range: [330.0, 3698.0],
        holes: 0,
        spacing: [1.0, 1.0],
        crs: None,
        exact_in_16_bit: true,
    },
    Expected {
        file: "taiwan_xueshan_769x1025_u16_stretched.png",
        format: "PNG",
        size: [769, 1025],
        range: [0.0, 63682.0],
        holes: 0,
        spacing: [1.0, 1.0],
        crs: None,
        exact_in_16_bit: true,
    },
    Expected {
        file: "N42E001.hgt",
        format: "SRTM HGT",
        size: [1201, 1201],
        range: [349.0, 3100.0],
        holes: 7652,
        spacing: [68.499, 92.569],
        crs: Some("EPSG:4326"),
        exact_in_16_bit: true,
    },
    Expected {
        file: "N41E001.hgt.zip",
        format: "SRTM HGT",
        size: [1201, 1201],
        range: [-20.0, 1204.0],
        holes: 134,
        spacing: [69.580, 92.553],
        crs: Some("EPSG:4326"),
        exact_in_16_bit: true,
    },
    // The index says "none": three voids are 0.0002 %.
    Expected {
        file: "N52E008.hgt.zip",
        format: "SRTM HGT",
        size: [1201, 1201],
        range: [-1.0, 357.0],
        holes: 3,
        spacing: [56.592, 92.731],
        crs: Some("EPSG:4326"),
        exact_in_16_bit: true,
    },
    Expected {
        file: "mt_everest_90m.tif",
        format: "GeoTIFF",
        size: [1201, 1201],
        range: [192.0, 8642.0],
        holes: 130_953,
        spacing: [82.343, 92.343],
        crs: Some("EPSG:4326"),
        exact_in_16_bit: true,
    },
    Expected {
        file: "bigtujunga.tif",
        format: "GeoTIFF",
        size: [1197, 643],
        range: [315.0, 2295.0],
        holes: 0,
        spacing: [30.0, 30.0],
        crs: Some("EPSG:32611"),
        exact_in_16_bit: true,
    },
    Expected {
        file: "gabilan_lidar1m_921x859_f32_cog_deflate_pred3.tif",
        format: "GeoTIFF",
        size: [921, 859],
        range: [187.90, 307.28],
        holes: 0,
        spacing: [1.0, 1.0],
        crs: Some("EPSG:32611"),
        exact_in_16_bit: false,
    },
    Expected {
        file: "ned_oregon_f32_dem1.tif",
        format: "GeoTIFF",
        size: [361, 361],
        range: [47.15, 2109.25],
        holes: 0,
        spacing: [228.457, 308.735],
        crs: Some("EPSG:4269"),
        exact_in_16_bit: false,
    },
    Expected {
        file: "ned_oregon_f32_dem2.tif",
        format: "GeoTIFF",
        size: [361, 361],
        range: [283.36, 2848.57],
        holes: 0,
        spacing: [228.457, 308.735],
        crs: Some("EPSG:4269"),
        exact_in_16_bit: false,
    },
    Expected {
        file: "SainteHelens.dem",
        format: "USGS DEM",
        size: [327, 468],
        range: [682.0, 2543.0],
        holes: 4151,
        spacing: [30.0, 30.0],
        crs: Some("EPSG:26710"),
        exact_in_16_bit: true,
    },
    Expected {
        file: "hugo_site.asc",
        format: "ESRI ASCII grid",
        size: [76, 55],
        range: [1660.0, 1711.0],
        holes: 2028,
        spacing: [10.0, 10.0],
        crs: None,
        exact_in_16_bit: true,
    },
    Expected {
        file: "jacksboro_fault_403x344.asc",
        format: "ESRI ASCII grid",
        size: [403, 344],
        range: [236.0, 1076.0],
        holes: 0,
        spacing: [74.848, 92.471],
        crs: Some("GCS_WGS_1984"),
        exact_in_16_bit: true,
    },
    Expected {
        file: "tiles_world_terrarium",
        format: "Terrarium tiles",
        size: [1024, 768],
        range: [-9499.0, 6727.0],
        holes: 0,
        spacing: [8301.577, 8301.577],
        crs: Some("EPSG:3857"),
        exact_in_16_bit: true,
    },
    Expected {
        file: "tiles_taiwan_mapbox_rgb",
        format: "Terrain-RGB tiles",
        size: [1024, 1792],
        range: [-19.0, 3880.0],
        holes: 824_480,
        spacing: [280.253, 280.253],
        crs: Some("EPSG:3857"),
        exact_in_16_bit: true,
    },
];

#[test]
fn files_hold_what_the_index_says() {
    for expected in FILES {
        // A picture states no scale; values are metres.
        let is_picture = expected.file.ends_with(".png");
        let options = Options { height_scale: is_picture.then_some(1.0), ..Options::default() };
        let Some(loaded) = load(expected.file, &options) else { return };
        let (field, file) = (&loaded.field, expected.file);
        let statistics = field.statistics();
        assert_eq!((loaded.format, field.size()), (expected.format, expected.size), "{file}");
        let close = |found: f32, expected: f32| (found - expected).abs() < 0.0051;
        assert!(
            close(statistics.min, expected.range[0]) && close(statistics.max, expected.range[1]),
            "{file}: {statistics:?}"
        );
        assert_eq!(field.holes().count(), expected.holes, "{file}");
        let near = |k: usize| (field.spacing[k] - expected.spacing[k]).abs() < 0.001;
        assert!(near(0) && near(1), "{file}: {:?}", field.spacing);
        assert_eq!(field.crs.as_deref(), expected.crs, "{file}");
        assert_eq!(loaded.exact_in_16_bit, expected.exact_in_16_bit, "{file}");
        let warned = usize::from(file == "hugo_site.asc" || is_picture);
        assert_eq!(loaded.warnings.len(), warned, "{file}: {:?}", loaded.warnings);
    }
}

#[test]
fn bare_samples() {
    for (file, layout, size, range) in [
        ("taiwan_xueshan_513x513_le_stretched.r16", "513x513:u16le", [513, 513], None),
        ("jotunheimen_512x512_le_u16.raw", "512x512:u16le", [512, 512], Some([58.0, 65315.0])),
    ] {
        let Some(path) = shared(file) else { return };
        let error = height::load(&path, &Options::default()).unwrap_err().to_string();
        assert!(error.contains("--raw") && error.contains(layout), "{error}");
        let options = Options { raw: Some(layout.parse().unwrap()), height_scale: Some(1.0), ..Options::default() };
        let field = height::load(&path, &options).unwrap().field;
        let statistics = field.statistics();
        assert_eq!(field.size(), size);
        assert!(range.is_none_or(|range| range == [statistics.min, statistics.max]), "{statistics:?}");
    }
}

/// The raw file is rows 512.. and columns 300.. of the metres, stretched from 693..3416 m to 0..65535.
#[test]
fn stretched_files_agree() {
    let raw = "513x513:u16le".parse().unwrap();
    let raw = Options { raw: Some(raw), height_scale: Some(1.0), ..Options::default() };
    let Some(raw) = load("taiwan_xueshan_513x513_le_stretched.r16", &raw) else { return };
    let crop = Options { crop: Some([300, 512, 513, 513]), ..Options::default() };
    let Some(metres) = load("taiwan_xueshan_2049x2049_u16_metres.png", &crop) else { return };
    for (i, j) in (0..513).flat_map(|j| (0..513).map(move |i| (i, j))) {
        let stretched = (metres.field.height(i, j) - 693.0) / (3416.0 - 693.0) * 65535.0;
        assert!((stretched - raw.field.height(i, j)).abs() <= 1.0, "({i}, {j})");
    }
}

#[test]
fn undeclared_nodata_of_crater_lake() {
    let file = "craterlake-elev-16bit-30m.tif";
    let Some(loaded) = load(file, &Options::default()) else { return };
    let [warning] = &loaded.warnings[..] else { panic!("{:?}", loaded.warnings) };
    assert!(warning.starts_with("39489 samples are -32767") && warning.contains("--nodata -32767"), "{warning}");
    let options = Options { nodata: Some(-32767.0), ..Options::default() };
    let Some(loaded) = load(file, &options) else { return };
    let statistics = loaded.field.statistics();
    assert_eq!((statistics.min, statistics.max, loaded.field.holes().count()), (1289.0, 1880.0, 39489));
    assert!(loaded.warnings.is_empty());
}

#[test]
fn pictures_are_refused() {
    for (file, word) in [
        ("craterlake-imagery-30m.tif", "--encoding terrarium|mapbox"),
        ("jotunheimen-texture.jpg", "JPEG"),
        ("tiles_world_hypsometric", "--encoding terrarium|mapbox"),
        ("INDEX.md", "--raw"),
    ] {
        let Some(path) = shared(file) else { return };
        let error = height::load(&path, &Options::default()).unwrap_err().to_string();
        assert!(error.contains(word) && !error.contains('\n'), "{error}");
    }
}

/// Neighbouring tiles of SRTM and of NED share an edge.
#[test]
fn neighbours_meet() {
    let options = Options::default();
    let (Some(north), Some(south)) = (load("N42E001.hgt", &options), load("N41E001.hgt.zip", &options)) else { return };
    for i in 0..1201 {
        assert_eq!(north.field.is_hole(i, 1200), south.field.is_hole(i, 0), "column {i}");
        assert!(north.field.is_hole(i, 1200) || north.field.height(i, 1200) == south.field.height(i, 0), "column {i}");
    }
    let (Some(west), Some(east)) =
        (load("ned_oregon_f32_dem1.tif", &options), load("ned_oregon_f32_dem2.tif", &options))
    else {
        return;
    };
    assert_eq!(west.field.spacing, east.field.spacing);
    let apart = (east.field.origin[0] - west.field.origin[0]) / west.field.spacing[0];
    // A degree, of 0.002779… degrees a step.
    assert!((apart - 1.0 / 0.002_779_316_7).abs() < 1e-3, "{apart}");
}

#[test]
fn tiles_by_zoom() {
    for (zoom, size) in [(0, [256, 256]), (1, [512, 512]), (2, [1024, 1024])] {
        let options = Options { zoom: Some(zoom), ..Options::default() };
        let Some(loaded) = load("tiles_world_terrarium", &options) else { return };
        assert_eq!((loaded.field.size(), loaded.field.holes().count()), (size, 0), "{zoom}");
    }
    let options = Options { zoom: Some(7), encoding: Some(Encoding::Mapbox), ..Options::default() };
    let Some(loaded) = load("tiles_taiwan_mapbox_rgb", &options) else { return };
    assert_eq!(loaded.field.size(), [512, 768]);
}
