//! Tests of the hole detection at the edge of an image.

use std::sync::Arc;

use cuesta::internal::height::synth;
use cuesta::internal::measure::picture::outline_radius;
use cuesta::internal::plan::{Look, ScenePlan};
use cuesta::internal::scene::Scene;
use cuesta::internal::scene::holes::Truth;
use cuesta::internal::view::{Lens, Tolerance, View};
use glam::DVec3;

use super::{aslant, on_device};

/// Seen from straight above, the terrain's edge is three pixels outside the image on one side and far outside on the
/// other. Within the tolerance an open pixel near the first edge may be outline; on the other side it is a hole.
#[test]
fn an_outline_just_outside_the_image_may_move_in() {
    on_device(|gpu| {
        let (field, look) = (Arc::new(synth::synth(synth::Kind::Fractal, [131, 97], 5)), Look::default());
        let (size, metres, outside) = ([64, 48], field.spacing[0], 3.0);
        let [x, z] = [outside + f64::from(size[0]) / 2.0, f64::from(field.size()[1]) / 2.0];
        let view = View {
            eye: field.world_at(0.0, z, 9000.0) + DVec3::new(x * metres, 0.0, 0.0),
            world_from_eye: View::looking_along(DVec3::NEG_Y),
            lens: Lens::Orthographic { width: f64::from(size[0]) * metres, far: 20_000.0 },
            ..aslant(&field, size, 1.0)
        };
        let plan = ScenePlan::builder(&field, &look, &gpu.device_limits()).build().unwrap();
        let scene = Scene { gpu, field: &field, plan: &plan, look: &look, overlay: None };
        let truth = Truth::new(&scene, &view).unwrap();
        assert!(truth.picture.pixels().all(|p| p.0[3] == 255), "terrain fills the image");
        let right = size[0] - 1;
        let open = |columns: &[u32]| {
            let mut picture = truth.picture.clone();
            columns.iter().for_each(|&x| picture.put_pixel(x, 20, image::Rgba([0; 4])));
            picture
        };
        let holes = |px: f64, columns: &[u32]| {
            let tolerance = Tolerance { px, ..view.tolerance };
            let row = 20 * size[0] as usize;
            let found = truth.hole_pixels(&scene, &View { tolerance, ..view }, &open(columns)).unwrap();
            found.into_iter().map(|k| (k - row) as u32).collect::<Vec<_>>()
        };
        assert_eq!(holes(1.0, &[0, 1, 20, right]), [0, 1, 20, right], "{} pixels do not reach", outline_radius(1.0));
        assert_eq!(holes(4.0, &[0, 1, 2, 20, right]), [2, 20, right]);
        assert_eq!(holes(15.0, &[0, 1, 20, right]), [20, right]);
        assert_eq!(holes(40.0, &[0, 20, right]), [right], "the edge on the other side is still too far");
    });
}
