//! Draws one picture of the terrain that comes with the crate, on any Vulkan device, and writes a PNG file.
//!
//! `cargo run --release --example render_png -- [OUTPUT.png]`

use std::error::Error;
use std::sync::Arc;

use cuesta::glam::DVec3;
use cuesta::offscreen::{self, Choice, Colour, Look};
use cuesta::techniques::Techniques;
use cuesta::{View, heights};

fn main() -> Result<(), Box<dyn Error>> {
    let file = std::env::args().nth(1).unwrap_or_else(|| "terrain.png".to_string());
    let field = Arc::new(heights::demo());
    let view = View::builder()
        .eye(DVec3::new(12_800.0, 4500.0, 27_000.0))
        .look_at(DVec3::new(12_800.0, 1000.0, 12_800.0))
        .size(640, 360)
        .build()?;
    let mut technique = Techniques::built_in().prepare("sphere-tree", &field)?;
    // Tints by height; the sun stands in the west, 35° high.
    let look = Look { colour: Colour::Height, sun: [270.0, 35.0], ..Look::default() };
    let mut picture = offscreen::picture(&field, technique.as_mut(), &view, &look, &Choice::Best)?;
    // Alpha is 0 where the sky is: a file without transparency shows it.
    picture.pixels_mut().for_each(|pixel| pixel.0[3] = 255);
    picture.save(&file)?;
    println!("{file}: {} x {} pixels", picture.width(), picture.height());
    Ok(())
}
