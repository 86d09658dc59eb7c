//! Tests of the virtual ground texture on the GPU.

use std::sync::Arc;

use cuesta::internal::gpu::Gpu;
use cuesta::internal::height::Field;
use cuesta::internal::height::synth::{Kind, synth};
use cuesta::internal::plan::{Colour, Look, ScenePlan};
use cuesta::internal::scene::{Copy, Scene, SceneRenderer};
use cuesta::internal::texture::ground::Ground;
use cuesta::internal::texture::working_set::TileId;
use cuesta::internal::view::{Lens, View};
use glam::DVec3;
use image::{Rgba, RgbaImage};

use super::{aslant, difference, on_device, technique};

/// A field of 129 × 129 samples, equal to its root square.
fn field() -> Arc<Field> {
    Arc::new(synth(Kind::Fractal, [129, 129], 5))
}

fn renderer(
    gpu: &Arc<Gpu>,
    field: &Arc<Field>,
    name: &str,
    look: &Look,
    picture: Option<&RgbaImage>,
    view: &View,
) -> SceneRenderer {
    let (limits, technique) = (gpu.device_limits(), technique(field, name, &[]));
    let size = picture.map(|picture| picture.dimensions().into());
    let plan = ScenePlan::builder(field, look, &limits).overlay(size);
    let plan = plan.requirements(technique.pipeline_requirements()).build().unwrap();
    Scene { gpu, field, plan: &plan, look, overlay: picture }.renderer(technique.as_ref(), view.size).unwrap()
}

fn drawn(renderer: &mut SceneRenderer, field: &Arc<Field>, name: &str, view: &View, settles: bool) -> RgbaImage {
    let mut technique = technique(field, name, &[]);
    if settles {
        renderer.settle(technique.as_mut(), view).unwrap();
    }
    renderer.draw(technique.as_mut(), view, Copy::Picture).unwrap();
    renderer.picture()
}

fn looking(colour: Colour) -> Look {
    Look { colour, ..Look::default() }
}

/// A view from straight above, four pixels per sample.
fn above(field: &Field) -> View {
    let mut view = aslant(field, [256, 192], 0.5);
    view.eye = field.world_at(60.0, 70.0, 9000.0);
    view.world_from_eye = View::looking_along(DVec3::NEG_Y);
    view.lens = Lens::Orthographic { width: 64.0 * field.spacing[0], far: 20_000.0 };
    view
}

fn mean(a: &RgbaImage, b: &RgbaImage) -> f64 {
    let apart = a.iter().zip(b.iter()).map(|(p, q)| f64::from(p.abs_diff(*q)));
    apart.sum::<f64>() / a.len() as f64
}

/// The virtual texture shows the same as one texture of the whole ground, with the triangles of any technique.
#[test]
fn the_virtual_texture_shows_the_whole_ground() {
    on_device(|gpu| {
        let field = field();
        let view = above(&field);
        // As fine as the tiles that the view needs.
        let cells = 512;
        let tile = Ground::new(&field).tile(TileId { level: 0, at: [0, 0] }, cells);
        let whole = RgbaImage::from_fn(cells + 1, cells + 1, |x, z| Rgba(tile[(z * (cells + 1) + x) as usize]));
        let mut by_picture = renderer(gpu, &field, "sphere-tree", &looking(Colour::Overlay), Some(&whole), &view);
        let by_picture = drawn(&mut by_picture, &field, "sphere-tree", &view, false);
        for name in ["sphere-tree", "clusters:gpu-driven", "smooth-tiles"] {
            let mut in_nodes = renderer(gpu, &field, name, &looking(Colour::Ground), None, &view);
            let coarse = drawn(&mut in_nodes, &field, name, &view, false);
            let pending = in_nodes.maps().expect("a virtual texture").pending;
            assert!(pending > 10, "{name}: {pending} pending");
            let fine = drawn(&mut in_nodes, &field, name, &view, true);
            let stats = in_nodes.maps().expect("a virtual texture");
            assert!(stats.pending == 0 && stats.held > pending && stats.texel_px == 1.0, "{name}: {stats}");
            let [coarse, fine] = [coarse, fine].map(|picture| mean(&picture, &by_picture));
            println!("{name}: {coarse:.2} from the root alone, {fine:.2} at rest; {stats}");
            assert!(fine < 4.0 && coarse > 1.5 * fine, "{name}: {coarse} then {fine} apart on the mean");
        }
    });
}

/// On the way down to the ground the budget is kept, and the tiles become smaller.
#[test]
fn tiles_get_smaller_on_the_way_down_within_the_budget() {
    on_device(|gpu| {
        let field = field();
        let look = Look { texture_bytes: 12_000_000, ..looking(Colour::Nodes) };
        let first = aslant(&field, [200, 120], 1.0);
        let mut renderer = renderer(gpu, &field, "sphere-tree", &look, None, &first);
        let ground = field.world_at(64.3, 64.7, f64::from(field.height(64, 64)));
        let mut pictures = Vec::new();
        for k in 0..8 {
            let view = View { eye: ground + (first.eye - ground) * 0.4f64.powi(k), near: 0.01, ..first };
            pictures.push(drawn(&mut renderer, &field, "sphere-tree", &view, k % 2 == 1));
            let stats = renderer.maps().expect("a virtual texture");
            assert!(stats.bytes <= 12_000_000 && stats.held <= stats.slots, "{stats}");
            // Drivers may pad rows.
            let held = gpu.device_bytes()["ground texels"];
            assert!(held <= 18_000_000, "{held} bytes");
        }
        let (_, share) = difference(&pictures[1], &pictures[7], 8);
        assert!(share > 0.3, "{share} of the pixels");
    });
}

/// Other colour modes allocate no ground texels.
#[test]
fn other_colour_modes_allocate_no_ground_texels() {
    on_device(|gpu| {
        let field = field();
        let view = above(&field);
        let bytes = |colour| {
            let _stage = renderer(gpu, &field, "sphere-tree", &looking(colour), None, &view);
            gpu.device_bytes().get("ground texels").copied().unwrap_or(0)
        };
        assert_eq!(bytes(Colour::Height), 0);
        assert!(bytes(Colour::Ground) > 1 << 20);
    });
}
