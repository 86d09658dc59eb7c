//! Combines the measurements of all frames of a case into its [`Errors`].

use std::path::Path;

use anyhow::{Context, Result};
use image::{RgbImage, RgbaImage};

use super::rows::{Errors, PendingFrames, Within, Worst};
use super::run::BenchScene;
use crate::height::{Field, save};
use crate::measure::economy::{Economy, Triangles};
use crate::measure::geometric::{self, ANGLE_DEG, AngleBin};
use crate::measure::image::{self as pictures, ImageError};
use crate::measure::pop::Pop;
use crate::measure::reference::{self, Reference};
use crate::measure::watertight::{CounterExample, Proof};
use crate::measure::{beyond, peers, summary};
use crate::view::View;

/// Largest number of samples of a field for which near-optimal meshes are built. Larger ones would take minutes.
const REFERENCE_SAMPLES: u64 = 1100 * 1100;

/// Measurements of all frames so far.
#[derive(Default)]
pub struct Pool {
    frames: usize,
    /// Frames whose largest error is within the tolerance.
    kept: usize,
    metres: summary::Pool,
    pixels: summary::Pool,
    silhouette: summary::Pool,
    /// Screen error divided by the tolerance, by the angle off the view axis.
    off_axis: [summary::Pool; geometric::ANGLES],
    /// Number of samples in view, and of those within the tolerance, over all frames.
    samples: [f64; 2],
    /// Frame with the largest screen error, and that error, pixels.
    worst: Option<(usize, f64)>,
    counter_example: Option<String>,
    as_drawn: Option<bool>,
    hole_pixels: u64,
    skirt_pixels: u64,
    pop: Option<Pop>,
    triangles: Option<Triangles>,
    /// Fragment shader invocations, and fragments that passed the depth test; `None` if the device does not count them.
    fragments: [Option<u64>; 2],
    /// Pixels covered by terrain, all frames.
    covered: u64,
    peers: peers::Pool,
    pictures: Vec<pictures::Difference>,
    pending: PendingFrames,
    /// Picture and difference of the worst frame so far.
    worst_pictures: Option<(RgbImage, RgbImage)>,
}

impl Pool {
    /// Adds the geometric errors of a frame. `tolerance_px` is `None` if the frame's tolerance was scaled up: such a
    /// frame never counts as within the tolerance.
    pub fn errors(&mut self, frame: usize, errors: &geometric::Errors, tolerance_px: Option<f64>) {
        self.frames += 1;
        self.kept += usize::from(tolerance_px.is_some_and(|px| errors.screen_px.max <= px));
        self.metres.add(errors.samples, &errors.vertical_m);
        self.pixels.add(errors.samples, &errors.screen_px);
        self.silhouette.add(errors.silhouette_samples, &errors.silhouette_px);
        for (k, pool) in self.off_axis.iter_mut().enumerate() {
            pool.add(errors.off_axis_samples[k], &errors.off_axis[k]);
        }
        let count = errors.samples as f64;
        self.samples = [self.samples[0] + count, self.samples[1] + count * errors.bound_kept];
        if self.worst.is_none_or(|(_, px)| errors.screen_px.max > px) {
            self.worst = Some((frame, errors.screen_px.max));
        }
    }

    /// Adds a frame with pending data: its largest screen error, pixels, and its depth buffer.
    pub fn pending(&mut self, field: &Field, view: &View, max_px: f64, depth: &[f32]) {
        let excess_px = (max_px - view.tolerance.px).max(0.0);
        self.pending.frames += 1;
        self.pending.kept += usize::from(excess_px == 0.0);
        self.pending.pixels += beyond::pixels(field, view, depth);
        self.pending.excess_px = self.pending.excess_px.max(excess_px);
    }

    /// Adds the result of a frame's proof of watertightness. The first counter-example is kept.
    pub fn proof(&mut self, frame: usize, proof: Result<Proof, Box<CounterExample>>) {
        if let Err(found) = proof {
            self.counter_example.get_or_insert_with(|| format!("frame {frame}: {found}"));
        }
    }

    /// Adds a frame whose triangles were captured on the device: true if they equal those of its draw list.
    pub fn captured(&mut self, is_equal: bool) {
        *self.as_drawn.get_or_insert(true) &= is_equal;
    }

    /// Adds a frame's number of pixels where the sky shows through terrain.
    pub fn hole_pixels(&mut self, pixels: usize) {
        self.hole_pixels += pixels as u64;
    }

    /// Adds a frame's number of pixels that show a skirt.
    pub fn skirt_pixels(&mut self, pixels: usize) {
        self.skirt_pixels += pixels as u64;
    }

    /// Adds the displacement of the surface from the previous frame to this one.
    pub fn pop(&mut self, pop: Pop) {
        match &mut self.pop {
            None => self.pop = Some(pop),
            Some(all) => all.merge(&pop),
        }
    }

    /// Adds a frame's triangles, its fragments (shader invocations, and those that passed the depth test) and its
    /// number of pixels covered by terrain.
    pub fn triangles(&mut self, triangles: &Triangles, fragments: [Option<u64>; 2], covered: u64) {
        self.triangles.get_or_insert_default().merge(triangles);
        self.fragments = [0, 1].map(|k| fragments[k].map(|n| n + self.fragments[k].unwrap_or(0)));
        self.covered += covered;
    }

    /// Adds a frame's depth buffer to the metric of other renderers ([`peers`]).
    pub fn peers(&mut self, field: &Field, view: &View, depth: &[f32]) {
        self.peers.add(field, view, depth);
    }

    /// Adds the difference of a frame's picture from the reference picture. Must follow [`Pool::errors`] of the same
    /// frame.
    ///
    /// # Errors
    /// If the pictures differ in size.
    pub fn picture(&mut self, frame: usize, picture: &RgbaImage, truth: &RgbaImage) -> Result<()> {
        let [picture, truth] = [picture, truth].map(|rgba| image::DynamicImage::from(rgba.clone()).into_rgb8());
        let (stats, difference) = pictures::compare(&picture, &truth)?;
        self.pictures.push(stats);
        if self.worst.is_some_and(|(worst, _)| worst == frame) {
            self.worst_pictures = Some((picture, difference));
        }
        Ok(())
    }

    /// Returns the errors of the case, and writes the pictures of its worst frame.
    ///
    /// # Errors
    /// If a near-optimal mesh cannot be built or a picture cannot be written.
    pub fn finish(self, scene: &BenchScene) -> Result<Errors> {
        let within = Within {
            frames: self.kept as f64 / self.frames.max(1) as f64,
            samples: if self.samples[0] > 0.0 { self.samples[1] / self.samples[0] } else { 1.0 },
        };
        Ok(Errors {
            frames: self.frames,
            error_px: self.pixels.summary(),
            error_m: self.metres.summary(),
            silhouette_px: (!self.silhouette.is_empty()).then(|| self.silhouette.summary()),
            within: Some(within),
            by_angle: self.by_angle(),
            image: ImageError::mean(&self.pictures),
            watertight: Some(self.counter_example.is_none()),
            as_drawn: self.as_drawn,
            hole_pixels: Some(self.hole_pixels),
            skirt_pixels: Some(self.skirt_pixels),
            economy: self.triangles.as_ref().map(|all| Economy::new(all, self.fragments, self.covered)),
            reference: self.reference(scene)?,
            peers_px: (self.peers.pixels() > 0).then(|| self.peers.summary()),
            worst: self.worst(scene)?,
            pending: Some(self.pending),
            pop: self.pop,
            counter_example: self.counter_example,
        })
    }

    /// Returns the bins of angles that have samples.
    fn by_angle(&self) -> Vec<AngleBin> {
        let bin = |(k, pool): (usize, &summary::Pool)| {
            let summary = pool.summary();
            let [from_deg, to_deg] = [k, k + 1].map(|k| ANGLE_DEG * k as f64);
            AngleBin { from_deg, to_deg, p999: summary.p999, max: summary.max }
        };
        self.off_axis.iter().enumerate().filter(|(_, pool)| !pool.is_empty()).map(bin).collect()
    }

    /// Writes the pictures of the frame with the largest screen error.
    fn worst(&self, scene: &BenchScene) -> Result<Option<Worst>> {
        let (Some((frame, error_px)), Some((picture, difference))) = (self.worst, &self.worst_pictures) else {
            return Ok(None);
        };
        let picture = Some(save_picture(scene, "worst", picture)?);
        let difference = Some(save_picture(scene, "difference", difference)?);
        Ok(Some(Worst { frame, error_px, picture, difference }))
    }

    /// Builds near-optimal meshes of the field within the case's largest vertical error. Returns `None` if that is 0
    /// or infinite, or the field is too large.
    fn reference(&self, scene: &BenchScene) -> Result<Option<Reference>> {
        let [columns, rows] = scene.field.size().map(u64::from);
        let error_m = self.metres.summary().max;
        if !(error_m.is_finite() && error_m > 0.0) || columns * rows > REFERENCE_SAMPLES {
            return Ok(None);
        }
        let delaunay = reference::greedy(scene.field, error_m)?.triangles;
        let rtin = reference::rtin(scene.field, error_m)?.triangles;
        // Mean share of the field's samples in view: the same share of the whole mesh is comparable.
        let in_view = self.samples[0] / (self.frames as f64 * (columns * rows) as f64);
        let drawn = self.triangles.as_ref().map_or(0, |all| all.shown + all.facing_away) as f64 / self.frames as f64;
        let multiple = (in_view > 0.0).then(|| drawn / (delaunay as f64 * in_view));
        Ok(Some(Reference { error_m, delaunay: Some(delaunay), rtin: Some(rtin), multiple }))
    }
}

/// Writes a picture of a case to the folder `pictures`. Returns its path relative to the benchmark's folder.
fn save_picture(scene: &BenchScene, what: &str, picture: &RgbImage) -> Result<String> {
    let mut name: String =
        format!("{}-{what}", scene.case).chars().map(|c| if c.is_alphanumeric() { c } else { '-' }).collect();
    while name.contains("--") {
        name = name.replace("--", "-");
    }
    let name = format!("pictures/{name}.png");
    let path = scene.folder.join(&name);
    std::fs::create_dir_all(path.parent().unwrap_or(Path::new("."))).with_context(|| path.display().to_string())?;
    save::replace(&path, |out| picture.write_to(out, image::ImageFormat::Png).map_err(std::io::Error::other))
        .with_context(|| path.display().to_string())?;
    Ok(name)
}
