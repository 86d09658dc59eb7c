//! Tests of the virtual ground texture: bounded size, and a settled state that depends on the view alone.

use std::sync::Arc;

use cuesta::internal::draw::{DrawList, Geometry};
use cuesta::internal::height::Field;
use cuesta::internal::height::synth::{Kind, synth};
use cuesta::internal::lod::Technique;
use cuesta::internal::texture::virtual_ground::{VirtualGround, VirtualGroundLayout};
use cuesta::internal::texture::virtual_overlay::VirtualTextureStats;
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;

use super::page_table::find;
use crate::prepared;

const SIZE: [u32; 2] = [640, 360];

fn field() -> Arc<Field> {
    Arc::new(synth(Kind::Fractal, [257, 257], 9))
}

fn technique(field: &Arc<Field>) -> Box<dyn Technique> {
    prepared::technique(field, "sphere-tree", &[])
}

/// A view from 3 m above a position in samples.
fn view(field: &Field, at: [f64; 2], turn: f64) -> View {
    let [x, z] = [0, 1].map(|k| at[k] * field.spacing[k]);
    View {
        eye: DVec3::new(x, field.height_at(x, z).expect("over the field") + 3.0, z),
        world_from_eye: View::turned(turn, -15.0, 0.0),
        lens: Lens::Perspective { fov_x: 1.1 },
        size: SIZE,
        near: 0.2,
        tolerance: Tolerance { px: 4.0, metric: Metric::Certified },
        time_s: 0.0,
    }
}

/// Updates until no tile is pending. Returns the statistics and the tile level at each of 64 × 64 positions.
fn settle(ground: &mut VirtualGround, technique: &mut dyn Technique, view: &View) -> (VirtualTextureStats, Vec<u32>) {
    let mut list = DrawList::default();
    technique.select(view, &mut list);
    ground.require(view, &Geometry::default(), &list);
    for _ in 0..200 {
        ground.update(64);
        ground.wait();
        if ground.stats().pending == 0 {
            break;
        }
    }
    let levels = (0..4096).map(|k| find(ground.table().words(), [(k % 64) << 26, (k / 64) << 26]).0);
    (ground.stats(), levels.collect())
}

#[test]
fn tiles_are_bounded_by_the_screen_and_independent_of_the_path() {
    let field = field();
    let mut technique = technique(&field);
    let layout = VirtualGroundLayout::new(&field, 1 << 26, 2048).unwrap();
    let mut ground = VirtualGround::new(&field, layout);
    let first = view(&field, [100.0, 90.0], 30.0);
    let (stats, at_first) = settle(&mut ground, technique.as_mut(), &first);
    assert_eq!((stats.pending, stats.texel_px), (0, 1.0), "{stats}");
    assert!(at_first.iter().max() >= Some(&6) && at_first.contains(&0), "{at_first:?}");
    for k in (0..12).map(f64::from) {
        let (stats, _) =
            settle(&mut ground, technique.as_mut(), &view(&field, [100.0 + 9.0 * k, 90.0], 30.0 + 20.0 * k));
        assert_eq!(stats.pending, 0);
        let a_pixel = ground.texels() / f64::from(SIZE[0] * SIZE[1]);
        assert!((0.5..6.0).contains(&a_pixel), "{a_pixel} texels a pixel");
        assert!(ground.table().words().len() <= layout.table_words());
    }
    assert_eq!(settle(&mut ground, technique.as_mut(), &first).1, at_first);
}

/// In the first frame the root stands in for all pending tiles.
#[test]
fn the_root_stands_in_for_pending_tiles() {
    let field = field();
    let mut technique = technique(&field);
    let mut ground = VirtualGround::new(&field, VirtualGroundLayout::new(&field, 1 << 26, 2048).unwrap());
    let here = view(&field, [100.0, 90.0], 30.0);
    let mut list = DrawList::default();
    technique.select(&here, &mut list);
    ground.require(&here, &Geometry::default(), &list);
    let uploads = ground.update(64);
    assert_eq!(uploads.len(), 1, "the root");
    assert!(ground.stats().pending > 10, "{}", ground.stats());
    assert_eq!(ground.table().words(), [1, 0, 0, 0, 0]);
}

#[test]
fn a_small_budget_gives_longer_texels_and_a_tiny_one_is_an_error() {
    let field = field();
    let refused = VirtualGroundLayout::new(&field, 1_000_000, 2048).unwrap_err();
    assert!(refused.contains("expected at least 2 MB"), "{refused}");
    let mut ground = VirtualGround::new(&field, VirtualGroundLayout::new(&field, 2_000_000, 2048).unwrap());
    let view = View { size: [1280, 720], ..view(&field, [128.0, 128.0], 0.0) };
    let (stats, _) = settle(&mut ground, technique(&field).as_mut(), &view);
    assert!(stats.texel_px > 1.0 && stats.bytes <= 2_000_000 && stats.pending == 0, "{stats}");
}
