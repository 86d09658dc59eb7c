//! The compiled shaders.

use anyhow::{Context, Result};
use ash::vk;

use super::device::Gpu;
use crate::draw::{Morph, Seams};
use crate::plan::ScenePlan;

/// File name of the source and SPIR-V of every shader (made by build.rs).
pub const SHADERS: &[(&str, &[u8])] = include!(concat!(env!("OUT_DIR"), "/shaders.rs"));

/// The SPIR-V words of a shader.
///
/// # Panics
/// If there is no such shader: the names are constants of this module's callers.
pub fn words(name: &str) -> Vec<u32> {
    let (_, bytes) = SHADERS.iter().find(|(n, _)| *n == name).expect("a shader of this program");
    bytes.chunks_exact(4).map(|w| u32::from_le_bytes([w[0], w[1], w[2], w[3]])).collect()
}

/// Makes a shader module; the caller destroys it once its pipelines are made.
pub fn module(gpu: &Gpu, name: &str) -> Result<vk::ShaderModule> {
    let words = words(name);
    let info = vk::ShaderModuleCreateInfo::default().code(&words);
    // SAFETY: the words are SPIR-V from our own compiler.
    let module = unsafe { gpu.raw.create_shader_module(&info, None) }.with_context(|| format!("shader {name}"))?;
    gpu.name(module, name);
    Ok(module)
}

/// Bytes and map of specialization constants, ids counting from 0, four bytes each.
pub struct Constants {
    data: Vec<u32>,
    entries: Vec<vk::SpecializationMapEntry>,
}

impl Constants {
    /// Constants with these values, in the order of their ids.
    pub fn new(values: &[u32]) -> Self {
        let entry = |k: u32| vk::SpecializationMapEntry { constant_id: k, offset: 4 * k, size: 4 };
        Self { data: values.to_vec(), entries: (0..values.len() as u32).map(entry).collect() }
    }

    /// What a scene's shaders leave out, in the order of their `constant_id`s.
    pub fn of(plan: &ScenePlan) -> Self {
        let flag = u32::from;
        let extent = plan.maps.map_or([0.0; 2], |cut| cut.extent).map(|pages| (pages as f32).to_bits());
        Self::new(&[
            flag(plan.coded),
            flag(plan.tiled),
            plan.page_shift,
            flag(plan.holes),
            flag(plan.fog),
            plan.colour as u32,
            flag(plan.filtered),
            flag(plan.requirements.morph != Morph::No),
            flag(plan.requirements.seams == Seams::Skirts),
            flag(plan.detail),
            flag(plan.requirements.morph == Morph::ByDistance),
            flag(plan.stored.iter().all(|n| n.is_power_of_two())),
            flag(plan.ceiling),
            plan.ground.map_or(0, |cut| 32 - cut.root_shift),
            extent[0],
            extent[1],
            flag(plan.drape.ends),
        ])
    }

    /// The values in the order of their ids.
    pub fn words(&self) -> &[u32] {
        &self.data
    }

    /// The description for a pipeline stage.
    pub fn info(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default().data(bytemuck::cast_slice(&self.data)).map_entries(&self.entries)
    }
}
