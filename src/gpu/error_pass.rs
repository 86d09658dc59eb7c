//! The error of captured triangles, found on the device: for fields and lists too big for the exact oracle on the
//! CPU (`measure::geometric`), whose rules it follows in single precision.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;
use gpu_allocator::MemoryLocation;

use super::bindings::{Bindings, Bound};
use super::capture::Capture;
use super::device::Gpu;
use super::frames::Recording;
use super::memory::{Buffer, memory_barrier};
use super::pipelines;
use super::shaders::Constants;
use crate::draw::layout::{ErrorPassInput, TriangleError};
use crate::plan::ScenePlan;

/// Triangles measured at once.
pub const TRIANGLES: usize = 1 << 20;
/// Classes of a histogram: the upper 12 bits of a positive float, 16 to an octave.
const CLASSES: usize = 4096;
const HISTOGRAM: usize = 2 * CLASSES * size_of::<u32>();
const WORKGROUP: u32 = 64;

/// A quantity over all samples in view.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// Samples.
    pub count: u64,
    /// Root of the mean square.
    pub rms: f64,
    /// A value that 99.9 % of the samples do not exceed, at most a sixteenth of an octave (6.25 %) too large.
    pub p999: f64,
    /// Largest.
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

/// What was found so far.
#[derive(Default)]
struct Sums {
    samples: u64,
    squares: [f64; 2],
    largest: [f32; 2],
    classes: Vec<u64>,
}

impl ErrorPass {
    /// Makes what measuring a scene needs, reading the vertices of a capture.
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

    /// Forgets what was found.
    pub fn reset(&mut self) {
        self.sums = Sums::default();
    }

    /// Records the measuring of at most [`TRIANGLES`] triangles, three captured records each; `scene` are the
    /// descriptors of the view, and the capture of the records was recorded before.
    pub fn record(
        &mut self,
        recording: &mut Recording,
        scene: vk::DescriptorSet,
        size: [u32; 2],
        triangles: &[[u32; 3]],
    ) -> Result<()> {
        self.triangles.write(0, bytemuck::cast_slice(triangles));
        self.histogram.write(0, &[0; HISTOGRAM]);
        let given = ErrorPassInput { half_size: size.map(|n| n as f32 / 2.0), triangles: triangles.len() as u32 };
        let (layout, set, pipeline) = (self.bindings.layout, self.bindings.set, self.pipeline);
        recording.scope("error pass", |r| {
            let (raw, commands, point) = (&r.gpu.raw, r.commands, vk::PipelineBindPoint::COMPUTE);
            // SAFETY: what is bound outlives the frame.
            unsafe {
                raw.cmd_bind_pipeline(commands, point, pipeline);
                raw.cmd_bind_descriptor_sets(commands, point, layout, 0, &[scene, set], &[]);
                let stage = vk::ShaderStageFlags::COMPUTE;
                raw.cmd_push_constants(commands, layout, stage, 0, bytemuck::bytes_of(&given));
                raw.cmd_dispatch(commands, given.triangles.div_ceil(WORKGROUP), 1, 1);
            }
            Ok(())
        })?;
        use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
        let written = (Stage::COMPUTE_SHADER, Access::SHADER_STORAGE_WRITE);
        memory_barrier(&self.gpu, recording.commands, written, (Stage::HOST, Access::HOST_READ));
        Ok(())
    }

    /// Adds what the last recording found, once its frame has finished.
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

    /// Vertical errors in metres and screen errors in pixels, of all that was collected since the last reset.
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

/// Upper end of the class in which the value lies that 99.9 % of the samples do not exceed.
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
            let _ = self.gpu.raw.device_wait_idle();
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
