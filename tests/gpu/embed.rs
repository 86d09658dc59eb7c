//! Terrain inside another program's renderer: the picture of `examples/embed.rs` in every convention of a host.

#[path = "../../examples/embed.rs"]
mod example;

use ash::vk;
use cuesta::embed::{DepthTarget, Target, TerrainRenderer};
use cuesta::internal::plan::Look;

use self::example::Options;
use super::{golden, on_device};

/// Draws the example with some options, and compares it with the golden picture.
fn check(options: Options) {
    // A device that the other tests can use is one for the example, too.
    on_device(|_| {
        let outcome = example::render(options).unwrap();
        assert!(outcome.messages.is_empty(), "validation:\n{}", outcome.messages.join("\n"));
        let stats = outcome.stats;
        assert!(stats.error_bound_px == Some(1.0) && stats.pending == 0 && stats.triangles > 10_000, "{stats:?}");
        golden::check(&outcome.picture, "embed");
    });
}

#[test]
fn cubes_and_terrain_hide_each_other_in_reversed_depth() {
    check(Options::default());
}

#[test]
fn they_do_so_in_common_depth_with_a_far_plane() {
    check(Options { is_reversed: false, far_m: Some(60_000.0), ..Options::default() });
}

#[test]
fn they_do_so_in_a_render_pass_with_24_bits_of_depth_and_y_up() {
    let depth = vk::Format::X8_D24_UNORM_PACK32;
    let own = Options::default();
    let pass = Options { is_reversed: false, depth, has_render_pass: true, is_y_up: true, ..own };
    check(pass);
    check(Options { is_reversed: true, far_m: Some(60_000.0), ..pass });
}

/// Smooth tiles upload geometry with their selections: a selection that was never drawn must not take it along.
#[test]
fn a_dropped_frame_loses_no_uploads() {
    on_device(|_| {
        let drawn = [false, true].map(|drops_a_frame| {
            let options = Options { technique: "smooth-tiles", drops_a_frame, ..Options::default() };
            example::render(options).unwrap()
        });
        assert!(drawn.iter().all(|outcome| outcome.messages.is_empty()), "{:?}", drawn[1].messages);
        assert_eq!(drawn[0].picture, drawn[1].picture);
    });
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
