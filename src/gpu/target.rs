//! Targets of frames: attachments, rendering into them, and the offscreen picture that the host reads back.

use std::sync::Arc;

use anyhow::Result;
use ash::vk;
use gpu_allocator::MemoryLocation;

use super::device::Gpu;
use super::formats::{DEPTH, Formats};
use super::frames::{Recording, Semaphores};
use super::memory::{Buffer, Image, ImageInfo, aspect, barriers, image_barrier, memory_barrier};
use super::pass::Pass;
use super::terrain::Terrain;
use crate::draw::DrawList;

/// Stages, accesses and layout of one use of an image.
pub(super) type Use = (vk::PipelineStageFlags2, vk::AccessFlags2, vk::ImageLayout);

/// A colour attachment, not owned.
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

/// A depth attachment, not owned.
#[derive(Clone, Copy)]
pub struct Depth {
    /// The image.
    pub image: vk::Image,
    /// Its view.
    pub view: vk::ImageView,
    /// Stores the values after the frame, or discards them.
    pub store: vk::AttachmentStoreOp,
}

/// The images that a frame is drawn into.
#[derive(Clone, Copy)]
pub struct Attachments {
    /// The colours.
    pub colour: Attachment,
    /// The depth, if the frame is drawn with it.
    pub depth: Option<Depth>,
}

/// State of a frame between its selection and its recording.
pub struct Selected<'a> {
    /// The scene's resources.
    pub terrain: &'a Terrain,
    /// The frame's slot.
    pub slot: usize,
    /// Milliseconds that selection took.
    pub select_ms: f64,
}

/// The images that a frame is drawn into, and their use afterwards: read back, or shown in a window.
pub trait Target {
    /// Gets the images for the frame in this slot, which has begun. Returns false if there are none now: then the frame
    /// is dropped.
    ///
    /// # Errors
    /// If the device or the window fails.
    fn acquire(&mut self, _slot: usize) -> Result<bool> {
        Ok(true)
    }

    /// The images of the current frame.
    fn attachments(&self) -> Attachments;

    /// Reacts to the selected list, before the frame is recorded.
    ///
    /// # Errors
    /// If the device fails.
    fn selected(&mut self, _frame: &Selected, _list: &mut DrawList) -> Result<()> {
        Ok(())
    }

    /// A pass of the target's own, drawn last.
    fn overlay(&mut self) -> Option<&mut dyn Pass> {
        None
    }

    /// Records copies and layout changes after the last pass.
    fn finish(&self, recording: &Recording);

    /// Semaphores of the frame's last submission.
    fn semaphores(&self) -> Semaphores {
        Semaphores::default()
    }

    /// Uses the frame once it is submitted.
    ///
    /// # Errors
    /// If the device or the window fails.
    fn present(&mut self) -> Result<()> {
        Ok(())
    }

    /// True if the host waits until the device has finished the frame.
    fn waits(&self) -> bool;
}

/// Colours as rendering leaves them.
pub(super) const COLOUR_WRITTEN: Use = (
    vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
    vk::AccessFlags2::COLOR_ATTACHMENT_WRITE,
    vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
);

/// Colours as a later pass samples them.
pub(super) const COLOUR_SAMPLED: Use = (
    vk::PipelineStageFlags2::FRAGMENT_SHADER,
    vk::AccessFlags2::SHADER_SAMPLED_READ,
    vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
);

/// Depth as rendering leaves it.
pub(super) const DEPTH_WRITTEN: Use = (
    vk::PipelineStageFlags2::LATE_FRAGMENT_TESTS,
    vk::AccessFlags2::DEPTH_STENCIL_ATTACHMENT_WRITE,
    vk::ImageLayout::DEPTH_ATTACHMENT_OPTIMAL,
);

/// Depth as a later pass samples it.
pub(super) const DEPTH_SAMPLED: Use = (
    vk::PipelineStageFlags2::FRAGMENT_SHADER,
    vk::AccessFlags2::SHADER_SAMPLED_READ,
    vk::ImageLayout::DEPTH_READ_ONLY_OPTIMAL,
);

/// Makes a depth image of the size of a target, for these uses beside that of an attachment.
pub fn depth_image(gpu: &Arc<Gpu>, size: [u32; 2], uses: vk::ImageUsageFlags) -> Result<Image> {
    let usage = vk::ImageUsageFlags::DEPTH_STENCIL_ATTACHMENT | uses;
    Image::new(gpu, ImageInfo { purpose: "depth", size, layers: None, format: DEPTH, usage })
}

impl Image {
    /// The image as a colour attachment.
    pub(super) fn attachment(&self) -> Attachment {
        Attachment { image: self.raw, view: self.view, format: self.format, size: self.size }
    }
}

/// Begins rendering into attachments, cleared to alpha 0 (no terrain) and the far plane.
pub(super) fn begin(recording: &Recording, Attachments { colour, depth }: Attachments) {
    use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
    let tests = Stage::EARLY_FRAGMENT_TESTS | Stage::LATE_FRAGMENT_TESTS;
    let depth_access = Access::DEPTH_STENCIL_ATTACHMENT_READ | Access::DEPTH_STENCIL_ATTACHMENT_WRITE;
    // Earlier uses of the colours: presented, copied, or sampled by a later pass.
    let used = Stage::COLOR_ATTACHMENT_OUTPUT | Stage::COPY | Stage::FRAGMENT_SHADER;
    let colour_used = (used, Access::NONE, Layout::UNDEFINED);
    let before = image_barrier(colour.image, colour.format, colour_used, COLOUR_WRITTEN);
    match depth {
        None => barriers(recording.gpu, recording.commands, &[before]),
        Some(depth) => {
            // Earlier uses of the depth: tested, copied, or sampled by a later pass.
            let used = tests | Stage::COPY | Stage::FRAGMENT_SHADER;
            let depth_before = image_barrier(
                depth.image,
                DEPTH,
                (used, Access::DEPTH_STENCIL_ATTACHMENT_WRITE, Layout::UNDEFINED),
                (tests, depth_access, Layout::DEPTH_ATTACHMENT_OPTIMAL),
            );
            barriers(recording.gpu, recording.commands, &[before, depth_before]);
        }
    }
    open(recording, colour, depth, vk::AttachmentLoadOp::CLEAR);
}

/// Continues rendering into attachments, over what the same frame drew before.
pub(super) fn resume(recording: &Recording, Attachments { colour, depth }: Attachments) {
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
    let depth = depth.map(|Depth { view, store, .. }| {
        vk::RenderingAttachmentInfo::default()
            .image_view(view)
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

/// Ends rendering.
pub(super) fn end(recording: &Recording) {
    // SAFETY: `begin` or `resume` was recorded in the same command buffer.
    unsafe { recording.gpu.raw.cmd_end_rendering(recording.commands) };
}

/// A picture in memory.
pub struct Offscreen {
    colour: Image,
    readback: Buffer,
    depth: Option<DepthPicture>,
}

/// The depth of a picture in memory.
struct DepthPicture {
    image: Image,
    readback: Buffer,
}

impl Offscreen {
    /// Makes a picture of this size without depth.
    ///
    /// # Errors
    /// If the size exceeds a limit of the device, or its memory.
    pub fn new(gpu: &Arc<Gpu>, size: [u32; 2]) -> Result<Self> {
        let usage = vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC;
        let info = ImageInfo { purpose: "colour", size, layers: None, format: Self::COLOUR, usage };
        Ok(Self { colour: Image::new(gpu, info)?, readback: readback(gpu, "read-back", size)?, depth: None })
    }

    /// Makes the depth image, unless the picture has one.
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

    /// The picture as the target of one frame.
    pub fn target(&self, draws_depth: bool, copies: Copies) -> OffscreenTarget<'_> {
        OffscreenTarget { picture: self, draws_depth, copies }
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

    /// Records the copy of the depth to the host; the image keeps the layout of an attachment.
    ///
    /// # Panics
    /// If it has no depth.
    fn read_back_depth(&self, recording: &Recording) {
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
        let DepthPicture { image, readback } = self.depth_picture();
        copy_out(recording, image, DEPTH_WRITTEN, readback);
        let copied = (Stage::COPY, Access::TRANSFER_READ, Layout::TRANSFER_SRC_OPTIMAL);
        barriers(recording.gpu, recording.commands, &[image.barrier(copied, DEPTH_WRITTEN)]);
    }

    /// The picture copied last, once its frame has finished. Alpha is 0 where there is no terrain.
    pub fn picture(&self) -> image::RgbaImage {
        let [width, height] = self.colour.size;
        let bytes = &self.readback.read()[..4 * width as usize * height as usize];
        image::RgbaImage::from_raw(width, height, bytes.to_vec()).expect("as many bytes as pixels")
    }

    /// The depth copied last, row by row from the top; 0 is infinitely far.
    ///
    /// # Panics
    /// If it has no depth.
    pub fn depth_values(&self) -> Vec<f32> {
        let [width, height] = self.colour.size;
        let bytes = self.depth_picture().readback.read();
        bytemuck::pod_collect_to_vec(&bytes[..4 * width as usize * height as usize])
    }
}

/// Copies of a picture to the host, recorded with its frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Copies {
    /// Copies the colours.
    pub colour: bool,
    /// Copies the depth, which the picture must have.
    pub depth: bool,
}

/// A picture in memory as the target of one frame.
pub struct OffscreenTarget<'a> {
    picture: &'a Offscreen,
    draws_depth: bool,
    copies: Copies,
}

impl Target for OffscreenTarget<'_> {
    fn attachments(&self) -> Attachments {
        let image = self.picture.depth.as_ref().filter(|_| self.draws_depth).map(|depth| &depth.image);
        let depth =
            image.map(|image| Depth { image: image.raw, view: image.view, store: vk::AttachmentStoreOp::STORE });
        Attachments { colour: self.picture.colour.attachment(), depth }
    }

    fn finish(&self, recording: &Recording) {
        if self.copies.colour {
            copy_out(recording, &self.picture.colour, COLOUR_WRITTEN, &self.picture.readback);
        }
        if self.copies.depth {
            self.picture.read_back_depth(recording);
        }
    }

    fn waits(&self) -> bool {
        true
    }
}

/// Makes a buffer for the host's copy of colours or depths: four bytes a pixel.
fn readback(gpu: &Arc<Gpu>, purpose: &'static str, [width, height]: [u32; 2]) -> Result<Buffer> {
    let bytes = 4 * u64::from(width) * u64::from(height);
    Buffer::new(gpu, purpose, bytes, vk::BufferUsageFlags::TRANSFER_DST, MemoryLocation::GpuToCpu)
}

/// Records the copy of an image's single layer to a buffer that the host reads.
fn copy_out(recording: &Recording, image: &Image, written: Use, to: &Buffer) {
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
