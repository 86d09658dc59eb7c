//! Pools what is measured of the frames of a case.

use std::path::Path;

use anyhow::{Context, Result};
use image::{RgbImage, RgbaImage};

use super::rows::{
    AngleBin, Bin, Economy, Errors, ImageError, PeersError, PendingFrames, Pop, Reference, Summary, Within, Worst,
};
use super::run::BenchScene;
use crate::height::{Field, save};
use crate::measure::economy::{self, overdraw};
use crate::measure::histogram::Histogram;
use crate::measure::watertight::{CounterExample, Proof};
use crate::measure::{beyond, geometric, image as pictures, peers, pop, reference};
use crate::view::View;

/// Samples of the largest field that near-optimal meshes are made of: larger ones take minutes.
const REFERENCE: u64 = 1100 * 1100;
/// Width of a bin of [`geometric::Errors::off_axis`], degrees.
const ANGLE: f64 = 10.0;

/// Everything measured so far.
#[derive(Default)]
pub struct Pool {
    frames: usize,
    /// Frames whose largest error is within the tolerance.
    kept: usize,
    metres: Quantity,
    pixels: Quantity,
    silhouette: Quantity,
    off_axis: [Quantity; geometric::ANGLES],
    /// Samples in view, and those of them within the tolerance.
    samples: [f64; 2],
    worst: Option<(usize, f64)>,
    counter_example: Option<String>,
    as_drawn: Option<bool>,
    hole_pixels: u64,
    skirt_pixels: u64,
    pops: Option<pop::Pop>,
    in_view: u64,
    sub_pixel: f64,
    shown: u64,
    hidden: u64,
    sizes: Option<Histogram>,
    /// Run, and past the depth test.
    fragments: [Option<u64>; 2],
    covered: u64,
    peers: peers::Pool,
    pictures: Vec<pictures::Difference>,
    pending: PendingFrames,
    /// Picture and difference of the worst frame so far.
    shots: Option<(usize, RgbImage, RgbImage)>,
}

/// A quantity over the frames: its root mean square is exact, its 99.9th percentile the largest of any frame.
#[derive(Clone, Copy, Default)]
struct Quantity {
    count: u64,
    squares: f64,
    p999: f64,
    max: f64,
}

impl Quantity {
    fn add(&mut self, of_frame: &geometric::Summary) {
        self.count += of_frame.count;
        if of_frame.count > 0 {
            self.squares += of_frame.count as f64 * of_frame.rms * of_frame.rms;
        }
        self.p999 = self.p999.max(of_frame.p999);
        self.max = self.max.max(of_frame.max);
    }

    fn summary(&self) -> Summary {
        Summary { rms: (self.squares / self.count.max(1) as f64).sqrt(), p999: self.p999, max: self.max }
    }
}

impl Pool {
    /// The geometric errors of a frame, and the tolerance unless it was widened: then it was not kept, whatever the
    /// error.
    pub fn errors(&mut self, frame: usize, errors: &geometric::Errors, tolerance_px: Option<f64>) {
        self.frames += 1;
        self.kept += usize::from(tolerance_px.is_some_and(|px| errors.screen_px.max <= px));
        self.metres.add(&errors.vertical_m);
        self.pixels.add(&errors.screen_px);
        self.silhouette.add(&errors.silhouette_px);
        self.off_axis.iter_mut().zip(&errors.off_axis).for_each(|(all, bin)| all.add(bin));
        let count = errors.screen_px.count as f64;
        self.samples = [self.samples[0] + count, self.samples[1] + count * errors.bound_kept];
        if self.worst.is_none_or(|(_, px)| errors.screen_px.max > px) {
            self.worst = Some((frame, errors.screen_px.max));
        }
    }

    /// A frame in which a refinement waited, by its largest error, and its depth.
    pub fn pending(&mut self, field: &Field, view: &View, max_px: f64, depth: &[f32]) {
        let excess_px = (max_px - view.tolerance.px).max(0.0);
        self.pending.frames += 1;
        self.pending.kept += usize::from(excess_px == 0.0);
        self.pending.pixels += beyond::pixels(field, view, depth);
        self.pending.excess_px = self.pending.excess_px.max(excess_px);
    }

    /// Whether a frame was proven to be one surface.
    pub fn proof(&mut self, frame: usize, proof: Result<Proof, Box<CounterExample>>) {
        if let Err(found) = proof {
            self.counter_example.get_or_insert_with(|| format!("frame {frame}: {found}"));
        }
    }

    /// Whether what the device drew is what the list says, to the bit.
    pub fn captured(&mut self, is_equal: bool) {
        *self.as_drawn.get_or_insert(true) &= is_equal;
    }

    /// Pixels where the sky shines through land.
    pub fn hole_pixels(&mut self, pixels: usize) {
        self.hole_pixels += pixels as u64;
    }

    /// Pixels that show a skirt.
    pub fn skirt_pixels(&mut self, pixels: usize) {
        self.skirt_pixels += pixels as u64;
    }

    /// How far the surface jumped at a frame.
    pub fn pop(&mut self, pop: &pop::Pop) {
        match &mut self.pops {
            None => self.pops = Some(pop.clone()),
            Some(all) => {
                all.histogram.merge(&pop.histogram);
                all.p99_px = all.p99_px.max(pop.p99_px);
                all.p999_px = all.p999_px.max(pop.p999_px);
                all.max_px = all.max_px.max(pop.max_px);
            }
        }
    }

    /// What a frame's triangles were spent on; fragments run, and past the depth test, and pixels covered by land.
    pub fn economy(&mut self, economy: &economy::Economy, fragments: [Option<u64>; 2], covered: u64) {
        self.in_view += economy.shown + economy.facing_away;
        self.shown += economy.shown;
        self.hidden += economy.hidden;
        self.sub_pixel += economy.sub_pixel_share * economy.shown as f64;
        match &mut self.sizes {
            None => self.sizes = Some(economy.sizes_px.clone()),
            Some(sizes) => sizes.merge(&economy.sizes_px),
        }
        self.fragments = [0, 1].map(|k| fragments[k].map(|n| n + self.fragments[k].unwrap_or(0)));
        self.covered += covered;
    }

    /// The peers' metric of a frame's depth.
    pub fn peers(&mut self, field: &Field, view: &View, depth: &[f32]) {
        self.peers.add(field, view, depth);
    }

    /// A frame's picture against the truth's.
    pub fn picture(&mut self, frame: usize, picture: &RgbaImage, truth: &RgbaImage) -> Result<()> {
        let [picture, truth] = [picture, truth].map(|rgba| image::DynamicImage::from(rgba.clone()).into_rgb8());
        let (stats, difference) = pictures::compare(&picture, &truth)?;
        self.pictures.push(stats);
        if self.worst.is_some_and(|(worst, _)| worst == frame) {
            self.shots = Some((frame, picture, difference));
        }
        Ok(())
    }

    /// What a case's row says; the worst frame's pictures are written.
    pub fn finish(self, scene: &BenchScene) -> Result<Errors> {
        let worst = match (&self.worst, &self.shots) {
            (Some((frame, error_px)), Some((_, picture, difference))) => {
                let save = |what: &str, picture| save_picture(scene, what, picture).map(Some);
                let (picture, difference) = (save("worst", picture)?, save("difference", difference)?);
                Some(Worst { frame: *frame, error_px: *error_px, picture, difference })
            }
            _ => None,
        };
        let within = Within {
            frames: self.kept as f64 / self.frames.max(1) as f64,
            samples: if self.samples[0] > 0.0 { self.samples[1] / self.samples[0] } else { 1.0 },
        };
        let reference = self.reference(scene)?;
        let peers = self.peers.summary();
        Ok(Errors {
            frames: self.frames,
            error_px: self.pixels.summary(),
            error_m: self.metres.summary(),
            silhouette_px: (self.silhouette.count > 0).then(|| self.silhouette.summary()),
            within: Some(within),
            by_angle: self.by_angle(),
            image: self.image(),
            pop: self.pops.as_ref().map(|pop| Pop {
                p99_px: pop.p99_px,
                p999_px: pop.p999_px,
                max_px: pop.max_px,
                histogram: bins(&pop.histogram),
            }),
            watertight: Some(self.counter_example.is_none()),
            counter_example: self.counter_example.clone(),
            as_drawn: self.as_drawn,
            hole_pixels: Some(self.hole_pixels),
            skirt_pixels: Some(self.skirt_pixels),
            economy: self.sizes.as_ref().map(|sizes| Economy {
                pixels_per_triangle: bins(sizes),
                hidden_share: self.hidden as f64 / self.shown.max(1) as f64,
                subpixel_share: self.sub_pixel / self.shown.max(1) as f64,
                overdraw: self.fragments[0].and_then(|run| overdraw(run, self.covered)),
                passed: self.fragments[1].and_then(|passed| overdraw(passed, self.covered)),
            }),
            reference,
            peers_px: (peers.pixels > 0).then_some(PeersError {
                mean: peers.mean,
                rms: peers.rms,
                p95: peers.p95,
                p99: peers.p99,
                max: peers.max,
            }),
            worst,
            pending: Some(self.pending),
        })
    }

    fn by_angle(&self) -> Vec<AngleBin> {
        let bin = |(k, quantity): (usize, &Quantity)| AngleBin {
            from_deg: ANGLE * k as f64,
            to_deg: ANGLE * (k + 1) as f64,
            p999: quantity.p999,
            max: quantity.max,
        };
        self.off_axis.iter().enumerate().filter(|(_, q)| q.count > 0).map(bin).collect()
    }

    fn image(&self) -> Option<ImageError> {
        let mean = |of: fn(&pictures::Difference) -> Option<f64>| {
            let values: Vec<f64> = self.pictures.iter().filter_map(of).collect();
            (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
        };
        // The noise of all frames together: where none has any, the ratio is infinite.
        let noise = mean(|d| Some(d.rmse * d.rmse))?;
        Some(ImageError {
            rmse: noise.sqrt() / 255.0,
            psnr: if noise > 0.0 { 10.0 * (255.0 * 255.0 / noise).log10() } else { f64::INFINITY },
            ssim: mean(|d| d.ssim).unwrap_or(1.0),
            flip: mean(|d| Some(d.flip_mean))?,
        })
    }

    /// Near-optimal meshes of the field at the case's largest vertical error, where that is one.
    fn reference(&self, scene: &BenchScene) -> Result<Option<Reference>> {
        let [columns, rows] = scene.field.size().map(u64::from);
        let error_m = self.metres.max;
        if !(error_m.is_finite() && error_m > 0.0) || columns * rows > REFERENCE {
            return Ok(None);
        }
        let delaunay = reference::greedy(scene.field, error_m)?.triangles;
        let rtin = reference::rtin(scene.field, error_m)?.triangles;
        // Of the mesh, the part that lies in view.
        let in_view = self.samples[0] / (self.frames as f64 * (columns * rows) as f64);
        let drawn = self.in_view as f64 / self.frames as f64;
        let multiple = (in_view > 0.0).then(|| drawn / (delaunay as f64 * in_view));
        Ok(Some(Reference { error_m, delaunay: Some(delaunay), rtin: Some(rtin), multiple }))
    }
}

fn bins(histogram: &Histogram) -> Vec<Bin> {
    let last = histogram.counts.len() - 1;
    let end = |k: usize| if k < last { histogram.begin(k + 1) } else { f64::INFINITY };
    histogram.counts.iter().enumerate().map(|(k, &count)| Bin { from: histogram.begin(k), to: end(k), count }).collect()
}

/// Writes a picture of a case; its name relative to the folder.
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
