//! Tests that need a device: counts and times of single draws.

use std::sync::Arc;

use cuesta::internal::draw::{Draw, DrawList, Geometry, Limits, Submission};
use cuesta::internal::gpu::Gpu;
use cuesta::internal::gpu::probe::{Counts, DRAWS};
use cuesta::internal::height::{Field, synth};
use cuesta::internal::lod::Technique;
use cuesta::internal::plan::{Look, ScenePlan};
use cuesta::internal::profile::{self, Form, Profile, timeline, trace};
use cuesta::internal::scene::probed::ProbedFrame;
use cuesta::internal::scene::{Copy, Scene, SceneRenderer};
use cuesta::internal::view::View;

use super::trace_format::{self, Slice};
use crate::gpu::{aslant, mountains, on_device};
use crate::prepared::technique;

/// Makes a scene of a field and lends it.
fn with_scene<T>(gpu: &Arc<Gpu>, field: &Arc<Field>, f: impl FnOnce(&Scene) -> T) -> T {
    let look = Look::default();
    let plan = ScenePlan::builder(field, &look, &gpu.device_limits()).build().unwrap();
    f(&Scene { gpu, field, plan: &plan, look: &look, overlay: None })
}

fn total(frame: &ProbedFrame) -> Counts {
    frame.draws.iter().filter_map(|draw| draw.counts).fold(Counts::default(), |sum, counts| Counts {
        vertices: sum.vertices + counts.vertices,
        clipped: sum.clipped + counts.clipped,
        primitives: sum.primitives + counts.primitives,
        fragments: sum.fragments + counts.fragments,
    })
}

/// The counts of a plain frame, as [`total`] has them.
fn plain(renderer: &mut SceneRenderer, technique: &mut dyn Technique, view: &View) -> [u64; 3] {
    let times = renderer.draw(technique, view, Copy::Picture).unwrap();
    times.gpu.statistics.unwrap_or_default()
}

#[test]
fn the_counts_of_all_draws_are_the_frames_and_the_picture_stays() {
    on_device(|gpu| {
        let field = mountains();
        let view = aslant(&field, [160, 120], 1.0);
        for name in ["brute-force", "geomipmap", "geomipmap:draw-per-block"] {
            let mut technique = technique(&field, name, if name == "brute-force" { &[] } else { &["block=17"] });
            let mut renderer = with_scene(gpu, &field, |scene| scene.renderer(technique.as_ref(), view.size)).unwrap();
            for submission in [Submission::Direct, Submission::Indirect] {
                renderer.submission = Some(submission);
                let expected = plain(&mut renderer, technique.as_mut(), &view);
                let picture = renderer.picture();
                let frame = renderer.draw_probed(technique.as_mut(), name, &view).unwrap();
                assert_eq!(renderer.picture(), picture, "{name} {submission:?}");
                assert_eq!(frame.draws.len(), renderer.list.draws.len());
                let sum = total(&frame);
                assert_eq!([sum.vertices, sum.primitives, sum.fragments], expected, "{name} {submission:?}");
                if gpu.has_statistics {
                    assert_eq!(sum.clipped, renderer.list.triangles(), "every triangle reaches clipping");
                }
            }
        }
    });
}

#[test]
fn draws_beyond_the_pools_are_summed_in_one() {
    on_device(|gpu| {
        let field = Arc::new(synth::synth(synth::Kind::Fractal, [385, 385], 3));
        let view = aslant(&field, [64, 48], 1e-3);
        let mut technique = technique(&field, "geomipmap:draw-per-block", &["block=9"]);
        let mut renderer = with_scene(gpu, &field, |scene| scene.renderer(technique.as_ref(), view.size)).unwrap();
        let expected = plain(&mut renderer, technique.as_mut(), &view);
        let frame = renderer.draw_probed(technique.as_mut(), "geomipmap", &view).unwrap();
        let draws = renderer.list.draws.len();
        assert!(draws > DRAWS, "{draws} draws");
        assert_eq!(frame.draws.len(), DRAWS + 1);
        let rest = &frame.draws[DRAWS].piece;
        assert_eq!(rest.draws, DRAWS..draws);
        assert!(rest.label.ends_with(&format!("batches {DRAWS} to {}", draws - 1)), "{}", rest.label);
        let sum = total(&frame);
        assert_eq!([sum.vertices, sum.primitives, sum.fragments], expected);
    });
}

/// The device works between submission and the end of the wait, and on its draws one after the other.
#[test]
fn host_and_device_stand_on_one_line_of_time() {
    on_device(|gpu| {
        let field = mountains();
        let view = aslant(&field, [160, 120], 1.0);
        let mut technique = technique(&field, "geomipmap", &["block=17"]);
        let mut renderer = with_scene(gpu, &field, |scene| scene.renderer(technique.as_ref(), view.size)).unwrap();
        for _ in 0..3 {
            let frame = renderer.draw_probed(technique.as_mut(), "geomipmap", &view).unwrap();
            let steps: Vec<_> = frame.steps.iter().map(|(step, _)| *step).collect();
            assert_eq!(steps, ["select", "upload", "record", "submit", "wait"]);
            assert!(frame.steps.windows(2).all(|s| s[0].1.end_us <= s[1].1.start_us), "{:?}", frame.steps);
            let (submit, wait) = (frame.steps[3].1, frame.steps[4].1);
            let (first, last) = (frame.passes[0].1, frame.passes[frame.passes.len() - 1].1);
            let slack = frame.deviation_us;
            assert!(first.start_us >= submit.start_us - slack, "{frame:?}");
            assert!(last.end_us <= wait.end_us + slack, "{frame:?}");
            assert!(frame.draws.windows(2).all(|d| d[0].span.end_us == d[1].span.start_us), "no gap, no overlap");
            assert!(frame.draws.iter().all(|d| d.span.us() >= 0.0), "{:?}", frame.draws);
        }
    });
}

/// Work of one draw is not booked on another: tiny draws before and after a draw of nearly all the work stay cheap.
#[test]
fn time_goes_to_the_draw_that_took_it() {
    on_device(|gpu| {
        let field = Arc::new(synth::synth(synth::Kind::Fractal, [513, 513], 3));
        let view = aslant(&field, [640, 480], 1e-6);
        let mut parted = Parted(technique(&field, "brute-force", &[]));
        let mut renderer = with_scene(gpu, &field, |scene| scene.renderer(&parted, view.size)).unwrap();
        let mut share = [f64::INFINITY; 2];
        for _ in 0..4 {
            let frame = renderer.draw_probed(&mut parted, "brute-force", &view).unwrap();
            let us: Vec<_> = frame.draws.iter().map(|draw| draw.span.us()).collect();
            assert_eq!(us.len(), 3);
            share = [share[0].min(us[0] / us[1]), share[1].min(us[2] / us[1])];
        }
        assert!(share.iter().all(|&s| s < 0.1), "{share:?} of the large draw's time");
    });
}

/// Another technique's one draw in three: one triangle, all others, one triangle.
struct Parted(Box<dyn Technique>);

impl Technique for Parted {
    fn resident(&self) -> &Geometry {
        self.0.resident()
    }

    fn limits(&self) -> Limits {
        Limits { draws: 3, ..self.0.limits() }
    }

    fn select(&mut self, view: &View, list: &mut DrawList) {
        self.0.select(view, list);
        list.submission = Submission::Direct;
        let whole = list.draws[0].clone();
        let of = |indices| Draw { indices, instances: 0..1, ..whole.clone() };
        let first = whole.indices.start;
        list.draws = vec![of(first..first + 3), whole.clone(), of(first..first + 3)];
    }

    fn keeps_tolerance(&self) -> bool {
        false
    }
}

fn measure(gpu: &Arc<Gpu>, frames: u32) -> (Profile, serde_json::Value) {
    let field = mountains();
    let view = aslant(&field, [160, 120], 1.0);
    let forms = ["geomipmap", "geomipmap:draw-per-block"]
        .map(|name| Form { name: name.to_string(), technique: technique(&field, name, &["block=17"]) });
    let measured = with_scene(gpu, &field, |scene| profile::run(scene, &view, forms.into(), frames, |_, _| {}));
    let measured = measured.unwrap();
    (measured.profile, measured.trace)
}

/// Returns true if a slice lies within another.
fn holds(outer: &Slice, inner: &Slice) -> bool {
    outer.track == inner.track && outer.ns[0] <= inner.ns[0] && inner.ns[1] <= outer.ns[1]
}

#[test]
fn every_draw_is_one_slice_of_its_pipeline_and_its_pass() {
    on_device(|gpu| {
        let (profile, trace) = measure(gpu, 3);
        let slices = trace_format::check(&trace).expect("a valid trace");
        let of = |category: &str| -> Vec<&Slice> { slices.iter().filter(|s| s.category == category).collect() };
        let passes: Vec<_> = of("pass").iter().map(|s| s.name.clone()).collect();
        assert_eq!(passes, ["terrain", "sky"]);
        assert_eq!(of("step").len(), 5);
        assert!(profile.draws.len() > 5, "{} draws", profile.draws.len());
        for (k, row) in profile.draws.iter().enumerate() {
            let own: Vec<_> = of("draw").into_iter().filter(|s| s.name == row.label).collect();
            assert_eq!(own.len(), 1, "{}", row.label);
            assert_eq!((row.batch, row.draws), (k, 1));
            assert_eq!(own[0].args["batch"], k);
            assert_eq!(own[0].args["triangles"], row.triangles);
            let around =
                |category: &str, name: &str| of(category).iter().filter(|s| s.name == name && holds(s, own[0])).count();
            assert_eq!(around("pass", &row.pass), 1, "{}", row.label);
            assert_eq!(around("pipeline", &row.pipeline), 1, "{}", row.label);
            let level = row.level_min.expect("instances");
            assert_eq!(row.level_max, Some(level), "a draw of geomipmap is of one level");
            assert_eq!(row.label, format!("geomipmap lattice triangles level {level} batch {k}"));
        }
    });
}

#[test]
fn modes_draw_the_same_terrain_and_rows_add_up() {
    on_device(|gpu| {
        let (profile, _) = measure(gpu, 2);
        let modes: Vec<_> = profile.modes.iter().map(|m| (m.form.as_str(), m.submission.as_str())).collect();
        let per_block = "geomipmap:draw-per-block";
        let expected =
            [("geomipmap", "indirect"), ("geomipmap", "direct"), (per_block, "direct"), (per_block, "indirect")];
        assert_eq!(modes, expected);
        let triangles: u64 = profile.draws.iter().map(|d| d.triangles).sum();
        assert!(profile.modes.iter().all(|m| m.triangles == triangles), "{:?}", profile.modes);
        assert!(profile.modes.iter().all(|m| m.commands == if m.submission == "direct" { m.draws } else { 1 }));
        assert_eq!(profile.modes[0].draws, profile.draws.len());
        assert!(profile.modes[2].draws > profile.modes[0].draws);
        assert_eq!((profile.modes[0].gpu_ratio, profile.modes[0].record_ratio), (1.0, 1.0), "against itself");
        let terrain = &profile.passes[0];
        assert_eq!((terrain.pass.as_str(), terrain.draws), ("terrain", profile.draws.len()));
        assert_eq!(terrain.vertices_run, profile.draws.iter().map(|d| d.vertices_run).sum());
        assert_eq!(profile.frames, 2);
    });
}

/// A device without statistics leaves the counts empty and no counter in the trace.
#[test]
fn without_statistics_there_are_no_counts() {
    on_device(|gpu| {
        let field = mountains();
        let view = aslant(&field, [160, 120], 1.0);
        let mut technique = technique(&field, "geomipmap", &["block=17"]);
        let mut renderer = with_scene(gpu, &field, |scene| scene.renderer(technique.as_ref(), view.size)).unwrap();
        let mut frame = renderer.draw_probed(technique.as_mut(), "geomipmap", &view).unwrap();
        let (profile, _) = measure(gpu, 1);
        frame.draws.truncate(profile.draws.len());
        let mut rows = profile.draws;
        rows.iter_mut().for_each(|row| (row.vertices_run, row.fragments_run) = (None, None));
        let names: Vec<_> = timeline::counters(&frame, &rows).iter().map(|c| c.name).collect();
        assert_eq!(names, ["triangles submitted"]);
        let tracks = timeline::tracks(&frame, &rows);
        let trace = trace::document(&tracks, &timeline::counters(&frame, &rows), serde_json::json!({}));
        trace_format::check(&trace).expect("a valid trace");
    });
}
