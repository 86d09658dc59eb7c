//! The embedded terrain equals what the program generates.

use std::path::Path;

use cuesta::internal::height::demo::{OVERLAY, demo};
use cuesta::internal::height::save::save;
use cuesta::internal::height::synth::{Kind, synth};
use image::codecs::jpeg::JpegEncoder;

use super::overlay::overlay;

/// Kind of landscape that the embedded terrain was synthesised from.
pub const KIND: Kind = Kind::Eroded;
/// Samples along (x, z).
const SIZE: [u32; 2] = [1025, 1025];
/// See [`KIND`].
pub const SEED: u64 = 2;

#[test]
#[ignore = "writes assets/"]
fn make_assets() {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    let field = synth(KIND, SIZE, SEED);
    save(&field, &assets.join("demo.png")).unwrap();
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, 74).encode_image(&overlay(&field)).unwrap();
    std::fs::write(assets.join("demo_overlay.jpg"), jpeg).unwrap();
}

#[test]
fn demo_is_what_synth_makes() {
    let [demo, made] = [demo(), synth(KIND, SIZE, SEED)];
    assert!(demo.samples() == made.samples(), "run make_assets");
    assert_eq!((demo.size(), demo.spacing), (made.size(), made.spacing));
}

/// JPEG changes each pixel a little; the means of large tiles stay.
#[test]
fn demo_overlay_is_what_synth_makes() {
    let tiles = |picture: image::RgbImage| image::imageops::thumbnail(&picture, 16, 16);
    let embedded = tiles(image::load_from_memory(OVERLAY).unwrap().into_rgb8());
    let made = tiles(overlay(&demo()));
    let apart = embedded.iter().zip(made.iter()).map(|(a, b)| a.abs_diff(*b)).max();
    assert!(apart <= Some(2), "{apart:?}: run make_assets");
}

#[test]
fn demo_is_alpine() {
    let statistics = demo().statistics();
    assert!((2000.0..2800.0).contains(&(statistics.max - statistics.min)), "{statistics:?}");
}
