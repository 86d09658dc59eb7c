//! Graphics pipelines of a scene: one per kind of draws, specialised to the plan, and the sky's.

use std::collections::{BTreeMap, BTreeSet};
use std::mem::offset_of;
use std::sync::Arc;

use anyhow::{Context, Result};
use ash::vk;

use super::device::Gpu;
use super::formats::Formats;
use super::live;
use super::shaders::{self, Constants};
use crate::draw::layout::{ExplicitVertex, Instance, LatticeVertex, VertexNormals};
use crate::draw::{Normals, Source, Topology};
use crate::plan::ScenePlan;

/// Number of sampled images of a scene.
pub(super) const IMAGES: usize = 5;

/// The pipelines of a scene and their common layout.
pub struct Pipelines {
    gpu: Arc<Gpu>,
    /// Layout of set 0: the frame and the scene's images.
    pub set_layout: vk::DescriptorSetLayout,
    /// Layout of all pipelines.
    pub layout: vk::PipelineLayout,
    /// Sky behind the terrain; null if the formats have none.
    pub sky: vk::Pipeline,
    terrain: BTreeMap<(Source, Topology), vk::Pipeline>,
}

impl Pipelines {
    /// Creates the pipelines of a plan for targets of these formats.
    pub fn new(gpu: &Arc<Gpu>, plan: &ScenePlan, formats: Formats) -> Result<Self> {
        // The scene's images, the tiles of the virtual texture, and its page table.
        let images = [vk::DescriptorType::COMBINED_IMAGE_SAMPLER; IMAGES + 1];
        let kinds = std::iter::once(vk::DescriptorType::UNIFORM_BUFFER).chain(images);
        let kinds = kinds.chain([vk::DescriptorType::STORAGE_BUFFER]);
        let bindings: Vec<_> = (0u32..)
            .zip(kinds)
            .map(|(binding, kind)| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(kind)
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::ALL)
            })
            .collect();
        // SAFETY: the device is alive; Drop destroys what is made here.
        let (set_layout, layout) = unsafe {
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            let set_layout = gpu.raw.create_descriptor_set_layout(&info, None)?;
            let sets = [set_layout];
            let info = vk::PipelineLayoutCreateInfo::default().set_layouts(&sets);
            (set_layout, gpu.raw.create_pipeline_layout(&info, None)?)
        };
        gpu.name(layout, "scene");
        let sky = vk::Pipeline::null();
        let mut pipelines = Self { gpu: Arc::clone(gpu), set_layout, layout, sky, terrain: BTreeMap::new() };
        if formats.has_sky {
            pipelines.sky = pipelines.make_sky(formats)?;
        }
        for (source, topology) in draws(plan) {
            let pipeline = terrain(gpu, layout, plan, Pass::Picture(formats), source, topology)?;
            pipelines.terrain.insert((source, topology), pipeline);
        }
        Ok(pipelines)
    }

    /// Pipeline for draws of a source and topology. Resident and streamed geometry share one.
    ///
    /// # Panics
    /// If the plan has no such draws: the technique must declare them in its [`PipelineRequirements`].
    ///
    /// [`PipelineRequirements`]: crate::draw::PipelineRequirements
    pub fn terrain(&self, source: Source, topology: Topology) -> vk::Pipeline {
        let program = if source == Source::Lattice { source } else { Source::Resident };
        *self.terrain.get(&(program, topology)).expect("a kind of draw that the technique states")
    }

    fn make_sky(&self, formats: Formats) -> Result<vk::Pipeline> {
        let description = Description {
            name: "sky",
            vertex: "sky.vert",
            fragment: Some("sky.frag"),
            constants: &Constants::none(),
            input: vk::PipelineVertexInputStateCreateInfo::default(),
            topology: vk::PrimitiveTopology::TRIANGLE_LIST,
            wireframe: false,
            // Passes only where depth is still cleared.
            depth: formats.depth.map(|_| (false, vk::CompareOp::EQUAL)),
            cull: vk::CullModeFlags::NONE,
            formats: Some(formats),
        };
        make(&self.gpu, self.layout, description)
    }
}

/// The kinds of draws of a plan. `Resident` stands for streamed geometry too.
pub(super) fn draws(plan: &ScenePlan) -> impl Iterator<Item = (Source, Topology)> {
    let all = [Source::Lattice, Source::Resident]
        .into_iter()
        .flat_map(|source| [Topology::Triangles, Topology::Strip].map(|topology| (source, topology)));
    let stated = plan.draws;
    all.filter(move |&(source, topology)| stated.hold(source, topology))
}

/// The purpose of a terrain pipeline.
#[derive(Clone, Copy)]
pub(super) enum Pass {
    /// Draws a picture with these formats.
    Picture(Formats),
    /// Writes vertices to a buffer, without fragments.
    Capture,
}

/// Returns true if vertex normals light draws of a source.
fn lit_by_vertices(plan: &ScenePlan, source: Source) -> bool {
    plan.requirements.normals == Normals::Vertices && source != Source::Lattice
}

/// Vertex and fragment shader of a source.
fn programs(plan: &ScenePlan, source: Source) -> [&'static str; 2] {
    match source {
        Source::Lattice => ["lattice.vert", "terrain.frag"],
        _ if lit_by_vertices(plan, source) => ["explicit.normals.vert", "terrain.normals.frag"],
        Source::Resident | Source::Streamed => ["explicit.vert", "terrain.frag"],
    }
}

/// Number of pipelines of a plan's pictures, and of live instructions in their shaders under the plan's constants.
pub fn size(plan: &ScenePlan) -> [usize; 2] {
    let values = Constants::of(plan);
    let sky = ["sky.vert", "sky.frag"];
    let used: BTreeSet<_> = draws(plan).flat_map(|(source, _)| programs(plan, source)).chain(sky).collect();
    let instructions = used.into_iter().map(|name| live::instructions(&shaders::words(name), values.words()));
    [draws(plan).count() + 1, instructions.sum()]
}

/// Creates the pipeline of a pass for draws of a source and topology.
pub(super) fn terrain(
    gpu: &Arc<Gpu>,
    layout: vk::PipelineLayout,
    plan: &ScenePlan,
    pass: Pass,
    source: Source,
    topology: Topology,
) -> Result<vk::Pipeline> {
    let constants = Constants::of(plan);
    let (stride, mut attributes) = vertex_input(source);
    let mut bindings = vec![
        vk::VertexInputBindingDescription::default().binding(0).stride(stride),
        vk::VertexInputBindingDescription::default()
            .binding(1)
            .stride(size_of::<Instance>() as u32)
            .input_rate(vk::VertexInputRate::INSTANCE),
    ];
    if lit_by_vertices(plan, source) && matches!(pass, Pass::Picture(_)) {
        bindings
            .push(vk::VertexInputBindingDescription::default().binding(2).stride(size_of::<VertexNormals>() as u32));
        let format = vk::Format::R32G32B32_UINT;
        attributes.push(vk::VertexInputAttributeDescription { location: 6, binding: 2, format, offset: 0 });
    }
    let (name, capture) = match source {
        Source::Lattice => ("lattice", "lattice.capture.vert"),
        Source::Resident | Source::Streamed => ("explicit", "explicit.capture.vert"),
    };
    let (vertex, fragment, formats) = match pass {
        Pass::Picture(formats) => {
            let [vertex, fragment] = programs(plan, source);
            (vertex, Some(fragment), Some(formats))
        }
        Pass::Capture => (capture, None, None),
    };
    let nearer = |formats: Formats| if formats.is_reversed { vk::CompareOp::GREATER } else { vk::CompareOp::LESS };
    let depth = formats.filter(|formats| formats.depth.is_some()).map(|formats| (true, nearer(formats)));
    let description = Description {
        name,
        vertex,
        fragment,
        constants: &constants,
        input: vk::PipelineVertexInputStateCreateInfo::default()
            .vertex_binding_descriptions(&bindings)
            .vertex_attribute_descriptions(&attributes),
        topology: match topology {
            Topology::Triangles => vk::PrimitiveTopology::TRIANGLE_LIST,
            Topology::Strip => vk::PrimitiveTopology::TRIANGLE_STRIP,
        },
        wireframe: plan.wireframe,
        depth,
        cull: vk::CullModeFlags::BACK,
        formats,
    };
    make(gpu, layout, description)
}

/// Makes a graphics pipeline.
pub(super) fn make(gpu: &Arc<Gpu>, layout: vk::PipelineLayout, d: Description) -> Result<vk::Pipeline> {
    let vertex = shaders::module(gpu, d.vertex)?;
    let fragment = d.fragment.map(|name| shaders::module(gpu, name)).transpose()?;
    let special = d.constants.info();
    let stage = |stage, module| {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(stage)
            .module(module)
            .name(c"main")
            .specialization_info(&special)
    };
    let mut stages = vec![stage(vk::ShaderStageFlags::VERTEX, vertex)];
    stages.extend(fragment.map(|module| stage(vk::ShaderStageFlags::FRAGMENT, module)));
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
        .topology(d.topology)
        .primitive_restart_enable(d.topology == vk::PrimitiveTopology::TRIANGLE_STRIP);
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let polygon = if d.wireframe { vk::PolygonMode::LINE } else { vk::PolygonMode::FILL };
    let raster = vk::PipelineRasterizationStateCreateInfo::default()
        .polygon_mode(polygon)
        .cull_mode(d.cull)
        .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
        .line_width(1.0)
        // Capturing needs only the writes of the vertex shader.
        .rasterizer_discard_enable(fragment.is_none());
    let samples = vk::PipelineMultisampleStateCreateInfo::default()
        .rasterization_samples(d.formats.map_or(vk::SampleCountFlags::TYPE_1, |formats| formats.samples));
    let depth = vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(d.depth.is_some())
        .depth_write_enable(d.depth.is_some_and(|(writes, _)| writes))
        .depth_compare_op(d.depth.map_or(vk::CompareOp::ALWAYS, |(_, compare)| compare));
    let colours: Vec<_> = d.formats.iter().map(|formats| formats.colour).collect();
    let blend = vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA);
    let blend = vec![blend; colours.len()];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blend);
    let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
    let depth_format = d.formats.and_then(|formats| formats.depth).unwrap_or(vk::Format::UNDEFINED);
    let mut rendering = vk::PipelineRenderingCreateInfo::default()
        .color_attachment_formats(&colours)
        .depth_attachment_format(depth_format)
        .stencil_attachment_format(d.formats.map_or(vk::Format::UNDEFINED, |formats| formats.stencil));
    let render_pass = d.formats.and_then(|formats| formats.render_pass);
    let (pass, subpass) = render_pass.unwrap_or((vk::RenderPass::null(), 0));
    let info = vk::GraphicsPipelineCreateInfo::default()
        .stages(&stages)
        .vertex_input_state(&d.input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&samples)
        .depth_stencil_state(&depth)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout)
        .render_pass(pass)
        .subpass(subpass);
    let info = if render_pass.is_none() { info.push_next(&mut rendering) } else { info };
    // SAFETY: all that the info points to lives here; modules may go once the pipeline is made.
    let made = unsafe { gpu.raw.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None) };
    // SAFETY: nothing uses the modules any more.
    unsafe {
        gpu.raw.destroy_shader_module(vertex, None);
        fragment.into_iter().for_each(|module| gpu.raw.destroy_shader_module(module, None));
    }
    let pipeline = made.map_err(|(_, e)| e).with_context(|| format!("pipeline {}", d.name))?[0];
    gpu.name(pipeline, d.name);
    Ok(pipeline)
}

/// Creates a compute pipeline.
pub(super) fn compute(
    gpu: &Arc<Gpu>,
    layout: vk::PipelineLayout,
    name: &str,
    shader: &str,
    constants: &Constants,
) -> Result<vk::Pipeline> {
    let module = shaders::module(gpu, shader)?;
    let special = constants.info();
    let stage = vk::PipelineShaderStageCreateInfo::default()
        .stage(vk::ShaderStageFlags::COMPUTE)
        .module(module)
        .name(c"main")
        .specialization_info(&special);
    let info = [vk::ComputePipelineCreateInfo::default().stage(stage).layout(layout)];
    // SAFETY: everything that the info points to is alive; the module may be destroyed once the pipeline exists.
    let made = unsafe {
        let made = gpu.raw.create_compute_pipelines(vk::PipelineCache::null(), &info, None);
        gpu.raw.destroy_shader_module(module, None);
        made
    };
    let pipeline = made.map_err(|(_, e)| e).with_context(|| format!("pipeline {name}"))?[0];
    gpu.name(pipeline, name);
    Ok(pipeline)
}

/// The differences between the graphics pipelines.
pub(super) struct Description<'a> {
    pub name: &'static str,
    pub vertex: &'static str,
    pub fragment: Option<&'static str>,
    pub constants: &'a Constants,
    pub input: vk::PipelineVertexInputStateCreateInfo<'a>,
    pub topology: vk::PrimitiveTopology,
    pub wireframe: bool,
    /// True if it writes depth, and its depth test; `None`: no depth buffer.
    pub depth: Option<(bool, vk::CompareOp)>,
    pub cull: vk::CullModeFlags,
    /// Formats of the attachments; `None`: there are none.
    pub formats: Option<Formats>,
}

/// Vertex stride and attributes of a source.
fn vertex_input(source: Source) -> (u32, Vec<vk::VertexInputAttributeDescription>) {
    let attribute = |binding: u32| {
        move |(location, format, offset): (u32, vk::Format, usize)| vk::VertexInputAttributeDescription {
            location,
            binding,
            format,
            offset: offset as u32,
        }
    };
    const PAIR: vk::Format = vk::Format::R32G32_SINT;
    const UINT: vk::Format = vk::Format::R32_UINT;
    const FLOAT: vk::Format = vk::Format::R32_SFLOAT;
    const WEIGHTS: vk::Format = vk::Format::R32G32B32A32_UINT;
    let (stride, vertex) = match source {
        Source::Lattice => (size_of::<LatticeVertex>(), vec![(0, PAIR, offset_of!(LatticeVertex, position))]),
        Source::Resident | Source::Streamed => (
            size_of::<ExplicitVertex>(),
            vec![
                (0, PAIR, offset_of!(ExplicitVertex, position)),
                (1, FLOAT, offset_of!(ExplicitVertex, height)),
                (2, FLOAT, offset_of!(ExplicitVertex, target)),
                (3, FLOAT, offset_of!(ExplicitVertex, second_target)),
                (4, FLOAT, offset_of!(ExplicitVertex, morph)),
                (5, UINT, offset_of!(ExplicitVertex, regions)),
            ],
        ),
    };
    let instance = [
        (8, PAIR, offset_of!(Instance, origin)),
        (9, UINT, offset_of!(Instance, cells)),
        (10, vk::Format::R32_SINT, offset_of!(Instance, shift)),
        (11, UINT, offset_of!(Instance, rotation)),
        (12, UINT, offset_of!(Instance, level)),
        (13, UINT, offset_of!(Instance, batch)),
        (15, WEIGHTS, offset_of!(Instance, weights_words)),
    ];
    // Explicit vertices have weights of one kind: their shader does not read the tag.
    let tag = (source == Source::Lattice).then_some((14, UINT, offset_of!(Instance, weights_kind)));
    let instance = instance.into_iter().chain(tag).map(attribute(1));
    let attributes = vertex.into_iter().map(attribute(0)).chain(instance).collect();
    (stride as u32, attributes)
}

impl Drop for Pipelines {
    fn drop(&mut self) {
        // SAFETY: owners wait for the device before they drop their pipelines.
        unsafe {
            for pipeline in self.terrain.values() {
                self.gpu.raw.destroy_pipeline(*pipeline, None);
            }
            self.gpu.raw.destroy_pipeline(self.sky, None);
            self.gpu.raw.destroy_pipeline_layout(self.layout, None);
            self.gpu.raw.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}
