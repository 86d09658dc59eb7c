//! Terrain inside another program's Vulkan renderer.
//!
//! The host program has its own instance, device, allocator, attachments, depth buffer and pipeline. It draws one cube before
//! the terrain and one after it. Each cube is partly in the ground or partly behind a ridge.
//!
//! `cargo run --release --example embed` writes `embed.png`. It exits with 1 if the validation layers report anything.
#![allow(unsafe_code)]

#[path = "embed/host.rs"]
mod host;

use std::sync::Arc;

use anyhow::Result;
use ash::vk;
use cuesta::embed::{DepthTarget, SelectionStats, Target, TerrainDescription, TerrainRenderer};
use cuesta::glam::{DVec3, Vec4};
use cuesta::offscreen::{Colour, Look};
use cuesta::techniques::Techniques;
use cuesta::{Lens, Metric, Tolerance, View, heights};

use host::{Attachment, Host, Readback};

const SIZE: [u32; 2] = [640, 360];
const COLOUR: vk::Format = vk::Format::R8G8B8A8_SRGB;
/// Frames whose commands may be under way at once.
const FRAMES_IN_FLIGHT: usize = 2;
/// The camera moves for some frames; the last one is the picture.
const FRAMES: usize = 3;

/// The technique, and conventions of the host's renderer.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Name of the technique.
    pub technique: &'static str,
    /// True if the host drops its first frame after the selection, as on a swapchain that is out of date.
    pub drops_a_frame: bool,
    /// True if depth is 1 at the near plane.
    pub is_reversed: bool,
    /// Distance of the far plane, metres; `None`: at infinity.
    pub far_m: Option<f64>,
    /// Format of the depth buffer.
    pub depth: vk::Format,
    /// True if clip space has y up and the viewport a negative height.
    pub is_y_up: bool,
    /// True if the host draws in a render pass, false if it uses dynamic rendering.
    pub has_render_pass: bool,
}

/// The picture, and how it came about.
pub struct Outcome {
    /// The picture.
    pub picture: image::RgbaImage,
    /// Messages of the validation layers.
    pub messages: Vec<String>,
    /// The terrain selected for the picture.
    pub stats: SelectionStats,
}

#[allow(dead_code)]
fn main() -> Result<()> {
    let outcome = render(Options::default())?;
    outcome.picture.save("embed.png")?;
    println!("embed.png: {:?}", outcome.stats);
    outcome.messages.iter().for_each(|message| eprintln!("{message}"));
    std::process::exit(i32::from(!outcome.messages.is_empty()))
}

impl Default for Options {
    fn default() -> Self {
        Self {
            technique: "geomipmap",
            drops_a_frame: false,
            is_reversed: true,
            far_m: None,
            depth: vk::Format::D32_SFLOAT,
            is_y_up: false,
            has_render_pass: false,
        }
    }
}

/// Draws the picture with a renderer of these options.
pub fn render(options: Options) -> Result<Outcome> {
    let look = Look { colour: Colour::Overlay, ..Look::default() };
    let host = Host::new(&TerrainRenderer::requirements(&target(options, None), &look))?;
    let renderer = Renderer::new(&host, options)?;
    let field = Arc::new(heights::demo());
    let description = TerrainDescription {
        technique: Techniques::built_in().prepare(options.technique, &field).map_err(anyhow::Error::msg)?,
        field,
        look,
        overlay: Some(&image::load_from_memory(include_bytes!("../assets/demo_overlay.jpg"))?.into_rgba8()),
        target: renderer.target,
        frames_in_flight: FRAMES_IN_FLIGHT,
    };
    // SAFETY: the host's handles live until the terrain is dropped, and the device has the features it needs.
    let mut terrain = unsafe { TerrainRenderer::from_raw(host.handles(), description)? };
    for frame in 0..FRAMES {
        let view = view(&terrain, frame);
        terrain.update(&view);
        if frame == 0 && options.drops_a_frame {
            terrain.update(&view);
        }
        renderer.draw(&mut terrain, &view, frame % FRAMES_IN_FLIGHT)?;
    }
    // SAFETY: one thread uses the device. The terrain is dropped after its last frame.
    unsafe { host.device.device_wait_idle()? };
    let stats = terrain.stats();
    drop(terrain);
    let picture = renderer.picture();
    renderer.destroy()?;
    Ok(Outcome { picture, messages: host.close()?, stats })
}

fn target(options: Options, render_pass: Option<(vk::RenderPass, u32)>) -> Target {
    let Options { is_reversed, far_m, depth, is_y_up, .. } = options;
    let depth = DepthTarget { format: depth, has_stencil: false, is_reversed, far_m };
    Target { depth: Some(depth), is_y_up, render_pass, ..Target::new(COLOUR, depth.format) }
}

/// Looks along a valley, and comes closer frame by frame.
fn view(terrain: &TerrainRenderer, frame: usize) -> View {
    let back_m = 100.0 * (FRAMES - 1 - frame) as f64;
    let ground = |x: f64, z: f64| terrain.height_at(x, z).unwrap_or_default();
    let eye = DVec3::new(EYE[0], ground(EYE[0], EYE[1]) + 600.0, EYE[1]);
    let towards = DVec3::new(LOOK[0], ground(LOOK[0], LOOK[1]), LOOK[1]);
    let world_from_eye = View::looking_along(towards - eye);
    View {
        eye: eye + world_from_eye.z_axis * back_m,
        world_from_eye,
        lens: Lens::Perspective { fov_x: 60f64.to_radians() },
        size: SIZE,
        near: 20.0,
        tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
        time_s: 0.0,
    }
}

/// World position (x, z) of the eye, metres.
const EYE: [f64; 2] = [12_000.0, 18_500.0];
/// World position (x, z) that it looks at.
const LOOK: [f64; 2] = [9_000.0, 14_500.0];

/// A cube, drawn by the host's own pipeline.
struct Cube {
    /// World position (x, z) of the centre, metres.
    at: [f64; 2],
    /// Height of the centre above the ground, metres.
    above: f64,
    /// Half the side, metres.
    half: f64,
    colour: [f32; 3],
}

/// Drawn before the terrain: it stands in the ground.
const FIRST: Cube = Cube { at: [10_868.0, 17_100.0], above: 20.0, half: 100.0, colour: [0.8, 0.05, 0.03] };
/// Drawn after the terrain: a ridge hides its lower part.
const SECOND: Cube = Cube { at: [10_947.0, 16_040.0], above: 100.0, half: 200.0, colour: [0.03, 0.15, 0.8] };

/// The host's renderer: attachments, frames in flight, and the pipeline of the cubes.
struct Renderer<'a> {
    host: &'a Host,
    target: Target,
    colour: Attachment,
    depth: Attachment,
    readback: Readback,
    framebuffer: vk::Framebuffer,
    layout: vk::PipelineLayout,
    pipeline: vk::Pipeline,
    pool: vk::CommandPool,
    frames: Vec<(vk::CommandBuffer, vk::Fence)>,
}

impl<'a> Renderer<'a> {
    fn new(host: &'a Host, options: Options) -> Result<Self> {
        use vk::ImageUsageFlags as Usage;
        let device = &host.device;
        let colour = host.attachment(SIZE, COLOUR, Usage::COLOR_ATTACHMENT | Usage::TRANSFER_SRC)?;
        let depth = host.attachment(SIZE, options.depth, Usage::DEPTH_STENCIL_ATTACHMENT)?;
        let readback = host.readback(4 * u64::from(SIZE[0] * SIZE[1]))?;
        let (render_pass, framebuffer) = match options.has_render_pass {
            true => render_pass(host, &colour, &depth)?,
            false => (vk::RenderPass::null(), vk::Framebuffer::null()),
        };
        let target = target(options, options.has_render_pass.then_some((render_pass, 0)));
        let (layout, pipeline) = cube_pipeline(host, &target)?;
        // SAFETY: the device is alive.
        let (pool, frames) = unsafe {
            let flags = vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER;
            let info = vk::CommandPoolCreateInfo::default().queue_family_index(host.queue_family).flags(flags);
            let pool = device.create_command_pool(&info, None)?;
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(pool)
                .command_buffer_count(FRAMES_IN_FLIGHT as u32);
            let signalled = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
            let commands = device.allocate_command_buffers(&info)?;
            let frames = commands.into_iter().map(|commands| Ok((commands, device.create_fence(&signalled, None)?)));
            (pool, frames.collect::<Result<_>>()?)
        };
        Ok(Self { host, target, colour, depth, readback, framebuffer, layout, pipeline, pool, frames })
    }

    /// Draws a frame: a cube, the terrain, and another cube.
    fn draw(&self, terrain: &mut TerrainRenderer, view: &View, index: usize) -> Result<()> {
        let (device, (commands, fence)) = (&self.host.device, self.frames[index]);
        let info = vk::CommandBufferBeginInfo::default().flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the fence says that the frame's last commands have finished; one thread uses the queue.
        unsafe {
            device.wait_for_fences(&[fence], true, u64::MAX)?;
            device.reset_fences(&[fence])?;
            device.begin_command_buffer(commands, &info)?;
            terrain.prepare(commands, index)?;
            self.begin(commands);
            self.draw_cube(commands, terrain, view, &FIRST);
            terrain.draw(commands)?;
            self.draw_cube(commands, terrain, view, &SECOND);
            self.end(commands);
            device.end_command_buffer(commands)?;
            let buffers = [commands];
            device.queue_submit(self.host.queue, &[vk::SubmitInfo::default().command_buffers(&buffers)], fence)?;
        }
        Ok(())
    }

    /// Records the start of the pass: the attachments are cleared to the sky and the far plane.
    unsafe fn begin(&self, commands: vk::CommandBuffer) {
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
        let device = &self.host.device;
        let tests = Stage::EARLY_FRAGMENT_TESTS | Stage::LATE_FRAGMENT_TESTS;
        let colour = (Stage::COLOR_ATTACHMENT_OUTPUT, Access::COLOR_ATTACHMENT_WRITE);
        let depth = (tests, Access::DEPTH_STENCIL_ATTACHMENT_READ | Access::DEPTH_STENCIL_ATTACHMENT_WRITE);
        // After the frame before: it copied the colours and wrote the depth.
        let colour = barrier(self.colour.image, false)
            .src_stage_mask(Stage::COPY)
            .dst_stage_mask(colour.0)
            .dst_access_mask(colour.1)
            .new_layout(Layout::COLOR_ATTACHMENT_OPTIMAL);
        let depth = barrier(self.depth.image, true)
            .src_stage_mask(tests)
            .src_access_mask(Access::DEPTH_STENCIL_ATTACHMENT_WRITE)
            .dst_stage_mask(depth.0)
            .dst_access_mask(depth.1)
            .new_layout(Layout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL);
        let is_reversed = self.target.depth.is_some_and(|depth| depth.is_reversed);
        let far = vk::ClearDepthStencilValue { depth: if is_reversed { 0.0 } else { 1.0 }, stencil: 0 };
        let sky = vk::ClearColorValue { float32: [0.35, 0.5, 0.75, 1.0] };
        let clear = [vk::ClearValue { color: sky }, vk::ClearValue { depth_stencil: far }];
        let extent = vk::Extent2D { width: SIZE[0], height: SIZE[1] };
        let area = vk::Rect2D { extent, ..Default::default() };
        // SAFETY: the attachments live until the frame has finished.
        unsafe {
            let barriers = [colour, depth];
            device.cmd_pipeline_barrier2(commands, &vk::DependencyInfo::default().image_memory_barriers(&barriers));
            match self.target.render_pass {
                Some((pass, _)) => {
                    let info = vk::RenderPassBeginInfo::default()
                        .render_pass(pass)
                        .framebuffer(self.framebuffer)
                        .render_area(area)
                        .clear_values(&clear);
                    device.cmd_begin_render_pass(commands, &info, vk::SubpassContents::INLINE);
                }
                None => {
                    let attachment = |view, layout, clear| {
                        vk::RenderingAttachmentInfo::default()
                            .image_view(view)
                            .image_layout(layout)
                            .load_op(vk::AttachmentLoadOp::CLEAR)
                            .store_op(vk::AttachmentStoreOp::STORE)
                            .clear_value(clear)
                    };
                    let colours = [attachment(self.colour.view, Layout::COLOR_ATTACHMENT_OPTIMAL, clear[0])];
                    let depth = attachment(self.depth.view, Layout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL, clear[1]);
                    let info = vk::RenderingInfo::default()
                        .render_area(area)
                        .layer_count(1)
                        .color_attachments(&colours)
                        .depth_attachment(&depth);
                    device.cmd_begin_rendering(commands, &info);
                }
            }
            let [width, height] = SIZE.map(|side| side as f32);
            let down = vk::Viewport { x: 0.0, y: 0.0, width, height, min_depth: 0.0, max_depth: 1.0 };
            let up = vk::Viewport { y: height, height: -height, ..down };
            device.cmd_set_viewport(commands, 0, &[if self.target.is_y_up { up } else { down }]);
            device.cmd_set_scissor(commands, 0, &[area]);
        }
    }

    unsafe fn draw_cube(&self, commands: vk::CommandBuffer, terrain: &TerrainRenderer, view: &View, cube: &Cube) {
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

    /// Records the end of the pass, and the copy of the colours to the host.
    unsafe fn end(&self, commands: vk::CommandBuffer) {
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
        let device = &self.host.device;
        let drawn = [barrier(self.colour.image, false)
            .src_stage_mask(Stage::COLOR_ATTACHMENT_OUTPUT)
            .src_access_mask(Access::COLOR_ATTACHMENT_WRITE)
            .old_layout(Layout::COLOR_ATTACHMENT_OPTIMAL)
            .dst_stage_mask(Stage::COPY)
            .dst_access_mask(Access::TRANSFER_READ)
            .new_layout(Layout::TRANSFER_SRC_OPTIMAL)];
        // The frame before copied to the same buffer.
        let copied = [vk::MemoryBarrier2::default()
            .src_stage_mask(Stage::COPY)
            .src_access_mask(Access::TRANSFER_WRITE)
            .dst_stage_mask(Stage::COPY | Stage::HOST)
            .dst_access_mask(Access::TRANSFER_WRITE | Access::HOST_READ)];
        let layers = vk::ImageSubresourceLayers::default().aspect_mask(vk::ImageAspectFlags::COLOR).layer_count(1);
        let extent = vk::Extent3D { width: SIZE[0], height: SIZE[1], depth: 1 };
        let region = [vk::BufferImageCopy::default().image_subresource(layers).image_extent(extent)];
        // SAFETY: `begin` began the pass; image and buffer live until the frame has finished.
        unsafe {
            match self.target.render_pass {
                Some(_) => device.cmd_end_render_pass(commands),
                None => device.cmd_end_rendering(commands),
            }
            let (image, buffer) = (self.colour.image, self.readback.buffer);
            device.cmd_pipeline_barrier2(commands, &vk::DependencyInfo::default().image_memory_barriers(&drawn));
            device.cmd_copy_image_to_buffer(commands, image, Layout::TRANSFER_SRC_OPTIMAL, buffer, &region);
            device.cmd_pipeline_barrier2(commands, &vk::DependencyInfo::default().memory_barriers(&copied));
        }
    }

    /// The last frame, once it has finished.
    fn picture(&self) -> image::RgbaImage {
        let bytes = self.readback.bytes()[..4 * (SIZE[0] * SIZE[1]) as usize].to_vec();
        image::RgbaImage::from_raw(SIZE[0], SIZE[1], bytes).expect("four bytes a pixel")
    }

    /// Destroys everything; the device is idle.
    fn destroy(self) -> Result<()> {
        let device = &self.host.device;
        // SAFETY: the device is idle.
        unsafe {
            self.frames.iter().for_each(|(_, fence)| device.destroy_fence(*fence, None));
            device.destroy_command_pool(self.pool, None);
            device.destroy_pipeline(self.pipeline, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_framebuffer(self.framebuffer, None);
            device.destroy_render_pass(self.target.render_pass.unwrap_or_default().0, None);
        }
        self.host.destroy_attachment(self.colour)?;
        self.host.destroy_attachment(self.depth)?;
        self.host.destroy_readback(self.readback)
    }
}

/// A barrier for a whole attachment whose content is not kept.
fn barrier(image: vk::Image, is_depth: bool) -> vk::ImageMemoryBarrier2<'static> {
    let usage = if is_depth { vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT } else { vk::ImageUsageFlags::empty() };
    vk::ImageMemoryBarrier2::default()
        .image(image)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .subresource_range(host::range(usage))
}

/// Creates a render pass with both attachments, and its framebuffer.
fn render_pass(host: &Host, colour: &Attachment, depth: &Attachment) -> Result<(vk::RenderPass, vk::Framebuffer)> {
    use vk::ImageLayout as Layout;
    let description = |attachment: &Attachment, layout| {
        vk::AttachmentDescription::default()
            .format(attachment.format)
            .samples(vk::SampleCountFlags::TYPE_1)
            .load_op(vk::AttachmentLoadOp::CLEAR)
            .store_op(vk::AttachmentStoreOp::STORE)
            .stencil_load_op(vk::AttachmentLoadOp::DONT_CARE)
            .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
            .initial_layout(layout)
            .final_layout(layout)
    };
    let layouts = [Layout::COLOR_ATTACHMENT_OPTIMAL, Layout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL];
    let attachments = [description(colour, layouts[0]), description(depth, layouts[1])];
    let colours = [vk::AttachmentReference { attachment: 0, layout: layouts[0] }];
    let deep = vk::AttachmentReference { attachment: 1, layout: layouts[1] };
    let subpasses = [vk::SubpassDescription::default()
        .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
        .color_attachments(&colours)
        .depth_stencil_attachment(&deep)];
    let info = vk::RenderPassCreateInfo::default().attachments(&attachments).subpasses(&subpasses);
    // SAFETY: the device is alive.
    unsafe {
        let pass = host.device.create_render_pass(&info, None)?;
        let views = [colour.view, depth.view];
        let info = vk::FramebufferCreateInfo::default()
            .render_pass(pass)
            .attachments(&views)
            .width(SIZE[0])
            .height(SIZE[1])
            .layers(1);
        Ok((pass, host.device.create_framebuffer(&info, None)?))
    }
}

/// Creates the pipeline of the cubes for the attachments of a target.
fn cube_pipeline(host: &Host, target: &Target) -> Result<(vk::PipelineLayout, vk::Pipeline)> {
    let device = &host.device;
    let module = |bytes: &[u8]| {
        let words = ash::util::read_spv(&mut std::io::Cursor::new(bytes))?;
        // SAFETY: the words are SPIR-V.
        let module = unsafe { device.create_shader_module(&vk::ShaderModuleCreateInfo::default().code(&words), None)? };
        anyhow::Ok(module)
    };
    // Compiled by `glslc --target-env=vulkan1.3 -O cube.vert -o cube.vert.spv`, and alike.
    let vertex = module(include_bytes!("embed/cube.vert.spv"))?;
    let fragment = module(include_bytes!("embed/cube.frag.spv"))?;
    let stage = |stage, module| vk::PipelineShaderStageCreateInfo::default().stage(stage).module(module).name(c"main");
    let stages = [stage(vk::ShaderStageFlags::VERTEX, vertex), stage(vk::ShaderStageFlags::FRAGMENT, fragment)];
    let input = vk::PipelineVertexInputStateCreateInfo::default();
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewport = vk::PipelineViewportStateCreateInfo::default().viewport_count(1).scissor_count(1);
    let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let samples = vk::PipelineMultisampleStateCreateInfo::default().rasterization_samples(target.samples);
    let is_reversed = target.depth.is_some_and(|depth| depth.is_reversed);
    let depth = vk::PipelineDepthStencilStateCreateInfo::default()
        .depth_test_enable(true)
        .depth_write_enable(true)
        .depth_compare_op(if is_reversed { vk::CompareOp::GREATER } else { vk::CompareOp::LESS });
    let blend = [vk::PipelineColorBlendAttachmentState::default().color_write_mask(vk::ColorComponentFlags::RGBA)];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&blend);
    let dynamic = [vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR];
    let dynamic = vk::PipelineDynamicStateCreateInfo::default().dynamic_states(&dynamic);
    let constants = [vk::PushConstantRange::default().stage_flags(vk::ShaderStageFlags::VERTEX).size(96)];
    let colours = [target.colour];
    let mut rendering = vk::PipelineRenderingCreateInfo::default()
        .color_attachment_formats(&colours)
        .depth_attachment_format(target.depth.map_or(vk::Format::UNDEFINED, |depth| depth.format));
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
        Ok((layout, made.map_err(|(_, error)| error)?[0]))
    }
}
