//! Selects the triangles of one view without a device, and prints their number and their error.
//!
//! `cargo run --release --no-default-features --example select_on_cpu -- [TECHNIQUE] [PIXELS]`

use std::error::Error;
use std::sync::Arc;

use cuesta::glam::DVec3;
use cuesta::techniques::Techniques;
use cuesta::{DrawList, View, accuracy, heights};

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let name = arguments.next().unwrap_or_else(|| "geomipmap".to_string());
    let tolerance_px = arguments.next().map_or(Ok(4.0), |text| text.parse())?;

    // Alpine terrain of 25.6 x 25.6 km, seen from its southern edge.
    let field = Arc::new(heights::demo());
    let view = View::builder()
        .eye(DVec3::new(12_800.0, 4000.0, 25_600.0))
        .look_at(DVec3::new(12_800.0, 1000.0, 12_800.0))
        .tolerance_px(tolerance_px)
        .build()?;

    let mut technique = Techniques::built_in().prepare(&name, &field)?;
    let mut list = DrawList::default();
    technique.select(&view, &mut list);

    let [columns, rows] = field.size().map(|n| u64::from(n - 1));
    println!("{name}: {} of {} triangles, {} draws", list.triangles(), 2 * columns * rows, list.draws.len());

    // Compares every sample in view with the surface that is drawn for it.
    let errors = accuracy::errors(&field, &view, technique.resident(), &list);
    println!("certified: at most {tolerance_px} pixels");
    println!("measured:  at most {:.3} pixels, {:.2} m", errors.screen_px.max, errors.vertical_m.max);
    if list.tolerance_scale > 1.0 {
        println!("the list was full: the tolerance was multiplied by {}", list.tolerance_scale);
    }
    Ok(())
}
