//! The one place where plans are made.

use super::colour::Colour;
use super::device_limits::DeviceLimits;
use super::look::Look;
use super::pages::page_shift;
use super::scene_plan::ScenePlan;
use crate::draw::PipelineRequirements;
use crate::height::{Field, Samples};
use crate::texture::virtual_ground::VirtualGroundLayout;
use crate::texture::virtual_layout::VirtualTextureLayout;

/// The inputs of a [`ScenePlan`]: see [`ScenePlan::builder`].
#[derive(Clone, Copy, Debug)]
pub struct ScenePlanBuilder<'a> {
    field: &'a Field,
    look: &'a Look,
    limits: DeviceLimits,
    overlay: Option<[u32; 2]>,
    requirements: PipelineRequirements,
    windowed: bool,
    measured: bool,
}

impl ScenePlan {
    /// Starts the plan of a field with a look (which also names the forced features) on a device. By default there is
    /// no overlay, the technique draws lattice triangles, pictures stay in memory, and frames are timed.
    pub fn builder<'a>(field: &'a Field, look: &'a Look, limits: &DeviceLimits) -> ScenePlanBuilder<'a> {
        let requirements = PipelineRequirements::default();
        ScenePlanBuilder { field, look, limits: *limits, overlay: None, requirements, windowed: false, measured: true }
    }
}

impl ScenePlanBuilder<'_> {
    /// Drapes a picture of this size (texels along x and z) over the field, if there is one. It becomes a virtual
    /// texture if it exceeds the look's bytes or one image, and the field has samples.
    pub fn overlay(self, size: Option<[u32; 2]>) -> Self {
        Self { overlay: size, ..self }
    }

    /// The pipelines that the technique's lists need.
    pub fn requirements(self, requirements: PipelineRequirements) -> Self {
        Self { requirements, ..self }
    }

    /// Pictures go to a window.
    pub fn windowed(self) -> Self {
        Self { windowed: true, ..self }
    }

    /// Frames are not timed.
    pub fn unmeasured(self) -> Self {
        Self { measured: false, ..self }
    }

    /// Makes the plan.
    ///
    /// # Errors
    /// If the field exceeds a limit of the device, the overlay is empty, or the look's texture bytes do not hold the smallest
    /// working set.
    pub fn build(self) -> Result<ScenePlan, String> {
        let Self { field, look, limits, overlay, requirements, windowed, measured } = self;
        if overlay.is_some_and(|size| size.contains(&0)) {
            return Err("overlay: expected at least one pixel a side".to_string());
        }
        let (stored, is_endless) = (field.stored(), field.procedural().is_some());
        let page_shift = page_shift(stored, &limits);
        let drape = look.drape_over(field);
        let is_whole = |size: &[u32; 2]| look.holds(*size) && size.iter().all(|&n| n <= limits.image_side);
        let virtual_size = overlay.filter(|size| !is_endless && !is_whole(size));
        let maps = virtual_size
            .map(|size| VirtualTextureLayout::new(size, drape.repeats(), look.texture_bytes, limits.image_layers))
            .transpose()?;
        let ground = look.colour.shows_ground();
        let ground = ground.then(|| VirtualGroundLayout::new(field, look.texture_bytes, limits.image_layers));
        let mut plan = ScenePlan {
            coded: matches!(field.samples(), Samples::Coded { .. }),
            tiled: field.is_tiled(),
            holes: field.holes().count() > 0,
            ceiling: field.ceiling().is_some(),
            fog: look.fog > 0.0,
            // A field without samples has no reference surface.
            colour: if is_endless && look.colour == Colour::Error { Colour::Height } else { look.colour },
            wireframe: look.wireframe,
            page_shift,
            filtered: limits.filters_heights && page_shift == 0,
            requirements,
            draws: requirements.draws,
            detail: look.detail,
            measured,
            windowed,
            stored,
            overlay,
            maps,
            drape,
            ground: ground.transpose()?,
            forced: look.forced,
        };
        plan.force();
        plan.check_layers(&limits)?;
        Ok(plan)
    }
}
