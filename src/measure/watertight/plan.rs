//! A counter-example as a picture: the drawn triangles in plan around what is wrong, north up.

use image::{Rgb, RgbImage};

use super::{CounterExample, Kind};
use crate::draw::expand::Drawn;
use crate::height::surface::{Corner, Triangle, doubled_area};

/// Width and height of the picture, pixels.
const SIZE: u32 = 512;
/// Cells around the triangles at fault, at least.
const MARGIN: f64 = 1.5;

const GROUND: Rgb<u8> = Rgb([255, 255, 255]);
const LAND: Rgb<u8> = Rgb([214, 224, 206]);
const EDGE: Rgb<u8> = Rgb([110, 125, 100]);
/// A triangle at fault, and where two of them lie on each other.
const FAULT: Rgb<u8> = Rgb([240, 140, 120]);
const FAULT_TWICE: Rgb<u8> = Rgb([200, 30, 30]);
const FAULT_EDGE: Rgb<u8> = Rgb([130, 0, 0]);
/// Land that is missing.
const MISSING: Rgb<u8> = Rgb([90, 130, 240]);
/// A vertex with two heights.
const VERTEX: Rgb<u8> = Rgb([20, 20, 20]);

/// Draws the triangles (grey-green) and those at fault: red, darker where they overlap; what is missing is blue; a
/// vertex with two heights gets a dot.
pub fn picture(triangles: &[Drawn], found: &CounterExample) -> RgbImage {
    let window = Window::around(&found.triangles);
    let mut picture = RgbImage::from_pixel(SIZE, SIZE, GROUND);
    let near: Vec<&Triangle> = triangles.iter().map(|t| &t.corners).filter(|t| window.meets(t)).collect();
    near.iter().for_each(|t| window.fill(&mut picture, t, |_| LAND));
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

/// The square of the lattice that the picture shows.
struct Window {
    /// Its north-western corner, lattice units.
    first: [f64; 2],
    px_per_cell: f64,
}

impl Window {
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

    /// Where a corner lies in the picture, pixels.
    fn at(&self, corner: &Corner) -> [f64; 2] {
        [corner.x, corner.z].map(f64::from).iter().zip(self.first).map(|(n, first)| (n - first) * self.px_per_cell).collect::<Vec<_>>()[..].try_into().expect("two")
    }
}
