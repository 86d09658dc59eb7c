//! A descriptor set of a pass, written once, and the pipeline layout that goes with it.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;

use super::device::Gpu;
use super::memory::Buffer;

/// The resource at a binding.
#[derive(Clone, Copy)]
pub(super) enum Bound<'a> {
    /// A uniform buffer.
    Uniform(&'a Buffer),
    /// A storage buffer.
    Storage(&'a Buffer),
    /// A sampled image with its sampler and its layout.
    Texture(vk::Sampler, vk::ImageView, vk::ImageLayout),
}

/// A descriptor set and its layouts.
pub(super) struct Bindings {
    gpu: Arc<Gpu>,
    set_layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    /// Layout of the pass's pipelines.
    pub layout: vk::PipelineLayout,
    /// The set: number 1 if the pass reads the scene's set too, else number 0.
    pub set: vk::DescriptorSet,
}

impl Bindings {
    /// Binds resources at bindings 0, 1, … for shaders of some stages, with `constants` bytes of push constants. `scene`:
    /// layout of the scene's set, if the shaders read it too. The resources must outlive the use of the set.
    pub fn new(
        gpu: &Arc<Gpu>,
        name: &str,
        scene: Option<vk::DescriptorSetLayout>,
        stages: vk::ShaderStageFlags,
        bound: &[Bound],
        constants: usize,
    ) -> Result<Self> {
        let (set_layout, pool, layout, set) = Default::default();
        let mut bindings = Self { gpu: Arc::clone(gpu), set_layout, pool, layout, set };
        let entry = |(binding, bound): (u32, &Bound)| {
            let entry = vk::DescriptorSetLayoutBinding::default().binding(binding).descriptor_count(1);
            entry.descriptor_type(bound.kind()).stage_flags(stages)
        };
        let entries: Vec<_> = (0u32..).zip(bound).map(entry).collect();
        let sizes: Vec<_> =
            bound.iter().map(|b| vk::DescriptorPoolSize { ty: b.kind(), descriptor_count: 1 }).collect();
        let pushed = [vk::PushConstantRange { stage_flags: stages, offset: 0, size: constants as u32 }];
        // SAFETY: the device is alive; Drop destroys the objects, also if a later step fails.
        unsafe {
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&entries);
            bindings.set_layout = gpu.raw.create_descriptor_set_layout(&info, None)?;
            let sets: Vec<_> = scene.into_iter().chain([bindings.set_layout]).collect();
            let pushed = if constants > 0 { &pushed[..] } else { &[] };
            let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets).push_constant_ranges(pushed);
            bindings.layout = gpu.raw.create_pipeline_layout(&info, None)?;
            let info = vk::DescriptorPoolCreateInfo::default().max_sets(1).pool_sizes(&sizes);
            bindings.pool = gpu.raw.create_descriptor_pool(&info, None)?;
            let sets = [bindings.set_layout];
            let info = vk::DescriptorSetAllocateInfo::default().descriptor_pool(bindings.pool).set_layouts(&sets);
            bindings.set = gpu.raw.allocate_descriptor_sets(&info)?[0];
        }
        gpu.name(bindings.layout, name);
        gpu.name(bindings.set, name);
        bindings.write(bound);
        Ok(bindings)
    }

    fn write(&self, bound: &[Bound]) {
        let buffers: Vec<_> = bound.iter().map(|b| [b.buffer()]).collect();
        let images: Vec<_> = bound.iter().map(|b| [b.image()]).collect();
        let write = vk::WriteDescriptorSet::default().dst_set(self.set);
        let writes: Vec<_> = bound
            .iter()
            .enumerate()
            .map(|(k, bound)| {
                let write = write.dst_binding(k as u32).descriptor_type(bound.kind());
                match bound {
                    Bound::Texture(..) => write.image_info(&images[k]),
                    _ => write.buffer_info(&buffers[k]),
                }
            })
            .collect();
        // SAFETY: the set is not in use yet, and the resources outlive its use.
        unsafe { self.gpu.raw.update_descriptor_sets(&writes, &[]) };
    }
}

impl Bound<'_> {
    fn kind(&self) -> vk::DescriptorType {
        match self {
            Bound::Uniform(_) => vk::DescriptorType::UNIFORM_BUFFER,
            Bound::Storage(_) => vk::DescriptorType::STORAGE_BUFFER,
            Bound::Texture(..) => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
        }
    }

    fn buffer(&self) -> vk::DescriptorBufferInfo {
        match self {
            Bound::Uniform(buffer) | Bound::Storage(buffer) => {
                vk::DescriptorBufferInfo { buffer: buffer.raw, offset: 0, range: vk::WHOLE_SIZE }
            }
            Bound::Texture(..) => vk::DescriptorBufferInfo::default(),
        }
    }

    fn image(&self) -> vk::DescriptorImageInfo {
        match *self {
            Bound::Texture(sampler, image_view, image_layout) => {
                vk::DescriptorImageInfo { sampler, image_view, image_layout }
            }
            _ => vk::DescriptorImageInfo::default(),
        }
    }
}

impl Drop for Bindings {
    fn drop(&mut self) {
        // SAFETY: nothing is in use once the device is idle.
        unsafe {
            let _ = self.gpu.raw.device_wait_idle();
            self.gpu.raw.destroy_pipeline_layout(self.layout, None);
            self.gpu.raw.destroy_descriptor_pool(self.pool, None);
            self.gpu.raw.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}
