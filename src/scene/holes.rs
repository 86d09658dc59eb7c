//! Pixels where the sky shines through the terrain, and pixels of skirts.

use std::sync::Arc;

use anyhow::{Result, ensure};

use super::renderer::Scene;
use crate::height::Field;
use crate::lod::{self, Settings, Technique, sorted_strips};
use crate::measure::picture;
use crate::view::{Tolerance, View};

/// A tolerance below anything visible, pixels.
const EXACT_PX: f64 = 1e-3;

/// A view as brute force draws it: the reference for other pictures of the view.
pub struct Truth {
    /// The picture; alpha is 0 where there is no terrain.
    pub picture: image::RgbaImage,
    masks: Masks,
}

/// Pixels of a picture with terrain.
struct Masks {
    width: usize,
    terrain: Vec<bool>,
    /// Pixels of terrain without data, if there is any.
    missing: Option<Vec<bool>>,
}

impl Truth {
    /// Draws the view.
    ///
    /// # Errors
    /// If the device fails.
    pub fn new(scene: &Scene, view: &View) -> Result<Self> {
        let picture = brute_force(scene, scene.field, view)?;
        Ok(Self { masks: Masks::new(scene, view, &picture)?, picture })
    }

    /// Returns the hole pixels of a picture of the same view, numbered row by row. They show no terrain, although terrain
    /// covers their whole neighbourhood in the reference. Pixels of terrain without data do not count: terrain within the
    /// tolerance may show samples without data that the reference just hides. Holes near the edge are verified in a larger
    /// picture, because their neighbourhood crosses the edge.
    ///
    /// # Errors
    /// If the device fails.
    pub fn hole_pixels(&self, scene: &Scene, view: &View, picture: &image::RgbaImage) -> Result<Vec<usize>> {
        let radius = picture::outline_radius(view.tolerance.px);
        let mut holes = self.masks.holes(&covered(picture), radius);
        let [width, height] = view.size.map(|n| n as usize);
        let is_beside = |n: usize, of: usize| n < radius || n + radius >= of;
        if holes.iter().any(|&k| is_beside(k % width, width) || is_beside(k / width, height)) {
            let real = real_holes(scene, view, picture, radius)?;
            holes.retain(|k| real.contains(k));
        }
        Ok(holes)
    }
}

/// Returns the hole pixels of a picture against a larger reference, which contains their whole neighbourhoods.
fn real_holes(scene: &Scene, view: &View, picture: &image::RgbaImage, radius: usize) -> Result<Vec<usize>> {
    let [inner, height] = view.size;
    let room = scene.gpu.device_limits().image_side.saturating_sub(inner.max(height)) / 2;
    let margin = room.min(radius as u32);
    let wide = view.with_margin(margin);
    let masks = Masks::new(scene, &wide, &brute_force(scene, scene.field, &wide)?)?;
    let (inner, margin) = (inner as usize, margin as usize);
    let mut drawn = vec![true; masks.terrain.len()];
    for (row, covered) in covered(picture).chunks(inner).enumerate() {
        drawn[(row + margin) * masks.width + margin..][..inner].copy_from_slice(covered);
    }
    let place = |k: usize| (k / masks.width - margin) * inner + k % masks.width - margin;
    Ok(masks.holes(&drawn, radius).into_iter().map(place).collect())
}

impl Masks {
    fn new(scene: &Scene, view: &View, picture: &image::RgbaImage) -> Result<Self> {
        let has_holes = scene.field.holes().count() > 0;
        let missing = has_holes.then(|| missing_terrain(scene, view)).transpose()?;
        Ok(Self { width: view.size[0] as usize, terrain: covered(picture), missing })
    }

    fn holes(&self, covered: &[bool], radius: usize) -> Vec<usize> {
        let mut holes = picture::hole_pixels(covered, &self.terrain, self.width, radius);
        if let Some(missing) = &self.missing {
            let missing = picture::dilated(missing, self.width, radius);
            holes.retain(|&k| !missing[k]);
        }
        holes
    }
}

fn missing_terrain(scene: &Scene, view: &View) -> Result<Vec<bool>> {
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

/// Returns true for each pixel that shows a skirt: alpha is half there.
pub fn skirts(picture: &image::RgbaImage) -> Vec<bool> {
    picture.pixels().map(|p| (1..255).contains(&p.0[3])).collect()
}

/// Returns true for each pixel that shows terrain.
pub fn covered(picture: &image::RgbaImage) -> Vec<bool> {
    picture.pixels().map(|p| p.0[3] > 0).collect()
}

/// Draws every sample. A cave is drawn by the only technique that can, at a tolerance of almost 0.
fn brute_force(scene: &Scene, field: &Arc<Field>, view: &View) -> Result<image::RgbaImage> {
    let is_cave = field.ceiling().is_some();
    let entry = lod::find(if is_cave { sorted_strips::ENTRY.name } else { "brute-force" }).expect("in the table");
    let mut technique: Box<dyn Technique> = (entry.build)(Arc::clone(field), &Settings::defaults(entry));
    let plan = scene.plan.clone().with_requirements(technique.pipeline_requirements());
    let tolerance = Tolerance { px: if is_cave { EXACT_PX } else { view.tolerance.px }, ..view.tolerance };
    let view = View { tolerance, ..*view };
    let rendered = Scene { field, plan: &plan, ..scene.clone() }.render(technique.as_mut(), &view, 1)?;
    ensure!(
        !is_cave || rendered.list.tolerance_scale == 1.0,
        "the cave has too many samples in view for a picture of all"
    );
    Ok(rendered.picture)
}
