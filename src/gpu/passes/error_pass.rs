//! Pass `error pass`: measures the error of captured triangles on the device, in single precision.
//!
//! For fields and lists too large for the exact CPU reference, `measure::geometric`, whose rules it follows.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;
use gpu_allocator::MemoryLocation;

use super::capture::Capture;
use crate::draw::layout::{ErrorPassInput, TriangleError};
use crate::gpu::bindings::{Bindings, Bound};
use crate::gpu::device::Gpu;
use crate::gpu::frames::Recording;
use crate::gpu::memory::{Buffer, memory_barrier};
use crate::gpu::pass::{Occurs, Origin, Pass, PassInput, Resource, Row};
use crate::gpu::pipelines;
use crate::gpu::shaders::Constants;
use crate::gpu::terrain::Terrain;
use crate::plan::ScenePlan;

pub(super) static ROW: Row = Row {
    name: "error pass",
    reads: &[Resource::Uniforms, Resource::Vertices],
    writes: &[Resource::Errors],
    occurs: Occurs::Last,
    origin: Origin::Caller,
};

/// Most triangles measured in one frame.
pub const TRIANGLES: usize = 1 << 20;
/// Classes of a histogram: the upper 12 bits of a positive float, 16 to an octave.
const CLASSES: usize = 4096;
const HISTOGRAM: usize = 2 * CLASSES * size_of::<u32>();
const WORKGROUP: u32 = 64;

/// Statistics of a quantity over all samples in view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// Number of samples.
    pub count: u64,
    /// Root mean square.
    pub rms: f64,
    /// Percentile 99.9, at most a sixteenth of an octave (6.25 %) too large.
    pub p999: f64,
    /// Maximum.
    pub max: f64,
}

/// Pipeline and buffers.
pub struct ErrorPass {
    gpu: Arc<Gpu>,
    bindings: Bindings,
    pipeline: vk::Pipeline,
    triangles: Buffer,
    errors: Buffer,
    histogram: Buffer,
    sums: Sums,
}

/// Sums over the triangles measured so far.
#[derive(Default)]
struct Sums {
    samples: u64,
    squares: [f64; 2],
    largest: [f32; 2],
    classes: Vec<u64>,
}

impl ErrorPass {
    /// Makes pipeline and buffers for a scene, reading the vertices of a capture. `scene` is the layout of the scene's
    /// descriptors.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn new(gpu: &Arc<Gpu>, plan: &ScenePlan, scene: vk::DescriptorSetLayout, capture: &Capture) -> Result<Self> {
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let bytes = (TRIANGLES * size_of::<[u32; 3]>()) as u64;
        let triangles = Buffer::host(gpu, "captured triangles", bytes, usage)?;
        let back = |purpose, bytes: usize| Buffer::new(gpu, purpose, bytes as u64, usage, MemoryLocation::GpuToCpu);
        let errors = back("triangle errors", TRIANGLES * size_of::<TriangleError>())?;
        let histogram = back("error histogram", HISTOGRAM)?;
        let bound = [&capture.buffer, &triangles, &errors, &histogram].map(Bound::Storage);
        let constants = size_of::<ErrorPassInput>();
        let bindings = Bindings::new(gpu, "error pass", Some(scene), vk::ShaderStageFlags::COMPUTE, &bound, constants)?;
        let pipeline = pipelines::compute(gpu, bindings.layout, "error pass", "error_pass.comp", &Constants::of(plan))?;
        let (gpu, sums) = (Arc::clone(gpu), Sums::default());
        Ok(Self { gpu, bindings, pipeline, triangles, errors, histogram, sums })
    }

    /// The pass of one frame: measures at most [`TRIANGLES`] triangles, three captured records each. An earlier frame
    /// captured the records.
    pub fn triangles<'a>(&'a mut self, triangles: &'a [[u32; 3]]) -> Triangles<'a> {
        Triangles { pass: self, triangles }
    }

    /// Adds the errors of the last frame, once that has finished.
    pub fn collect(&mut self, triangles: usize) {
        let errors: &[TriangleError] =
            bytemuck::cast_slice(&self.errors.read()[..triangles * size_of::<TriangleError>()]);
        let sums = &mut self.sums;
        for error in errors {
            sums.samples += u64::from(error.samples);
            sums.squares[0] += f64::from(error.squares_m);
            sums.squares[1] += f64::from(error.squares_px);
            sums.largest = [sums.largest[0].max(error.largest_m), sums.largest[1].max(error.largest_px)];
        }
        let classes: &[u32] = bytemuck::cast_slice(&self.histogram.read()[..HISTOGRAM]);
        sums.classes.resize(classes.len(), 0);
        sums.classes.iter_mut().zip(classes).for_each(|(sum, &class)| *sum += u64::from(class));
    }

    /// Returns vertical errors in metres and screen errors in pixels, over all triangles collected.
    pub fn summaries(&self) -> [Summary; 2] {
        let sums = &self.sums;
        [0, 1].map(|k| Summary {
            count: sums.samples,
            rms: (sums.squares[k] / sums.samples.max(1) as f64).sqrt(),
            p999: percentile(sums.classes.get(k * CLASSES..(k + 1) * CLASSES).unwrap_or_default(), sums.samples),
            max: f64::from(sums.largest[k]),
        })
    }
}

/// The measurement of some triangles.
pub struct Triangles<'a> {
    pass: &'a mut ErrorPass,
    triangles: &'a [[u32; 3]],
}

impl Pass for Triangles<'_> {
    fn row(&self) -> &'static Row {
        &ROW
    }

    fn prepare(&mut self, _: usize, _: &mut Terrain, _: &PassInput) -> bool {
        self.pass.triangles.write(0, bytemuck::cast_slice(self.triangles));
        self.pass.histogram.write(0, &[0; HISTOGRAM]);
        true
    }

    fn record(&mut self, r: &mut Recording, scene: &mut Terrain, input: &PassInput) -> Result<()> {
        use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
        let half_size = input.view.size.map(|n| n as f32 / 2.0);
        let given = ErrorPassInput { half_size, triangles: self.triangles.len() as u32 };
        let (raw, commands, point) = (&r.gpu.raw, r.commands, vk::PipelineBindPoint::COMPUTE);
        let (layout, sets) = (self.pass.bindings.layout, [scene.scene_set(r), self.pass.bindings.set]);
        // SAFETY: what is bound outlives the frame.
        unsafe {
            raw.cmd_bind_pipeline(commands, point, self.pass.pipeline);
            raw.cmd_bind_descriptor_sets(commands, point, layout, 0, &sets, &[]);
            let stage = vk::ShaderStageFlags::COMPUTE;
            raw.cmd_push_constants(commands, layout, stage, 0, bytemuck::bytes_of(&given));
            raw.cmd_dispatch(commands, given.triangles.div_ceil(WORKGROUP), 1, 1);
        }
        let written = (Stage::COMPUTE_SHADER, Access::SHADER_STORAGE_WRITE);
        memory_barrier(r.gpu, commands, written, (Stage::HOST, Access::HOST_READ));
        Ok(())
    }
}

/// Returns the upper end of the class that holds percentile 99.9.
fn percentile(classes: &[u64], samples: u64) -> f64 {
    let mut beyond = samples / 1000;
    for (class, &count) in classes.iter().enumerate().rev() {
        if count > beyond {
            return f64::from(f32::from_bits(((class as u32 + 1) << 19) - 1)) * f64::from(u8::from(class > 0));
        }
        beyond -= count;
    }
    0.0
}

impl Drop for ErrorPass {
    fn drop(&mut self) {
        // SAFETY: nothing is in use once the device is idle.
        unsafe {
            let _ = self.gpu.wait_idle();
            self.gpu.raw.destroy_pipeline(self.pipeline, None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_percentile_is_a_sixteenth_of_an_octave_high_at_max() {
        let values: Vec<f32> = (0..5000).map(|k| 0.001 * k as f32).collect();
        let mut classes = vec![0; CLASSES];
        values.iter().for_each(|v| classes[(v.to_bits() >> 19) as usize] += 1);
        let exact = f64::from(values[4994]);
        let found = percentile(&classes, 5000);
        assert!((exact..exact * 1.0625).contains(&found), "{found} for {exact}");
        assert_eq!(percentile(&[0; CLASSES], 0), 0.0);
        let mut zeros = vec![0; CLASSES];
        zeros[0] = 77;
        assert_eq!(percentile(&zeros, 77), 0.0);
    }
}
