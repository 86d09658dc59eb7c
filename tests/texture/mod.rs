//! The texture working set along a flight: how large it is, and whether spheres find the same one.

use std::collections::HashMap;
use std::sync::Arc;

use cuesta::draw::DrawList;
use cuesta::draw::expand::{self, Drawn};
use cuesta::draw::layout::Frame;
use cuesta::height::synth::{self, Kind};
use cuesta::height::{Field, surface};
use cuesta::lod::{self, Settings, Technique};
use cuesta::texture::mip_spheres::Spheres;
use cuesta::texture::working_set::{Stop, Wedge, WorkingSet};
use cuesta::view::{Lens, Metric, Tolerance, View};
use glam::{DVec2, DVec3};

/// Cells along a side of the field, its root square too.
const CELLS: i32 = 1024;
/// Distance of samples, metres.
const SPACING_M: f64 = 10.0;
const SIZE: [u32; 2] = [1280, 720];
/// Level of the map over it: 2^36 texels.
const MAP_LEVEL: i32 = 18;

struct Flight {
    field: Arc<Field>,
    room: Box<dyn Technique>,
}

/// A wedge in sight.
struct Seen {
    key: u64,
    wedge: Wedge,
    corners: [DVec3; 3],
    /// On the screen, pixels; negative if it faces away.
    area_px: f64,
    is_near: bool,
    /// Cosine of the angle between its normal and the way to the eye.
    cosine: f64,
}

impl Flight {
    fn new() -> Self {
        let mut field = synth::synth(Kind::Eroded, [CELLS as u32 + 1; 2], 7);
        field.spacing = [SPACING_M; 2];
        let field = Arc::new(field);
        let entry = lod::find("sphere-tree").expect("in the table");
        let room = (entry.build)(Arc::clone(&field), &Settings::defaults(entry));
        Self { field, room }
    }

    fn view(&self, frame: usize, px: f64) -> View {
        let turn = frame as f64 / 1000.0 * std::f64::consts::TAU;
        let extent = f64::from(CELLS) * SPACING_M;
        let [x, z] = [0.5 + 0.25 * turn.cos(), 0.5 + 0.25 * turn.sin()].map(|part| part * extent);
        let ground = self.field.height_at(x, z).expect("over the field");
        View {
            eye: DVec3::new(x, ground + 300.0, z),
            world_from_eye: View::turned(turn.to_degrees() + 90.0, -15.0, 0.0),
            lens: Lens::Perspective { fov_x: 1.0 },
            size: SIZE,
            near: 1.0,
            tolerance: Tolerance { px, metric: Metric::Certified },
            time_s: 0.0,
        }
    }

    fn seen(&mut self, view: &View) -> Vec<Seen> {
        let mut list = DrawList::default();
        self.room.select(view, &mut list);
        let drawn = expand::triangles(&self.field, &Frame::placing(&self.field, view), self.room.resident(), &list);
        drawn.iter().filter_map(|triangle| self.see(view, triangle)).collect()
    }

    /// What is seen of a triangle, unless it is beside the picture or behind the eye.
    fn see(&self, view: &View, Drawn { corners, .. }: &Drawn) -> Option<Seen> {
        let level = ((f64::from(CELLS).powi(2)) / surface::doubled_area(corners) as f64).log2().round() as u32;
        let sum = [corners.iter().map(|c| c.x).sum::<i32>(), corners.iter().map(|c| c.z).sum()];
        let barycentre = sum.map(|n| f64::from(n) / f64::from(3 * CELLS));
        let world = corners.map(|c| self.field.world_at(f64::from(c.x), f64::from(c.z), f64::from(c.y)));
        let depths = world.map(|at| (at - view.eye).dot(view.forward()));
        if depths.iter().all(|&depth| depth <= view.near) {
            return None;
        }
        let key = (u64::from(level) << 48) | ((sum[0] as u64) << 24) | sum[1] as u64;
        let normal = (world[1] - world[0]).cross(world[2] - world[0]);
        let to = view.eye - (world[0] + world[1] + world[2]) / 3.0;
        let cosine = normal.dot(to) / (normal.length() * to.length());
        let mut seen =
            Seen { key, wedge: Wedge { level, barycentre }, corners: world, area_px: 0.0, is_near: true, cosine };
        let [Some(a), Some(b), Some(c)] = world.map(|at| view.project(at)) else { return Some(seen) };
        let pixels = [a.pixel, b.pixel, c.pixel];
        let size = DVec2::new(f64::from(SIZE[0]), f64::from(SIZE[1]));
        let is_beside = (0..2).any(|k| pixels.iter().all(|p| p[k] < 0.0) || pixels.iter().all(|p| p[k] > size[k]));
        // Rows count downwards.
        (seen.is_near, seen.area_px) = (false, -(pixels[1] - pixels[0]).perp_dot(pixels[2] - pixels[0]) / 2.0);
        (!is_beside).then_some(seen)
    }
}

#[test]
fn the_set_is_bounded_by_the_screen_and_spheres_find_it_within_a_level() {
    let mut flight = Flight::new();
    let stops = [Stop::Ends(5), Stop::Largest(5), Stop::Largest(8), Stop::Generated(5)];
    let mut sets = stops.map(|stop| WorkingSet::new(MAP_LEVEL, stop));
    let mut most = [[0.0f64; 2]; 4];
    // Without wedges that the near plane cuts, which need the most there is.
    let (mut far, mut most_far) = (WorkingSet::new(MAP_LEVEL, Stop::Ends(5)), 0.0f64);
    let (mut wedges, mut covered, mut apart) = ([usize::MAX, 0], 0.0f64, [0usize; 3]);
    let mut levels: HashMap<u64, i32> = HashMap::new();
    for frame in 0..1000 {
        let view = flight.view(frame, 20.0);
        let seen = flight.seen(&view);
        wedges = [wedges[0].min(seen.len()), wedges[1].max(seen.len())];
        let area: f64 = seen.iter().map(|s| s.area_px.max(0.0)).sum();
        covered = covered.max(area);
        far.begin();
        seen.iter().filter(|s| !s.is_near).for_each(|s| {
            far.show(s.key, &s.wedge, s.area_px as f32, false);
        });
        far.end();
        // A wedge is a quarter of its smallest node or more, and a texture has less than 4 times the texels it needs;
        // the root's has 4^5 at most.
        assert!(far.texels() <= 16.0 * area + 1024.0, "frame {frame}: {} texels for {area} pixels", far.texels());
        most_far = most_far.max(far.texels() / area);
        for (set, most) in sets.iter_mut().zip(&mut most) {
            set.begin();
            seen.iter().for_each(|s| {
                set.show(s.key, &s.wedge, s.area_px as f32, s.is_near);
            });
            set.end();
            *most = [most[0].max(set.texels()), most[1].max(set.nodes().count() as f64)];
        }
        let mut followed = HashMap::new();
        for s in seen.iter().filter(|s| !s.is_near && s.area_px > 0.0) {
            let spheres = Spheres::new(s.corners, s.wedge.level, view.focal_px(), 1.0).expect("a triangle");
            let level = spheres.follow(levels.get(&s.key).copied().unwrap_or(10), view.eye);
            followed.insert(s.key, level);
            if s.cosine > 0.03 {
                let alpha = sets[0].need(s.key).expect("in sight").alpha;
                apart[(level - alpha).unsigned_abs().min(2) as usize] += 1;
            }
        }
        levels = followed;
    }
    let screen = f64::from(SIZE[0] * SIZE[1]);
    println!("{wedges:?} wedges, {:.2} screens", covered / screen);
    for (stop, [texels, nodes]) in stops.iter().zip(most) {
        println!("{stop:?}: at most {:.2} texels a pixel, {nodes} nodes", texels / screen);
    }
    println!("without wedges at the near plane: at most {most_far:.2} texels a pixel of the wedges seen");
    println!("apart by 0, 1, more levels: {apart:?}");
    assert!(apart[2] * 100_000 < apart[0] && apart[1] < apart[0], "{apart:?}");
}
