//! Tests of the texture working set along a flight: its size.

mod ground;
mod page_table;

use std::sync::Arc;

use cuesta::internal::draw::DrawList;
use cuesta::internal::draw::expand::{self, Drawn};
use cuesta::internal::draw::layout::Frame;
use cuesta::internal::height::synth::{self, Kind};
use cuesta::internal::height::{Field, surface};
use cuesta::internal::lod::Technique;
use cuesta::internal::texture::hidden::Depths;
use cuesta::internal::texture::pieces::{ClipPlanes, Clipper, Corner};
use cuesta::internal::texture::resolution::{level_by_exponent, texture_area};
use cuesta::internal::texture::wedges;
use cuesta::internal::texture::working_set::{Wedge, WorkingSet};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::{DVec2, DVec3};

use crate::prepared::technique;

/// Cells along a side of the field and of its root square.
const CELLS: i32 = 1024;
/// Sample spacing, metres.
const SPACING_M: f64 = 10.0;
const SIZE: [u32; 2] = [1280, 720];
/// Frames of the flight.
const FRAMES: usize = 1000;
/// Level of the virtual texture: 2^36 texels.
const TEXTURE_LEVEL: i32 = 18;
/// Pixels of the image.
const SCREEN: f64 = (SIZE[0] * SIZE[1]) as f64;
/// Texture level of a tile: 32 × 32 texels.
const TILE_LEVEL: i32 = 5;
/// Wedges in view.
const WEDGES: f64 = 8000.0;

/// A circular flight over a synthetic field.
struct Flight {
    field: Arc<Field>,
    technique: Box<dyn Technique>,
}

/// A wedge in view.
struct VisibleWedge {
    key: u64,
    wedge: Wedge,
    /// Corners, right angle first.
    corners: [Corner; 3],
    /// Area on the screen, pixels; negative if the wedge faces away.
    area_px: f64,
    is_near: bool,
    /// Cosine of the angle between the wedge's normal and the direction to the eye.
    cosine: f64,
}

impl Flight {
    fn new() -> Self {
        let mut field = synth::synth(Kind::Eroded, [CELLS as u32 + 1; 2], 7);
        field.spacing = [SPACING_M; 2];
        let field = Arc::new(field);
        Self { technique: technique(&field, "sphere-tree", &[]), field }
    }

    fn view(&self, frame: usize, px: f64) -> View {
        let turn = frame as f64 / FRAMES as f64 * std::f64::consts::TAU;
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

    /// Returns the working set of a view computed from scratch by the library.
    fn working_set_of(&mut self, view: &View) -> WorkingSet {
        let mut list = DrawList::default();
        self.technique.select(view, &mut list);
        let wedges = wedges::from_draw_list(&self.field, view, self.technique.resident(), &list);
        let mut set = WorkingSet::new(TEXTURE_LEVEL, TILE_LEVEL);
        wedges::update(&mut set, view, Clipper::new(view, 1.0, TEXTURE_LEVEL, TILE_LEVEL), &wedges);
        set
    }

    /// Returns the wedges of a view's draw list that are in view.
    fn visible_wedges(&mut self, view: &View) -> Vec<VisibleWedge> {
        let mut list = DrawList::default();
        self.technique.select(view, &mut list);
        let drawn =
            expand::triangles(&self.field, &Frame::placing(&self.field, view), self.technique.resident(), &list);
        drawn.iter().filter_map(|triangle| self.visible_wedge(view, triangle)).collect()
    }

    /// Returns a triangle as a wedge, or `None` if it is beside the image or behind the near plane.
    fn visible_wedge(&self, view: &View, Drawn { corners, .. }: &Drawn) -> Option<VisibleWedge> {
        let level = ((f64::from(CELLS).powi(2)) / surface::doubled_area(corners) as f64).log2().round() as u32;
        let sum = [corners.iter().map(|c| c.x).sum::<i32>(), corners.iter().map(|c| c.z).sum()];
        let barycentre = sum.map(|n| f64::from(n) / f64::from(3 * CELLS));
        let world = corners.map(|c| self.field.world_at(f64::from(c.x), f64::from(c.z), f64::from(c.y)));
        let depths = world.map(|at| (at - view.eye).dot(view.forward()));
        if depths.iter().all(|&depth| depth <= view.near) {
            return None;
        }
        let key = (u64::from(level) << 48) | ((sum[0] as u64) << 24) | sum[1] as u64;
        let right_angle = (0..3).max_by_key(|&k| squared_length(corners, k)).unwrap_or(0);
        let share = |n: i32| f64::from(n) / f64::from(CELLS);
        let corner = |k: usize| Corner { uv: DVec2::new(share(corners[k].x), share(corners[k].z)), world: world[k] };
        let in_order = [0, 1, 2].map(|k| corner((k + right_angle) % 3));
        let normal = (world[1] - world[0]).cross(world[2] - world[0]);
        let to = view.eye - (world[0] + world[1] + world[2]) / 3.0;
        let cosine = normal.dot(to) / (normal.length() * to.length());
        let mut seen = VisibleWedge {
            key,
            wedge: Wedge { level, barycentre },
            corners: in_order,
            area_px: 0.0,
            is_near: true,
            cosine,
        };
        let [Some(a), Some(b), Some(c)] = world.map(|at| view.project(at)) else { return Some(seen) };
        let pixels = [a.pixel, b.pixel, c.pixel];
        let size = DVec2::new(f64::from(SIZE[0]), f64::from(SIZE[1]));
        let is_beside = (0..2).any(|k| pixels.iter().all(|p| p[k] < 0.0) || pixels.iter().all(|p| p[k] > size[k]));
        // Screen y points down.
        (seen.is_near, seen.area_px) = (false, -(pixels[1] - pixels[0]).perp_dot(pixels[2] - pixels[0]) / 2.0);
        (!is_beside).then_some(seen)
    }
}

/// Returns the squared length in plan of the side opposite corner `k`.
fn squared_length(corners: &surface::Triangle, k: usize) -> i64 {
    let [a, b] = [1, 2].map(|step| corners[(k + step) % 3]);
    i64::from(a.x - b.x).pow(2) + i64::from(a.z - b.z).pow(2)
}

/// Returns the view and its wedges at the tolerance at which [`WEDGES`] are in view; starts from the last frame's
/// tolerance.
fn with_wedge_count(flight: &mut Flight, frame: usize, px: &mut f64) -> (View, Vec<VisibleWedge>) {
    for _ in 0..30 {
        let view = flight.view(frame, *px);
        let seen = flight.visible_wedges(&view);
        let ratio = seen.len() as f64 / WEDGES;
        if (ratio - 1.0).abs() < 0.02 {
            return (view, seen);
        }
        *px *= ratio.powf(0.7);
    }
    panic!("frame {frame}: no tolerance for {WEDGES} wedges");
}

/// A working set with one clipping rule, and its sizes along the flight.
struct Variant {
    name: String,
    set: WorkingSet,
    /// Clipper settings; `None` for whole triangles as published.
    configure: Option<fn(Clipper) -> Clipper>,
    tile_level: i32,
    omits_hidden: bool,
    /// Per frame: texels of the set, its tiles, pixels of all pieces, and texels of the pieces alone at levels
    /// rounded up.
    frames: Vec<[f64; 4]>,
}

impl Variant {
    fn new(name: &str, tile_level: i32, configure: Option<fn(Clipper) -> Clipper>) -> Self {
        let (name, set) = (format!("{name}, 4^{tile_level}"), WorkingSet::new(TEXTURE_LEVEL, tile_level));
        Self { name, set, configure, tile_level, omits_hidden: false, frames: Vec::new() }
    }

    fn without_hidden(self) -> Self {
        Self { omits_hidden: true, ..self }
    }

    fn follow(&mut self, view: &View, seen: &[VisibleWedge], depths: &Depths) {
        let Self { set, configure, .. } = self;
        let (mut pixels, mut alone) = (0.0, 0.0);
        set.begin();
        match configure {
            None => seen.iter().for_each(|s| {
                set.require(s.key, &s.wedge, s.area_px as f32, s.is_near);
            }),
            Some(configure) => {
                let clipper = configure(Clipper::new(view, 1.0, TEXTURE_LEVEL, self.tile_level));
                let clipper = if self.omits_hidden { clipper.with_occlusion(depths) } else { clipper };
                seen.iter().filter(|s| s.cosine > 0.0).for_each(|s| {
                    clipper.split(s.wedge.level, s.corners, &mut |piece| {
                        set.require(piece.wedge.key(), &piece.wedge, piece.texels, false);
                        let alpha = level_by_exponent(piece.texels, piece.wedge.level).min(TEXTURE_LEVEL);
                        let rounded = texture_area(alpha) / 2f64.powi(piece.wedge.level as i32 + 1);
                        pixels += piece.pixels;
                        alone += piece.pixels / f64::from(piece.texels) * rounded;
                    });
                });
            }
        }
        set.end();
        self.frames.push([set.texels(), set.tiles().count() as f64, pixels, alone]);
    }

    /// Returns the maximum number of texels per pixel of the image.
    fn max(&self) -> f64 {
        self.frames.iter().map(|frame| frame[0] / SCREEN).fold(0.0, f64::max)
    }

    fn print(&self) {
        let mean = |of: fn(&[f64; 4]) -> f64| self.frames.iter().map(of).sum::<f64>() / self.frames.len() as f64;
        let (texels, tiles) = (mean(|frame| frame[0] / SCREEN), mean(|frame| frame[1]));
        print!("{:28} {texels:7.2} texels a pixel, at most {:7.2}; {tiles:6.0} tiles", self.name, self.max());
        if self.configure.is_some() {
            let [covered, rounded, held] = [mean(|f| f[2] / SCREEN), mean(|f| f[3] / f[2]), mean(|f| f[0] / f[3])];
            print!(
                "; {covered:.2} pixels covered x {rounded:.2} by rounding up x {held:.2} outside pieces within tiles"
            );
        }
        println!();
    }
}

/// Goal: at most 4 texels per pixel at one texel per pixel in every frame, whatever the size of the virtual texture.
/// The variants measure the overhead of each rule of the paper: near plane, whole triangles, whole tiles.
#[test]
fn the_working_set_is_bounded_by_the_screen_size() {
    let mut flight = Flight::new();
    let whole: [fn(Clipper) -> Clipper; 2] = [|c| c.unsplit(ClipPlanes::NearPlane), |c| c.unsplit(ClipPlanes::Screen)];
    let in_pieces = |level: i32| Variant::new("split into pieces", level, Some(|clipper| clipper));
    let mut variants = [
        Variant::new("as published", TILE_LEVEL, None),
        Variant::new("clipped at the near plane", TILE_LEVEL, Some(whole[0])),
        Variant::new("clipped to the screen", TILE_LEVEL, Some(whole[1])),
        in_pieces(TILE_LEVEL),
        in_pieces(6).without_hidden(),
        in_pieces(TILE_LEVEL).without_hidden(),
        in_pieces(4).without_hidden(),
    ];
    let mut px = 20.0;
    for frame in 0..FRAMES {
        let (view, seen) = with_wedge_count(&mut flight, frame, &mut px);
        let (mut depths, clipper) = (Depths::new(SIZE, 4.0), Clipper::new(&view, 1.0, TEXTURE_LEVEL, TILE_LEVEL));
        seen.iter().filter(|s| s.cosine > 0.0).for_each(|s| clipper.add_occluder(&s.corners, &mut depths));
        variants.iter_mut().for_each(|variant| variant.follow(&view, &seen, &depths));
        if frame % 100 == 0 {
            assert_eq!(flight.working_set_of(&view).texels(), variants[5].set.texels(), "frame {frame}");
        }
    }
    println!("{WEDGES} wedges, {FRAMES} frames");
    variants.iter().for_each(Variant::print);
    let [published, .., slots, _] = &variants;
    assert!(slots.max() <= 4.0, "{} texels a pixel", slots.max());
    assert!(published.max() > 4.0 * slots.max(), "the published rules need more");
    // A lower bound: most of the image is terrain, which needs about one texel per pixel.
    assert!(slots.frames.iter().all(|frame| frame[0] > 0.5 * SCREEN));
}
