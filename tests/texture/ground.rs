//! The working set of a ground's texels: bounded, and at rest a function of the view.

use std::sync::Arc;

use cuesta::internal::draw::{DrawList, Geometry};
use cuesta::internal::height::Field;
use cuesta::internal::height::synth::{Kind, synth};
use cuesta::internal::lod::{self, Settings, Technique};
use cuesta::internal::texture::virtual_ground::{VirtualGround, VirtualGroundLayout};
use cuesta::internal::texture::virtual_overlay::VirtualTextureStats;
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;

const SIZE: [u32; 2] = [640, 360];

fn field() -> Arc<Field> {
    Arc::new(synth(Kind::Fractal, [257, 257], 9))
}

fn room(field: &Arc<Field>) -> Box<dyn Technique> {
    let entry = lod::find("sphere-tree").expect("in the table");
    (entry.build)(Arc::clone(field), &Settings::defaults(entry))
}

/// From a few metres above a place, samples.
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

/// Looks until nothing is to come; what is held then, and the level that serves at each of 64 × 64 places.
fn rest(maps: &mut VirtualGround, room: &mut dyn Technique, view: &View) -> (VirtualTextureStats, Vec<u32>) {
    let mut list = DrawList::default();
    room.select(view, &mut list);
    maps.see(view, &Geometry::default(), &list);
    for _ in 0..200 {
        maps.look(64);
        maps.wait();
        if maps.stats().pending == 0 {
            break;
        }
    }
    let levels = (0..4096).map(|k| maps.table().find([(k % 64) << 26, (k / 64) << 26]).0);
    (maps.stats(), levels.collect())
}

#[test]
fn texels_are_those_of_the_screen_and_the_same_after_any_way() {
    let field = field();
    let mut room = room(&field);
    let cut = VirtualGroundLayout::new(&field, 1 << 26, 2048).unwrap();
    let mut maps = VirtualGround::new(&field, cut);
    let first = view(&field, [100.0, 90.0], 30.0);
    let (stats, at_first) = rest(&mut maps, room.as_mut(), &first);
    assert_eq!((stats.pending, stats.texel_px), (0, 1.0), "{stats}");
    assert!(at_first.iter().max() >= Some(&6) && at_first.contains(&0), "{at_first:?}");
    for k in (0..12).map(f64::from) {
        let (stats, _) = rest(&mut maps, room.as_mut(), &view(&field, [100.0 + 9.0 * k, 90.0], 30.0 + 20.0 * k));
        assert_eq!(stats.pending, 0);
        let a_pixel = maps.texels() / f64::from(SIZE[0] * SIZE[1]);
        assert!((0.5..6.0).contains(&a_pixel), "{a_pixel} texels a pixel");
        assert!(maps.table().words().len() <= cut.table_words());
    }
    assert_eq!(rest(&mut maps, room.as_mut(), &first).1, at_first);
}

/// What is not there yet is served by what lies around it, from the first frame on.
#[test]
fn a_coarser_node_serves_until_the_finer_one_is_there() {
    let field = field();
    let mut room = room(&field);
    let mut maps = VirtualGround::new(&field, VirtualGroundLayout::new(&field, 1 << 26, 2048).unwrap());
    let here = view(&field, [100.0, 90.0], 30.0);
    let mut list = DrawList::default();
    room.select(&here, &mut list);
    maps.see(&here, &Geometry::default(), &list);
    let fills = maps.look(64);
    assert_eq!(fills.len(), 1, "the root");
    assert!(maps.stats().pending > 10, "{}", maps.stats());
    assert_eq!(maps.table().words(), [1, 0, 0, 0, 0]);
}

#[test]
fn a_little_memory_makes_texels_long_and_too_little_is_refused() {
    let field = field();
    let refused = VirtualGroundLayout::new(&field, 1_000_000, 2048).unwrap_err();
    assert!(refused.contains("expected at least 2 MB"), "{refused}");
    let mut maps = VirtualGround::new(&field, VirtualGroundLayout::new(&field, 2_000_000, 2048).unwrap());
    let view = View { size: [1280, 720], ..view(&field, [128.0, 128.0], 0.0) };
    let (stats, _) = rest(&mut maps, room(&field).as_mut(), &view);
    assert!(stats.texel_px > 1.0 && stats.bytes <= 2_000_000 && stats.pending == 0, "{stats}");
}
