//! Pass `capture`: writes the vertices of a draw list, as the vertex shaders place them, to a buffer for the host.
//!
//! A variant of each vertex shader (`CAPTURE` in `shaders/emit.glsl`) writes every vertex it places to a storage
//! buffer. Vertex buffers and vertex input are those of drawing. A list is captured in batches that fit the buffer.

use std::collections::BTreeMap;
use std::sync::Arc;

use anyhow::{Result, bail};
use ash::vk;
use gpu_allocator::MemoryLocation;

use crate::draw::layout::{Captured, CapturedPart};
use crate::draw::{Draw, DrawList, Geometry, RESTART, Source, Topology, expand};
use crate::gpu::bindings::{Bindings, Bound};
use crate::gpu::device::Gpu;
use crate::gpu::frames::Recording;
use crate::gpu::memory::{Buffer, memory_barrier};
use crate::gpu::pass::{Occurs, Origin, Pass, PassInput, Resource, Row};
use crate::gpu::pipelines;
use crate::gpu::terrain::Terrain;
use crate::plan::ScenePlan;

pub(super) static ROW: Row = Row {
    name: "capture",
    reads: &[Resource::Uniforms, Resource::Geometry],
    writes: &[Resource::Vertices],
    occurs: Occurs::Last,
    origin: Origin::Caller,
};

/// Most triangles in a part of a draw.
const PART: usize = 1 << 15;
/// Records in the buffer: 1.4 million, 32 MiB.
const RECORDS: usize = (32 << 20) / size_of::<Captured>();

/// A part of a draw, and the place of its vertices in the buffer.
pub struct Part {
    /// The part.
    pub draw: Draw,
    /// The place of its records.
    pub place: CapturedPart,
}

impl Part {
    /// Returns the index of the record of an instance's vertex.
    pub fn record(&self, instance: u32, index: u32) -> usize {
        let (instance, vertex) = (instance - self.place.first_instance, index - self.place.first_vertex);
        (self.place.base + instance * self.place.vertices + vertex) as usize
    }

    fn records(&self) -> usize {
        self.draw.instances.len() * self.place.vertices as usize
    }
}

/// Pipelines and the buffer.
pub struct Capture {
    gpu: Arc<Gpu>,
    bindings: Bindings,
    pipelines: BTreeMap<(Source, Topology), vk::Pipeline>,
    /// The records: an array of [`Captured`].
    buffer: Buffer,
}

impl Capture {
    /// Makes pipelines and buffer for a scene; `scene` is the layout of its descriptors.
    ///
    /// # Errors
    /// If the device lacks `vertexPipelineStoresAndAtomics`, or memory.
    pub fn new(gpu: &Arc<Gpu>, plan: &ScenePlan, scene: vk::DescriptorSetLayout) -> Result<Self> {
        if !gpu.captures {
            bail!("{}: vertexPipelineStoresAndAtomics is missing: as-drawn capture needs it", gpu.candidate.name);
        }
        let bytes = (RECORDS * size_of::<Captured>()) as u64;
        let usage = vk::BufferUsageFlags::STORAGE_BUFFER;
        let buffer = Buffer::new(gpu, "captured vertices", bytes, usage, MemoryLocation::GpuToCpu)?;
        let (bound, constants) = ([Bound::Storage(&buffer)], size_of::<CapturedPart>());
        let bindings = Bindings::new(gpu, "capture", Some(scene), vk::ShaderStageFlags::VERTEX, &bound, constants)?;
        let mut capture = Self { gpu: Arc::clone(gpu), bindings, pipelines: BTreeMap::new(), buffer };
        for (source, topology) in pipelines::draws(plan) {
            let pipeline =
                pipelines::terrain(gpu, capture.bindings.layout, plan, pipelines::Pass::Capture, source, topology)?;
            capture.pipelines.insert((source, topology), pipeline);
        }
        Ok(capture)
    }

    /// Cuts a list into batches whose vertices fit the buffer.
    ///
    /// # Errors
    /// If one instance of a part exceeds the buffer.
    pub fn batches(resident: &Geometry, list: &DrawList) -> Result<Vec<Vec<Part>>> {
        let mut batches: Vec<Vec<Part>> = Vec::new();
        let mut used = RECORDS;
        for draw in list.draws.iter().flat_map(|draw| draw.parts(PART)) {
            let geometry = expand::geometry(draw.source, resident, list);
            let indices = &geometry.indices[draw.indices.start as usize..draw.indices.end as usize];
            let used_ones = indices.iter().filter(|&&k| k != RESTART);
            let (first, last) = used_ones.fold((u32::MAX, 0), |(low, high), &k| (low.min(k), high.max(k)));
            if first > last {
                continue;
            }
            let [first, last] = [first, last].map(|k| k + draw.first_vertex);
            let place = CapturedPart {
                base: 0,
                first_instance: draw.instances.start,
                first_vertex: first,
                vertices: last - first + 1,
            };
            for mut part in split(Part { draw, place }) {
                let records = part.records();
                if records > RECORDS {
                    bail!("capture: one mesh of {records} vertices, at most {RECORDS} fit");
                }
                if used + records > RECORDS {
                    batches.push(Vec::new());
                    used = 0;
                }
                part.place.base = used as u32;
                used += records;
                batches.last_mut().expect("pushed at first").push(part);
            }
        }
        Ok(batches)
    }

    /// Fills the buffer with heights that are no number, which no vertex shader writes.
    pub fn clear(&mut self) {
        self.buffer.fill(0xff);
    }

    /// The pass of one frame: captures a batch of the frame's list.
    pub fn batch<'a>(&'a self, parts: &'a [Part]) -> Batch<'a> {
        Batch { capture: self, parts }
    }

    /// Returns the records of a batch, once its frame has finished.
    pub fn records(&self) -> &[Captured] {
        bytemuck::cast_slice(&self.buffer.read()[..RECORDS * size_of::<Captured>()])
    }
}

/// The capture of one batch.
pub struct Batch<'a> {
    capture: &'a Capture,
    parts: &'a [Part],
}

impl Pass for Batch<'_> {
    fn row(&self) -> &'static Row {
        &ROW
    }

    fn record(&mut self, r: &mut Recording, scene: &mut Terrain, _: &PassInput) -> Result<()> {
        let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width: 1, height: 1 } };
        let info = vk::RenderingInfo::default().render_area(area).layer_count(1);
        let viewport = [vk::Viewport { width: 1.0, height: 1.0, max_depth: 1.0, ..Default::default() }];
        let (raw, commands, graphics) = (&r.gpu.raw, r.commands, vk::PipelineBindPoint::GRAPHICS);
        // SAFETY: what is bound outlives the frame; ranges lie in the bound buffers.
        unsafe {
            raw.cmd_begin_rendering(commands, &info);
            raw.cmd_set_viewport(commands, 0, &viewport);
            raw.cmd_set_scissor(commands, 0, &[area]);
            let (sets, layout) = ([scene.scene_set(r), self.capture.bindings.set], self.capture.bindings.layout);
            raw.cmd_bind_descriptor_sets(commands, graphics, layout, 0, &sets, &[]);
            for Part { draw, place } in self.parts {
                let source = if draw.source == Source::Streamed { Source::Resident } else { draw.source };
                raw.cmd_bind_pipeline(commands, graphics, self.capture.pipelines[&(source, draw.topology)]);
                scene.bind_geometry(r, draw.source);
                let stage = vk::ShaderStageFlags::VERTEX;
                raw.cmd_push_constants(commands, layout, stage, 0, bytemuck::bytes_of(place));
                let (indices, instances) = (draw.indices.len() as u32, draw.instances.len() as u32);
                let (first_index, first_instance) = (draw.indices.start, draw.instances.start);
                let offset = draw.first_vertex as i32;
                raw.cmd_draw_indexed(commands, indices, instances, first_index, offset, first_instance);
            }
            raw.cmd_end_rendering(commands);
        }
        use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
        let written = (Stage::VERTEX_SHADER, Access::SHADER_STORAGE_WRITE);
        memory_barrier(r.gpu, commands, written, (Stage::HOST, Access::HOST_READ));
        Ok(())
    }
}

/// Cuts a part into pieces of instances that fit the buffer.
fn split(part: Part) -> Vec<Part> {
    let max = (RECORDS / part.place.vertices as usize).max(1);
    let last = part.draw.instances.end;
    let piece = |first: u32| Part {
        draw: Draw { instances: first..last.min(first + max as u32), ..part.draw.clone() },
        place: CapturedPart { first_instance: first, ..part.place },
    };
    part.draw.instances.clone().step_by(max).map(piece).collect()
}

impl Drop for Capture {
    fn drop(&mut self) {
        // SAFETY: nothing is in use once the device is idle.
        unsafe {
            let _ = self.gpu.wait_idle();
            for pipeline in self.pipelines.values() {
                self.gpu.raw.destroy_pipeline(*pipeline, None);
            }
        }
    }
}
