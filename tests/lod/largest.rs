//! Fields as large as lattice coordinates allow, in which the last pages and blocks extend beyond them.

use std::sync::Arc;

use cuesta::internal::draw::layout::Frame;
use cuesta::internal::draw::{DrawList, expand};
use cuesta::internal::height::synth::{Kind, synth};
use cuesta::internal::height::{Field, MAX_SIDE};
use cuesta::internal::lod::{self, Settings};
use cuesta::internal::view::{Lens, Metric, Tolerance, View};
use glam::DVec3;

/// Returns views near the last corner, out of the field, down and into it, near the first corner, and over the middle.
fn views(field: &Field) -> Vec<View> {
    let last = field.size().map(|n| f64::from(n - 1));
    let at = |share: f64, above_m: f64| {
        let [i, j] = last.map(|n| (share * n) as u32);
        field.world(i, j) + DVec3::Y * above_m
    };
    let view = |eye: DVec3, yaw: f64, pitch: f64| View {
        eye,
        world_from_eye: View::turned(yaw, pitch, 0.0),
        lens: Lens::Perspective { fov_x: 1.0 },
        size: [320, 200],
        near: 0.1,
        tolerance: Tolerance { px: 4.0, metric: Metric::Certified },
        time_s: 0.0,
    };
    vec![
        view(at(1.0, 3.0), 45.0, -10.0),
        view(at(1.0, 90.0), 225.0, -80.0),
        view(at(1.0, 3.0), 225.0, -10.0),
        view(at(0.0, 3.0), 45.0, -10.0),
        view(at(0.5, 50.0), 10.0, -89.0),
    ]
}

#[test]
fn techniques_draw_or_reject_largest_fields() {
    let mut drawn = 0;
    let long = |size: [u32; 2], sides: [u32; 2]| {
        let tiles = [0, 1].map(|k| sides[k] / size[k]);
        Arc::new(synth(Kind::Fractal, size, 5).tiled(tiles))
    };
    let fields = [
        long([64, 64], [MAX_SIDE; 2]),
        // The field's end cuts the last block.
        long([63, 61], [MAX_SIDE; 2]),
        long([64, 32], [MAX_SIDE, 32]),
        long([32, 64], [32, MAX_SIDE]),
        // Maximum size for sorted strips.
        long([64, 64], [1 << 22; 2]),
    ];
    for field in fields {
        let forms = [
            ("sorted-strips", "level", "certified"),
            ("sorted-strips", "level", "uniform"),
            ("clusters", "morph", "off"),
            ("clusters", "morph", "on"),
            ("clusters", "morph", "distance"),
            ("clusters", "seams", "skirts"),
            ("brute-force", "", ""),
            ("geomipmap", "morph", "on"),
            ("smooth-tiles", "morph", "on"),
            ("sphere-tree", "morph", "on"),
        ];
        for (name, key, word) in forms {
            let entry = lod::find(name).expect("in the table");
            let choices: Vec<_> = (!key.is_empty()).then(|| (key.to_owned(), word.to_owned())).into_iter().collect();
            let settings = Settings::new(entry, None, &choices).expect("the table's own values");
            // Techniques that visit all samples reject these fields.
            let Ok(mut technique) = entry.prepare(&field, &settings) else { continue };
            // Strips take seconds if much terrain is visible.
            let views = views(&field);
            let views = if name == "sorted-strips" { &views[..2] } else { &views };
            for (k, view) in views.iter().enumerate() {
                let mut list = DrawList::default();
                technique.select(view, &mut list);
                assert!(technique.limits().hold(&list.size()), "{name} {key}={word}, view {k}");
                let place = format!("{name} {key}={word}, {:?}, view {k}", field.size());
                assert!(!list.draws.is_empty() || k == 0, "{place}: nothing is drawn");
                let last = field.size().map(|n| n as i32 - 1);
                expand::visit_triangles(&field, &Frame::placing(&field, view), technique.resident(), &list, |drawn| {
                    for corner in drawn.corners {
                        let is_inside = [corner.x, corner.z].iter().zip(last).all(|(n, last)| (0..=last).contains(n));
                        assert!(is_inside && corner.y.is_finite(), "{place}: {corner:?}");
                    }
                });
            }
            drawn += 1;
        }
    }
    assert!(drawn >= 18, "{drawn} forms");
}
