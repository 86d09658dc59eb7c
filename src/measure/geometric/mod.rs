//! Distance of the drawn triangles from the samples: vertically in metres, and on the screen in pixels.
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

mod silhouette;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use self::silhouette::Silhouette;
use super::extended::{self, Extended};
use super::projection::Projection;
use super::summary::Tally;
pub use super::summary::{Place, Summary};
use super::{each_part, facing_up};
use crate::draw::expand::{self, Drawn};
use crate::draw::layout::Frame;
use crate::draw::{Draw, DrawList, Geometry};
use crate::height::Field;
use crate::height::surface::{self, Corner, Triangle, doubled_area};
use crate::view::{Aabb, Containment, Frustum, Projected, View};
use glam::DVec3;

/// Number of bins of the angle off the view axis: a perspective picture ends before 90°.
pub const ANGLES: usize = 9;
/// Width of such a bin, degrees.
pub const ANGLE_DEG: f64 = 10.0;

/// Screen error divided by the tolerance, in one range of angles off the view axis.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = extended::non_negative)]
pub struct AngleBin {
    /// Smallest angle, degrees, inclusive.
    pub from_deg: f64,
    /// Largest angle, degrees, exclusive.
    pub to_deg: f64,
    /// 99.9th percentile.
    #[serde(with = "extended")]
    #[schemars(with = "Extended")]
    pub p999: f64,
    /// Largest value.
    #[serde(with = "extended")]
    #[schemars(with = "Extended")]
    pub max: f64,
}

/// Errors of one frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Errors {
    /// Samples measured.
    pub samples: u64,
    /// Vertical distance of the drawn surface from the sample, metres.
    pub vertical_m: Summary,
    /// Distance of the same two points on the screen, pixels.
    pub screen_px: Summary,
    /// Share of the samples whose screen error is at most the view's tolerance; 1 without samples.
    pub bound_kept: f64,
    /// Samples in the silhouette band.
    pub silhouette_samples: u64,
    /// Screen error in the silhouette band, pixels. A sample lies in the band if some of the four triangles that it
    /// makes with a neighbour along x and one along z face the eye and others do not.
    pub silhouette_px: Summary,
    /// Samples by the angle of the drawn point off the view axis: bin k spans [`ANGLE_DEG`]·k to [`ANGLE_DEG`]·(k + 1).
    /// All rays of an orthographic view are in bin 0.
    pub off_axis_samples: [u64; ANGLES],
    /// Screen error divided by the view's tolerance, in the same bins.
    pub off_axis: [Summary; ANGLES],
    /// Place of the largest vertical error; `None` if nothing is in view or no error is above 0.
    pub vertical_at: Option<Place>,
    /// Place of the largest screen error.
    pub screen_at: Option<Place>,
}

/// Measures the triangles of a list; in a cave, those that face down against its ceiling.
///
/// Time is linear in triangles and samples. Memory is bounded by a few thousandths of the field's samples for each of 64
/// parallel parts.
pub fn errors(field: &Field, view: &View, resident: &Geometry, list: &DrawList) -> Errors {
    let ruler = Ruler::new(field, view, list.fraction_bits);
    let mut total = ruler.tallies();
    each_part(list, |part| ruler.part(resident, list, part), |part| total.merge(part));
    total.errors(view.tolerance.px)
}

/// Sums over samples.
struct Tallies {
    vertical: Tally,
    screen: Tally,
    /// Counted samples beyond the tolerance.
    beyond: u64,
    silhouette: Tally,
    off_axis: [Tally; ANGLES],
}

impl Tallies {
    fn merge(&mut self, other: Tallies) {
        self.vertical.merge(other.vertical);
        self.screen.merge(other.screen);
        self.beyond += other.beyond;
        self.silhouette.merge(other.silhouette);
        self.off_axis.iter_mut().zip(other.off_axis).for_each(|(mine, theirs)| mine.merge(theirs));
    }

    fn errors(&self, tolerance_px: f64) -> Errors {
        Errors {
            samples: self.screen.count,
            vertical_m: self.vertical.summary(),
            screen_px: self.screen.summary(),
            bound_kept: 1.0 - self.beyond as f64 / self.screen.count.max(1) as f64,
            silhouette_samples: self.silhouette.count,
            silhouette_px: self.silhouette.summary(),
            off_axis_samples: self.off_axis.each_ref().map(|bin| bin.count),
            off_axis: self.off_axis.each_ref().map(|bin| bin.summary().in_units_of(tolerance_px)),
            vertical_at: self.vertical.largest_at,
            screen_at: self.screen.largest_at,
        }
    }
}

/// Data for measuring triangles.
struct Ruler<'a> {
    field: &'a Field,
    /// Reference for triangles that face up.
    floor: Truth<'a>,
    /// Reference for triangles that face down, in a cave.
    ceiling: Option<Truth<'a>>,
    tolerance_px: f64,
    fraction_bits: u32,
    frame: Frame,
    frustum: Frustum,
    projection: Projection,
    /// Squared cosines of the angles where bins meet.
    bin_ends: [f64; ANGLES - 1],
}

/// The surface that should be there.
struct Truth<'a> {
    field: &'a Field,
    silhouette: Silhouette<'a>,
}

impl<'a> Truth<'a> {
    fn new(field: &'a Field, view: &View) -> Self {
        Self { field, silhouette: Silhouette::new(field, view) }
    }
}

impl<'a> Ruler<'a> {
    fn new(field: &'a Field, view: &View, fraction_bits: u32) -> Self {
        Self {
            field,
            fraction_bits,
            floor: Truth::new(field, view),
            ceiling: field.ceiling().map(|ceiling| Truth::new(ceiling, view)),
            tolerance_px: view.tolerance.px,
            frame: Frame::placing(field, view),
            frustum: view.frustum(),
            projection: Projection::new(view),
            bin_ends: std::array::from_fn(|k| (ANGLE_DEG * (k + 1) as f64).to_radians().cos().powi(2)),
        }
    }

    fn tallies(&self) -> Tallies {
        let [w, h] = self.field.size().map(u64::from);
        let surfaces = 1 + u64::from(self.ceiling.is_some());
        let tally = || Tally::new(surfaces * w * h, 1000);
        Tallies {
            vertical: tally(),
            screen: tally(),
            beyond: 0,
            silhouette: tally(),
            off_axis: std::array::from_fn(|_| tally()),
        }
    }

    fn part(&self, resident: &Geometry, list: &DrawList, part: &Draw) -> Tallies {
        let mut tallies = self.tallies();
        expand::visit_draw(self.field, &self.frame, resident, list, part, &mut |triangle: &Drawn| {
            let truth = self.ceiling.as_ref().filter(|_| doubled_area(&triangle.corners) < 0).unwrap_or(&self.floor);
            self.triangle(truth, &facing_up(&triangle.corners), &mut tallies);
        });
        tallies
    }

    fn triangle(&self, truth: &Truth, triangle: &Triangle, tallies: &mut Tallies) {
        let bits = self.fraction_bits;
        if self.frustum.contains(&bounds(self.field, triangle, bits)) == Containment::Outside {
            return;
        }
        let last = self.field.size().map(|n| n as i32 - 1);
        surface::visit_samples_between(triangle, bits, |x, z, y| {
            let error = y - f64::from(truth.field.height(x, z));
            let counts = owns(triangle, bits, [x as i32, z as i32], last);
            if (error == 0.0 && !counts) || self.field.is_hole(x, z) {
                return;
            }
            let drawn = self.field.world_at(f64::from(x), f64::from(z), y);
            if let Some(at) = self.projection.project_seen(drawn) {
                let place = Place { sample: [x, z], truth: truth.field.world(x, z), drawn };
                self.sample(place, &at, counts, tallies);
                if truth.silhouette.passes(&place) {
                    tallies.silhouette.add(self.projection.distance_px(&at, place.truth), counts, place);
                }
            }
        });
    }

    fn sample(&self, place: Place, at: &Projected, counts: bool, tallies: &mut Tallies) {
        let error_px = self.projection.distance_px(at, place.truth);
        tallies.vertical.add((place.drawn.y - place.truth.y).abs(), counts, place);
        tallies.screen.add(error_px, counts, place);
        tallies.off_axis[self.angle_bin(place.drawn, at)].add(error_px, counts, place);
        tallies.beyond += u64::from(counts && error_px > self.tolerance_px);
    }

    fn angle_bin(&self, point: DVec3, at: &Projected) -> usize {
        let squared_cosine = self.projection.squared_cosine(point, at);
        self.bin_ends.iter().filter(|&&end| squared_cosine <= end).count()
    }
}

/// The box around a triangle, world metres.
fn bounds(field: &Field, triangle: &Triangle, fraction_bits: u32) -> Aabb {
    let [a, b, c] = triangle.each_ref().map(|corner| surface::world(field, corner, fraction_bits));
    Aabb { min: a.min(b).min(c), max: a.max(b).max(c) }
}

/// Returns true if a triangle counts a sample inside it or on its border.
///
/// Of all triangles around a sample, that one holds the sample moved by (ε, ε²) towards the inside of the field, for an
/// infinitely small ε. Corners have `fraction_bits` fraction bits.
pub(super) fn owns(triangle: &Triangle, fraction_bits: u32, [x, z]: [i32; 2], last: [i32; 2]) -> bool {
    let towards = [if x < last[0] { 1 } else { -1 }, if z < last[1] { 1 } else { -1 }];
    let [a, b, c] = *triangle;
    let sample = Corner { x: x << fraction_bits, z: z << fraction_bits, y: 0.0 };
    [[sample, b, c], [sample, c, a], [sample, a, b]].iter().all(|side| {
        let [_, p, q] = *side;
        // Growth of the side's doubled area with x and with z.
        let (along_x, along_z) = ((q.z - p.z) * towards[0], (p.x - q.x) * towards[1]);
        (doubled_area(side), along_x, along_z) > (0, 0, 0)
    })
}

#[cfg(test)]
mod tests;
