//! Reads a height file and prints its size, range and spacing.
//!
//! `cargo run --release --example read_dem -- FILE`; without a file, the terrain that comes with the crate.

use std::path::Path;

use cuesta::heights::{self, Field, Options};

fn main() -> Result<(), heights::Error> {
    let field = match std::env::args().nth(1) {
        Some(file) => read(Path::new(&file))?,
        None => heights::demo(),
    };
    let [columns, rows] = field.size();
    let [dx, dz] = field.spacing;
    let statistics = field.statistics();
    println!("size:    {columns} x {rows} samples");
    println!("spacing: {dx} m east, {dz} m south");
    println!("extent:  {:.1} x {:.1} km", f64::from(columns - 1) * dx / 1e3, f64::from(rows - 1) * dz / 1e3);
    println!("heights: {:.1} to {:.1} m, mean {:.1} m", statistics.min, statistics.max, statistics.mean);
    println!("holes:   {} samples", field.holes().count());
    Ok(())
}

/// Reads any supported format, recognised by its content.
fn read(file: &Path) -> Result<Field, heights::Error> {
    let loaded = heights::load(file, &Options::default())?;
    println!("format:  {}, {}", loaded.format, loaded.sample_type);
    loaded.warnings.iter().for_each(|warning| eprintln!("warning: {warning}"));
    Ok(loaded.field)
}
