//! Terrain inside another program's Vulkan renderer.
//!
//! The host program has its own instance, device, allocator, attachments, depth buffer and pipeline. It draws one cube before
//! the terrain and one after it. Each cube is partly in the ground or partly behind a ridge.
//!
//! `cargo run --release --example embed` writes `embed.png`. It exits with 1 if the validation layers report anything.
#![allow(unsafe_code)]

#[path = "embed/attachments.rs"]
mod attachments;
#[path = "embed/cube.rs"]
mod cube;
#[path = "embed/host.rs"]
mod host;

use std::sync::Arc;

use anyhow::{Error, Result};
use ash::vk;
use cuesta::embed::{DepthTarget, SelectionStats, Target, TerrainDescription, TerrainRenderer};
use cuesta::glam::DVec3;
use cuesta::offscreen::{Colour, Look};
use cuesta::techniques::{Settings, Techniques};
use cuesta::{Lens, Metric, Tolerance, View, heights};

use attachments::Attachments;
use cube::CubePipeline;
use host::Host;

const SIZE: [u32; 2] = [640, 360];
const COLOUR: vk::Format = vk::Format::R8G8B8A8_SRGB;
/// Frames whose commands may be under way at once.
const FRAMES_IN_FLIGHT: usize = 2;
/// The camera moves for some frames; the last one is the picture.
pub const FRAMES: usize = 3;

/// The technique, and conventions of the host's renderer.
#[derive(Clone, Copy, Debug)]
pub struct Options {
    /// Name of the technique.
    pub technique: &'static str,
    /// Settings of the technique: name and value.
    pub settings: &'static [(&'static str, &'static str)],
    /// A frame that the host drops after the selection, as on a swapchain that is out of date. It then begins it again.
    pub dropped_frame: Option<usize>,
    /// True if the terrain allocates from the host's allocator, false if it brings its own.
    pub lends_allocator: bool,
    /// True if the host draws its cubes.
    pub has_cubes: bool,
    /// True if depth is 1 at the near plane.
    pub is_reversed: bool,
    /// Distance of the far plane, metres; `None`: at infinity.
    pub far_m: Option<f64>,
    /// Format of the depth buffer; `None`: there is none.
    pub depth: Option<vk::Format>,
    /// Samples of a pixel. Several are resolved.
    pub samples: vk::SampleCountFlags,
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
    /// Bytes of the host's allocator that the terrain held.
    pub borrowed_bytes: u64,
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
            settings: &[],
            dropped_frame: None,
            lends_allocator: true,
            has_cubes: true,
            is_reversed: true,
            far_m: None,
            depth: Some(vk::Format::D32_SFLOAT),
            samples: vk::SampleCountFlags::TYPE_1,
            is_y_up: false,
            has_render_pass: false,
        }
    }
}

/// Draws the picture with a renderer of these options.
pub fn render(options: Options) -> Result<Outcome> {
    let look = Look { colour: Colour::Overlay, ..Look::default() };
    let target = target(options);
    let host = Host::new(&TerrainRenderer::requirements(&target, &look))?;
    let renderer = Renderer::new(&host, target, options)?;
    let field = Arc::new(heights::demo());
    let techniques = Techniques::built_in();
    let entry = techniques.find(options.technique).expect("a built-in technique");
    let settings = options.settings.iter().map(|(name, value)| (name.to_string(), value.to_string()));
    let settings = Settings::new(entry, None, &settings.collect::<Vec<_>>()).map_err(Error::msg)?;
    let description = TerrainDescription {
        technique: entry.prepare(&field, &settings).map_err(Error::msg)?,
        field,
        look,
        overlay: Some(&image::load_from_memory(include_bytes!("../assets/demo_overlay.jpg"))?.into_rgba8()),
        target: renderer.attachments.target,
        frames_in_flight: FRAMES_IN_FLIGHT,
    };
    let own_bytes = host.allocated_bytes();
    // SAFETY: the host's handles live until the terrain is dropped, and the device has the features it needs.
    let mut terrain = unsafe { TerrainRenderer::from_raw(host.handles(options.lends_allocator), description)? };
    for frame in 0..FRAMES {
        let view = view(&terrain, frame);
        terrain.update(&view);
        if options.dropped_frame == Some(frame) {
            terrain.update(&view);
        }
        renderer.draw(&mut terrain, &view, frame % FRAMES_IN_FLIGHT)?;
    }
    // SAFETY: one thread uses the device. The terrain is dropped after its last frame.
    unsafe { host.device.device_wait_idle()? };
    let (stats, borrowed_bytes) = (terrain.stats(), host.allocated_bytes() - own_bytes);
    drop(terrain);
    let picture = renderer.attachments.picture();
    renderer.destroy()?;
    Ok(Outcome { picture, messages: host.close()?, stats, borrowed_bytes })
}

fn target(options: Options) -> Target {
    let Options { is_reversed, far_m, samples, is_y_up, .. } = options;
    let depth = |format| DepthTarget { format, has_stencil: host::has_stencil(format), is_reversed, far_m };
    Target { colour: COLOUR, depth: options.depth.map(depth), samples, render_pass: None, is_y_up }
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

/// The host's renderer: attachments, frames in flight, and the pipeline of the cubes.
struct Renderer<'a> {
    host: &'a Host,
    attachments: Attachments<'a>,
    cubes: Option<CubePipeline<'a>>,
    pool: vk::CommandPool,
    frames: Vec<(vk::CommandBuffer, vk::Fence)>,
}

impl<'a> Renderer<'a> {
    fn new(host: &'a Host, target: Target, options: Options) -> Result<Self> {
        let device = &host.device;
        let attachments = Attachments::new(host, SIZE, target, options.has_render_pass)?;
        let cubes = options.has_cubes.then(|| CubePipeline::new(host, attachments.target)).transpose()?;
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
        Ok(Self { host, attachments, cubes, pool, frames })
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
            self.attachments.begin(commands);
            if let Some(cubes) = &self.cubes {
                cubes.draw(commands, terrain, view, &cube::FIRST);
            }
            terrain.draw(commands)?;
            if let Some(cubes) = &self.cubes {
                cubes.draw(commands, terrain, view, &cube::SECOND);
            }
            self.attachments.end(commands);
            device.end_command_buffer(commands)?;
            let buffers = [commands];
            device.queue_submit(self.host.queue, &[vk::SubmitInfo::default().command_buffers(&buffers)], fence)?;
        }
        Ok(())
    }

    /// Destroys everything; the device is idle.
    fn destroy(self) -> Result<()> {
        let device = &self.host.device;
        // SAFETY: the device is idle.
        unsafe {
            self.frames.iter().for_each(|(_, fence)| device.destroy_fence(*fence, None));
            device.destroy_command_pool(self.pool, None);
        }
        self.cubes.into_iter().for_each(CubePipeline::destroy);
        self.attachments.destroy()
    }
}
