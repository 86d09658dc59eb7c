//! Terrain inside another program's renderer: the picture of `examples/embed.rs` in every convention of a host.

#[path = "../../examples/embed.rs"]
mod example;

use std::sync::Arc;

use ash::vk;
use cuesta::embed::{DepthTarget, DeviceHandles, Target, TerrainDescription, TerrainRenderer};
use cuesta::internal::gpu::{Gpu, frames};
use cuesta::internal::height::demo;
use cuesta::internal::plan::Look;
use cuesta::internal::view::View;
use glam::DVec3;

use self::example::{FRAMES, Options, Outcome};
use super::{difference, golden, on_device};
use crate::prepared;

/// Draws the example with some options, without messages of the validation layers.
fn render(options: Options) -> Outcome {
    let outcome = example::render(options).unwrap();
    assert!(outcome.messages.is_empty(), "{options:?}: validation:\n{}", outcome.messages.join("\n"));
    outcome
}

fn default() -> Options {
    Options::default()
}

/// A pass of a host with common depth and y up.
fn pass(depth: vk::Format) -> Options {
    Options { is_reversed: false, depth: Some(depth), has_render_pass: true, is_y_up: true, ..default() }
}

/// In every convention of a host, cubes and terrain hide each other.
#[test]
fn every_host_gets_the_same_picture() {
    let common = Options { is_reversed: false, ..default() };
    let stencil = Some(vk::Format::D32_SFLOAT_S8_UINT);
    let cases = [
        default(),
        Options { far_m: Some(60_000.0), ..common },
        pass(vk::Format::X8_D24_UNORM_PACK32),
        Options { is_reversed: true, far_m: Some(60_000.0), ..pass(vk::Format::X8_D24_UNORM_PACK32) },
        Options { depth: stencil, ..default() },
        pass(vk::Format::D32_SFLOAT_S8_UINT),
    ];
    on_device(|_| {
        for options in cases {
            let Outcome { picture, stats, .. } = render(options);
            let is_exact = stats.error_bound_px == Some(1.0) && stats.pending == 0;
            assert!(is_exact && stats.triangles > 10_000, "{options:?}: {stats:?}");
            golden::check(&picture, "embed");
        }
    });
}

/// Resolved samples soften edges: every pixel lies between its neighbours in a picture of one sample.
#[test]
fn several_samples_soften_edges_and_change_nothing_else() {
    on_device(|_| {
        let single = render(default()).picture;
        for has_render_pass in [false, true] {
            let options = Options { samples: vk::SampleCountFlags::TYPE_4, has_render_pass, ..default() };
            let resolved = render(options).picture;
            let (_, changed) = difference(&single, &resolved, 5);
            let outliers = resolved.enumerate_pixels().filter(|&(x, y, pixel)| !lies_between(&single, [x, y], pixel));
            let outliers = outliers.count() as f64 / f64::from(single.width() * single.height());
            println!("changed: {changed}, outside of their neighbours: {outliers}");
            assert!(changed > 0.002 && outliers < 0.002, "{options:?}: {changed} changed, {outliers} outliers");
        }
    });
}

/// Returns true if a pixel lies between the least and the largest value, in each channel, of a pixel and its neighbours.
fn lies_between(picture: &image::RgbaImage, [x, y]: [u32; 2], pixel: &image::Rgba<u8>) -> bool {
    let [xs, ys] = [(x, picture.width()), (y, picture.height())].map(|(at, n)| at.saturating_sub(1)..n.min(at + 2));
    (0..4).all(|channel| {
        let near = ys.clone().flat_map(|y| xs.clone().map(move |x| picture.get_pixel(x, y).0[channel]));
        let [low, high] = near.fold([255, 0], |[low, high], value: u8| [low.min(value), high.max(value)]);
        (low.saturating_sub(8)..=high.saturating_add(8)).contains(&pixel.0[channel])
    })
}

/// Without a depth buffer a technique that draws from back to front gives the picture of one with a depth buffer; the
/// others are refused.
#[test]
fn without_depth_the_painters_order_counts() {
    on_device(|_| {
        let settings = &[("order", "painter")][..];
        let painter = Options { technique: "sorted-strips", settings, has_cubes: false, ..default() };
        let [deep, flat] = [painter.depth, None].map(|depth| render(Options { depth, ..painter }));
        assert!(flat.stats.triangles > 10_000 && flat.stats == deep.stats, "{:?}", flat.stats);
        assert_eq!(difference(&deep.picture, &flat.picture, 0), (0, 0.0));
        let refused = example::render(Options { settings: &[("order", "front")], depth: None, ..painter });
        let error = refused.map(|outcome| outcome.stats).unwrap_err().to_string();
        assert!(error.contains("it needs a depth attachment"), "{error}");
    });
}

/// Of a host's allocator all memory of the terrain is allocated, or none if it is not lent. The host checks that none is
/// left.
#[test]
fn memory_comes_from_the_lent_allocator() {
    on_device(|_| {
        let [lent, own] = [true, false].map(|lends_allocator| render(Options { lends_allocator, ..default() }));
        // Heights of the demo: two bytes each.
        assert!(lent.borrowed_bytes > 1 << 20, "{} bytes", lent.borrowed_bytes);
        assert_eq!(own.borrowed_bytes, 0);
        assert_eq!(lent.picture, own.picture);
    });
}

/// Smooth tiles upload geometry with their selections: a selection that was never drawn must not take it along.
#[test]
fn a_dropped_frame_loses_no_uploads() {
    on_device(|_| {
        let all_drawn = Options { technique: "smooth-tiles", ..default() };
        let expected = render(all_drawn).picture;
        for dropped in 0..FRAMES {
            let picture = render(Options { dropped_frame: Some(dropped), ..all_drawn }).picture;
            assert_eq!(difference(&picture, &expected, 0), (0, 0.0), "frame {dropped} dropped");
        }
    });
}

/// `update` may run on any thread.
#[test]
fn a_renderer_may_move_to_another_thread() {
    fn is_send<T: Send>() {}
    is_send::<TerrainRenderer>();
}

#[test]
fn requirements_are_stated_and_checked() {
    on_device(|gpu| {
        let (look, candidate) = (Look::default(), &gpu.candidate);
        let target = Target::new(vk::Format::R8G8B8A8_SRGB, vk::Format::D32_SFLOAT);
        let check = |target: &Target, family: u32| {
            let requirements = TerrainRenderer::requirements(target, &look);
            // SAFETY: the device is of this instance, which is for Vulkan 1.3.
            #[allow(unsafe_code)]
            unsafe {
                requirements.check(&gpu.instance.raw, candidate.raw, family)
            }
        };
        assert_eq!(check(&target, gpu.queue_family), Ok(()));
        // A compressed format is no attachment, a colour no depth, and there are fewer queue families.
        let depth = target.depth.map(|depth| DepthTarget { format: vk::Format::R8G8B8A8_SRGB, ..depth });
        let wrong = Target { colour: vk::Format::BC1_RGB_SRGB_BLOCK, depth, ..target };
        let error = check(&wrong, 1000).unwrap_err();
        assert_eq!(error.device, candidate.name);
        let refused = |target: &Target| check(target, gpu.queue_family).unwrap_err().to_string();
        let samples = [vk::SampleCountFlags::TYPE_64, vk::SampleCountFlags::empty(), vk::SampleCountFlags::from_raw(6)];
        for samples in samples {
            let text = refused(&Target { samples, ..target });
            assert!(text.contains("samples"), "{samples:?}: {text}");
        }
        let stencil = target.depth.map(|depth| DepthTarget { has_stencil: true, ..depth });
        assert!(refused(&Target { depth: stencil, ..target }).contains("D32_SFLOAT as a stencil"));
        assert!(refused(&Target { colour: vk::Format::R8G8B8A8_UINT, ..target }).contains("R8G8B8A8_UINT"));
        let text = error.to_string();
        for part in ["BC1_RGB_SRGB_BLOCK as a colour", "R8G8B8A8_SRGB as a depth", "graphics in queue family 1000"] {
            assert!(text.contains(part), "{text}");
        }
        let names = |target: &Target, wireframe: bool| {
            TerrainRenderer::requirements(target, &Look { wireframe, ..look }).features()
        };
        let pass = Target { render_pass: Some((vk::RenderPass::null(), 0)), ..target };
        assert!(
            names(&target, false).contains(&"dynamicRendering") && !names(&pass, false).contains(&"dynamicRendering")
        );
        assert!(
            names(&target, true).contains(&"fillModeNonSolid") && !names(&target, false).contains(&"fillModeNonSolid")
        );
    });
}

/// Terrain on a device of the tests, as a host lends it. The device is left idle.
fn lent(gpu: &Arc<Gpu>, technique: &str, target: Target) -> anyhow::Result<TerrainRenderer> {
    let handles = DeviceHandles {
        entry: gpu.instance.entry.clone(),
        instance: gpu.instance.raw.clone(),
        physical_device: gpu.candidate.raw,
        device: gpu.raw.clone(),
        queue: gpu.queue,
        queue_family: gpu.queue_family,
        allocator: Some(Arc::clone(&gpu.allocator)),
        debug_utils: gpu.instance.has_debug_utils,
    };
    let field = Arc::new(demo::demo());
    let technique = prepared::technique(&field, technique, &[]);
    let (look, frames_in_flight) = (Look::default(), 1);
    let description = TerrainDescription { field, technique, look, overlay: None, target, frames_in_flight };
    // SAFETY: the device of the tests has the features of all targets and outlives the terrain.
    #[allow(unsafe_code)]
    unsafe {
        TerrainRenderer::from_raw(handles, description)
    }
}

fn view_to(target: DVec3) -> View {
    View::builder().eye(DVec3::new(12_800.0, 4500.0, 27_000.0)).look_at(target).size(320, 180).build().unwrap()
}

/// Calls out of order and views that make no sense are errors, before anything is recorded.
#[test]
#[allow(unsafe_code)]
fn calls_out_of_order_are_errors() {
    let refusal = |result: anyhow::Result<()>| result.unwrap_err().to_string();
    let none = vk::CommandBuffer::null();
    on_device(|gpu| {
        let target = Target::new(vk::Format::R8G8B8A8_SRGB, vk::Format::D32_SFLOAT);
        let mut terrain = lent(gpu, "geomipmap", target).unwrap();
        let view = view_to(DVec3::new(12_800.0, 1000.0, 12_800.0));
        // SAFETY: refused before a command is recorded.
        unsafe {
            assert!(refusal(terrain.prepare(none, 0)).contains("call update first"));
            terrain.update(&view);
            assert!(refusal(terrain.draw(none)).contains("call prepare first"));
            assert!(refusal(terrain.prepare(none, 1)).contains("less than frames_in_flight"));
            terrain.update(&View { near: f64::NAN, ..view });
            assert!(refusal(terrain.prepare(none, 0)).contains("near plane"));
        }
        let far_m = Some(view.near);
        let mut short =
            lent(gpu, "geomipmap", Target { depth: target.depth.map(|d| DepthTarget { far_m, ..d }), ..target });
        let short = short.as_mut().unwrap();
        short.update(&view);
        // SAFETY: refused before a command is recorded.
        unsafe {
            assert!(refusal(short.prepare(none, 0)).contains("beyond the near plane"));
        }
    });
}

/// An update needs a new `prepare` before `draw`. If it keeps an earlier selection, whose uploads are yet to come, it
/// certifies no error.
#[test]
#[allow(unsafe_code)]
fn a_selection_of_an_earlier_view_has_no_certified_error() {
    on_device(|gpu| {
        let target = Target::new(vk::Format::R8G8B8A8_SRGB, vk::Format::D32_SFLOAT);
        let mut terrain = lent(gpu, "smooth-tiles", target).unwrap();
        let [first, second] = [12_800.0, 20_000.0].map(|x| view_to(DVec3::new(x, 1000.0, 12_800.0)));
        terrain.update(&first);
        let certified = terrain.stats();
        assert_eq!(certified.error_bound_px, Some(1.0), "{certified:?}");
        terrain.update(&second);
        let kept = terrain.stats();
        assert_eq!((kept.triangles, kept.error_bound_px), (certified.triangles, None), "{kept:?}");
        terrain.update(&first);
        assert_eq!(terrain.stats(), certified);
        let mut drawn = lent(gpu, "geomipmap", target).unwrap();
        frames::once(gpu, |recording| {
            drawn.update(&first);
            // SAFETY: a primary command buffer outside of rendering, submitted and waited for here.
            unsafe { drawn.prepare(recording.commands, 0)? };
            drawn.update(&second);
            // SAFETY: refused before a command is recorded.
            let refused = unsafe { drawn.draw(recording.commands) };
            assert!(refused.unwrap_err().to_string().contains("call prepare first"));
            Ok(())
        })
        .unwrap();
    });
}
