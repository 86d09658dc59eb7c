//! A backend without a device: times, errors and pictures from a formula, the same in every run.

use std::collections::BTreeMap;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

use anyhow::Result;
use cuesta::internal::bench::controller::ToleranceController;
use cuesta::internal::bench::rows::{Decision, Device, Errors, Header, Machine, PendingFrames, Plan, Within, Worst};
use cuesta::internal::bench::run::{BenchBackend, BenchScene, Ended, Run, Timed};
use cuesta::internal::bench::{Case, FrameSample, SCHEMA, Terrain};
use cuesta::internal::height::Field;
use cuesta::internal::height::synth::{Kind, synth};
use cuesta::internal::measure::economy::Economy;
use cuesta::internal::measure::geometric::AngleBin;
use cuesta::internal::measure::histogram::{Bin, Histogram};
use cuesta::internal::measure::image::ImageError;
use cuesta::internal::measure::peers::PeersError;
use cuesta::internal::measure::pop::Pop;
use cuesta::internal::measure::reference::Reference;
use cuesta::internal::measure::summary::Summary;
use image::{Rgb, RgbImage};

/// Its one adjustable thing: what it leaves unmeasured.
#[derive(Default)]
pub struct Mock {
    /// Omit all optional measurements.
    pub is_bare: bool,
    /// Calls so far.
    pub calls: Vec<String>,
}

impl BenchBackend for Mock {
    fn describe(&mut self, fields: &[(Terrain, Arc<Field>)]) -> Result<(Device, Vec<Plan>)> {
        let device = Device { name: "Mock & Sons <1>".to_string(), driver: "formula 1.0".to_string(), is_cpu: true };
        let decision = |feature: &str, reason: &str, bytes| Decision {
            feature: feature.to_string(),
            reason: reason.to_string(),
            bytes,
        };
        let plan = |(terrain, _): &(Terrain, Arc<Field>)| Plan {
            terrain: terrain.to_string(),
            kept: vec![decision("queries", "times are reported", 0)],
            left_out: vec![decision("fog", "density 0", 0), decision("hole mask", "every sample has data", 1 << 20)],
        };
        Ok((device, fields.iter().map(plan).collect()))
    }

    fn time(&mut self, scene: &BenchScene) -> Result<Timed> {
        let call = self.calls.len();
        self.calls.push(format!("time {}", scene.case));
        let mut controller = ToleranceController::new(scene.case);
        let frame = |k: usize| {
            let view = controller.view(&scene.views[k]);
            let triangles = triangles(scene.case, view.tolerance.px);
            // The warm-up is slow.
            let slow = if k < 3 { 10.0 } else { 1.0 + 0.05 * ((k * 7 + call * 13) % 10) as f64 / 10.0 };
            let gpu_ms = (8.0 + triangles / 4e3) * slow;
            let [select_ms, record_ms] = [0.2 + triangles / 4e5, 0.3];
            let frame_ms = gpu_ms + select_ms + record_ms + 0.4;
            controller.learn(&view, triangles as u64, frame_ms);
            FrameSample {
                frame_ms,
                select_ms,
                record_ms,
                gpu_ms: (!self.is_bare).then_some(gpu_ms),
                upload_ms: (!self.is_bare).then_some(0.1),
                shading_only_ms: (!self.is_bare).then_some(7.5),
                triangles: triangles as u64,
                vertices: (!self.is_bare).then_some(triangles as u64 * 2),
                draws: 12,
                commands: 1,
                tolerance_scale: 1.0,
                pending: 0,
                tolerance_px: view.tolerance.px,
            }
        };
        let device_bytes = BTreeMap::from([("heights".to_string(), 1 << 20), ("mesh".to_string(), 1 << 16)]);
        let stats = BTreeMap::from([("blocks".to_string(), 12.0)]);
        Ok(Timed { frames: (0..scene.views.len()).map(frame).collect(), device_bytes, stats })
    }

    fn measure(&mut self, scene: &BenchScene) -> Result<Errors> {
        self.calls.push(format!("measure {}", scene.case));
        assert!(scene.views.windows(2).all(|pair| pair[0].time_s < pair[1].time_s), "the scene's time goes on");
        let case = scene.case;
        let is_truth = case.technique == "brute-force";
        let is_paper = case.metric == "paper";
        let excess = if is_paper { 1.9 } else { 0.92 };
        let max = if is_truth { 2e-9 } else { case.tolerance_px * excess };
        let frames = scene.views.len().div_ceil(case.every);
        let mut errors = Errors {
            frames,
            error_px: Summary { rms: max / 8.0, p999: max / 2.0, max },
            error_m: Summary { rms: max, p999: max * 4.0, max: max * 9.0 },
            ..Errors::default()
        };
        if self.is_bare {
            return Ok(errors);
        }
        let bin = |k: i32, count| Bin { from: 2f64.powi(k), to: 2f64.powi(k + 1), count };
        let peak = case.tolerance_px.log2() as i32;
        errors.silhouette_px = Some(Summary { rms: max / 4.0, p999: max * 0.8, max });
        errors.within =
            Some(Within { frames: if is_paper { 0.4 } else { 1.0 }, samples: if is_paper { 0.93 } else { 1.0 } });
        errors.by_angle = (0..6).map(|k| angle_bin(k, is_truth, is_paper)).collect();
        errors.image = Some(ImageError { rmse: 0.01, psnr: f64::INFINITY, ssim: 0.99, flip: 0.02 });
        errors.pop = (!is_truth).then(|| Pop {
            p99_px: case.tolerance_px / 2.0,
            p999_px: case.tolerance_px / 1.5,
            max_px: case.tolerance_px,
            histogram: Histogram { bins: (peak - 5..=peak).map(|k| bin(k, 4u64.pow((peak - k + 1) as u32))).collect() },
        });
        errors.watertight = Some(true);
        (errors.hole_pixels, errors.skirt_pixels) = (Some(0), Some(0));
        errors.pending = Some(PendingFrames { frames: 2, kept: 1, pixels: 77, excess_px: max / 3.0 });
        errors.economy = Some(Economy {
            pixels_per_triangle: Histogram {
                bins: (-2..=8).map(|k| bin(k, (1000 - 30 * (k - peak - 3).pow(2)).max(3) as u64)).collect(),
            },
            hidden_share: 0.3,
            subpixel_share: 0.04,
            overdraw: Some(1.2),
            passed: Some(1.1),
        });
        let multiple = Some(3.1 + case.tolerance_px / 10.0);
        errors.reference = Some(Reference { error_m: max * 9.0, delaunay: Some(5000), rtin: Some(21000), multiple });
        let p99 = max + 0.2;
        errors.peers_px = Some(PeersError { mean: p99 / 9.0, rms: p99 / 4.0, p95: p99 / 2.0, p99, max: p99 * 6.0 });
        errors.worst = Some(worst(scene, max)?);
        Ok(errors)
    }
}

fn angle_bin(k: i32, is_truth: bool, is_paper: bool) -> AngleBin {
    let (from_deg, to_deg) = (10.0 * f64::from(k), 10.0 * f64::from(k + 1));
    let grows = ((from_deg + to_deg) / 2.0f64).to_radians().cos().powi(-2);
    let max = match (is_truth, is_paper) {
        (true, _) => 1e-9,
        (_, true) => 0.9 * grows,
        _ => 0.9,
    };
    AngleBin { from_deg, to_deg, p999: max * 0.8, max }
}

fn triangles(case: &Case, tolerance_px: f64) -> f64 {
    let samples = f64::from(case.terrain.size[0] - 1) * f64::from(case.terrain.size[1] - 1);
    let paper = if case.metric == "paper" { 0.8 } else { 1.0 };
    match case.technique.as_str() {
        "brute-force" => 2.0 * samples,
        _ => paper * 0.9 * samples / (1.0 + tolerance_px),
    }
}

/// A gradient, and dots where it is wrong.
fn worst(scene: &BenchScene, error_px: f64) -> Result<Worst> {
    let pictures = scene.folder.join("pictures");
    std::fs::create_dir_all(&pictures)?;
    let name = scene.case.to_string().replace(|c: char| !c.is_ascii_alphanumeric(), "-");
    let file = |what: &str| format!("pictures/{name}-{what}.png");
    let [picture, difference] = ["drawn", "difference"].map(file);
    RgbImage::from_fn(320, 180, |x, y| Rgb([(x / 2) as u8, 120, 200 - y as u8])).save(scene.folder.join(&picture))?;
    let dot = |x: u32, y: u32| if (x * 7 + y * 13).is_multiple_of(97) { Rgb([255, 120, 0]) } else { Rgb([0, 0, 30]) };
    RgbImage::from_fn(320, 180, dot).save(scene.folder.join(&difference))?;
    Ok(Worst { frame: 3, error_px, picture: Some(picture), difference: Some(difference) })
}

/// The header of every run with the mock.
pub fn header(backend: &mut dyn BenchBackend, fields: &[(Terrain, Arc<Field>)]) -> Header {
    let (device, plans) = backend.describe(fields).expect("the mock knows itself");
    Header {
        schema: SCHEMA,
        program: "0.0.0".to_string(),
        commit: Some("0123456789ab".to_string()),
        date: "2026-01-02T03:04:05Z".to_string(),
        arguments: vec!["demo".to_string(), "--tolerance 0.5,1,2,4,8".to_string()],
        base: "brute-force".to_string(),
        machine: Machine { cpu: "Made-up CPU".to_string(), cores: 2, system: "linux x86_64".to_string() },
        device,
        plans,
    }
}

pub fn field(side: u32) -> (Terrain, Arc<Field>) {
    let terrain = Terrain { name: "fractal".to_string(), size: [side; 2], spacing_m: [1.0; 2] };
    (terrain, Arc::new(synth(Kind::Fractal, [side; 2], 1)))
}

pub fn case(terrain: &Terrain, technique: &str, tolerance_px: f64, metric: &str, path: &str) -> Case {
    Case {
        terrain: terrain.clone(),
        technique: technique.to_string(),
        settings: BTreeMap::new(),
        tolerance_px,
        goal: None,
        metric: metric.to_string(),
        path: path.to_string(),
        size: [320, 180],
        frames: 20,
        every: 5,
    }
}

/// Brute force, and geomipmap at every tolerance and metric, along these paths over fields of these sides.
pub fn cases(fields: &[(Terrain, Arc<Field>)], paths: &[&str]) -> Vec<Case> {
    let mut cases = Vec::new();
    for (terrain, path) in fields.iter().flat_map(|(terrain, _)| paths.iter().map(move |path| (terrain, path))) {
        cases.push(case(terrain, "brute-force", 0.5, "certified", path));
        for metric in ["certified", "paper"] {
            let of = |px: f64| case(terrain, "geomipmap", px, metric, path);
            cases.extend([0.5, 1.0, 2.0, 4.0, 8.0].map(of));
        }
    }
    cases
}

/// Runs cases to the end into a folder.
pub fn run(folder: &Path, fields: Vec<(Terrain, Arc<Field>)>, cases: Vec<Case>, rounds: usize) -> Mock {
    run_with(Mock::default(), folder, fields, cases, rounds)
}

pub fn run_with(
    mut mock: Mock,
    folder: &Path,
    fields: Vec<(Terrain, Arc<Field>)>,
    cases: Vec<Case>,
    rounds: usize,
) -> Mock {
    let header = header(&mut mock, &fields);
    let stop = AtomicBool::new(false);
    let run = Run { folder, cases, fields, rounds, warm_up: 3, stop: &stop };
    let ended = run.run(&mut mock, header, &mut |_| {}).expect("a whole run");
    assert_eq!(ended, Ended::Complete);
    mock
}
