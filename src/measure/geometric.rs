//! How far the as-drawn triangles are from the samples: vertically in metres, and on the screen in pixels.
//!
//! Measured is every sample with data inside or on the border of a drawn triangle, if the drawn point above
//! or below it is in view. The screen error is exact: both end points of the vertical difference are projected
//! in f64. The near plane only says what is drawn: a true point that lies before it is projected through the
//! pinhole all the same, and only at or behind the eye, where it has no image, is the error infinite. (The
//! certified metric bounds the error of such points too, see [`View::allowed_error`].)
//!
//! Each sample counts once: of the triangles around a sample, the one on its south-east side (at the field's
//! last column and row, on its west and north side) counts it, chosen exactly on the integers. A sample at the
//! south or east border of the drawn land inside the field, which has no such triangle, counts towards the
//! maximum only; every triangle does.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;
use rayon::prelude::*;

use super::in_view;
use crate::draw::expand::{self, Drawn};
use crate::draw::layout::Frame;
use crate::draw::{Draw, DrawList, Geometry};
use crate::height::Field;
use crate::height::surface::{self, Corner, Triangle, doubled_area};
use crate::view::{Aabb, Containment, Frustum, Lens, View};

/// Triangles in a piece of work, and pieces in work at once. Fixed numbers, so that sums are formed in the
/// same order on every machine.
const PART: usize = 1 << 15;
const BATCH: usize = 64;

/// A quantity over all samples in view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// Samples.
    pub count: u64,
    /// Root of the mean square.
    pub rms: f64,
    /// Exact: the smallest value that 99.9 % of the samples do not exceed.
    pub p999: f64,
    /// Largest.
    pub max: f64,
}

/// A sample and the point drawn for it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Place {
    /// Lattice position.
    pub sample: [u32; 2],
    /// The sample's world position.
    pub truth: DVec3,
    /// The drawn point's world position.
    pub drawn: DVec3,
}

/// What [`errors`] finds.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Drawn surface − sample, absolute, metres.
    pub vertical_m: Summary,
    /// The same difference on the screen, pixels.
    pub screen_px: Summary,
    /// Where the vertical error is largest; `None` if nothing is in view or nothing is wrong.
    pub vertical_at: Option<Place>,
    /// Where the screen error is largest.
    pub screen_at: Option<Place>,
}

/// Measures the triangles of a list. Time is linear in triangles and samples; memory is bounded by a
/// thousandth of the field's samples for each of 64 pieces of work.
pub fn errors(field: &Field, view: &View, resident: &Geometry, list: &DrawList) -> Errors {
    let ruler = Ruler::new(field, view);
    let (mut vertical, mut screen) = (ruler.tally(), ruler.tally());
    let parts: Vec<Draw> = list.draws.iter().flat_map(|draw| draw.parts(PART)).collect();
    for batch in parts.chunks(BATCH) {
        let measured: Vec<_> = batch.par_iter().map(|part| ruler.part(resident, list, part)).collect();
        for (part_vertical, part_screen) in measured {
            vertical.merge(part_vertical);
            screen.merge(part_screen);
        }
    }
    Errors {
        vertical_m: vertical.summary(),
        screen_px: screen.summary(),
        vertical_at: vertical.largest_at,
        screen_at: screen.largest_at,
    }
}

/// What triangles are measured with.
struct Ruler<'a> {
    field: &'a Field,
    view: &'a View,
    frame: Frame,
    frustum: Frustum,
    /// The view with its near plane moved to the eye: see the module's text.
    pinhole: View,
}

impl<'a> Ruler<'a> {
    fn new(field: &'a Field, view: &'a View) -> Self {
        let near = match view.lens {
            // Not zero: a depth that it divides by must leave finite pixels.
            Lens::Perspective { .. } => 1e-100,
            Lens::Orthographic { .. } => f64::NEG_INFINITY,
        };
        let frame = Frame::placing(field, view);
        Self { field, view, frame, frustum: view.frustum(), pinhole: View { near, ..*view } }
    }

    fn tally(&self) -> Tally {
        let [w, h] = self.field.size().map(|n| n as usize);
        Tally { capacity: w * h / 1000 + 1, ..Tally::default() }
    }

    fn part(&self, resident: &Geometry, list: &DrawList, part: &Draw) -> (Tally, Tally) {
        let (mut vertical, mut screen) = (self.tally(), self.tally());
        expand::visit_draw(self.field, &self.frame, resident, list, part, &mut |triangle: &Drawn| {
            self.triangle(&facing_up(&triangle.corners), &mut vertical, &mut screen);
        });
        (vertical, screen)
    }

    fn triangle(&self, triangle: &Triangle, vertical: &mut Tally, screen: &mut Tally) {
        if self.frustum.contains(&bounds(self.field, triangle)) == Containment::Outside {
            return;
        }
        let last = self.field.size().map(|n| n as i32 - 1);
        surface::visit_samples(triangle, |x, z, y| {
            let error = y - f64::from(self.field.height(x, z));
            let counts = owns(triangle, [x as i32, z as i32], last);
            if (error == 0.0 && !counts) || self.field.is_hole(x, z) {
                return;
            }
            let drawn = self.field.world_at(f64::from(x), f64::from(z), y);
            if in_view(self.view, drawn) {
                let place = Place { sample: [x, z], truth: self.field.world(x, z), drawn };
                vertical.add(error.abs(), counts, place);
                screen.add(self.pinhole.displacement_px(drawn, place.truth), counts, place);
            }
        });
    }
}

fn facing_up(triangle: &Triangle) -> Triangle {
    let [a, b, c] = *triangle;
    if doubled_area(triangle) < 0 { [a, c, b] } else { [a, b, c] }
}

fn bounds(field: &Field, triangle: &Triangle) -> Aabb {
    let [a, b, c] = triangle.map(|corner| field.world_at(corner.x.into(), corner.z.into(), corner.y.into()));
    Aabb { min: a.min(b).min(c), max: a.max(b).max(c) }
}

/// Whether the triangle is the one that counts a sample inside it or on its border: the one that holds the
/// sample moved by (ε, ε²) for an infinitely small ε, towards the inside of the field.
fn owns(triangle: &Triangle, [x, z]: [i32; 2], last: [i32; 2]) -> bool {
    let towards = [if x < last[0] { 1 } else { -1 }, if z < last[1] { 1 } else { -1 }];
    let [a, b, c] = *triangle;
    let sample = Corner { x, z, y: 0.0 };
    [[sample, b, c], [sample, c, a], [sample, a, b]].iter().all(|side| {
        let [_, p, q] = *side;
        // Growth of the side's doubled area with x and with z.
        let (along_x, along_z) = ((q.z - p.z) * towards[0], (p.x - q.x) * towards[1]);
        (doubled_area(side), along_x, along_z) > (0, 0, 0)
    })
}

/// Sums one quantity up.
#[derive(Default)]
struct Tally {
    count: u64,
    squares: f64,
    /// The largest counted values that are not 0, at most `capacity`, as bits: the order of non-negative
    /// numbers is that of their bits. A thousandth of all samples is enough for the 99.9th percentile.
    top: BinaryHeap<Reverse<u64>>,
    capacity: usize,
    largest: f64,
    largest_at: Option<Place>,
}

impl Tally {
    fn add(&mut self, value: f64, counts: bool, place: Place) {
        if value > self.largest {
            (self.largest, self.largest_at) = (value, Some(place));
        }
        if counts {
            self.count += 1;
            self.squares += value * value;
            self.keep(Reverse(value.to_bits()));
        }
    }

    fn keep(&mut self, value: Reverse<u64>) {
        if value.0 != 0 && self.top.len() < self.capacity {
            self.top.push(value);
        } else if let Some(mut smallest) = self.top.peek_mut()
            && smallest.0 < value.0
        {
            *smallest = value;
        }
    }

    fn merge(&mut self, other: Tally) {
        if other.largest > self.largest {
            (self.largest, self.largest_at) = (other.largest, other.largest_at);
        }
        self.count += other.count;
        self.squares += other.squares;
        other.top.into_iter().for_each(|value| self.keep(value));
    }

    fn summary(&self) -> Summary {
        let mut top: Vec<u64> = self.top.iter().map(|value| value.0).collect();
        top.sort_unstable_by_key(|&bits| Reverse(bits));
        Summary {
            count: self.count,
            rms: (self.squares / self.count.max(1) as f64).sqrt(),
            p999: top.get((self.count / 1000) as usize).map_or(0.0, |&bits| f64::from_bits(bits)),
            max: self.largest,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::{ExplicitVertex, Instance, Source, Topology};
    use crate::height::{Holes, Samples};
    use crate::view::{Metric, Tolerance};

    /// Two triangles over a field of bumps, as a streamed list.
    fn slab([w, h]: [u32; 2]) -> (Field, DrawList) {
        let heights = (0..w * h).map(|k| (k.wrapping_mul(2_654_435_761) >> 16) as f32 / 6000.0).collect();
        let field = Field::new(Samples::F32(heights), [w, h], [2.0, 3.0], Holes::none((w * h) as usize));
        let (x, z) = (w as i32 - 1, h as i32 - 1);
        let vertex = |position| ExplicitVertex { position, height: 20.0, ..ExplicitVertex::default() };
        let mut list = DrawList::default();
        list.instances.push(Instance::default());
        list.streamed.vertices = [[0, 0], [0, z], [x, 0], [x, z]].map(vertex).to_vec();
        list.streamed.indices = vec![0, 1, 2, 2, 1, 3];
        list.draws.push(Draw {
            source: Source::Streamed,
            topology: Topology::Triangles,
            indices: 0..6,
            instances: 0..1,
        });
        (field, list)
    }

    fn from_above(width: f64) -> View {
        View {
            eye: DVec3::new(-36.0, 300.0, 34.0),
            world_from_eye: View::turned(20.0, -70.0, 0.0),
            lens: Lens::Orthographic { width, far: 1e4 },
            size: [400, 300],
            near: 1.0,
            tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
        }
    }

    #[test]
    fn every_sample_counts_once_and_the_summary_is_exact() {
        let (field, list) = slab([61, 47]);
        let view = from_above(1000.0);
        let measured = errors(&field, &view, &Geometry::default(), &list);
        let mut expected: Vec<f64> =
            (0..61 * 47).map(|k| (20.0 - f64::from(field.samples().height(k))).abs()).collect();
        expected.sort_by(f64::total_cmp);
        let n = expected.len();
        let rms = (expected.iter().map(|e| e * e).sum::<f64>() / n as f64).sqrt();
        assert_eq!(measured.vertical_m.count, n as u64);
        assert!((measured.vertical_m.rms - rms).abs() < 1e-12 * rms);
        assert_eq!(measured.vertical_m.p999, expected[(n * 999).div_ceil(1000) - 1]);
        assert_eq!(measured.vertical_m.max, expected[n - 1]);
        // Orthographic: 0.4 px a metre, shortened by the pitch.
        let px = measured.vertical_m.max * 0.4 * 70f64.to_radians().cos();
        assert!((measured.screen_px.max - px).abs() < 1e-9);
        let place = measured.vertical_at.unwrap();
        assert_eq!(place.truth, field.world(place.sample[0], place.sample[1]));
        assert_eq!((place.drawn.y - place.truth.y).abs(), expected[n - 1]);
    }

    #[test]
    fn only_what_is_in_view_counts() {
        let (field, list) = slab([61, 47]);
        let view = from_above(60.0);
        let measured = errors(&field, &view, &Geometry::default(), &list);
        let drawn = |k: u32| field.world_at((k % 61).into(), (k / 61).into(), 20.0);
        let seen = (0..61 * 47).filter(|&k| in_view(&view, drawn(k))).count();
        assert!(seen > 100 && seen < 61 * 47 / 2, "{seen}");
        assert_eq!(measured.vertical_m.count, seen as u64);
    }

    #[test]
    fn truth_at_the_eye_is_infinitely_far_and_before_the_near_plane_is_not() {
        let (field, list) = slab([9, 9]);
        let mut view = from_above(1.0);
        view.lens = Lens::Perspective { fov_x: 2.0 };
        view.world_from_eye = View::turned(0.0, 90.0, 0.0);
        // Under the drawn surface at 20 m, looking up, with the truth below the eye, then just above it.
        let truth = f64::from(field.height(4, 4));
        view.eye = field.world_at(4.2, 4.2, truth + 1.0);
        let measured = errors(&field, &view, &Geometry::default(), &list);
        assert_eq!(measured.screen_px.max, f64::INFINITY);
        view.eye.y = -0.5;
        let measured = errors(&field, &view, &Geometry::default(), &list);
        assert!(measured.screen_px.count > 0 && measured.screen_px.max.is_finite(), "{measured:?}");
    }
}
