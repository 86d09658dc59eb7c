//! Tests of endless procedural terrain, which has no samples, on the GPU.

use std::sync::Arc;

use cuesta::internal::height::Field;
use cuesta::internal::height::bezier::{Bezier, LAYERS, SIDE_M};
use cuesta::internal::view::View;
use glam::DVec3;

use super::{aslant, on_device, render, technique};

/// From far and near the image shows terrain below sky, with visible shading.
#[test]
fn the_endless_terrain_is_drawn_and_lit() {
    on_device(|gpu| {
        let field = Arc::new(Field::endless(Arc::new(Bezier::new(1, LAYERS))));
        let [x, z] = [0.43 * SIDE_M, 0.37 * SIDE_M];
        let ground = field.height_at(x, z).expect("over the terrain");
        for above_m in [20_000.0, 20.0, 0.3] {
            let like = aslant(&field, [160, 120], 16.0);
            let eye = DVec3::new(x, ground + above_m, z);
            let view =
                View { eye, world_from_eye: View::turned(40.0, -12.0, 0.0), near: 0.1 * above_m.min(1.0), ..like };
            let rendered = render(gpu, &field, technique(&field, "sphere-tree", &[]).as_mut(), &view);
            let terrain: Vec<_> =
                rendered.picture.pixels().filter(|pixel| pixel.0[3] == 255).map(|p| f64::from(p.0[1])).collect();
            assert!(
                terrain.len() > 160 * 40 && terrain.len() < 160 * 120,
                "{above_m} m: {} pixels of terrain",
                terrain.len()
            );
            let mean = terrain.iter().sum::<f64>() / terrain.len() as f64;
            let deviation = (terrain.iter().map(|n| (n - mean).powi(2)).sum::<f64>() / terrain.len() as f64).sqrt();
            assert!(deviation > 2.0, "{above_m} m: the shading is uniform, {deviation} of 255 about {mean}");
        }
    });
}
