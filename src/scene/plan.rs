//! The plan of a scene for an open device.

use anyhow::{Error, Result};

use crate::draw::PipelineRequirements;
use crate::gpu::Gpu;
use crate::height::Field;
use crate::plan::{Look, ScenePlan};

/// Plans a field with a look on a device, with an overlay if there is one, for lists of these requirements.
///
/// # Errors
/// If the field exceeds a limit of the device, or the look's texture bytes do not hold the smallest working set.
pub fn plan(
    gpu: &Gpu,
    field: &Field,
    look: &Look,
    overlay: Option<&image::RgbaImage>,
    requirements: PipelineRequirements,
) -> Result<ScenePlan> {
    let plan = ScenePlan::builder(field, look, &gpu.device_limits());
    let plan = plan.overlay(overlay.map(|picture| picture.dimensions().into()));
    plan.requirements(requirements).build().map_err(Error::msg)
}
