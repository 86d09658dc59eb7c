//! Where frames are drawn: attachments that a frame begins and ends, and the offscreen picture read back.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;
use gpu_allocator::MemoryLocation;

use super::device::Gpu;
use super::frames::Recording;
use super::memory::{Buffer, Image, ImageInfo, aspect, barriers, image_barrier, memory_barrier};

/// Formats of the attachments, and the conventions of the pass that has them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Formats {
    /// Format of the colour attachment.
    pub colour: vk::Format,
    /// Format of the depth attachment; `None`: there is no depth test, and the last triangle drawn shows.
    pub depth: Option<vk::Format>,
    /// Format of the stencil attachment; `UNDEFINED`: there is none.
    pub stencil: vk::Format,
    /// True if depth is 1 at the near plane and 0 at the far one.
    pub is_reversed: bool,
    /// Samples of a pixel.
    pub samples: vk::SampleCountFlags,
    /// Render pass and subpass; `None`: dynamic rendering.
    pub render_pass: Option<(vk::RenderPass, u32)>,
    /// True if the terrain's own sky is drawn behind it. Needs reversed depth.
    pub has_sky: bool,
}

impl Formats {
    /// The formats of this crate's own targets: dynamic rendering, reversed depth, one sample, sky.
    pub fn own(colour: vk::Format, depth: Option<vk::Format>) -> Self {
        Self {
            colour,
            depth,
            stencil: vk::Format::UNDEFINED,
            is_reversed: true,
            samples: vk::SampleCountFlags::TYPE_1,
            render_pass: None,
            has_sky: true,
        }
    }
}

/// Depth: 32-bit float, cleared to 0, the far plane.
pub const DEPTH: vk::Format = vk::Format::D32_SFLOAT;

/// A colour attachment to draw into, whoever owns it.
#[derive(Clone, Copy)]
pub struct Attachment {
    /// The image.
    pub image: vk::Image,
    /// Its view.
    pub view: vk::ImageView,
    /// Its format.
    pub format: vk::Format,
    /// Pixels.
    pub size: [u32; 2],
}

/// A depth attachment, and what becomes of its values after the frame.
pub type Depth<'a> = (&'a Image, vk::AttachmentStoreOp);

/// How a frame leaves its depth image.
pub const DEPTH_WRITTEN: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout) = (
    vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS,
    vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE,
    vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
);

/// A depth image of the size of a target, for these uses beside that of an attachment.
pub fn depth_image(gpu: &Arc<Gpu>, size: [u32; 2], uses: vk::ImageUsageFlags) -> Result<Image> {
    let usage = vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | uses;
    Image::new(gpu, ImageInfo { purpose: "depth", size, layers: None, format: DEPTH, usage })
}

/// Begins drawing into an attachment, cleared to alpha 0 (no land) and the far plane.
pub fn begin(recording: &Recording, colour: Attachment, depth: Option<Depth>) {
    use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
    let colour_write =
        (Stage::COLOR_ATTACHMENT_OUTPUT, Access::COLOR_ATTACHMENT_WRITE, Layout::COLOR_ATTACHMENT_OPTIMAL);
    let tests = Stage::EARLY_FRAGMENT_TESTS | Stage::LATE_FRAGMENT_TESTS;
    let depth_access = Access::DEPTH_STENCIL_ATTACHMENT_READ | Access::DEPTH_STENCIL_ATTACHMENT_WRITE;
    // After the picture's last use: presented, or copied out.
    let colour_used = (Stage::COLOR_ATTACHMENT_OUTPUT | Stage::COPY, Access::NONE, Layout::UNDEFINED);
    let before = image_barrier(colour.image, colour.format, colour_used, colour_write);
    match depth {
        None => barriers(recording.gpu, recording.commands, &[before]),
        Some((image, _)) => {
            // And the depth's: tested, copied out, or read by a pass of its own.
            let used = tests | Stage::COPY | Stage::FRAGMENT_SHADER;
            let depth_before = image.barrier(
                (used, Access::DEPTH_STENCIL_ATTACHMENT_WRITE, Layout::UNDEFINED),
                (tests, depth_access, Layout::DEPTH_ATTACHMENT_OPTIMAL),
            );
            barriers(recording.gpu, recording.commands, &[before, depth_before]);
        }
    }
    open(recording, colour, depth, vk::AttachmentLoadOp::CLEAR);
}

/// Goes on drawing into an attachment over what an earlier submission of the same frame drew.
pub fn go_on(recording: &Recording, colour: Attachment, depth: Option<Depth>) {
    use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
    let tests = Stage::EARLY_FRAGMENT_TESTS | Stage::LATE_FRAGMENT_TESTS;
    let stages = Stage::COLOR_ATTACHMENT_OUTPUT | tests;
    let written = Access::COLOR_ATTACHMENT_WRITE | Access::DEPTH_STENCIL_ATTACHMENT_WRITE;
    let read = Access::COLOR_ATTACHMENT_READ | Access::DEPTH_STENCIL_ATTACHMENT_READ;
    memory_barrier(recording.gpu, recording.commands, (stages, written), (stages, written | read));
    open(recording, colour, depth, vk::AttachmentLoadOp::LOAD);
}

fn open(recording: &Recording, colour: Attachment, depth: Option<Depth>, load: vk::AttachmentLoadOp) {
    use vk::ImageLayout as Layout;
    let (gpu, commands) = (recording.gpu, recording.commands);
    let clear = vk::ClearValue { color: vk::ClearColorValue { float32: [0.0; 4] } };
    let far = vk::ClearValue { depth_stencil: vk::ClearDepthStencilValue { depth: 0.0, stencil: 0 } };
    let colours = [vk::RenderingAttachmentInfo::default()
        .image_view(colour.view)
        .image_layout(Layout::COLOR_ATTACHMENT_OPTIMAL)
        .load_op(load)
        .store_op(vk::AttachmentStoreOp::STORE)
        .clear_value(clear)];
    let depth = depth.map(|(image, store)| {
        vk::RenderingAttachmentInfo::default()
            .image_view(image.view)
            .image_layout(Layout::DEPTH_ATTACHMENT_OPTIMAL)
            .load_op(load)
            .store_op(store)
            .clear_value(far)
    });
    let [width, height] = colour.size;
    let area = vk::Rect2D { offset: vk::Offset2D::default(), extent: vk::Extent2D { width, height } };
    let mut info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&colours);
    if let Some(depth) = &depth {
        info = info.depth_attachment(depth);
    }
    let viewport = [vk::Viewport { width: width as f32, height: height as f32, max_depth: 1.0, ..Default::default() }];
    // SAFETY: the command buffer is being recorded; the attachments live until the frame has ended.
    unsafe {
        gpu.raw.cmd_begin_rendering(commands, &info);
        gpu.raw.cmd_set_viewport(commands, 0, &viewport);
        gpu.raw.cmd_set_scissor(commands, 0, &[area]);
    }
}

/// Ends drawing.
pub fn end(recording: &Recording) {
    // SAFETY: `begin` was recorded in the same command buffer.
    unsafe { recording.gpu.raw.cmd_end_rendering(recording.commands) };
}

/// A picture in memory.
pub struct Offscreen {
    colour: Image,
    readback: Buffer,
    depth: Option<DepthPicture>,
}

/// Depths in memory.
struct DepthPicture {
    image: Image,
    readback: Buffer,
}

impl Offscreen {
    /// A picture of this size without depth, or which limit it exceeds.
    pub fn new(gpu: &Arc<Gpu>, size: [u32; 2]) -> Result<Self> {
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
        let info = ImageInfo { purpose: "colour", size, layers: None, format: Self::COLOUR, usage };
        Ok(Self { colour: Image::new(gpu, info)?, readback: readback(gpu, "read-back", size)?, depth: None })
    }

    /// Gives it depth, unless it has it.
    pub fn add_depth(&mut self, gpu: &Arc<Gpu>) -> Result<()> {
        if self.depth.is_none() {
            let (size, uses) = (self.colour.size, vk::ImageUsageFlags::TRANSFER_SRC | vk::ImageUsageFlags::SAMPLED);
            let (image, readback) = (depth_image(gpu, size, uses)?, readback(gpu, "depth read-back", size)?);
            self.depth = Some(DepthPicture { image, readback });
        }
        Ok(())
    }

    const COLOUR: vk::Format = vk::Format::R8G8B8A8_SRGB;

    /// The formats of every offscreen picture with depth or without.
    pub fn formats(has_depth: bool) -> Formats {
        Formats::own(Self::COLOUR, has_depth.then_some(DEPTH))
    }

    /// The attachment to draw into.
    pub fn attachment(&self) -> Attachment {
        let Image { raw, view, size, format, .. } = self.colour;
        Attachment { image: raw, view, format, size }
    }

    /// The depth to draw with, if it has it; its values stay after the frame.
    pub fn kept_depth(&self) -> Option<Depth<'_>> {
        self.depth.as_ref().map(|depth| (&depth.image, vk::AttachmentStoreOp::STORE))
    }

    /// The depth image.
    ///
    /// # Panics
    /// If it has no depth.
    pub fn depth_image(&self) -> &Image {
        &self.depth_picture().image
    }

    fn depth_picture(&self) -> &DepthPicture {
        self.depth.as_ref().expect("a picture with depth")
    }

    /// Records the copy of the colours to the host, after [`end`].
    pub fn read_back(&self, recording: &Recording) {
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
        let written =
            (Stage::COLOR_ATTACHMENT_OUTPUT, Access::COLOR_ATTACHMENT_WRITE, Layout::COLOR_ATTACHMENT_OPTIMAL);
        copy_out(recording, &self.colour, written, &self.readback);
    }

    /// Records the copy of the depth to the host, after [`end`]; the image stays as the frame left it.
    ///
    /// # Panics
    /// If it has no depth.
    pub fn read_back_depth(&self, recording: &Recording) {
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
        let DepthPicture { image, readback } = self.depth_picture();
        copy_out(recording, image, DEPTH_WRITTEN, readback);
        let copied = (Stage::COPY, Access::TRANSFER_READ, Layout::TRANSFER_SRC_OPTIMAL);
        barriers(recording.gpu, recording.commands, &[image.barrier(copied, DEPTH_WRITTEN)]);
    }

    /// The picture read back last (after the frame has finished); alpha says where land was drawn.
    pub fn picture(&self) -> image::RgbaImage {
        let [width, height] = self.colour.size;
        let bytes = &self.readback.read()[..4 * width as usize * height as usize];
        image::RgbaImage::from_raw(width, height, bytes.to_vec()).expect("as many bytes as pixels")
    }

    /// The depth read back last, row by row from the top; 0 is infinitely far.
    ///
    /// # Panics
    /// If it has no depth.
    pub fn depth_values(&self) -> Vec<f32> {
        let [width, height] = self.colour.size;
        let bytes = self.depth_picture().readback.read();
        bytemuck::pod_collect_to_vec(&bytes[..4 * width as usize * height as usize])
    }
}

/// A buffer for colours or depths of a picture, which the host reads: both have four bytes a pixel.
fn readback(gpu: &Arc<Gpu>, purpose: &'static str, [width, height]: [u32; 2]) -> Result<Buffer> {
    let bytes = 4 * u64::from(width) * u64::from(height);
    Buffer::new(gpu, purpose, bytes, vk::BufferUsageFlags::TRANSFER_DST, MemoryLocation::GpuToCpu)
}

/// Records the copy of an image's single layer to a buffer that the host reads.
fn copy_out(
    recording: &Recording,
    image: &Image,
    written: (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout),
    to: &Buffer,
) {
    use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
    let (gpu, commands) = (recording.gpu, recording.commands);
    let copied = (Stage::COPY, Access::TRANSFER_READ, Layout::TRANSFER_SRC_OPTIMAL);
    barriers(gpu, commands, &[image.barrier(written, copied)]);
    let [width, height] = image.size;
    let layers = vk::ImageSubresourceLayers::default().aspect_mask(aspect(image.format)).layer_count(1);
    let extent = vk::Extent3D { width, height, depth: 1 };
    let region = [vk::BufferImageCopy::default().image_subresource(layers).image_extent(extent)];
    // SAFETY: the command buffer is being recorded; image and buffer live until the frame has ended.
    unsafe {
        gpu.raw.cmd_copy_image_to_buffer(commands, image.raw, Layout::TRANSFER_SRC_OPTIMAL, to.raw, &region);
    }
    memory_barrier(gpu, commands, (Stage::COPY, Access::TRANSFER_WRITE), (Stage::HOST, Access::HOST_READ));
}
