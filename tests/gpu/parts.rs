//! Tests of frames drawn in parts, each submitted while the next one is selected: the image must be the same to the
//! bit.

use cuesta::internal::bench::paths;
use cuesta::internal::draw::DrawList;
use cuesta::internal::draw::expand;
use cuesta::internal::draw::layout::Frame;
use cuesta::internal::scene::Copy;
use cuesta::internal::view::{Metric, Tolerance};

use super::painter::renderer;
use super::{mountains, on_device, technique};

const SIZE: [u32; 2] = [96, 64];

#[test]
fn a_frame_in_parts_gives_the_same_image() {
    on_device(|gpu| {
        let field = mountains();
        let tolerance = Tolerance { px: 0.5, metric: Metric::Certified };
        for order in ["order=front", "order=back", "order=painter"] {
            let mut drawn = ["parts=1", "parts=2", "parts=5"]
                .map(|parts| technique(&field, "sorted-strips", &["page=16", order, parts]));
            let (mut passes, mut terrain) = ([0; 3], 0);
            let mut stages = drawn.each_ref().map(|technique| renderer(gpu, &field, technique.as_ref(), SIZE));
            for view in paths::find("corner").unwrap().views(&field, 6, SIZE, tolerance) {
                let pictures = [0, 1, 2].map(|k| {
                    let times = stages[k].draw(drawn[k].as_mut(), &view, Copy::PictureAndDepth).unwrap();
                    let own = times.gpu.passes.iter().filter(|(name, _)| *name == "terrain").count();
                    assert!((1..=[1, 2, 5][k]).contains(&own), "{order}: one pass a part");
                    passes[k] += own;
                    (stages[k].picture(), stages[k].depth())
                });
                assert!(pictures.windows(2).all(|pair| pair[0] == pair[1]), "{order}");
                terrain += pictures[0].0.pixels().filter(|p| p.0[3] > 0).count();
            }
            assert!(terrain > 3000, "{order}: {terrain} pixels of terrain");
            // Views with few rows of pages have fewer parts.
            assert!(passes[0] == 6 && passes[1] > 9 && passes[2] > 15, "{order}: {passes:?}");
        }
    });
}

/// Finished parts do not change, and together they equal the list selected at once.
#[test]
fn finished_parts_are_a_prefix_of_the_whole_list() {
    let field = mountains();
    let tolerance = Tolerance { px: 0.5, metric: Metric::Certified };
    for (order, serial) in [("order=front", ""), ("order=painter", ""), ("order=front", ":serial")] {
        let name = format!("sorted-strips{serial}");
        let [mut whole, mut parts] =
            ["parts=1", "parts=4"].map(|parts| technique(&field, &name, &["page=16", order, parts]));
        let mut parts_in_all = 0;
        for view in paths::find("corner").unwrap().views(&field, 6, SIZE, tolerance) {
            let (mut list, mut in_parts, mut ready) = (DrawList::default(), DrawList::default(), Vec::new());
            whole.select(&view, &mut list);
            parts.select_in_parts(&view, &mut in_parts, &mut |list| ready.push(list.clone()));
            assert!(ready.len() < 4, "{order}");
            parts_in_all += ready.len() + 1;
            for begun in &ready {
                assert!(!begun.draws.is_empty() && begun.draws.len() < in_parts.draws.len());
                assert_eq!(begun.draws, in_parts.draws[..begun.draws.len()], "{order}");
                let [begun, all] = [begun, &in_parts].map(|list| list.streamed.indices.as_slice());
                assert_eq!(*begun, all[..begun.len()], "{order}");
            }
            let triangles = |list: &DrawList| -> Vec<_> {
                let frame = Frame::placing(&field, &view);
                let drawn = expand::triangles(&field, &frame, whole.resident(), list);
                drawn.iter().map(|t| t.corners.map(|c| (c.x, c.z, c.y.to_bits()))).collect()
            };
            assert!(triangles(&list) == triangles(&in_parts), "{order}: the same ones in the same order");
            if order == "order=front" {
                assert_eq!((&list.draws, &list.streamed.indices), (&in_parts.draws, &in_parts.streamed.indices));
            }
        }
        assert!(parts_in_all > 12, "{order}: {parts_in_all} parts");
    }
}
