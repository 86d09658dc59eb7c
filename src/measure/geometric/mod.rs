//! Errors of the drawn triangles: vertical distances from the samples in metres, and distances on the screen in pixels.
//!
//! A sample with data is measured against each drawn triangle that contains it, if the drawn point above or below it is
//! in view. The screen error is the distance between the projections of both points, in f64. A sample before the near
//! plane is projected too; the error is infinite only if the sample lies at or behind the eye. The certified metric
//! covers such points ([`View::allowed_error`]).
//!
//! Statistics count each sample once, in the triangle to its south-east. At the field's last column or row it is the
//! triangle to its west or north. The choice is exact, in integers. Maxima take all triangles that contain the sample.
//! Where drawn terrain ends inside the field, samples on its south and east border have no such triangle, and affect
//! maxima only.

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

/// Number of bins of the angle off the view axis, which is below 90° in a perspective picture.
pub const ANGLES: usize = 9;
/// Width of a bin, degrees.
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
    /// Number of samples counted.
    pub samples: u64,
    /// Vertical distance between a sample and the drawn surface, metres.
    pub vertical_m: Summary,
    /// Distance of these two points on the screen, pixels.
    pub screen_px: Summary,
    /// Share of the samples whose screen error is at most the view's tolerance, 0 to 1; 1 without samples.
    pub bound_kept: f64,
    /// Number of samples on silhouettes.
    pub silhouette_samples: u64,
    /// Screen error of samples on silhouettes, pixels. A sample is on a silhouette if, of the four triangles that it
    /// forms with one neighbour along x and one along z, some face the eye and others do not.
    pub silhouette_px: Summary,
    /// Number of samples by the angle of the drawn point off the view axis. Bin k spans [`ANGLE_DEG`]·k to
    /// [`ANGLE_DEG`]·(k + 1). All samples of an orthographic view are in bin 0.
    pub off_axis_samples: [u64; ANGLES],
    /// Screen error divided by the view's tolerance, in the same bins.
    pub off_axis: [Summary; ANGLES],
    /// Sample with the largest vertical error; `None` if no sample in view has an error above 0.
    pub vertical_at: Option<Place>,
    /// Sample with the largest screen error; `None` as above.
    pub screen_at: Option<Place>,
}

/// Measures the triangles of a draw list. In a cave, triangles that face down are compared with the ceiling.
///
/// The time is linear in triangles and samples. Each of up to 64 parallel parts stores at most a few thousandths of the
/// field's samples.
pub fn errors(field: &Field, view: &View, resident: &Geometry, list: &DrawList) -> Errors {
    let ruler = Ruler::new(field, view, list.fraction_bits);
    let mut total = ruler.tallies();
    each_part(list, |part| ruler.part(resident, list, part), |part| total.merge(part));
    total.errors(view.tolerance.px)
}

/// Statistics of the samples so far.
struct Tallies {
    vertical: Tally,
    screen: Tally,
    /// Number of samples whose screen error exceeds the tolerance.
    beyond: u64,
    silhouette: Tally,
    /// Screen errors by the angle off the view axis.
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

/// Measures triangles in one view.
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
    /// Squared cosines of the angles at which bins end, but the last one.
    bin_ends: [f64; ANGLES - 1],
}

/// The samples that triangles are compared with: those of the floor or of the ceiling.
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

    /// Measures the triangles of a part of the list.
    fn part(&self, resident: &Geometry, list: &DrawList, part: &Draw) -> Tallies {
        let mut tallies = self.tallies();
        expand::visit_draw(self.field, &self.frame, resident, list, part, &mut |triangle: &Drawn| {
            let truth = self.ceiling.as_ref().filter(|_| doubled_area(&triangle.corners) < 0).unwrap_or(&self.floor);
            self.triangle(truth, &facing_up(&triangle.corners), &mut tallies);
        });
        tallies
    }

    /// Measures the samples in a triangle.
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

    /// Adds a sample, whose drawn point is at `at` on the screen. `counts` is true if this triangle counts the sample.
    fn sample(&self, place: Place, at: &Projected, counts: bool, tallies: &mut Tallies) {
        let error_px = self.projection.distance_px(at, place.truth);
        tallies.vertical.add((place.drawn.y - place.truth.y).abs(), counts, place);
        tallies.screen.add(error_px, counts, place);
        tallies.off_axis[self.angle_bin(place.drawn, at)].add(error_px, counts, place);
        tallies.beyond += u64::from(counts && error_px > self.tolerance_px);
    }

    /// Returns the bin of a point's angle off the view axis.
    fn angle_bin(&self, point: DVec3, at: &Projected) -> usize {
        let squared_cosine = self.projection.squared_cosine(point, at);
        self.bin_ends.iter().filter(|&&end| squared_cosine <= end).count()
    }
}

/// Returns the bounding box of a triangle, world metres.
fn bounds(field: &Field, triangle: &Triangle, fraction_bits: u32) -> Aabb {
    let [a, b, c] = triangle.each_ref().map(|corner| surface::world(field, corner, fraction_bits));
    Aabb { min: a.min(b).min(c), max: a.max(b).max(c) }
}

/// Returns true if a triangle counts the sample (x, z), which lies inside it or on its border.
///
/// Of all triangles that contain a sample, the one counts it that also contains the sample moved by (ε, ε²) for an
/// infinitely small ε: to the south-east, or towards the inside of the field at its last column and row (`last`).
/// Positions of corners have `fraction_bits` fraction bits.
pub(super) fn owns(triangle: &Triangle, fraction_bits: u32, [x, z]: [i32; 2], last: [i32; 2]) -> bool {
    let towards = [if x < last[0] { 1 } else { -1 }, if z < last[1] { 1 } else { -1 }];
    let [a, b, c] = *triangle;
    let sample = Corner { x: x << fraction_bits, z: z << fraction_bits, y: 0.0 };
    [[sample, b, c], [sample, c, a], [sample, a, b]].iter().all(|side| {
        let [_, p, q] = *side;
        // Derivatives of the doubled area with respect to x and z of the sample.
        let (along_x, along_z) = ((q.z - p.z) * towards[0], (p.x - q.x) * towards[1]);
        (doubled_area(side), along_x, along_z) > (0, 0, 0)
    })
}

#[cfg(test)]
mod tests;
