//! Pixels where the sky shines through land.

use std::sync::Arc;

use anyhow::Result;

use super::{Scene, Shot};
use crate::height::Field;
use crate::lod::{self, Settings, Technique};
use crate::measure::picture;
use crate::view::View;

/// Pixels, row by row, of a picture that are open although land covers all of their neighbourhood in the truth,
/// drawn by brute force. Where samples have no data, land within the tolerance of the truth may show what the
/// truth just hides: pixels that missing land projects to do not count.
pub fn hole_pixels(scene: &Scene, view: &View, shot: &Shot) -> Result<Vec<usize>> {
    let (width, radius) = (view.size[0] as usize, picture::outline_radius(view.tolerance.px));
    let truth = covered(&brute_force(scene, scene.field, view)?);
    let mut holes = picture::hole_pixels(&covered(&shot.picture), &truth, width, radius);
    if scene.field.holes().count() > 0 {
        let missing = picture::widened(&missing_land(scene, view)?, width, radius);
        holes.retain(|&k| !missing[k]);
    }
    Ok(holes)
}

/// Pixels that land without data projects to.
fn missing_land(scene: &Scene, view: &View) -> Result<Vec<bool>> {
    let missing = Arc::new(scene.field.around_holes());
    let mut mask = covered(&brute_force(scene, &missing, view)?);
    // Holes smaller than a pixel may fall between pixel centres.
    let ([w, h], width) = (missing.stored(), view.size[0] as usize);
    for (i, j) in (0..h).flat_map(|j| (0..w).map(move |i| (i, j))).filter(|&(i, j)| !missing.is_hole(i, j)) {
        let seen = view.project(missing.world(i, j)).filter(|p| view.in_picture(p));
        let pixel = seen.map(|p| (p.pixel.y as usize * width + p.pixel.x as usize).min(mask.len() - 1));
        pixel.into_iter().for_each(|k| mask[k] = true);
    }
    Ok(mask)
}

fn covered(picture: &image::RgbaImage) -> Vec<bool> {
    picture.pixels().map(|p| p.0[3] > 0).collect()
}

/// A field as all of its triangles draw it.
pub fn brute_force(scene: &Scene, field: &Arc<Field>, view: &View) -> Result<image::RgbaImage> {
    let entry = lod::find("brute-force").expect("in the table");
    let mut technique: Box<dyn Technique> = (entry.build)(Arc::clone(field), &Settings::defaults(entry));
    Ok(Scene { field, ..scene.clone() }.shoot(technique.as_mut(), view, 1)?.picture)
}
