//! Benchmark backend that draws on a Vulkan device: times frames, and measures the error of what was drawn.

use std::collections::BTreeMap;
use std::sync::Arc;

use anyhow::{Result, anyhow};

use super::controller::ToleranceController;
use super::paths::TIME_STEP_S;
use super::pool::Pool;
use super::rows::{Case, Decision, Device, Errors, Plan, Terrain};
use super::run::{BenchBackend, BenchScene, Timed};
use super::sample::FrameSample;
use crate::draw::expand::{self, Drawn};
use crate::draw::layout;
use crate::draw::{DrawList, Geometry, PipelineRequirements};
use crate::gpu::Gpu;
use crate::height::Field;
use crate::lod::{Settings, Technique, TechniqueSpec, Techniques};
use crate::measure::{economy, geometric, pop, watertight};
use crate::plan::{self, Look, ScenePlan};
use crate::scene::capture::AsDrawn;
use crate::scene::holes::{Truth, covered, skirts};
use crate::scene::{self, Copy, SceneRenderer};
use crate::view::View;

/// Largest number of triangles of a list that is captured on the device. Comparing larger captures with the CPU
/// expansion would take minutes.
const MAX_CAPTURED: u64 = 4_000_000;

/// Draws and measures benchmark cases on one device with one look.
pub struct DeviceBackend {
    gpu: Arc<Gpu>,
    look: Look,
    techniques: Techniques,
    /// Name of the current scene, and its reference pictures by frame. All cases of the scene share them.
    truths: (String, BTreeMap<usize, Arc<Truth>>),
}

impl DeviceBackend {
    /// Creates a backend. `techniques` are those that cases may name.
    pub fn new(gpu: Arc<Gpu>, look: Look, techniques: Techniques) -> Self {
        Self { gpu, look, techniques, truths: Default::default() }
    }

    /// Prepares the technique of a case for a field.
    fn build(&self, case: &Case, field: &Arc<Field>) -> Result<Box<dyn Technique>> {
        let spec: TechniqueSpec = case.technique.parse().map_err(anyhow::Error::msg)?;
        let entry = self.techniques.entry(&spec).map_err(anyhow::Error::msg)?;
        let given: Vec<_> = case.settings.iter().map(|(key, value)| (key.clone(), value.clone())).collect();
        let settings = Settings::new(entry, spec.variant.as_deref(), &given);
        let settings = settings.map_err(|e| anyhow!("{}: {e}", case.technique))?;
        entry.prepare(field, &settings).map_err(anyhow::Error::msg)
    }

    fn plan(&self, field: &Field, technique: &dyn Technique) -> Result<ScenePlan> {
        scene::plan(&self.gpu, field, &self.look, None, technique.pipeline_requirements())
    }

    /// Prepares the technique of a case from scratch, and a renderer for it.
    fn prepare(&self, scene: &BenchScene) -> Result<(Box<dyn Technique>, SceneRenderer)> {
        let technique = self.build(scene.case, scene.field)?;
        let plan = self.plan(scene.field, technique.as_ref())?;
        let renderer = self.scene(scene.field, &plan).renderer(technique.as_ref(), scene.case.size)?;
        Ok((technique, renderer))
    }

    fn scene<'a>(&'a self, field: &'a Arc<Field>, plan: &'a ScenePlan) -> scene::Scene<'a> {
        scene::Scene { gpu: &self.gpu, field, plan, look: &self.look, overlay: None }
    }

    /// Returns the reference picture of a frame, which is drawn once for all cases of a scene.
    fn truth(&mut self, scene: &BenchScene, frame: usize) -> Result<Arc<Truth>> {
        let name = scene.case.scene();
        if self.truths.0 != name {
            self.truths = (name, BTreeMap::new());
        }
        if !self.truths.1.contains_key(&frame) {
            let plan = scene::plan(&self.gpu, scene.field, &self.look, None, PipelineRequirements::default())?;
            let look = self.look.after(frame as f64 * TIME_STEP_S);
            let of_frame = scene::Scene { look: &look, ..self.scene(scene.field, &plan) };
            let truth = Truth::new(&of_frame, &scene.views[frame])?;
            self.truths.1.insert(frame, Arc::new(truth));
        }
        Ok(Arc::clone(&self.truths.1[&frame]))
    }
}

impl BenchBackend for DeviceBackend {
    fn describe(&mut self, fields: &[(Terrain, Arc<Field>)]) -> Result<(Device, Vec<Plan>)> {
        let candidate = &self.gpu.candidate;
        let device =
            Device { name: candidate.name.clone(), driver: candidate.driver.clone(), is_cpu: candidate.is_software() };
        let plan = |(terrain, field): &(Terrain, Arc<Field>)| {
            let plan = scene::plan(&self.gpu, field, &self.look, None, PipelineRequirements::default())?;
            let (kept, left_out) = plan.decisions(field, None);
            let [kept, left_out] = [kept, left_out].map(|all| all.into_iter().map(decision).collect());
            Ok(Plan { terrain: terrain.name.clone(), kept, left_out })
        };
        Ok((device, fields.iter().map(plan).collect::<Result<_>>()?))
    }

    fn time(&mut self, scene: &BenchScene) -> Result<Timed> {
        let (mut technique, mut renderer) = self.prepare(scene)?;
        let has_clock = self.gpu.timestamp_ns > 0.0;
        let mut controller = ToleranceController::new(scene.case);
        let draw = |view: &View| -> Result<FrameSample> {
            let view = &controller.view(view);
            let times = renderer.draw(technique.as_mut(), view, Copy::Nothing)?;
            let shading_only = renderer.draw_shading_only(view, Copy::Nothing)?;
            let list = &renderer.list;
            controller.learn(view, list.triangles(), times.frame_ms);
            Ok(FrameSample {
                frame_ms: times.frame_ms,
                select_ms: times.select_ms,
                record_ms: times.record_ms,
                gpu_ms: has_clock.then_some(times.gpu.total_ms),
                upload_ms: Some(times.upload_ms),
                shading_only_ms: Some(shading_only.frame_ms),
                triangles: list.triangles(),
                vertices: times.gpu.statistics.map(|[vertices, ..]| vertices),
                draws: list.draws.len() as u64,
                commands: list.commands() as u64,
                tolerance_scale: list.tolerance_scale,
                pending: list.pending as u64,
                tolerance_px: view.tolerance.px,
            })
        };
        let frames = scene.views.iter().map(draw).collect::<Result<_>>()?;
        let device_bytes = self.gpu.device_bytes().into_iter().map(|(purpose, n)| (purpose.to_string(), n)).collect();
        let stats = technique.stats().into_iter().map(|(name, value, _)| (name.to_string(), value)).collect();
        Ok(Timed { frames, device_bytes, stats })
    }

    fn measure(&mut self, scene: &BenchScene) -> Result<Errors> {
        let (mut technique, mut renderer) = self.prepare(scene)?;
        let mut pool = Pool::default();
        let mut before: Option<(View, Geometry, DrawList)> = None;
        let mut controller = ToleranceController::new(scene.case);
        for (frame, pose) in scene.views.iter().enumerate() {
            let view = &controller.view(pose);
            let is_measured = frame % scene.case.every == 0;
            let copy = if is_measured { Copy::PictureAndDepth } else { Copy::Nothing };
            renderer.time_s = frame as f64 * TIME_STEP_S;
            let times = renderer.draw(technique.as_mut(), view, copy)?;
            renderer.complete()?;
            controller.learn(view, renderer.list.triangles(), times.frame_ms);
            if is_measured {
                let truth = self.truth(scene, frame)?;
                let fragments = [times.gpu.statistics.map(|[.., run]| run), times.gpu.passed];
                measure_frame(scene, (frame, view), technique.as_ref(), &mut renderer, &truth, fragments, &mut pool)?;
                let plan = self.plan(scene.field, technique.as_ref())?;
                let drawn = self.scene(scene.field, &plan);
                pool.hole_pixels(truth.hole_pixels(&drawn, view, &renderer.picture())?.len());
                if let Some((from, resident, list)) = &before {
                    let old = pop::State { view: from, resident, list };
                    let new = pop::State { view, resident: technique.resident(), list: &renderer.list };
                    pool.pop(pop::pop(scene.field, old, new));
                }
            }
            // A measured frame is compared with the one before it.
            let is_next_measured = (frame + 1) % scene.case.every == 0;
            before = is_next_measured.then(|| (*view, technique.resident().clone(), renderer.list.clone()));
        }
        pool.finish(scene)
    }

    fn close(self: Box<Self>) -> Vec<String> {
        Gpu::close(self.gpu)
    }
}

fn decision(of_plan: plan::Decision) -> Decision {
    Decision { feature: of_plan.feature.to_string(), reason: of_plan.reason, bytes: of_plan.bytes }
}

/// Adds the measurements of the frame that was drawn last to `pool`. `fragments` are the numbers of fragment shader
/// invocations and of fragments that passed the depth test.
fn measure_frame(
    scene: &BenchScene,
    (frame, view): (usize, &View),
    technique: &dyn Technique,
    renderer: &mut SceneRenderer,
    truth: &Truth,
    fragments: [Option<u64>; 2],
    pool: &mut Pool,
) -> Result<()> {
    let (field, resident) = (scene.field, technique.resident());
    let picture = renderer.picture();
    if renderer.list.triangles() <= MAX_CAPTURED && renderer.captures() {
        let placing = layout::Frame::placing(field, view);
        let expanded = [
            expand::triangles(field, &placing, resident, &renderer.list),
            expand::skirts(field, &placing, resident, &renderer.list),
        ];
        let captured = renderer.capture(technique, view)?;
        let same = |(there, here): (&Vec<AsDrawn>, &Vec<Drawn>)| there.iter().map(|t| t.drawn).eq(here.iter().copied());
        pool.captured(captured.iter().zip(&expanded).all(same));
    }
    pool.proof(
        frame,
        watertight::prove_list(field, view, technique.pipeline_requirements().seams, resident, &renderer.list),
    );
    let is_kept = renderer.list.tolerance_scale == 1.0;
    let errors = geometric::errors(field, view, resident, &renderer.list);
    pool.errors(frame, &errors, is_kept.then_some(view.tolerance.px));
    let covered = covered(&picture).into_iter().filter(|&c| c).count() as u64;
    let depth = renderer.depth();
    if renderer.list.pending > 0 {
        pool.pending(field, view, errors.screen_px.max, &depth);
    }
    pool.triangles(&economy::triangles(field, view, resident, &renderer.list, &depth), fragments, covered);
    pool.peers(field, view, &depth);
    pool.skirt_pixels(skirts(&picture).into_iter().filter(|&is| is).count());
    pool.picture(frame, &picture, &truth.picture)
}
