//! Cubes, drawn by the host's own pipeline.

use anyhow::Result;
use ash::vk;
use cuesta::View;
use cuesta::embed::{Target, TerrainRenderer};
use cuesta::glam::{DVec3, Vec4};

use super::host::Host;

/// A cube over the terrain.
pub struct Cube {
    /// World position (x, z) of the centre, metres.
    at: [f64; 2],
    /// Height of the centre above the ground, metres.
    above: f64,
    /// Half the side, metres.
    half: f64,
    colour: [f32; 3],
}

/// Drawn before the terrain: it stands in the ground.
pub const FIRST: Cube = Cube { at: [10_868.0, 17_100.0], above: 20.0, half: 100.0, colour: [0.8, 0.05, 0.03] };
/// Drawn after the terrain: a ridge hides its lower part.
pub const SECOND: Cube = Cube { at: [10_947.0, 16_040.0], above: 100.0, half: 200.0, colour: [0.03, 0.15, 0.8] };

/// The pipeline of the cubes.
pub struct CubePipeline<'a> {
    host: &'a Host,
    target: Target,
    layout: vk::PipelineLayout,
    pipeline: vk::Pipeline,
}

impl<'a> CubePipeline<'a> {
    /// Creates the pipeline for the attachments of a target.
    pub fn new(host: &'a Host, target: Target) -> Result<Self> {
        let device = &host.device;
        let module = |bytes: &[u8]| {
            let words = ash::util::read_spv(&mut std::io::Cursor::new(bytes))?;
            let info = vk::ShaderModuleCreateInfo::default().code(&words);
            // SAFETY: the words are SPIR-V.
            anyhow::Ok(unsafe { device.create_shader_module(&info, None)? })
        };
        // The build script of the crate compiles `cube.vert` and `cube.frag`.
        let vertex = module(include_bytes!(concat!(env!("OUT_DIR"), "/cube.vert.spv")))?;
        let fragment = module(include_bytes!(concat!(env!("OUT_DIR"), "/cube.frag.spv")))?;
        let stage =
            |stage, module| vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main");
        let stages = [stage(vk::ShaderStageFlags::VERTEX, vertex), stage(vk::ShaderStageFlags::FRAGMENT, fragment)];
        let input = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
        let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
        let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(target.samples);
        let is_reversed = target.depth.is_some_and(|depth| depth.is_reversed);
        let depth = vk::PipelineDepthStencilStateCreateInfo::default()
            .depth_test_enable(target.depth.is_some())
            .depth_write_enable(target.depth.is_some())
            .depth_compare_op(if is_reversed { vk::CompareOp::GREATER } else { vk::CompareOp::LESS });
        let blend = [vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blend);
        let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
        let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
        let constants = [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::VERTEX).size(96)];
        let colours = [target.colour];
        let stencil = target.depth.filter(|depth| depth.has_stencil);
        let mut rendering = vk::PipelineRenderingCreateInfo::default()
            .color_attachment_formats(&colours)
            .depth_attachment_format(target.depth.map_or(vk::Format::UNDEFINED, |depth| depth.format))
            .stencil_attachment_format(stencil.map_or(vk::Format::UNDEFINED, |depth| depth.format));
        // SAFETY: all pointers live until the calls return.
        unsafe {
            let info = vk::PipelineLayoutCreateInfo::default().push_constant_ranges(&constants);
            let layout = device.create_pipeline_layout(&info, None)?;
            let info = vk::GraphicsPipelineCreateInfo::default()
                .stages(&stages)
                .vertex_input_state(&input)
                .input_assembly_state(&assembly)
                .viewport_state(&viewport)
                .rasterization_state(&raster)
                .multisample_state(&samples)
                .depth_stencil_state(&depth)
                .color_blend_state(&blend)
                .dynamic_state(&dynamic)
                .layout(layout);
            let info = match target.render_pass {
                Some((pass, subpass)) => info.render_pass(pass).subpass(subpass),
                None => info.push_next(&mut rendering),
            };
            let made = device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None);
            device.destroy_shader_module(vertex, None);
            device.destroy_shader_module(fragment, None);
            Ok(Self { host, target, layout, pipeline: made.map_err(|(_, error)| error)?[0] })
        }
    }

    /// Records the draw of a cube.
    ///
    /// # Safety
    /// `commands` is inside a pass with the attachments of the target.
    pub unsafe fn draw(&self, commands: vk::CommandBuffer, terrain: &TerrainRenderer, view: &View, cube: &Cube) {
        let [x, z] = cube.at;
        let centre = DVec3::new(x, terrain.height_at(x, z).unwrap_or_default() + cube.above, z);
        let relative = (centre - view.eye).as_vec3().extend(cube.half as f32);
        let clip = self.target.clip_from_relative(view).as_mat4();
        let [red, green, blue] = cube.colour;
        let columns = [clip.x_axis, clip.y_axis, clip.z_axis, clip.w_axis, relative, Vec4::new(red, green, blue, 1.0)];
        let device = &self.host.device;
        // SAFETY: the pipeline lives until the frame has finished; 36 vertices without input.
        unsafe {
            let bytes = bytemuck::cast_slice(&columns);
            device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, self.pipeline);
            device.cmd_push_constants(commands, self.layout, vk::ShaderStageFlags::VERTEX, 0, bytes);
            device.cmd_draw(commands, 36, 1, 0, 0);
        }
    }

    /// Destroys the pipeline; the device is idle.
    pub fn destroy(self) {
        // SAFETY: the device is idle.
        unsafe {
            self.host.device.destroy_pipeline(self.pipeline, None);
            self.host.device.destroy_pipeline_layout(self.layout, None);
        }
    }
}
