//! Slabs over small fields, where every number can be had another way.

use super::*;
use crate::draw::{ExplicitVertex, Instance, Source, Topology};
use crate::height::{Holes, Samples};
use crate::measure::in_view;
use crate::view::{Lens, Metric, Tolerance, View};

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
        first_vertex: 0,
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
        time_s: 0.0,
    }
}

#[test]
fn every_sample_counts_once_and_the_summary_is_exact() {
    let (field, list) = slab([61, 47]);
    let view = from_above(1000.0);
    let measured = errors(&field, &view, &Geometry::default(), &list);
    let mut expected: Vec<f64> = (0..61 * 47).map(|k| (20.0 - f64::from(field.samples().height(k))).abs()).collect();
    expected.sort_by(f64::total_cmp);
    let n = expected.len();
    let rms = (expected.iter().map(|e| e * e).sum::<f64>() / n as f64).sqrt();
    assert_eq!(measured.samples, n as u64);
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
    assert_eq!(measured.samples, seen as u64);
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
    assert!(measured.samples > 0 && measured.screen_px.max.is_finite(), "{measured:?}");
}
