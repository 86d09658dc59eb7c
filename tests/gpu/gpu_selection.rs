//! Tests of selection on the GPU: it must draw the same instances of the same kinds as on the CPU, in every view.

use std::sync::Arc;

use cuesta::internal::bench::paths;
use cuesta::internal::draw::{DrawList, Submission};
use cuesta::internal::gpu::Gpu;
use cuesta::internal::height::{Field, Holes, Samples, demo, synth};
use cuesta::internal::lod::Technique;
use cuesta::internal::plan::{Look, ScenePlan};
use cuesta::internal::scene::{Copy, Scene, SceneRenderer};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};

use super::{mountains, on_device, technique};

const SIZE: [u32; 2] = [320, 180];

type Set = Vec<([u32; 2], Vec<u32>)>;

/// Returns the instances with their kind, sorted. The batch is a position in the list and is ignored.
fn set(list: &DrawList) -> Set {
    let of_draw = |draw: &cuesta::internal::draw::Draw| {
        let range = [draw.indices.start, draw.indices.end];
        list.instances[draw.instances.start as usize..draw.instances.end as usize].iter().map(move |instance| {
            let alike = cuesta::internal::draw::Instance { batch: 0, ..*instance };
            (range, bytemuck::cast_slice(bytemuck::bytes_of(&alike)).to_vec())
        })
    };
    let mut all: Vec<_> = list.draws.iter().flat_map(of_draw).collect();
    all.sort_unstable();
    all
}

fn renderer(gpu: &Arc<Gpu>, field: &Arc<Field>, technique: &dyn Technique) -> SceneRenderer {
    let look = Look::default();
    let plan = ScenePlan::builder(field, &look, &gpu.device_limits())
        .requirements(technique.pipeline_requirements())
        .build()
        .unwrap();
    Scene { gpu, field, plan: &plan, look: &look, overlay: None }.renderer(technique, SIZE).unwrap()
}

/// Compares both selections in all views. Returns the number of instances.
fn compare(gpu: &Arc<Gpu>, field: &Arc<Field>, settings: &[&str], views: &[View]) -> usize {
    let mut technique = technique(field, "clusters:gpu-driven", settings);
    let mut renderer = renderer(gpu, field, technique.as_ref());
    let mut instances = 0;
    for view in views {
        renderer.draw(technique.as_mut(), view, Copy::Nothing).unwrap();
        renderer.complete().unwrap();
        assert!(renderer.list.submission == Submission::GpuDriven || renderer.list.tolerance_scale == f64::INFINITY);
        let mut list = DrawList::default();
        technique.select(view, &mut list);
        assert_eq!(renderer.list.tolerance_scale, list.tolerance_scale, "the same tolerance: {view:?}");
        let (device, host) = (set(&renderer.list), set(&list));
        let is_alike = device == host;
        let only = |a: &Set, b: &Set| a.iter().filter(|one| !b.contains(one)).take(3).cloned().collect::<Set>();
        assert!(
            is_alike,
            "{settings:?}: {} instances on the device ({:?} alone), {} on the host ({:?} alone), {view:?}",
            device.len(),
            only(&device, &host),
            host.len(),
            only(&host, &device)
        );
        let commands: Vec<_> = renderer.list.draws.iter().map(|d| (d.indices.clone(), d.instances.clone())).collect();
        let expected: Vec<_> = list.draws.iter().map(|d| (d.indices.clone(), d.instances.clone())).collect();
        assert_eq!(commands, expected, "the same commands");
        let batches = |list: &DrawList| list.instances.iter().map(|instance| instance.batch).collect::<Vec<_>>();
        assert_eq!(batches(&renderer.list), batches(&list), "batches are positions in the list");
        instances += host.len();
    }
    instances
}

fn random(seed: &mut u64) -> f64 {
    *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
    (*seed >> 11) as f64 / (1u64 << 53) as f64
}

/// Returns a random view inside the field or beside it, perspective or orthographic, under either metric.
fn anywhere(field: &Field, seed: &mut u64) -> View {
    let [w, h] = field.size().map(f64::from);
    let place = |n: f64, seed: &mut u64| n * (1.2 * random(seed) - 0.1);
    let extent = w * field.spacing[0] + h * field.spacing[1];
    let (x, z) = (place(w, seed), place(h, seed));
    let eye = field.world_at(x, z, field.statistics().mean + extent * random(seed).powi(4));
    let lens = match random(seed) {
        p if p < 0.3 => Lens::Orthographic { width: 2.0 * extent * random(seed).powi(2), far: 1e9 },
        _ => Lens::Perspective { fov_x: 0.02 + 2.0 * random(seed) },
    };
    View {
        eye,
        world_from_eye: View::turned(360.0 * random(seed), 120.0 * random(seed) - 90.0, 20.0 * random(seed)),
        lens,
        size: SIZE,
        near: 0.1,
        tolerance: Tolerance {
            px: 0.05 + 6.0 * random(seed).powi(3),
            metric: if random(seed) < 0.7 { Metric::Certified } else { Metric::Paper },
        },
        time_s: 0.0,
    }
}

/// A field smooth in one half and rough in the other.
fn half_rough(size: [u32; 2]) -> Field {
    let terrain = synth::synth(synth::Kind::Fractal, size, 7);
    let mut seed = 1;
    let height = |k: usize| {
        let rough = if k % size[0] as usize > size[0] as usize / 2 { 4.0 * random(&mut seed) as f32 } else { 0.0 };
        terrain.samples().height(k) + rough
    };
    let count = (size[0] * size[1]) as usize;
    let mut field = Field::new(Samples::F32((0..count).map(height).collect()), size, [5.0, 5.0], Holes::none(count));
    field.origin = [3.0e6, -1.0e6];
    field
}

#[test]
fn gpu_and_cpu_select_alike_along_paths() {
    on_device(|gpu| {
        let (demo, rough) = (Arc::new(demo::demo()), Arc::new(half_rough([600, 513])));
        for (name, field) in [("demo", demo), ("rough", rough)] {
            for path in ["skim", "circle"] {
                let ways = [
                    ["block=16", "morph=off", "seams=stitched"],
                    ["block=8", "morph=on", "seams=stitched"],
                    ["block=8", "morph=on", "seams=skirts"],
                    ["block=8", "morph=distance", "seams=stitched"],
                ];
                for settings in ways {
                    let tolerance = Tolerance { px: 1.0, metric: Metric::Certified };
                    let views = paths::find(path).unwrap().views(&field, 24, SIZE, tolerance);
                    let instances = compare(gpu, &field, &settings, &views);
                    println!("{name}, {path}, {settings:?}: {instances} instances");
                    assert!(instances > 24 * 20, "{name}, {path}: only {instances} instances");
                }
            }
        }
    });
}

#[test]
fn gpu_and_cpu_select_alike_from_random_views() {
    on_device(|gpu| {
        let holed = mountains();
        let tiled = |tiles| Arc::new((*holed).clone().tiled(tiles));
        let aligned = Arc::new(synth::synth(synth::Kind::Fractal, [128, 64], 3).tiled([3907, 7813]));
        let fields = [
            ("holes", Arc::clone(&holed)),
            ("tiled", tiled([3, 2])),
            ("tiled along one axis", tiled([1, 4])),
            ("500 000² samples", aligned),
            ("long", Arc::new(half_rough([900, 70]))),
            ("one block", Arc::new(half_rough([9, 9]))),
        ];
        let mut seed = 2;
        for (name, field) in fields {
            let views: Vec<_> = (0..8).map(|_| anywhere(&field, &mut seed)).collect();
            for block in ["block=8", "block=16", "block=32", "block=64", "block=128"] {
                let ways: [(&str, &str); 7] = [
                    ("seams=stitched", "morph=off"),
                    ("seams=stitched", "morph=on"),
                    ("seams=stitched", "error=halved"),
                    ("seams=stitched", "morph=distance"),
                    ("seams=skirts", "morph=off"),
                    ("seams=skirts", "morph=on"),
                    ("seams=skirts", "error=halved"),
                ];
                let is_tried = |seams: &str, setting: &str| {
                    ["block=8", "block=32"].contains(&block) || (seams, setting) == ("seams=stitched", "morph=off")
                };
                for (seams, setting) in ways.into_iter().filter(|(seams, setting)| is_tried(seams, setting)) {
                    let instances = compare(gpu, &field, &[block, seams, setting], &views);
                    println!("{name}, {block}, {seams}, {setting}: {instances} instances");
                }
            }
        }
    });
}

/// GPU and CPU raise the tolerance equally if the selection exceeds the tables.
#[test]
fn gpu_and_cpu_raise_the_tolerance_equally() {
    on_device(|gpu| {
        let field = Arc::new(half_rough([129, 129]).tiled([60, 60]));
        let [w, h] = field.size().map(f64::from);
        let eye = field.world_at(w / 2.0, h / 2.0, 1e4);
        let tolerance = |px: f64| Tolerance { px, metric: Metric::Certified };
        let lens = Lens::Perspective { fov_x: 1.8 };
        let rotation = View::turned(0.0, -90.0, 0.0);
        let view = View {
            eye,
            world_from_eye: rotation,
            lens,
            size: SIZE,
            near: 1.0,
            tolerance: tolerance(1e-4),
            time_s: 0.0,
        };
        // A tolerance that fits is unscaled again.
        let wide = View { tolerance: tolerance(400.0), ..view };
        for settings in [&["block=8"][..], &["block=8", "morph=distance"], &["block=8", "seams=skirts"]] {
            let mut technique = technique(&field, "clusters:gpu-driven", settings);
            let mut renderer = renderer(gpu, &field, technique.as_ref());
            let mut scales = Vec::new();
            for view in [&view, &wide] {
                renderer.draw(technique.as_mut(), view, Copy::Picture).unwrap();
                renderer.complete().unwrap();
                assert!(renderer.picture().pixels().all(|pixel| pixel.0[3] > 0), "all is covered");
                let mut list = DrawList::default();
                technique.select(view, &mut list);
                assert!(technique.limits().hold(&list.size()));
                assert_eq!(
                    (renderer.list.tolerance_scale, renderer.list.submission),
                    (list.tolerance_scale, Submission::GpuDriven)
                );
                assert!(set(&renderer.list) == set(&list) && list.instances.len() > 1, "{settings:?}");
                scales.push(list.tolerance_scale);
            }
            assert!(scales[0] > 1.0 && scales[0].is_finite() && scales[1] == 1.0, "{settings:?}: {scales:?}");
        }
    });
}

/// Images are equal to the CPU's, and draws are counted equally.
#[test]
fn images_and_profiles_of_gpu_and_cpu_selection_are_equal() {
    on_device(|gpu| {
        let field = mountains();
        let view = super::aslant(&field, SIZE, 1.0);
        let [host, device] = ["clusters", "clusters:gpu-driven"].map(|name| {
            let mut technique = technique(&field, name, &["block=8"]);
            let mut renderer = renderer(gpu, &field, technique.as_ref());
            renderer.draw(technique.as_mut(), &view, Copy::Picture).unwrap();
            let picture = renderer.picture();
            let captured =
                if renderer.captures() { renderer.capture(technique.as_ref(), &view).unwrap().len() } else { 0 };
            let probed = renderer.draw_probed(technique.as_mut(), "clusters", &view).unwrap();
            let pieces: Vec<_> = probed.draws.iter().map(|draw| (draw.piece.clone(), draw.counts)).collect();
            (
                picture,
                captured,
                pieces,
                renderer.list.triangles(),
                renderer.list.draws.clone(),
                renderer.list.commands(),
            )
        });
        assert!(host == device, "{:?} on the host, {:?} on the device", host.2, device.2);
    });
}
