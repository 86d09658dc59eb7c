//! Tests of an overlay image's placement over a field, pixel by pixel: whole or as a virtual texture, tiled, cropped,
//! placed, and from afar.

use std::sync::Arc;

use cuesta::internal::gpu::Gpu;
use cuesta::internal::height::{Field, Holes, Samples};
use cuesta::internal::plan::{Colour, Look, ScenePlan};
use cuesta::internal::scene::{Copy, Scene};
use cuesta::internal::texture::drape::Drape;
use cuesta::internal::view::{Lens, View};
use glam::DVec3;
use image::{Rgba, RgbaImage};

use super::{aslant, difference, on_device, technique};

/// Uniform blocks along a side of the image.
const BLOCKS: u32 = 8;
const SIZE: [u32; 2] = [160, 120];
const STORED: [u32; 2] = [64, 64];
/// Budgets for a whole texture and for a virtual texture.
const BYTES: [u64; 2] = [1 << 30, 1_000_000];

/// Flat terrain of 64 × 64 samples, 10 m apart.
fn field() -> Field {
    let count = (STORED[0] * STORED[1]) as usize;
    Field::new(Samples::F32(vec![100.0; count]), STORED, [10.0; 2], Holes::none(count))
}

/// Returns the bits of red, green and blue of a block, 1 to 7; adjacent blocks differ.
fn code(block: [u32; 2]) -> u32 {
    (block[0] + 3 * block[1]) % 7 + 1
}

/// Returns the image of blocks.
fn blocks() -> RgbaImage {
    const SIDE: u32 = 512;
    RgbaImage::from_fn(SIDE, SIDE, |x, y| {
        let code = code([x, y].map(|n| n * BLOCKS / SIDE));
        let channel = |bit: u32| if code >> bit & 1 != 0 { 220 } else { 0 };
        Rgba([channel(0), channel(1), channel(2), 255])
    })
}

/// A view from straight above a lattice position at `px` pixels per sample.
fn above(field: &Field, at: [f64; 2], px: f64) -> View {
    let mut view = aslant(field, SIZE, 0.5);
    view.eye = field.world_at(at[0], at[1], 9000.0);
    view.world_from_eye = View::looking_along(DVec3::NEG_Y);
    view.lens = Lens::Orthographic { width: f64::from(SIZE[0]) * field.spacing[0] / px, far: 20_000.0 };
    view
}

fn drawn(gpu: &Arc<Gpu>, field: &Arc<Field>, picture: &RgbaImage, look: &Look, view: &View) -> RgbaImage {
    let mut technique = technique(field, "clusters", &[]);
    let limits = gpu.device_limits();
    let plan = ScenePlan::builder(field, look, &limits).overlay(Some(picture.dimensions().into()));
    let plan = plan.requirements(technique.pipeline_requirements()).build().unwrap();
    assert_eq!(plan.maps.is_some(), look.texture_bytes < 1 << 20, "whole, or virtual");
    let scene = Scene { gpu, field, plan: &plan, look, overlay: Some(picture) };
    let mut renderer = scene.renderer(technique.as_ref(), view.size).unwrap();
    renderer.settle(technique.as_mut(), view).unwrap();
    renderer.draw(technique.as_mut(), view, Copy::Picture).unwrap();
    renderer.picture()
}

/// Returns a look with an overlay placement.
fn look(texture_bytes: u64, drape: Option<Drape>) -> Look {
    Look { colour: Colour::Overlay, texture_bytes, drape, ..Look::default() }
}

/// Asserts that each pixel shows the block expected at its lattice position, or the terrain's own colour. `share`
/// returns the position in the image, 0 to 1, or `None` outside it.
fn check(
    gpu: &Arc<Gpu>,
    field: Field,
    drape: Option<Drape>,
    at: [f64; 2],
    share: impl Fn([f64; 2]) -> Option<[f64; 2]>,
) {
    let (field, picture) = (Arc::new(field), blocks());
    let view = above(&field, at, 1.0);
    let bare = drawn(gpu, &field, &picture, &Look { colour: Colour::Height, ..look(BYTES[0], drape) }, &view);
    for bytes in BYTES {
        let seen = drawn(gpu, &field, &picture, &look(bytes, drape), &view);
        let (mut on, mut off) = (0, 0);
        for (x, y, pixel) in seen.enumerate_pixels() {
            let along = |k: usize, n: u32| at[k] + f64::from(n) + 0.5 - f64::from(SIZE[k]) / 2.0;
            let place = [along(0, x), along(1, y)];
            // Pixels on the edge of a block or of the field are skipped.
            let around = [[-1.0, -1.0], [1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [0.0, 0.0]];
            let expected = around.map(|[u, v]| share([place[0] + u, place[1] + v]));
            let last = field.size().map(|n| f64::from(n - 1));
            let is_inside = (0..2).all(|k| place[k] > 1.0 && place[k] < last[k] - 1.0);
            let block = expected.map(|s| s.map(|s| s.map(|n| ((n * f64::from(BLOCKS)) as u32).min(BLOCKS - 1))));
            if !is_inside || block.iter().any(|other| *other != block[4]) {
                continue;
            }
            match block[4] {
                Some(block) => {
                    let found = (0..3).filter(|&c| pixel.0[c] > 80).map(|c| 1 << c).sum::<u32>();
                    assert_eq!(found, code(block), "{bytes} bytes: {place:?}, {pixel:?} in block {block:?}");
                    on += 1;
                }
                None => {
                    assert_eq!(pixel, bare.get_pixel(x, y), "{bytes} bytes: {place:?} has its own colour");
                    off += 1;
                }
            }
        }
        assert!(on > 150, "{on} pixels of the picture, {off} beside it");
    }
}

fn within(share: [f64; 2]) -> Option<[f64; 2]> {
    share.iter().all(|s| (0.0..=1.0).contains(s)).then_some(share)
}

#[test]
fn a_picture_lies_from_the_first_to_the_last_sample() {
    on_device(|gpu| {
        let share = |p: [f64; 2]| Some([0, 1].map(|k| p[k] / f64::from(STORED[k] - 1)));
        check(gpu, field(), None, [32.0, 24.0], share);
    });
}

/// Includes positions where f32 no longer resolves fractions of a sample.
#[test]
fn a_picture_repeats_with_its_field() {
    on_device(|gpu| {
        let share =
            |p: [f64; 2]| Some([0, 1].map(|k| (p[k] + 0.5).rem_euclid(f64::from(STORED[k])) / f64::from(STORED[k])));
        for at in [[100.0, 90.0], [64.0 * 7900.0 + 3.0, 150.0]] {
            check(gpu, field().tiled([8000, 4]), None, at, share);
        }
    });
}

#[test]
fn a_picture_is_cropped_with_its_field() {
    on_device(|gpu| {
        let (at, whole) = ([100, 30], [300, 200]);
        let share = |p: [f64; 2]| Some([(p[0] + 100.0) / 299.0, (p[1] + 30.0) / 199.0]);
        check(gpu, field(), Some(Drape::of_part(&field(), at, whole)), [32.0, 24.0], share);
        let tiled = || field().tiled([5, 5]);
        let share = |p: [f64; 2]| share([p[0].rem_euclid(64.0), p[1].rem_euclid(64.0)]);
        check(gpu, tiled(), Some(Drape::of_part(&tiled(), at, whole)), [150.0, 120.0], share);
    });
}

/// Beyond the image's sides the terrain has its own colour, in every tile.
#[test]
fn a_placed_picture_ends_at_its_sides() {
    on_device(|gpu| {
        let (first, length) = ([-12.5, 10.25], [50.0, 30.0]);
        let share = |p: [f64; 2]| within([0, 1].map(|k| (p[k] - first[k]) / length[k]));
        let drape = Drape { first, length, period: [None; 2], ends: true };
        check(gpu, field(), Some(drape), [32.0, 24.0], share);
        let share = |p: [f64; 2]| share([p[0].rem_euclid(64.0), p[1].rem_euclid(64.0)]);
        let drape = Drape { period: STORED.map(Some), ..drape };
        check(gpu, field().tiled([8000, 4]), Some(drape), [64.0 * 7900.0, 130.0], share);
        // Sides between samples.
        let drape = Drape { first: [5.25, 12.5], length: [50.5, 40.25], period: [None; 2], ends: true };
        check(gpu, field(), Some(drape), [32.0, 24.0], |p| within([(p[0] - 5.25) / 50.5, (p[1] - 12.5) / 40.25]));
    });
}

/// Close up, a tile half a million samples away shows the same as the first one.
#[test]
fn far_tiles_are_as_sharp_as_the_first() {
    on_device(|gpu| {
        let (field, picture) = (Arc::new(field().tiled([8000, 2])), blocks());
        for bytes in BYTES {
            // A corner of four blocks in the middle of the image.
            let [near, far] = [0.0, 64.0 * 7990.0].map(|x| above(&field, [x + 32.3, 24.1], 40.0));
            let [near, far] = [near, far].map(|view| drawn(gpu, &field, &picture, &look(bytes, None), &view));
            let (largest, share) = difference(&near, &far, 4);
            assert!(share < 0.002, "{bytes} bytes: {share} of the pixels differ, by up to {largest}");
            let (_, edges) = difference(&near, &RgbaImage::from_pixel(SIZE[0], SIZE[1], *near.get_pixel(0, 0)), 60);
            assert!(edges > 0.3, "blocks are seen: {edges}");
        }
    });
}

/// A checkerboard of single black and white texels is grey from afar, in linear light.
#[test]
fn fine_texels_become_their_mean() {
    on_device(|gpu| {
        let field = Arc::new(field());
        // Odd sides: no mip level is exactly half of the finer one.
        let picture =
            RgbaImage::from_fn(1531, 1531, |x, y| if (x + y) % 2 == 0 { Rgba([255; 4]) } else { Rgba([0, 0, 0, 255]) });
        let grey = RgbaImage::from_pixel(4, 4, Rgba([188, 188, 188, 255]));
        for view in [above(&field, [32.0, 24.0], 1.7), aslant(&field, SIZE, 0.5)] {
            let plain = drawn(gpu, &field, &grey, &look(BYTES[0], None), &view);
            let seen = drawn(gpu, &field, &picture, &look(BYTES[0], None), &view);
            let (largest, share) = difference(&plain, &seen, 6);
            assert!(share < 0.01, "{share} of the pixels differ, by up to {largest}");
        }
    });
}
