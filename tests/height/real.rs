//! Real files against what another program reads from them (shared/data/INDEX.md).

use std::path::PathBuf;

use cuesta::height::{self, Encoding, Error, Loaded, Options};

/// The path of a shared data file; `None`, said aloud, where they are not.
fn shared(file: &str) -> Option<PathBuf> {
    let folder = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../shared/data");
    if !folder.is_dir() {
        eprintln!("skipped: {} is absent", folder.display());
        return None;
    }
    Some(folder.join(file))
}

fn load(file: &str, options: &Options) -> Option<Result<Loaded, Error>> {
    Some(height::load(&shared(file)?, options))
}

#[test]
fn report() {
    let raw = |text: &str| Options { raw: Some(text.parse().unwrap()), ..Options::default() };
    for (file, options) in [
        ("taiwan_north_8193x8193_i16_tiled512_deflate_pred2.tif", Options::default()),
        ("taiwan_xueshan_2049x2049_u16_metres.png", Options::default()),
        ("taiwan_xueshan_769x1025_u16_stretched.png", Options::default()),
        ("taiwan_xueshan_513x513_le_stretched.r16", raw("513x513:u16le")),
        ("taiwan_xueshan_513x513_le_stretched.r16", Options::default()),
        ("N42E001.hgt", Options::default()),
        ("N41E001.hgt.zip", Options::default()),
        ("N52E008.hgt.zip", Options::default()),
        ("mt_everest_90m.tif", Options::default()),
        ("bigtujunga.tif", Options::default()),
        ("gabilan_lidar1m_921x859_f32_cog_deflate_pred3.tif", Options::default()),
        ("ned_oregon_f32_dem1.tif", Options::default()),
        ("ned_oregon_f32_dem2.tif", Options::default()),
        ("craterlake-elev-16bit-30m.tif", Options::default()),
        ("craterlake-imagery-30m.tif", Options::default()),
        ("jotunheimen_512x512_le_u16.raw", raw("512x512:u16le")),
        ("jotunheimen-texture.jpg", Options::default()),
        ("SainteHelens.dem", Options::default()),
        ("hugo_site.asc", Options::default()),
        ("jacksboro_fault_403x344.asc", Options::default()),
        ("tiles_world_terrarium", Options::default()),
        ("tiles_world_terrarium", Options { zoom: Some(2), ..Options::default() }),
        ("tiles_world_hypsometric", Options::default()),
        ("tiles_taiwan_mapbox_rgb", Options::default()),
        ("tiles_taiwan_mapbox_rgb", Options { encoding: Some(Encoding::Mapbox), zoom: Some(7), ..Options::default() }),
    ] {
        let start = std::time::Instant::now();
        match load(file, &options) {
            None => return,
            Some(Err(e)) => println!("{e}"),
            Some(Ok(l)) => {
                let s = l.field.statistics();
                println!(
                    "{file}: {} {} {:?} {}..{} mean {:.2} holes {} spacing {:?} origin {:?} {:?} exact16 {} {:?} {:?}",
                    l.format,
                    l.sample_type,
                    l.field.size(),
                    s.min,
                    s.max,
                    s.mean,
                    l.field.holes().count(),
                    l.field.spacing,
                    l.field.origin,
                    l.field.crs,
                    l.exact_in_16_bit,
                    l.warnings,
                    start.elapsed()
                );
            }
        }
    }
}
