//! One picture by one call: opens a device, draws a view, closes the device.

use std::sync::Arc;

use anyhow::{Result, ensure};

use super::plan::plan;
use super::renderer::Scene;
use crate::gpu::{Choice, Gpu, Instance};
use crate::height::Field;
use crate::lod::Technique;
use crate::plan::Look;
use crate::view::View;

/// Draws one view of a field. Returns its colours; alpha is 0 where no terrain was drawn.
///
/// The technique must have been prepared for this field. Opening a device takes longer than drawing; a program that draws
/// many pictures keeps the device open.
///
/// # Errors
/// If there is no suitable device, the field exceeds a limit of the device, or a call of Vulkan fails.
pub fn picture(
    field: &Arc<Field>,
    technique: &mut dyn Technique,
    view: &View,
    look: &Look,
    device: &Choice,
) -> Result<image::RgbaImage> {
    ensure!(view.size.iter().all(|&side| side > 0), "a picture has at least one pixel a side");
    let gpu = Gpu::new(&Instance::new(&[], false)?, device, false)?;
    let plan = plan(&gpu, field, look, None, technique.pipeline_requirements())?;
    let scene = Scene { gpu: &gpu, field, plan: &plan, look, overlay: None };
    let rendered = scene.render(technique, view, 1)?;
    Gpu::close(gpu);
    Ok(rendered.picture)
}
