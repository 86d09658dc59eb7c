//! Measures popping: how far the surface moves on the screen between two frames due to the change of level of detail
//! alone.
//!
//! The draw lists of frames t − 1 and t give two surfaces, each as drawn for its own view, morphing included. Both are
//! projected with the view of frame t, so that the motion of the camera has no effect. A sample with data counts once,
//! if both surfaces cover it and its point on the newer one is in view. Its displacement is the distance between its
//! two points on the screen, in f64 as in [`geometric`](super::geometric).

use std::sync::atomic::{AtomicU64, Ordering};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::extended::{self, Extended};
use super::geometric::owns;
use super::histogram::Histogram;
use super::projection::Projection;
use super::summary::{Place, Tally};
use super::{each_part, facing_up};
use crate::draw::layout::Frame;
use crate::draw::{Draw, DrawList, Geometry, expand};
use crate::height::Field;
use crate::height::surface;
use crate::view::View;

/// Range of the histogram's bin ends, powers of two: from 1/64 px, which is invisible, to 64 px.
const BINS: [i32; 2] = [-6, 6];

/// A drawn frame. Techniques may change their resident geometry from frame to frame; the earlier state then needs a
/// copy.
#[derive(Clone, Copy, Debug)]
pub struct State<'a> {
    /// View that the list was made for.
    pub view: &'a View,
    /// Resident geometry of the technique in this frame.
    pub resident: &'a Geometry,
    /// Draw list of this frame.
    pub list: &'a DrawList,
}

/// Displacement of the surface on the screen when the level of detail changes.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Pop {
    /// 99th percentile over samples, pixels: the largest of any frame.
    #[serde(with = "extended")]
    #[schemars(with = "Extended")]
    pub p99_px: f64,
    /// 99.9th percentile over samples, pixels: the largest of any frame.
    #[serde(with = "extended", default)]
    #[schemars(with = "Extended")]
    pub p999_px: f64,
    /// Largest displacement, pixels.
    #[serde(with = "extended")]
    #[schemars(with = "Extended")]
    pub max_px: f64,
    /// Number of samples by displacement, pixels.
    pub histogram: Histogram,
}

impl Pop {
    /// Adds the displacements of another frame.
    pub fn merge(&mut self, frame: &Pop) {
        self.histogram.merge(&frame.histogram);
        self.p99_px = self.p99_px.max(frame.p99_px);
        self.p999_px = self.p999_px.max(frame.p999_px);
        self.max_px = self.max_px.max(frame.max_px);
    }
}

/// Measures the displacement from the surface of frame t − 1 to that of frame t, in the view of frame t. Needs eight
/// bytes per sample of the field.
pub fn pop(field: &Field, before: State, after: State) -> Pop {
    let meter = Meter { field, projection: Projection::new(after.view) };
    let heights = meter.heights(before);
    let (mut tally, mut histogram) = meter.empty();
    let work = |part: &Draw| meter.part(&heights, after, part);
    each_part(after.list, work, |(part_tally, part_histogram)| {
        tally.merge(part_tally);
        histogram.merge(&part_histogram);
    });
    Pop { p99_px: tally.quantile(), p999_px: tally.quantile_above(1000), max_px: tally.largest, histogram }
}

/// Measures displacements in the view of the newer frame.
struct Meter<'a> {
    field: &'a Field,
    projection: Projection,
}

impl Meter<'_> {
    fn empty(&self) -> (Tally, Histogram) {
        let [w, h] = self.field.size().map(u64::from);
        (Tally::new(w * h, 100), Histogram::new(BINS[0], BINS[1]))
    }

    fn index(&self, x: u32, z: u32) -> usize {
        z as usize * self.field.size()[0] as usize + x as usize
    }

    /// Calls `visit` for every sample that the triangles of a part count ([`owns`]), with the drawn height, metres.
    fn samples(&self, state: State, part: &Draw, mut visit: impl FnMut(u32, u32, f64)) {
        let last = self.field.size().map(|n| n as i32 - 1);
        let frame = Frame::placing(self.field, state.view);
        expand::visit_draw(self.field, &frame, state.resident, state.list, part, &mut |drawn| {
            let (triangle, bits) = (facing_up(&drawn.corners), state.list.fraction_bits);
            surface::visit_samples_between(&triangle, bits, |x, z, y| {
                if owns(&triangle, bits, [x as i32, z as i32], last) && !self.field.is_hole(x, z) {
                    visit(x, z, y);
                }
            });
        });
    }

    /// Returns the bits of the drawn height at every sample, NaN where nothing is drawn. Each sample is counted by one
    /// triangle, so threads never write the same element.
    fn heights(&self, state: State) -> Vec<AtomicU64> {
        let [w, h] = self.field.size().map(|n| n as usize);
        let heights: Vec<_> = (0..w * h).map(|_| AtomicU64::new(f64::NAN.to_bits())).collect();
        let store = |x, z, y: f64| heights[self.index(x, z)].store(y.to_bits(), Ordering::Relaxed);
        each_part(state.list, |part| self.samples(state, part, store), |()| ());
        heights
    }

    /// Measures the samples of a part of the newer list. `before` are the heights in the earlier frame.
    fn part(&self, before: &[AtomicU64], after: State, part: &Draw) -> (Tally, Histogram) {
        let (mut tally, mut histogram) = self.empty();
        self.samples(after, part, |x, z, y| {
            let old = f64::from_bits(before[self.index(x, z)].load(Ordering::Relaxed));
            let [from, to] = [old, y].map(|y| self.field.world_at(x.into(), z.into(), y));
            if !old.is_nan()
                && let Some(at) = self.projection.project_seen(to)
            {
                let moved_px = self.projection.distance_px(&at, from);
                tally.add(moved_px, true, Place { sample: [x, z], truth: from, drawn: to });
                histogram.add(moved_px);
            }
        });
        (tally, histogram)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::{ExplicitVertex, Instance, Source, Topology};
    use crate::height::{Holes, Samples};
    use crate::view::{Lens, Metric, Tolerance};
    use glam::DVec3;

    const SIDE: i32 = 40;

    fn field() -> Field {
        let count = ((SIDE + 1) * (SIDE + 1)) as usize;
        let mut holes = Holes::none(count);
        holes.insert(100);
        Field::new(Samples::F32(vec![0.0; count]), [SIDE as u32 + 1; 2], [2.0, 2.0], holes)
    }

    /// A level slab from column 0 to `east`.
    fn slab(east: i32, height: f32) -> DrawList {
        let vertex = |position| ExplicitVertex { position, height, ..ExplicitVertex::default() };
        let mut list = DrawList { instances: vec![Instance::default()], ..DrawList::default() };
        list.streamed.vertices = [[0, 0], [0, SIDE], [east, 0], [east, SIDE]].map(vertex).to_vec();
        list.streamed.indices = vec![0, 1, 2, 2, 1, 3];
        list.draws.push(Draw {
            source: Source::Streamed,
            topology: Topology::Triangles,
            indices: 0..6,
            instances: 0..1,
            first_vertex: 0,
        });
        list
    }

    /// All of the field from a slanted orthographic eye: 0.5 px a metre.
    fn view() -> View {
        View {
            eye: DVec3::new(40.0, 500.0, 500.0),
            world_from_eye: View::turned(-90.0, -45.0, 0.0),
            lens: Lens::Orthographic { width: 1280.0, far: 1e4 },
            size: [640, 640],
            near: 1.0,
            tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
            time_s: 0.0,
        }
    }

    fn jump(before: &DrawList, after: &DrawList) -> Pop {
        let resident = Geometry::default();
        let view = view();
        let state = |list| State { view: &view, resident: &resident, list };
        pop(&field(), state(before), state(after))
    }

    /// Returns the number of samples compared.
    fn total(pop: &Pop) -> u64 {
        pop.histogram.bins.iter().map(|bin| bin.count).sum()
    }

    #[test]
    fn a_slab_that_rises_moves_every_sample_alike() {
        let found = jump(&slab(SIDE, 3.0), &slab(SIDE, 11.0));
        // 8 m at 0.5 px a metre, seen from 45° above.
        let expected = 4.0 * 0.5f64.sqrt();
        assert_eq!(total(&found), 41 * 41 - 1, "all but the hole");
        assert!((found.max_px - expected).abs() < 1e-9 && (found.p99_px - expected).abs() < 1e-9, "{found:?}");
        let full = found.histogram.bins.iter().find(|bin| bin.count == total(&found)).unwrap();
        assert_eq!((full.from, full.to), (2.0, 4.0), "2.83 px");
    }

    #[test]
    fn nothing_moves_between_equal_states_whatever_the_way_they_are_split() {
        let mut split = slab(SIDE, 3.0);
        let middle = ExplicitVertex { position: [10, 10], height: 3.0, ..ExplicitVertex::default() };
        split.streamed.vertices.push(middle);
        split.streamed.indices = vec![0, 1, 4, 1, 2, 4, 2, 0, 4, 2, 1, 3];
        split.draws[0].indices = 0..12;
        for after in [slab(SIDE, 3.0), split] {
            let found = jump(&slab(SIDE, 3.0), &after);
            assert_eq!((total(&found), found.histogram.bins[0].count), (1680, 1680));
            assert!(found.max_px < 1e-9, "{found:?}");
        }
    }

    #[test]
    fn only_terrain_drawn_in_both_counts() {
        // Columns 0 to 9 and 0 to 19: the east side of the smaller one belongs to nobody.
        let found = jump(&slab(10, 3.0), &slab(20, 4.0));
        assert_eq!(total(&found), 10 * 41, "columns 0 to 9");
    }

    #[test]
    fn a_jump_of_a_few_samples_is_in_the_largest_but_not_in_p99() {
        let mut after = slab(SIDE, 3.0);
        let corner = |position, height| ExplicitVertex { position, height, ..ExplicitVertex::default() };
        // A spike of 100 m on a triangle of one cell at the corner.
        after.streamed.vertices.extend([corner([0, 0], 103.0), corner([0, 1], 3.0), corner([1, 0], 3.0)]);
        after.streamed.indices = vec![4, 5, 6, 5, 1, 2, 6, 5, 2, 2, 1, 3];
        after.draws[0].indices = 0..12;
        let found = jump(&slab(SIDE, 3.0), &after);
        assert!((found.max_px - 50.0 * 0.5f64.sqrt()).abs() < 1e-9 && found.p99_px < 1e-9, "{found:?}");
        assert!(found.p999_px >= found.p99_px && found.p999_px <= found.max_px, "{found:?}");
    }
}
