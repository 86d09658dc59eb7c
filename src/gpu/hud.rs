//! Draws the egui overlay (HUD) over a frame.

use std::sync::Arc;

use anyhow::{Context, Result};
use ash::vk;
use egui::epaint::{ClippedPrimitive, Mesh, Primitive, Vertex};
use egui_ash_renderer::allocator::Allocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer, RendererError, RendererResult};

use super::device::Gpu;
use super::frames::{Recording, SLOTS};
use super::memory::{Buffer, Image, ImageInfo};
use super::target::Formats;

/// Vertices reserved for each frame in flight; the help overlay takes about a third.
const VERTICES: usize = 32 << 10;

/// egui's Vulkan renderer with its command pool.
pub struct Hud {
    renderer: Renderer<TrackedAllocator>,
    pool: vk::CommandPool,
    gpu: Arc<Gpu>,
    is_reserved: bool,
}

impl Hud {
    /// Creates a renderer for attachments of the given formats.
    pub fn new(gpu: &Arc<Gpu>, formats: Formats) -> Result<Self> {
        let mode = mode(formats);
        let is_srgb = format!("{:?}", formats.colour).contains("SRGB");
        let options = Options { in_flight_frames: SLOTS, srgb_framebuffer: is_srgb, ..Default::default() };
        let renderer = Renderer::with_allocator(TrackedAllocator(Arc::clone(gpu)), gpu.raw.clone(), mode, options)
            .context("the overlay's pipeline")?;
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(gpu.queue_family);
        // SAFETY: the device is alive; Drop destroys the pool.
        let pool = unsafe { gpu.raw.create_command_pool(&info, None) }?;
        Ok(Self { renderer, pool, gpu: Arc::clone(gpu), is_reserved: false })
    }

    /// Changes the attachment formats. Waits until the device is idle.
    pub fn reformat(&mut self, formats: Formats) -> Result<()> {
        self.gpu.wait_idle()?;
        self.renderer.set_render_mode(mode(formats)).context("the overlay's pipeline")
    }

    /// Applies texture changes between frames. Waits until the device is idle, since textures in use may change.
    pub fn update(&mut self, mut textures: egui::TexturesDelta) -> Result<()> {
        if textures.is_empty() {
            return Ok(());
        }
        self.gpu.wait_idle()?;
        for (id, changes) in textures.set.drain() {
            for change in changes {
                self.renderer.set_texture(self.gpu.queue, self.pool, id, &change).context("the overlay's font")?;
            }
        }
        textures.free.drain().try_for_each(|id| self.renderer.free_texture(id)).context("the overlay's font")
    }

    /// Records the overlay. Must be the last draw of a frame, while rendering is active.
    pub fn draw(
        &mut self,
        recording: &mut Recording,
        [width, height]: [u32; 2],
        pixels_per_point: f32,
        primitives: &mut Vec<ClippedPrimitive>,
    ) -> Result<()> {
        if primitives.is_empty() {
            return Ok(());
        }
        if !std::mem::replace(&mut self.is_reserved, true) {
            primitives.push(reserving_mesh(primitives));
        }
        let extent = vk::Extent2D { width, height };
        recording.scope("hud", |r| {
            self.renderer.cmd_draw(r.commands, extent, pixels_per_point, primitives).context("drawing the overlay")
        })
    }
}

fn mode(formats: Formats) -> RenderMode {
    RenderMode::DynamicRendering(DynamicRendering {
        color_attachment_format: formats.colour,
        depth_attachment_format: formats.depth,
        stencil_attachment_format: None,
    })
}

impl Drop for Hud {
    fn drop(&mut self) {
        // SAFETY: the device is idle, so nothing is in use. The renderer is dropped after this.
        unsafe {
            let _ = self.gpu.raw.device_wait_idle();
            self.gpu.raw.destroy_command_pool(self.pool, None);
        }
    }
}

/// Returns an invisible mesh that makes egui's renderer allocate its buffers at full size in the first frame, so that
/// no later frame allocates.
fn reserving_mesh(primitives: &[ClippedPrimitive]) -> ClippedPrimitive {
    let texture_id = primitives.iter().find_map(|p| match &p.primitive {
        Primitive::Mesh(mesh) => Some(mesh.texture_id),
        Primitive::Callback(_) => None,
    });
    let mesh = Mesh {
        indices: vec![0; 3 * VERTICES],
        vertices: vec![Vertex::default(); VERTICES],
        texture_id: texture_id.unwrap_or_default(),
    };
    ClippedPrimitive { clip_rect: egui::Rect::ZERO, primitive: Primitive::Mesh(mesh) }
}

/// An allocator whose buffers and images are named and counted in the device's memory statistics.
struct TrackedAllocator(Arc<Gpu>);

/// A buffer or an image.
enum Resource {
    Buffer(Buffer),
    Image(#[allow(dead_code, reason = "held for its drop")] Image),
}

fn allocator_error(error: anyhow::Error) -> RendererError {
    RendererError::Allocator(format!("{error:#}"))
}

impl Allocator for TrackedAllocator {
    type Allocation = Resource;

    fn create_buffer(
        &mut self,
        _: &ash::Device,
        size: usize,
        usage: vk::BufferUsageFlags,
    ) -> RendererResult<(vk::Buffer, Resource)> {
        let buffer = Buffer::host(&self.0, "hud", size as u64, usage).map_err(allocator_error)?;
        Ok((buffer.raw, Resource::Buffer(buffer)))
    }

    fn create_image(&mut self, _: &ash::Device, width: u32, height: u32) -> RendererResult<(vk::Image, Resource)> {
        let usage = vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::SAMPLED;
        let format = vk::Format::R8G8B8A8_SRGB;
        let info = ImageInfo { purpose: "hud", size: [width, height], layers: None, format, usage };
        let image = Image::new(&self.0, info).map_err(allocator_error)?;
        Ok((image.raw, Resource::Image(image)))
    }

    fn destroy_buffer(&mut self, _: &ash::Device, _: vk::Buffer, _: Resource) -> RendererResult<()> {
        Ok(())
    }

    fn destroy_image(&mut self, _: &ash::Device, _: vk::Image, _: Resource) -> RendererResult<()> {
        Ok(())
    }

    fn update_buffer<T: Copy>(&mut self, _: &ash::Device, memory: &mut Resource, data: &[T]) -> RendererResult<()> {
        if let Resource::Buffer(buffer) = memory {
            // SAFETY: vertices, indices and texels are plain data without padding.
            let bytes = unsafe { std::slice::from_raw_parts(data.as_ptr().cast(), size_of_val(data)) };
            buffer.write(0, bytes);
        }
        Ok(())
    }
}
