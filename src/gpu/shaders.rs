//! The compiled shaders.

use anyhow::{Context, Result};
use ash::vk;

use super::device::Gpu;
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

/// Values of specialization constants, as pipelines take them: ids count from 0, four bytes each.
pub struct Constants {
    words: Vec<u32>,
    entries: Vec<vk::SpecializationMapEntry>,
}

impl Constants {
    /// The constants of a scene's shaders.
    pub fn of(plan: &ScenePlan) -> Self {
        Self::new(plan.constants().words())
    }

    /// No constants: every one keeps its default.
    pub fn none() -> Self {
        Self::new(Vec::new())
    }

    fn new(words: Vec<u32>) -> Self {
        let entry = |k: u32| vk::SpecializationMapEntry { constant_id: k, offset: 4 * k, size: 4 };
        let entries = (0..words.len() as u32).map(entry).collect();
        Self { words, entries }
    }

    /// The values in the order of their ids.
    pub fn words(&self) -> &[u32] {
        &self.words
    }

    /// The description for a pipeline stage.
    pub fn info(&self) -> vk::SpecializationInfo<'_> {
        vk::SpecializationInfo::default().data(bytemuck::cast_slice(&self.words)).map_entries(&self.entries)
    }
}
