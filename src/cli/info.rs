//! `cuesta info`: describes a terrain, the scene plan, a view's texture tiles, or the Vulkan devices.

use std::sync::Arc;

use anyhow::{Result, bail};
use serde::Serialize;

use super::common::{Common, Outcome};
pub use super::info_args::InfoArgs;
use super::{plan, report, working_set};
use crate::height::{Extent, Loaded, SourceFile};

/// Description of a terrain.
#[derive(Serialize)]
pub struct Info {
    format: String,
    width: u32,
    height: u32,
    spacing_m: [f64; 2],
    origin: [f64; 2],
    crs: Option<String>,
    /// Rectangle of longitudes and latitudes around the samples, if the coordinate system can be transformed.
    extent_deg: Option<Extent>,
    min_m: f32,
    max_m: f32,
    mean_m: f64,
    hole_count: u64,
    sample_type: String,
    exact_in_16_bit: bool,
    /// Largest difference, at the centre of a cell, between the two ways to split the cell into triangles, metres.
    cell_ambiguity_m: f32,
    /// The files that the heights come from. Where they overlap, the last one counts.
    sources: Vec<SourceFile>,
    warnings: Vec<String>,
}

impl Info {
    /// Describes a terrain that was read.
    pub fn of(loaded: &Loaded) -> Self {
        let field = &loaded.field;
        let [width, height] = field.size();
        let statistics = field.statistics();
        Self {
            format: loaded.format.to_string(),
            width,
            height,
            spacing_m: field.spacing,
            origin: field.origin,
            crs: field.crs.clone(),
            extent_deg: loaded.footprint.place.as_ref().and_then(|place| place.extent(field.stored())),
            min_m: statistics.min,
            max_m: statistics.max,
            mean_m: statistics.mean,
            hole_count: field.holes().count(),
            sample_type: loaded.sample_type.clone(),
            exact_in_16_bit: loaded.exact_in_16_bit,
            cell_ambiguity_m: field.cell_ambiguity(),
            sources: loaded.sources.clone(),
            warnings: loaded.warnings.clone(),
        }
    }
}

/// Runs the subcommand.
pub fn run(common: &Common, args: &InfoArgs) -> Result<Outcome> {
    if args.devices {
        return devices(common);
    }
    if args.terrain.is_empty() {
        bail!("info: expected a terrain, or --devices");
    }
    let loaded = args.reading.load(common, &args.terrain)?;
    if let Some(path) = &args.working_set {
        let field = Arc::new(loaded.field);
        let view = args.view.build(&field, args.technique.tolerance()?)?;
        let mut technique = args.technique.build(common, &field)?;
        report::print(common, &working_set::draw(&field, technique.as_mut(), &view, args.look.texture_bytes(), path)?)?;
        return Ok(Outcome::Done);
    }
    if !args.plan {
        report::print(common, &Info::of(&loaded))?;
        return Ok(Outcome::Done);
    }
    plan::run(common, args, &args.terrain.join(" "), loaded)
}

#[cfg(not(feature = "vulkan"))]
fn devices(_: &Common) -> Result<Outcome> {
    bail!("--devices: built without Vulkan");
}

/// Lists the Vulkan devices and the required features that each lacks.
#[cfg(feature = "vulkan")]
fn devices(common: &Common) -> Result<Outcome> {
    use crate::gpu::{Instance, device};

    #[derive(Serialize)]
    struct Device {
        name: String,
        kind: String,
        vulkan: String,
        driver: String,
        usable: bool,
        missing: Vec<String>,
    }
    #[derive(Serialize)]
    struct Devices {
        devices: Vec<Device>,
    }
    let instance = Instance::new(&[], common.validate)?;
    let devices = device::candidates(&instance)?.into_iter().map(|c| Device {
        kind: format!("{:?}", c.kind).to_lowercase(),
        usable: c.missing.is_empty(),
        name: c.name,
        vulkan: c.version,
        driver: c.driver,
        missing: c.missing,
    });
    report::print(common, &Devices { devices: devices.collect() })?;
    Ok(Outcome::Done)
}
