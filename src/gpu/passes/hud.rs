//! Pass `hud`: draws the text that egui lays out over a frame of the window.

use std::sync::Arc;

use anyhow::{Context, Result};
use ash::vk;
use egui::TexturesDelta;
use egui::epaint::{ClippedPrimitive, Mesh, Primitive, Vertex};
use egui_ash_renderer::allocator::Allocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer, RendererError, RendererResult};

use crate::gpu::device::{FRAMES_IN_FLIGHT, Gpu};
use crate::gpu::formats::Formats;
use crate::gpu::frames::Recording;
use crate::gpu::memory::{Buffer, Image, ImageInfo};
use crate::gpu::pass::{Occurs, Origin, Pass, PassInput, Resource, Row};
use crate::gpu::terrain::Terrain;

pub(super) static ROW: Row =
    Row { name: "hud", reads: &[], writes: &[Resource::Colour], occurs: Occurs::Last, origin: Origin::Caller };

/// Vertices per slot, allocated with the first frame. The help overlay takes about a third.
const VERTICES: usize = 32 << 10;

/// The overlay of one frame, as egui lays it out.
#[derive(Default)]
pub struct Painted {
    /// Changed textures.
    pub textures: TexturesDelta,
    /// Shapes to draw.
    pub primitives: Vec<ClippedPrimitive>,
    /// Pixels per egui point.
    pub pixels_per_point: f32,
}

/// egui's renderer, and the overlay to draw next.
pub struct Hud {
    painted: Painted,
    renderer: Renderer<Accounted>,
    pool: vk::CommandPool,
    gpu: Arc<Gpu>,
    is_reserved: bool,
}

impl Hud {
    /// Makes the pass for attachments of these formats.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn new(gpu: &Arc<Gpu>, formats: Formats) -> Result<Self> {
        let mode = mode(formats);
        let is_srgb = format!("{:?}", formats.colour).contains("SRGB");
        let options = Options { in_flight_frames: FRAMES_IN_FLIGHT, srgb_framebuffer: is_srgb, ..Default::default() };
        let renderer = Renderer::with_allocator(Accounted(Arc::clone(gpu)), gpu.raw.clone(), mode, options)
            .context("the overlay's pipeline")?;
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(gpu.queue_family);
        // SAFETY: the device is alive; Drop destroys the pool.
        let pool = unsafe { gpu.raw.create_command_pool(&info, None) }?;
        Ok(Self { painted: Painted::default(), renderer, pool, gpu: Arc::clone(gpu), is_reserved: false })
    }

    /// Changes the formats of the attachments. Waits for the device.
    ///
    /// # Errors
    /// If the device fails.
    pub fn reformat(&mut self, formats: Formats) -> Result<()> {
        self.gpu.wait_idle()?;
        self.renderer.set_render_mode(mode(formats)).context("the overlay's pipeline")
    }

    /// Sets the overlay of the next frame. Waits for the device if textures in use change.
    ///
    /// # Errors
    /// If the device fails.
    pub fn set(&mut self, painted: Painted) -> Result<()> {
        self.painted = painted;
        let mut textures = std::mem::take(&mut self.painted.textures);
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
}

impl Pass for Hud {
    fn row(&self) -> &'static Row {
        &ROW
    }

    fn prepare(&mut self, _: usize, _: &mut Terrain, _: &PassInput) -> bool {
        let primitives = &mut self.painted.primitives;
        if !primitives.is_empty() && !std::mem::replace(&mut self.is_reserved, true) {
            primitives.push(room(primitives));
        }
        !primitives.is_empty()
    }

    fn record(&mut self, recording: &mut Recording, _: &mut Terrain, input: &PassInput) -> Result<()> {
        let [width, height] = input.view.size;
        let Painted { primitives, pixels_per_point, .. } = &self.painted;
        self.renderer
            .cmd_draw(recording.commands, vk::Extent2D { width, height }, *pixels_per_point, primitives)
            .context("drawing the overlay")
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
        // SAFETY: nothing is in use once the device is idle; the renderer goes after this.
        unsafe {
            let _ = self.gpu.wait_idle();
            self.gpu.raw.destroy_command_pool(self.pool, None);
        }
    }
}

/// An invisible mesh of [`VERTICES`] vertices. The renderer sizes its buffers by the first frame, so that later frames
/// allocate nothing.
fn room(primitives: &[ClippedPrimitive]) -> ClippedPrimitive {
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

/// Allocator for the renderer: its buffers and images are named, and counted among the device's bytes.
struct Accounted(Arc<Gpu>);

/// A buffer or an image.
enum Held {
    Buffer(Buffer),
    Image(#[allow(dead_code, reason = "held for its drop")] Image),
}

fn refused(error: anyhow::Error) -> RendererError {
    RendererError::Allocator(format!("{error:#}"))
}

impl Allocator for Accounted {
    type Allocation = Held;

    fn create_buffer(
        &mut self,
        _: &ash::Device,
        size: usize,
        usage: vk::BufferUsageFlags,
    ) -> RendererResult<(vk::Buffer, Held)> {
        let buffer = Buffer::host(&self.0, "hud", size as u64, usage).map_err(refused)?;
        Ok((buffer.raw, Held::Buffer(buffer)))
    }

    fn create_image(&mut self, _: &ash::Device, width: u32, height: u32) -> RendererResult<(vk::Image, Held)> {
        let usage = vk::ImageUsageFlags::TRANSFER_DST | vk::ImageUsageFlags::SAMPLED;
        let format = vk::Format::R8G8B8A8_SRGB;
        let info = ImageInfo { purpose: "hud", size: [width, height], layers: None, format, usage };
        let image = Image::new(&self.0, info).map_err(refused)?;
        Ok((image.raw, Held::Image(image)))
    }

    fn destroy_buffer(&mut self, _: &ash::Device, _: vk::Buffer, _: Held) -> RendererResult<()> {
        Ok(())
    }

    fn destroy_image(&mut self, _: &ash::Device, _: vk::Image, _: Held) -> RendererResult<()> {
        Ok(())
    }

    fn update_buffer<T: Copy>(&mut self, _: &ash::Device, memory: &mut Held, data: &[T]) -> RendererResult<()> {
        if let Held::Buffer(buffer) = memory {
            // SAFETY: vertices, indices and texels are plain data without padding.
            let bytes = unsafe { std::slice::from_raw_parts(data.as_ptr().cast(), size_of_val(data)) };
            buffer.write(0, bytes);
        }
        Ok(())
    }
}
