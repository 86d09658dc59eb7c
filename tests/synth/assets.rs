//! The embedded terrain is what the program itself makes.

use std::path::Path;

use cuesta::height::demo::{self, KIND, SEED, SIZE};
use cuesta::height::save::save;
use cuesta::height::synth::{overlay, synth};
use image::ExtendedColorType::Rgb8;
use image::ImageEncoder;
use image::codecs::jpeg::JpegEncoder;

#[test]
#[ignore = "writes assets/"]
fn make_assets() {
    let assets = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    let field = synth(KIND, SIZE, SEED);
    save(&field, &assets.join("demo.png")).unwrap();
    let picture = overlay::overlay(&field);
    let mut jpeg = Vec::new();
    JpegEncoder::new_with_quality(&mut jpeg, 80)
        .write_image(&picture, picture.width(), picture.height(), Rgb8)
        .unwrap();
    std::fs::write(assets.join("demo_overlay.jpg"), jpeg).unwrap();
}
