//! Asks for the height at a point: of the samples' own surface, and of the coarser surface that is drawn.
//!
//! `cargo run --release --no-default-features --example query -- [X] [Z]`, in metres east and south.

use std::error::Error;
use std::sync::Arc;

use cuesta::draw_list::world_triangles;
use cuesta::glam::{DVec2, DVec3, Vec3Swizzles};
use cuesta::techniques::Techniques;
use cuesta::{DrawList, View, heights};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let mut metres = |default: f64| arguments.next().map_or(Ok(default), |text| text.parse());
    let point = DVec2::new(metres(12_345.6)?, metres(7890.1)?);

    let field = Arc::new(heights::demo());
    // Positions among the samples: column and row, with fractions.
    let at = [0, 1].map(|axis| (point[axis] - field.origin[axis]) / field.spacing[axis]);
    let exact = heights::height_at(&field, at).ok_or("there is no terrain at this point")?;
    println!("samples' surface: {exact:.3} m");

    for tolerance_px in [1.0, 8.0, 64.0] {
        let view = View::builder()
            .eye(DVec3::new(12_800.0, 4000.0, 25_600.0))
            .look_at(DVec3::new(point.x, exact, point.y))
            .tolerance_px(tolerance_px)
            .build()?;
        let mut technique = Techniques::built_in().prepare("clusters", &field)?;
        let mut list = DrawList::default();
        technique.select(&view, &mut list);
        let triangles = world_triangles(&field, &view, technique.resident(), &list);
        let drawn = triangles.iter().find_map(|triangle| height_in(triangle, point));
        let drawn = drawn.ok_or("nothing is drawn at this point")?;
        println!("drawn, {tolerance_px:2} px:     {drawn:.3} m, {:+.3} m", drawn - exact);
    }
    Ok(())
}

/// Returns the height of a triangle at a point in plan, if the point lies in it.
fn height_in([a, b, c]: &[DVec3; 3], point: DVec2) -> Option<f64> {
    let [pa, pb, pc] = [a, b, c].map(|corner| corner.xz() - point);
    let weights = [pb.perp_dot(pc), pc.perp_dot(pa), pa.perp_dot(pb)];
    let is_inside = weights.iter().all(|&w| w >= 0.0) || weights.iter().all(|&w| w <= 0.0);
    let area: f64 = weights.iter().sum();
    (is_inside && area != 0.0).then(|| (weights[0] * a.y + weights[1] * b.y + weights[2] * c.y) / area)
}
