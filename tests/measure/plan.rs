//! Draws a counter-example as a picture: the triangles around the fault in plan view, north up.

use cuesta::internal::draw::expand::Drawn;
use cuesta::internal::height::surface::{Corner, Triangle, doubled_area};
use cuesta::internal::measure::watertight::{CounterExample, Kind};
use image::{Rgb, RgbImage};

/// Width and height of the picture, pixels.
const SIZE: u32 = 512;
/// Smallest margin around the triangles at fault, cells.
const MARGIN: f64 = 1.5;

const GROUND: Rgb<u8> = Rgb([255, 255, 255]);
const TERRAIN: Rgb<u8> = Rgb([214, 224, 206]);
const EDGE: Rgb<u8> = Rgb([110, 125, 100]);
/// A triangle at fault.
const FAULT: Rgb<u8> = Rgb([240, 140, 120]);
/// Overlap of two triangles at fault.
const FAULT_TWICE: Rgb<u8> = Rgb([200, 30, 30]);
const FAULT_EDGE: Rgb<u8> = Rgb([130, 0, 0]);
/// Terrain that is missing.
const MISSING: Rgb<u8> = Rgb([90, 130, 240]);
/// A vertex with two heights.
const VERTEX: Rgb<u8> = Rgb([20, 20, 20]);

/// Draws a fault. Triangles are grey-green, those at fault red and darker where they overlap. Missing terrain is blue.
/// A dot marks a vertex with two heights.
pub fn picture(triangles: &[Drawn], found: &CounterExample) -> RgbImage {
    let window = Window::around(&found.triangles);
    let mut picture = RgbImage::from_pixel(SIZE, SIZE, GROUND);
    let near: Vec<&Triangle> = triangles.iter().map(|t| &t.corners).filter(|t| window.meets(t)).collect();
    near.iter().for_each(|t| window.fill(&mut picture, t, |_| TERRAIN));
    let fault = |under| match (found.kind, under) {
        (Kind::Gap, _) => MISSING,
        (_, FAULT | FAULT_TWICE) => FAULT_TWICE,
        _ => FAULT,
    };
    found.triangles.iter().for_each(|t| window.fill(&mut picture, t, fault));
    near.iter().for_each(|t| window.outline(&mut picture, t, EDGE, 0));
    found.triangles.iter().for_each(|t| window.outline(&mut picture, t, FAULT_EDGE, 1));
    if let (Kind::Crack, [a, b, ..]) = (found.kind, &found.triangles[..]) {
        let two_heights = |c: &&Corner| b.iter().any(|d| (c.x, c.z) == (d.x, d.z) && c.y.to_bits() != d.y.to_bits());
        a.iter().filter(two_heights).for_each(|c| window.line(&mut picture, [c, c], VERTEX, 5));
    }
    picture
}

/// The square that the picture shows.
struct Window {
    /// North-western corner (x, z), samples.
    first: [f64; 2],
    px_per_cell: f64,
}

impl Window {
    /// Returns a square around triangles with a margin of half their extent, at least [`MARGIN`].
    fn around(triangles: &[Triangle]) -> Self {
        let along = |axis: fn(&Corner) -> i32| {
            let all = || triangles.iter().flatten().map(axis).map(f64::from);
            (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max))
        };
        let [(west, east), (north, south)] = [along(|c| c.x), along(|c| c.z)];
        let extent = (east - west).max(south - north);
        let side = extent + 2.0 * MARGIN.max(extent / 2.0);
        Self { first: [(west + east - side) / 2.0, (north + south - side) / 2.0], px_per_cell: f64::from(SIZE) / side }
    }

    /// Returns the position of a corner in the picture, pixels.
    fn at(&self, corner: &Corner) -> [f64; 2] {
        let along = |n: i32, first: f64| (f64::from(n) - first) * self.px_per_cell;
        [along(corner.x, self.first[0]), along(corner.z, self.first[1])]
    }

    /// Returns the ranges of pixel columns and rows of a bounding box around points.
    fn pixels(points: &[[f64; 2]]) -> [std::ops::Range<u32>; 2] {
        [0, 1].map(|k| {
            let low = points.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min);
            let high = points.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max);
            // Casts of negative numbers saturate at 0.
            (low.floor() as u32).min(SIZE)..(high.ceil() as u32).min(SIZE)
        })
    }

    /// Returns true if a triangle's bounding box overlaps the picture.
    fn meets(&self, triangle: &Triangle) -> bool {
        Self::pixels(&triangle.each_ref().map(|c| self.at(c))).iter().all(|range| !range.is_empty())
    }

    /// Colours the pixels whose centres lie in a triangle. `colour` maps the present colour to the new one.
    fn fill(&self, picture: &mut RgbImage, triangle: &Triangle, colour: impl Fn(Rgb<u8>) -> Rgb<u8>) {
        let corners = triangle.each_ref().map(|c| self.at(c));
        let turn = doubled_area(triangle).signum() as f64;
        let [columns, rows] = Self::pixels(&corners);
        for (x, y) in rows.flat_map(|y| columns.clone().map(move |x| (x, y))) {
            let centre = [f64::from(x) + 0.5, f64::from(y) + 0.5];
            let is_left = |k: usize| {
                let (p, q) = (corners[k], corners[(k + 1) % 3]);
                let cross = (q[1] - p[1]) * (centre[0] - p[0]) - (q[0] - p[0]) * (centre[1] - p[1]);
                cross * turn >= 0.0
            };
            if (0..3).all(is_left) {
                let pixel = picture.get_pixel_mut(x, y);
                *pixel = colour(*pixel);
            }
        }
    }

    fn outline(&self, picture: &mut RgbImage, triangle: &Triangle, colour: Rgb<u8>, radius: i32) {
        (0..3).for_each(|k| self.line(picture, [&triangle[k], &triangle[(k + 1) % 3]], colour, radius));
    }

    /// Draws a line of square dots with a side of 2 · `radius` + 1 pixels.
    fn line(&self, picture: &mut RgbImage, ends: [&Corner; 2], colour: Rgb<u8>, radius: i32) {
        let [from, to] = ends.map(|corner| self.at(corner));
        let steps = (to[0] - from[0]).abs().max((to[1] - from[1]).abs()).ceil().max(1.0);
        let dots = (0..=steps as i32).map(|k| f64::from(k) / steps);
        for [x, y] in dots.map(|t| [0, 1].map(|k| (from[k] + (to[k] - from[k]) * t).floor() as i32)) {
            let around = (y - radius..=y + radius).flat_map(|y| (x - radius..=x + radius).map(move |x| [x, y]));
            for [x, y] in around.filter(|at| at.iter().all(|n| (0..SIZE as i32).contains(n))) {
                picture.put_pixel(x as u32, y as u32, colour);
            }
        }
    }
}

fn triangle(corners: [[i32; 2]; 3]) -> Triangle {
    corners.map(|[x, z]| Corner { x, z, y: 0.0 })
}

fn example(kind: Kind, triangles: Vec<Triangle>) -> CounterExample {
    CounterExample { kind, triangles, text: String::new() }
}

/// The colour at a lattice position, for pictures of a window of 16 cells from (−4, −4).
fn at(picture: &RgbImage, x: f64, z: f64) -> Rgb<u8> {
    let px = |n: f64| ((n + 4.0) * 32.0) as u32;
    *picture.get_pixel(px(x), px(z))
}

#[test]
fn every_triangle_is_where_it_lies() {
    let (west, east) = (triangle([[0, 0], [0, 8], [8, 8]]), triangle([[0, 0], [8, 8], [8, 0]]));
    let drawn = [west, east].map(|corners| Drawn { corners, instance: 0 });
    let shown = picture(&drawn, &example(Kind::Overlap, vec![west]));
    assert_eq!((at(&shown, 2.0, 5.0), at(&shown, 5.0, 2.0), at(&shown, -2.0, 5.0)), (FAULT, TERRAIN, GROUND));
    assert_eq!((at(&shown, 4.0, 4.0), at(&shown, 8.0, 4.0)), (FAULT_EDGE, EDGE));
    let twice = picture(&drawn, &example(Kind::Overlap, vec![west, west]));
    assert_eq!((at(&twice, 2.0, 5.0), at(&twice, 5.0, 2.0)), (FAULT_TWICE, TERRAIN));
    let gap = picture(&drawn[1..], &example(Kind::Gap, vec![west]));
    assert_eq!((at(&gap, 2.0, 5.0), at(&gap, 5.0, 2.0)), (MISSING, TERRAIN));
}

#[test]
fn the_vertex_with_two_heights_is_marked() {
    let (west, mut east) = (triangle([[0, 0], [0, 8], [8, 8]]), triangle([[0, 0], [8, 8], [8, 0]]));
    east[1].y = 1.0;
    let shown = picture(&[], &example(Kind::Crack, vec![west, east]));
    assert_eq!((at(&shown, 8.0, 8.0), at(&shown, 0.0, 0.0)), (VERTEX, FAULT_EDGE));
}
