//! `cuesta render`: one picture, and with `--measure` the error of what was really drawn.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

use anyhow::{Context, Result};
use clap::Args;
use serde::Serialize;

use super::scene::{LookArgs, TechniqueArgs, TerrainArgs, ViewArgs};
use super::{Common, Outcome, report};
use crate::draw::layout::Frame;
use crate::draw::{DrawList, expand};
use crate::gpu::frames::{Frames, Timing};
use crate::gpu::target::{self, Offscreen};
use crate::gpu::terrain::Terrain;
use crate::gpu::{Choice, Gpu, Instance};
use crate::height::save::replace;
use crate::height::{Error, Field};
use crate::lod::{self, Settings, Technique};
use crate::measure::geometric::{self, Summary};
use crate::measure::{picture, watertight};
use crate::plan::{Look, ScenePlan};
use crate::view::{Metric, View};

/// Arguments.
#[derive(Args, Debug)]
pub struct RenderArgs {
    /// Where heights come from.
    #[command(flatten)]
    pub terrain: TerrainArgs,
    /// The picture: .png.
    #[arg(short, long, value_name = "FILE")]
    pub output: PathBuf,
    /// The view.
    #[command(flatten)]
    pub view: ViewArgs,
    /// The technique.
    #[command(flatten)]
    pub technique: TechniqueArgs,
    /// The look.
    #[command(flatten)]
    pub look: LookArgs,
    /// Draw it so often and report the median times.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=10_000))]
    pub repeat: u32,
    /// Measure the error of what was drawn, prove it watertight, count hole pixels.
    #[arg(long)]
    pub measure: bool,
}

#[derive(Serialize)]
struct Rendered {
    technique: String,
    metric: &'static str,
    tolerance_px: f64,
    size: [u32; 2],
    device: String,
    triangles: u64,
    vertices: Option<u64>,
    draws: usize,
    commands: usize,
    batches: usize,
    levels: Vec<usize>,
    prepare_ms: f64,
    select_ms: f64,
    record_ms: f64,
    gpu_ms: f64,
    device_bytes: u64,
    validation_messages: Vec<String>,
    #[serde(flatten)]
    measured: Option<Measured>,
}

#[derive(Serialize)]
struct Measured {
    error_px: Statistics,
    error_m: Statistics,
    hole_pixels: usize,
    /// The first few, from the top left corner.
    hole_pixels_at: Vec<[usize; 2]>,
    skirt_pixels: usize,
    watertight: bool,
    #[serde(skip_serializing_if = "Option::is_none")]
    counter_example: Option<String>,
}

#[derive(Serialize)]
struct Statistics {
    rms: f64,
    p999: f64,
    max: f64,
}

impl From<Summary> for Statistics {
    fn from(s: Summary) -> Self {
        Self { rms: s.rms, p999: s.p999, max: s.max }
    }
}

/// The device that the command line asks for.
pub fn open(common: &Common, window: bool) -> Result<Arc<Gpu>> {
    Gpu::new(&Instance::new(&[], common.validate)?, &choice(common), window)
}

/// The choice of device on the command line.
pub fn choice(common: &Common) -> Choice {
    match common.device.as_deref() {
        None => Choice::Best,
        Some("cpu") => Choice::Cpu,
        Some(name) => Choice::Named(name.to_string()),
    }
}

/// Runs the subcommand.
pub fn run(common: &Common, args: &RenderArgs) -> Result<Outcome> {
    let output = args.output.display().to_string();
    if args.output.extension().and_then(|e| e.to_str()).is_none_or(|e| !e.eq_ignore_ascii_case("png")) {
        return Err(Error::new(output, "extension", "expected .png").into());
    }
    let field = Arc::new(args.terrain.load(common)?.field);
    let (look, overlay) = args.look.build(&args.terrain.terrain)?;
    let view = args.view.build(&field, args.technique.tolerance()?)?;
    let prepared = Instant::now();
    let mut technique = args.technique.build(common, &field)?;
    let prepare_ms = ms(prepared);
    let gpu = open(common, false)?;
    let plan = ScenePlan::new(&field, &look, &gpu.device_limits()).map_err(anyhow::Error::msg)?;
    let plan = plan.with_morph(technique.morphs());
    let scene = Scene { gpu: &gpu, field: &field, plan: &plan, look: &look, overlay: overlay.as_ref() };
    let shot = scene.shoot_often(technique.as_mut(), &view, args.repeat)?;
    save(&args.output, &shot.picture)?;
    let measured = if args.measure { Some(scene.measure(technique.as_ref(), &view, &shot)?) } else { None };
    let messages = gpu.messages();
    let missed = measured.as_ref().is_some_and(|m| {
        let over = technique.keeps_tolerance()
            && view.tolerance.metric == Metric::Certified
            && m.error_px.max > view.tolerance.px;
        over || m.hole_pixels > 0 || !m.watertight
    });
    let rendered = Rendered {
        technique: args.technique.technique.clone(),
        metric: if view.tolerance.metric == Metric::Certified { "certified" } else { "paper" },
        tolerance_px: view.tolerance.px,
        size: view.size,
        device: gpu.candidate.name.clone(),
        triangles: shot.list.triangles(),
        vertices: shot.timing.statistics.map(|s| s[0]),
        draws: shot.list.draws.len(),
        commands: shot.list.commands(),
        batches: shot.list.draws.len(),
        levels: shot.list.levels(),
        prepare_ms,
        select_ms: shot.select_ms,
        record_ms: shot.record_ms,
        gpu_ms: shot.timing.total_ms,
        device_bytes: shot.device_bytes,
        validation_messages: messages.clone(),
        measured,
    };
    report::print(common, &rendered)?;
    Ok(if missed || !messages.is_empty() { Outcome::LimitMissed } else { Outcome::Done })
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn ms(since: Instant) -> f64 {
    since.elapsed().as_secs_f64() * 1e3
}

/// Writes a picture's colours, or leaves the file that was there.
pub fn save(path: &Path, picture: &image::RgbaImage) -> Result<()> {
    let rgb = image::DynamicImage::from(picture.clone()).into_rgb8();
    let written = replace(path, |out| rgb.write_to(out, image::ImageFormat::Png).map_err(std::io::Error::other));
    Ok(written.map_err(|e| Error::new(path.display().to_string(), "file", e))?)
}

/// One field with one look on one device.
pub struct Scene<'a> {
    /// The device.
    pub gpu: &'a Arc<Gpu>,
    /// The field.
    pub field: &'a Arc<Field>,
    /// What the scene needs.
    pub plan: &'a ScenePlan,
    /// How it looks.
    pub look: &'a Look,
    /// The picture laid over it.
    pub overlay: Option<&'a image::RgbaImage>,
}

/// One picture and how it came about.
pub struct Shot {
    /// Colours; alpha says where land was drawn.
    pub picture: image::RgbaImage,
    /// What was drawn.
    pub list: DrawList,
    /// What the device took.
    pub timing: Timing,
    /// Selection, milliseconds.
    pub select_ms: f64,
    /// Recording, milliseconds.
    pub record_ms: f64,
    /// Device bytes in use while it was drawn.
    pub device_bytes: u64,
}

impl Scene<'_> {
    /// Draws one view offscreen.
    pub fn shoot(&self, technique: &mut dyn Technique, view: &View) -> Result<Shot> {
        self.shoot_often(technique, view, 1)
    }

    /// Draws one view offscreen `times` times; the times are medians.
    fn shoot_often(&self, technique: &mut dyn Technique, view: &View, times: u32) -> Result<Shot> {
        let offscreen = Offscreen::new(self.gpu, view.size)?;
        let (resident, limits) = (technique.resident(), technique.limits());
        let mut terrain =
            Terrain::new(self.gpu, self.plan, self.field, self.overlay, resident, limits, Offscreen::FORMATS)?;
        let statistics = self.field.statistics();
        let frame = self.look.frame(self.field, view, [statistics.min, statistics.max]);
        let mut frames = Frames::new(self.gpu, self.plan.measured)?;
        let mut list = DrawList::default();
        let (mut selects, mut records, mut timings) = (Vec::new(), Vec::new(), Vec::new());
        for _ in 0..times {
            let start = Instant::now();
            list.clear();
            technique.select(view, &mut list);
            selects.push(ms(start));
            let start = Instant::now();
            let mut recording = frames.begin()?;
            terrain.prepare(&mut recording, &frame, &list)?;
            target::begin(&recording, offscreen.attachment(), &offscreen.depth);
            terrain.draw(&mut recording, &list)?;
            target::end(&recording);
            offscreen.read_back(&recording);
            records.push(ms(start));
            frames.submit(None, None)?;
            frames.finish().context("drawing")?;
            timings.push(frames.timing.clone());
        }
        timings.sort_by(|a, b| a.total_ms.total_cmp(&b.total_ms));
        Ok(Shot {
            picture: offscreen.picture(),
            list,
            timing: timings[timings.len() / 2].clone(),
            select_ms: median(selects),
            record_ms: median(records),
            device_bytes: self.gpu.device_bytes().values().sum(),
        })
    }

    fn measure(&self, technique: &dyn Technique, view: &View, shot: &Shot) -> Result<Measured> {
        let errors = geometric::errors(self.field, view, technique.resident(), &shot.list);
        let triangles =
            expand::triangles(self.field, &Frame::placing(self.field, view), technique.resident(), &shot.list);
        let proof = watertight::prove(self.field, &view.frustum(), &triangles);
        drop(triangles);
        let holes = self.hole_pixels(view, shot)?;
        let width = view.size[0] as usize;
        Ok(Measured {
            error_px: errors.screen_px.into(),
            error_m: errors.vertical_m.into(),
            hole_pixels: holes.len(),
            hole_pixels_at: holes.iter().take(8).map(|k| [k % width, k / width]).collect(),
            // No technique of the table draws skirts.
            skirt_pixels: 0,
            watertight: proof.is_ok(),
            counter_example: proof.err().map(|e| e.to_string()),
        })
    }

    /// Pixels where the sky shines through land. Where samples have no data, land within the tolerance of the
    /// truth may show what the truth just hides: pixels that missing land projects to do not count.
    fn hole_pixels(&self, view: &View, shot: &Shot) -> Result<Vec<usize>> {
        let covered = |shot: &Shot| -> Vec<bool> { shot.picture.pixels().map(|p| p.0[3] > 0).collect() };
        let (width, radius) = (view.size[0] as usize, picture::outline_radius(view.tolerance.px));
        let truth = covered(&self.shoot(brute_force(self.field).as_mut(), view)?);
        let mut holes = picture::hole_pixels(&covered(shot), &truth, width, radius);
        if self.field.holes().count() > 0 {
            let missing = Arc::new(self.field.around_holes());
            let scene = Scene { field: &missing, ..*self };
            let mut mask = covered(&scene.shoot(brute_force(&missing).as_mut(), view)?);
            // Holes smaller than a pixel may fall between pixel centres.
            let [w, h] = missing.stored();
            for (i, j) in (0..h).flat_map(|j| (0..w).map(move |i| (i, j))).filter(|&(i, j)| !missing.is_hole(i, j)) {
                let seen = view.project(missing.world(i, j)).filter(|p| view.in_picture(p));
                let pixel = seen.map(|p| (p.pixel.y as usize * width + p.pixel.x as usize).min(mask.len() - 1));
                pixel.into_iter().for_each(|k| mask[k] = true);
            }
            let missing = picture::widened(&mask, width, radius);
            holes.retain(|&k| !missing[k]);
        }
        Ok(holes)
    }
}

fn brute_force(field: &Arc<Field>) -> Box<dyn Technique> {
    let entry = lod::find("brute-force").expect("in the table");
    (entry.build)(Arc::clone(field), &Settings::defaults(entry))
}
