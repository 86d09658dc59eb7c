//! The embedded terrain: 25.6 × 25.6 km of alpine landscape, made by [`super::synth`] (kind `eroded`, seed 2).
//!
//! `cargo test --release --no-default-features -- --ignored make_assets` writes both files again, byte for byte.

use super::field::Field;
use super::holes::Holes;
use super::samples::Samples;

/// Metres per code of the picture.
pub const SCALE: f32 = 0.1;
/// Distance of samples, metres.
pub const SPACING: f64 = 25.0;

/// Colours of the terrain, from the first sample to the last one along each axis, north up: a JPEG picture.
pub const OVERLAY: &[u8] = include_bytes!("../../assets/demo_overlay.jpg");

/// The heights as 16-bit codes: a grey PNG picture.
pub const PICTURE: &[u8] = include_bytes!("../../assets/demo.png");

/// Decodes the embedded terrain.
pub fn demo() -> Field {
    let picture = image::load_from_memory(PICTURE).expect("the embedded picture is whole").into_luma16();
    let size = [picture.width(), picture.height()];
    let codes = picture.into_raw();
    let holes = Holes::none(codes.len());
    Field::new(Samples::Coded { codes, zero: 0.0, scale: SCALE }, size, [SPACING; 2], holes)
}
