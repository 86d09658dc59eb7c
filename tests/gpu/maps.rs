//! Tests of overlay images as virtual textures: the same image as a whole texture, within less memory.

use std::sync::Arc;

use cuesta::internal::gpu::Gpu;
use cuesta::internal::height::Field;
use cuesta::internal::plan::{Colour, Look, ScenePlan};
use cuesta::internal::scene::{Copy, Scene, SceneRenderer};
use cuesta::internal::view::{Lens, View};
use glam::DVec3;
use image::{Rgba, RgbaImage};

use super::{aslant, difference, mountains, on_device, technique};

/// Texels per sample, and the length of a page of 16 samples, metres.
const FINE: u32 = 8;
const PAGE_M: [f64; 2] = [16.0 * 20.0, 16.0 * 25.0];

fn field() -> Arc<Field> {
    Arc::new((*mountains()).clone().without_holes())
}

/// Returns waves a dozen texels long and more.
fn picture(field: &Field) -> RgbaImage {
    let [w, h] = field.size().map(|n| FINE * (n - 1));
    RgbaImage::from_fn(w, h, |x, z| {
        let wave = |t: f64| (127.5 + 100.0 * t.sin()) as u8;
        let (x, z) = (f64::from(x), f64::from(z));
        Rgba([wave(x / 3.0), wave(z / 4.0 + x / 50.0), wave((x + z) / 9.0), 255])
    })
}

fn look(texture_bytes: u64) -> Look {
    Look { colour: Colour::Overlay, texture_bytes, ..Look::default() }
}

fn plan(gpu: &Gpu, field: &Arc<Field>, look: &Look, picture: &RgbaImage) -> ScenePlan {
    let limits = gpu.device_limits();
    let plan = ScenePlan::builder(field, look, &limits).overlay(Some(picture.dimensions().into()));
    plan.requirements(technique(field, "sorted-strips", &[]).pipeline_requirements()).build().unwrap()
}

/// Returns a renderer with sorted strips and a texture budget in bytes.
fn renderer(gpu: &Arc<Gpu>, field: &Arc<Field>, picture: &RgbaImage, texture_bytes: u64, view: &View) -> SceneRenderer {
    let look = look(texture_bytes);
    let plan = plan(gpu, field, &look, picture);
    let strips = technique(field, "sorted-strips", &[]);
    Scene { gpu, field, plan: &plan, look: &look, overlay: Some(picture) }.renderer(strips.as_ref(), view.size).unwrap()
}

fn drawn(renderer: &mut SceneRenderer, field: &Arc<Field>, view: &View) -> RgbaImage {
    renderer.draw(technique(field, "sorted-strips", &[]).as_mut(), view, Copy::Picture).unwrap();
    renderer.picture()
}

const WHOLE: u64 = 1 << 30;
/// A budget below the 3.2 MB of the whole image.
const PARTS: u64 = 3_000_000;

/// A view from straight above at `metres_px` metres per pixel.
fn above(field: &Field, at: DVec3, metres_px: f64) -> View {
    let mut view = aslant(field, [320, 240], 0.5);
    view.eye = at;
    view.world_from_eye = View::looking_along(DVec3::NEG_Y);
    view.lens = Lens::Orthographic { width: 320.0 * metres_px, far: 20_000.0 };
    view
}

/// Returns the largest and mean channel difference, over pixels on page edges and over all others.
fn differences(a: &RgbaImage, b: &RgbaImage, on_edge: impl Fn(u32, u32) -> bool) -> [(u8, f64); 2] {
    let mut found = [(0, 0.0, 0.0); 2];
    for (x, y, pixel) in a.enumerate_pixels() {
        let apart = pixel.0.iter().zip(b.get_pixel(x, y).0).map(|(p, q)| p.abs_diff(q)).max().unwrap_or(0);
        let (largest, sum, count) = &mut found[usize::from(!on_edge(x, y))];
        *largest = apart.max(*largest);
        *sum += f64::from(apart);
        *count += 1.0;
    }
    found.map(|(largest, sum, count)| (largest, sum / f64::max(count, 1.0)))
}

/// A settled virtual texture shows the same image as a whole texture, at page edges as inside.
#[test]
fn a_virtual_texture_shows_the_image_without_seams() {
    on_device(|gpu| {
        let field = field();
        let picture = picture(&field);
        let view = above(&field, field.world_at(63.0, 47.0, 9000.0), 2.0);
        let whole = drawn(&mut renderer(gpu, &field, &picture, WHOLE, &view), &field, &view);
        let mut parts = renderer(gpu, &field, &picture, PARTS, &view);
        parts.settle(technique(&field, "sorted-strips", &[]).as_mut(), &view).unwrap();
        let in_parts = drawn(&mut parts, &field, &view);
        let maps = parts.maps().expect("a virtual texture");
        assert!(maps.pending == 0 && maps.texel_px == 1.0 && maps.bytes <= PARTS, "{maps}");
        // North is up: x goes right and z down.
        let place = |k: usize, n: u32| {
            let (first, size) = ([view.eye.x, view.eye.z][k], [320.0, 240.0][k]);
            let along = first + (f64::from(n) + 0.5 - size / 2.0) * 2.0 - [field.origin[0], field.origin[1]][k];
            (along / PAGE_M[k] - (along / PAGE_M[k]).round()).abs() * PAGE_M[k]
        };
        let on_edge = |x: u32, y: u32| place(0, x) <= 2.5 || place(1, y) <= 2.5;
        let [edges, inside] = differences(&whole, &in_parts, on_edge);
        println!("edges {edges:?}, inside {inside:?}");
        assert!(inside.0 <= 12 && inside.1 < 2.5, "inside: {inside:?}");
        assert!(edges.0 <= inside.0 + 1 && edges.1 < inside.1 + 0.5, "edges {edges:?}, inside {inside:?}");
    });
}

/// Resident tiles are drawn at once and finer ones follow. The settled image does not depend on the path.
#[test]
fn coarse_tiles_are_drawn_at_once_and_finer_ones_follow() {
    on_device(|gpu| {
        let field = field();
        let picture = picture(&field);
        let view = aslant(&field, [320, 240], 1.0);
        let near = above(&field, field.world_at(30.0, 30.0, 9000.0), 2.0);
        let mut parts = renderer(gpu, &field, &picture, PARTS, &view);
        let first = drawn(&mut parts, &field, &near);
        assert!(parts.maps().unwrap().pending > 0);
        parts.settle(technique(&field, "sorted-strips", &[]).as_mut(), &near).unwrap();
        let settled = drawn(&mut parts, &field, &near);
        assert!(difference(&first, &settled, 8).1 > 0.5, "the root alone shows waves of a dozen texels");
        assert!(first.pixels().all(|pixel| pixel.0[3] == 255), "terrain is drawn at once");
        parts.settle(technique(&field, "sorted-strips", &[]).as_mut(), &view).unwrap();
        let aslant = drawn(&mut parts, &field, &view);
        assert!(difference(&aslant, &settled, 8).1 > 0.1);
        parts.settle(technique(&field, "sorted-strips", &[]).as_mut(), &near).unwrap();
        assert_eq!(drawn(&mut parts, &field, &near), settled);
    });
}

/// Tiles are generated, uploaded and evicted while frames are drawn: no validation messages, the budget kept, and all
/// terrain covered.
#[test]
fn tiles_are_replaced_along_a_path_within_the_budget() {
    on_device(|gpu| {
        let field = field();
        let picture = picture(&field);
        let min = 500_000;
        let at = |x: f64| above(&field, field.world_at(x, 47.0, 9000.0), 2.0);
        let mut parts = renderer(gpu, &field, &picture, min, &at(20.0));
        let mut held = Vec::new();
        for frame in 0..40 {
            let view = at(20.0 + 2.0 * f64::from(frame));
            let shown = drawn(&mut parts, &field, &view);
            assert!(shown.pixels().all(|pixel| pixel.0[3] == 255));
            let maps = parts.maps().unwrap();
            assert!(maps.bytes <= min && maps.texel_px > 1.0, "{maps}");
            held.push(maps.held);
        }
        assert!(held.iter().max() > held.iter().min());
    });
}
