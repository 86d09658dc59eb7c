//! Counts triangles by visibility and by size on the screen.
//!
//! The size of a triangle is the exact area of its projection, clipped to the picture. Parts that other terrain hides
//! are not subtracted. Triangles that are hidden as a whole are counted ([`Depths`]).

use glam::DVec4;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::each_part;
use super::extended;
use super::hidden::Depths;
use super::histogram::Histogram;
use crate::draw::expand;
use crate::draw::layout::Frame;
use crate::draw::{Draw, DrawList, Geometry};
use crate::height::Field;
use crate::height::surface::{self, Triangle};
use crate::view::View;

/// Range of the histogram's bin ends, powers of two: from 1/256 px² to more than the area of any picture.
const BINS: [i32; 2] = [-8, 24];

/// Shares of small and hidden triangles, and overdraw.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[schemars(transform = extended::non_negative)]
pub struct Economy {
    /// Triangles in view by their area on the screen, pixels.
    pub pixels_per_triangle: Histogram,
    /// Share of the triangles in view that terrain in front hides, 0 to 1.
    #[serde(default)]
    pub hidden_share: f64,
    /// Share of the triangles in view whose area is below one pixel, 0 to 1.
    pub subpixel_share: f64,
    /// Fragment shader invocations per covered pixel, by pipeline statistics. Software devices count whole blocks of
    /// pixels.
    pub overdraw: Option<f64>,
    /// Fragments that passed the depth test per covered pixel; 1 if no pixel is drawn twice.
    #[serde(default)]
    pub passed: Option<f64>,
}

impl Economy {
    /// Computes the shares of these triangles.
    ///
    /// `fragments` are the fragment shader invocations and the fragments that passed the depth test; `None` where the
    /// device does not count them. `covered` is the number of pixels that the triangles cover.
    pub fn new(triangles: &Triangles, fragments: [Option<u64>; 2], covered: u64) -> Self {
        let share = |count: u64| count as f64 / triangles.shown.max(1) as f64;
        let per_pixel = |fragments: u64| (covered > 0).then(|| fragments as f64 / covered as f64);
        let [overdraw, passed] = fragments.map(|count| count.and_then(per_pixel));
        Self {
            pixels_per_triangle: triangles.sizes_px.clone(),
            hidden_share: share(triangles.hidden),
            subpixel_share: share(triangles.sub_pixel()),
            overdraw,
            passed,
        }
    }
}

/// Counts of the triangles of one or several frames.
#[derive(Clone, Debug, PartialEq)]
pub struct Triangles {
    /// Triangles submitted.
    pub submitted: u64,
    /// Of these, triangles without area in plan view.
    pub degenerate: u64,
    /// Triangles wholly outside the picture.
    pub outside: u64,
    /// Triangles at least partly in the picture that face away from the eye or are seen edge-on.
    pub facing_away: u64,
    /// Triangles at least partly in the picture that face the eye.
    pub shown: u64,
    /// Of the shown triangles, those that terrain in front hides.
    pub hidden: u64,
    /// Total area of the shown triangles in the picture, pixels.
    pub area_px: f64,
    /// Shown triangles by their area in the picture, pixels. Bins end at 2^−8 to 2^24.
    pub sizes_px: Histogram,
}

/// Counts the triangles of a draw list. `depth` is the depth buffer after drawing it: reversed, row by row from the
/// top.
pub fn triangles(field: &Field, view: &View, resident: &Geometry, list: &DrawList, depth: &[f32]) -> Triangles {
    let screen = Screen::new(field, view, depth);
    let mut total = Triangles::default();
    each_part(list, |part| screen.part(resident, list, part), |part| total.merge(&part));
    total.submitted = list.triangles();
    total.degenerate = total.submitted - total.outside - total.facing_away - total.shown;
    total
}

impl Default for Triangles {
    fn default() -> Self {
        Self {
            submitted: 0,
            degenerate: 0,
            outside: 0,
            facing_away: 0,
            shown: 0,
            hidden: 0,
            area_px: 0.0,
            sizes_px: Histogram::new(BINS[0], BINS[1]),
        }
    }
}

impl Triangles {
    /// Returns the number of shown triangles with an area below 1 px².
    pub fn sub_pixel(&self) -> u64 {
        self.sizes_px.bins.iter().filter(|bin| bin.from < 1.0).map(|bin| bin.count).sum()
    }

    /// Adds the counts of another frame.
    pub fn merge(&mut self, part: &Triangles) {
        self.submitted += part.submitted;
        self.degenerate += part.degenerate;
        self.outside += part.outside;
        self.facing_away += part.facing_away;
        self.shown += part.shown;
        self.hidden += part.hidden;
        self.area_px += part.area_px;
        self.sizes_px.merge(&part.sizes_px);
    }

    /// Counts a triangle by its signed area in the picture, pixels, and true if it is hidden; `None` if it lies
    /// outside.
    fn add(&mut self, seen: Option<(f64, bool)>) {
        match seen {
            None => self.outside += 1,
            Some((area, is_hidden)) if area > 0.0 => {
                self.shown += 1;
                self.hidden += u64::from(is_hidden);
                self.area_px += area;
                self.sizes_px.add(area);
            }
            Some(_) => self.facing_away += 1,
        }
    }
}

/// Projects the triangles of one view and tests whether they are hidden.
struct Screen<'a> {
    field: &'a Field,
    view: &'a View,
    frame: Frame,
    depths: Depths<'a>,
    clip_from_relative: glam::DMat4,
}

impl<'a> Screen<'a> {
    fn new(field: &'a Field, view: &'a View, depth: &'a [f32]) -> Self {
        let (frame, clip_from_relative) = (Frame::placing(field, view), view.clip_from_relative());
        Self { field, view, frame, depths: Depths { size: view.size, values: depth }, clip_from_relative }
    }

    fn part(&self, resident: &Geometry, list: &DrawList, part: &Draw) -> Triangles {
        let mut found = Triangles::default();
        expand::visit_draw(self.field, &self.frame, resident, list, part, &mut |triangle| {
            found.add(self.seen(&triangle.corners, list.fraction_bits));
        });
        found
    }

    /// Returns the area of a triangle in the picture, pixels, negative if it faces away, and true if it is hidden.
    /// `None` if it lies outside.
    fn seen(&self, triangle: &Triangle, fraction_bits: u32) -> Option<(f64, bool)> {
        let corners = triangle.each_ref().map(|corner| {
            let point = surface::world(self.field, corner, fraction_bits);
            self.clip_from_relative * (point - self.view.eye).extend(1.0)
        });
        let [w, h] = self.view.size.map(f64::from);
        // The picture is two units of clip space wide and high. Triangles that face the eye have a negative area there.
        clipped(corners).map(|polygon| (-signed_area(&polygon) * w * h / 4.0, self.depths.hide(&polygon)))
    }
}

/// Signed distances of a point of clip space from the sides, the near and the far plane; positive inside (reversed
/// depth).
fn inside(p: DVec4) -> [f64; 6] {
    [p.w - p.x, p.w + p.x, p.w - p.y, p.w + p.y, p.w - p.z, p.z]
}

/// Returns the part of a triangle that lies in the picture, by clipping in homogeneous coordinates (Sutherland and
/// Hodgman 1974); `None` if it lies outside.
fn clipped(corners: [DVec4; 3]) -> Option<Vec<DVec4>> {
    let inner = corners.map(inside);
    if (0..6).any(|plane| inner.iter().all(|corner| corner[plane] <= 0.0)) {
        return None;
    }
    let mut polygon = corners.to_vec();
    for plane in (0..6).filter(|&plane| inner.iter().any(|corner| corner[plane] < 0.0)) {
        polygon = cut(&polygon, plane);
    }
    (polygon.len() >= 3).then_some(polygon)
}

/// Returns the part of a polygon on the inner side of a clipping plane, one of those of [`inside`].
fn cut(polygon: &[DVec4], plane: usize) -> Vec<DVec4> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (k, &to) in polygon.iter().enumerate() {
        let from = polygon[(k + polygon.len() - 1) % polygon.len()];
        let [a, b] = [from, to].map(|p| inside(p)[plane]);
        if (a < 0.0) != (b < 0.0) {
            kept.push(from + (to - from) * (a / (a - b)));
        }
        if b >= 0.0 {
            kept.push(to);
        }
    }
    kept
}

/// Returns the area of a polygon after division by w. It is positive if the corners run anticlockwise with y up.
fn signed_area(polygon: &[DVec4]) -> f64 {
    let flat = |p: DVec4| [p.x / p.w, p.y / p.w];
    let origin = flat(polygon[0]);
    let from_origin = |p: &DVec4| [flat(*p)[0] - origin[0], flat(*p)[1] - origin[1]];
    let cross = |[a, b]: &[DVec4; 2]| {
        let ([ax, ay], [bx, by]) = (from_origin(a), from_origin(b));
        ax * by - ay * bx
    };
    polygon.array_windows().map(cross).sum::<f64>() / 2.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::{ExplicitVertex, Instance, Source, Topology};
    use crate::height::{Holes, Samples};
    use crate::view::{Lens, Metric, Tolerance};
    use glam::DVec3;

    const SIDE: i32 = 64;

    fn field() -> Field {
        let count = ((SIDE + 1) * (SIDE + 1)) as usize;
        Field::new(Samples::F32(vec![0.0; count]), [SIDE as u32 + 1; 2], [1.0, 1.0], Holes::none(count))
    }

    fn list(corners: &[([i32; 2], f32)]) -> DrawList {
        let vertex = |&(position, height): &([i32; 2], f32)| ExplicitVertex { position, height, ..Default::default() };
        let mut list = DrawList { instances: vec![Instance::default()], ..DrawList::default() };
        list.streamed.vertices = corners.iter().map(vertex).collect();
        list.streamed.indices = (0..corners.len() as u32).collect();
        list.draws.push(Draw {
            source: Source::Streamed,
            topology: Topology::Triangles,
            indices: 0..corners.len() as u32,
            instances: 0..1,
            first_vertex: 0,
        });
        list
    }

    /// From straight above, 4 px a metre: `width` metres around (x, z).
    fn above(x: f64, z: f64, width: u32) -> View {
        View {
            eye: DVec3::new(x, 100.0, z),
            world_from_eye: View::turned(-90.0, -90.0, 0.0),
            lens: Lens::Orthographic { width: f64::from(width), far: 1e3 },
            size: [4 * width, 4 * width],
            near: 1.0,
            tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
            time_s: 0.0,
        }
    }

    fn measure(view: &View, corners: &[([i32; 2], f32)]) -> Triangles {
        let nothing = vec![0.0; (view.size[0] * view.size[1]) as usize];
        triangles(&field(), view, &Geometry::default(), &list(corners), &nothing)
    }

    #[test]
    fn areas_are_exact_and_clipped_to_the_picture() {
        let half_field = [([0, 0], 0.0), ([0, SIDE], 0.0), ([SIDE, 0], 0.0)];
        let whole = measure(&above(32.0, 32.0, 100), &half_field);
        assert_eq!((whole.submitted, whole.shown, whole.outside, whole.facing_away), (1, 1, 0, 0));
        assert!((whole.area_px - 64.0 * 64.0 / 2.0 * 16.0).abs() < 1e-6, "{whole:?}");
        // A window of 8 m whose upper left half lies on the triangle.
        let part = measure(&above(32.0, 32.0, 8), &half_field);
        assert!((part.area_px - 8.0 * 8.0 / 2.0 * 16.0).abs() < 1e-6, "{part:?}");
        assert_eq!(part.sizes_px.bins.iter().find(|bin| bin.count == 1).unwrap().from, 512.0);
        assert_eq!(measure(&above(60.0, 60.0, 4), &half_field).outside, 1);
    }

    #[test]
    fn what_faces_away_or_has_no_area_shows_nothing() {
        let corners = [
            ([0, 0], 0.0),
            ([8, 0], 0.0),
            ([0, 8], 0.0), // Turned over.
            ([3, 3], 0.0),
            ([3, 3], 0.0),
            ([9, 9], 1.0), // Degenerate in plan.
            ([20, 20], 0.0),
            ([20, 21], 0.0),
            ([21, 20], 0.0), // 8 px².
        ];
        let found = measure(&above(32.0, 32.0, 100), &corners);
        assert_eq!([found.submitted, found.degenerate, found.facing_away, found.shown, found.outside], [3, 1, 1, 1, 0]);
        // From below everything is the other way round.
        let mut below = above(32.0, 32.0, 100);
        below.eye.y = -100.0;
        below.world_from_eye = View::turned(-90.0, 90.0, 0.0);
        let found = measure(&below, &corners);
        assert_eq!([found.facing_away, found.shown], [1, 1]);
        assert!((found.area_px - 32.0 * 16.0).abs() < 1e-9);
    }

    #[test]
    fn a_triangle_through_the_near_plane_is_cut_there() {
        let mut view = above(32.0, 32.0, 100);
        (view.lens, view.size) = (Lens::Perspective { fov_x: 2.0 }, [100, 100]);
        (view.eye, view.world_from_eye) = (DVec3::new(32.0, 5.0, 32.0), View::turned(-90.0, 0.0, 0.0));
        let (a, b, c, d) = (([0, 0], 0.0), ([0, SIDE], 0.0), ([SIDE, 0], 0.0), ([SIDE, SIDE], 0.0));
        let found = measure(&view, &[a, b, c, c, b, d]);
        // A floor 5 m below, 32 m to each side: it ends below the horizon, and further away than where 32 m are
        // half the picture it leaves a corner open on each side.
        let focal = view.focal_px();
        let below_horizon = |distance: f64| focal * 5.0 / distance;
        let corner = (50.0 - focal) * (below_horizon(32.0 * focal / 50.0) - below_horizon(32.0)) / 2.0;
        let expected = 100.0 * (50.0 - below_horizon(32.0)) - 2.0 * corner;
        assert!((found.area_px - expected).abs() < 1e-6, "{found:?}, expected {expected}");
    }

    /// Triangles of the size of a pixel and below, in a picture that covers them all: their areas add up, and their
    /// share is counted.
    #[test]
    fn sub_pixel_triangles_are_counted() {
        let cell = |x: i32, size: i32| [([x, 0], 0.0), ([x, size], 0.0), ([x + size, 0], 0.0)];
        let corners: Vec<_> = [cell(0, 1), cell(2, 2), cell(6, 1), cell(8, 4)].concat();
        let mut view = above(32.0, 32.0, 100);
        // 1 px a metre: areas 1/2, 2, 1/2 and 8 px².
        view.size = [100, 100];
        let found = measure(&view, &corners);
        assert_eq!((found.shown, found.sub_pixel()), (4, 2));
        assert!((found.area_px - 11.0).abs() < 1e-9);
    }

    /// A roof 10 m above half of the floor: from above it hides what lies under it, and nothing else.
    #[test]
    fn what_lies_behind_what_was_drawn_is_hidden() {
        let half = |x: i32, y: f32| {
            [([x, 0], y), ([x, SIDE], y), ([x + 32, 0], y), ([x + 32, 0], y), ([x, SIDE], y), ([x + 32, SIDE], y)]
        };
        let corners = [half(0, 0.0), half(32, 0.0), half(32, 10.0)].concat();
        let view = above(32.0, 32.0, 64);
        let depth_of = |y: f64| (1e3 - (100.0 - y)) / (1e3 - 1.0);
        let [w, h] = view.size;
        let drawn = |k: u32| if k % w >= w / 2 { depth_of(10.0) as f32 } else { depth_of(0.0) as f32 };
        let depth: Vec<f32> = (0..w * h).map(drawn).collect();
        let found = triangles(&field(), &view, &Geometry::default(), &list(&corners), &depth);
        assert_eq!((found.shown, found.hidden), (6, 2));
        assert_eq!(measure(&view, &corners).hidden, 0);
    }

    #[test]
    fn overdraw_is_a_ratio() {
        let of = |fragments, covered| Economy::new(&Triangles::default(), fragments, covered);
        assert_eq!(of([Some(300), None], 200).overdraw, Some(1.5));
        assert_eq!(of([None, Some(200)], 200).passed, Some(1.0));
        assert_eq!(of([Some(0), None], 0).overdraw, None);
    }
}
