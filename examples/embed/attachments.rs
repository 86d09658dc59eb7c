//! The host's attachments, and its pass over them.

use anyhow::Result;
use ash::vk;
use cuesta::embed::Target;

use super::host::{Attachment, Host, Readback, range};

/// The images that the host draws into.
pub struct Attachments<'a> {
    host: &'a Host,
    /// Formats and conventions of the pass.
    pub target: Target,
    size: [u32; 2],
    /// The colours, one sample a pixel.
    colour: Attachment,
    /// Colours with several samples a pixel. The pass draws to them and resolves them to `colour`.
    multisampled: Option<Attachment>,
    depth: Option<Attachment>,
    readback: Readback,
    framebuffer: vk::Framebuffer,
}

const COLOUR_LAYOUT: vk::ImageLayout = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
const DEPTH_LAYOUT: vk::ImageLayout = vk::ImageLayout::DEPTH_STENCIL_ATTACHMENT_OPTIMAL;

impl<'a> Attachments<'a> {
    /// Creates attachments of a target, which has no render pass yet.
    pub fn new(host: &'a Host, size: [u32; 2], target: Target, has_render_pass: bool) -> Result<Self> {
        use vk::ImageUsageFlags as Usage;
        let (one, many) = (vk::SampleCountFlags::TYPE_1, target.samples);
        let colour = host.attachment(size, target.colour, one, Usage::COLOR_ATTACHMENT | Usage::TRANSFER_SRC)?;
        let multisampled = (many != one).then(|| host.attachment(size, target.colour, many, Usage::COLOR_ATTACHMENT));
        let depth = target.depth.map(|d| host.attachment(size, d.format, many, Usage::DEPTH_STENCIL_ATTACHMENT));
        let (multisampled, depth) = (multisampled.transpose()?, depth.transpose()?);
        let readback = host.readback(4 * u64::from(size[0] * size[1]))?;
        let framebuffer = vk::Framebuffer::null();
        let mut attachments = Self { host, target, size, colour, multisampled, depth, readback, framebuffer };
        if has_render_pass {
            attachments.create_render_pass()?;
        }
        Ok(attachments)
    }

    /// The attachments in the order of the render pass: the colours that are drawn, the depth, the resolved colours.
    fn images(&self) -> impl Iterator<Item = (&Attachment, vk::ImageLayout)> {
        let drawn = self.multisampled.as_ref().unwrap_or(&self.colour);
        let resolved = self.multisampled.as_ref().map(|_| (&self.colour, COLOUR_LAYOUT));
        let depth = self.depth.as_ref().map(|depth| (depth, DEPTH_LAYOUT));
        std::iter::once((drawn, COLOUR_LAYOUT)).chain(depth).chain(resolved)
    }

    fn create_render_pass(&mut self) -> Result<()> {
        let description = |(attachment, layout): (&Attachment, vk::ImageLayout)| {
            vk::AttachmentDescription::default()
                .format(attachment.format)
                .samples(attachment.samples)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(vk::AttachmentStoreOp::STORE)
                .stencil_load_op(vk::AttachmentLoadOp::CLEAR)
                .stencil_store_op(vk::AttachmentStoreOp::DONT_CARE)
                .initial_layout(layout)
                .final_layout(layout)
        };
        let descriptions: Vec<_> = self.images().map(description).collect();
        let views: Vec<_> = self.images().map(|(attachment, _)| attachment.view).collect();
        let references: Vec<_> = (0u32..)
            .zip(self.images())
            .map(|(attachment, (_, layout))| vk::AttachmentReference { attachment, layout })
            .collect();
        let mut subpass = vk::SubpassDescription::default()
            .pipeline_bind_point(vk::PipelineBindPoint::GRAPHICS)
            .color_attachments(&references[..1]);
        if self.depth.is_some() {
            subpass = subpass.depth_stencil_attachment(&references[1]);
        }
        if self.multisampled.is_some() {
            subpass = subpass.resolve_attachments(&references[references.len() - 1..]);
        }
        let subpasses = [subpass];
        let info = vk::RenderPassCreateInfo::default().attachments(&descriptions).subpasses(&subpasses);
        let [width, height] = self.size;
        // SAFETY: the device is alive.
        unsafe {
            let pass = self.host.device.create_render_pass(&info, None)?;
            let info = vk::FramebufferCreateInfo::default().render_pass(pass).attachments(&views);
            let info = info.width(width).height(height).layers(1);
            self.framebuffer = self.host.device.create_framebuffer(&info, None)?;
            self.target.render_pass = Some((pass, 0));
        }
        Ok(())
    }

    /// Records the start of the pass: the attachments are cleared to the sky and the far plane.
    ///
    /// # Safety
    /// `commands` is in the recording state.
    pub unsafe fn begin(&self, commands: vk::CommandBuffer) {
        let device = &self.host.device;
        let barriers: Vec<_> = self.images().map(|(attachment, layout)| begun(attachment, layout)).collect();
        let is_reversed = self.target.depth.is_some_and(|depth| depth.is_reversed);
        let far = vk::ClearDepthStencilValue { depth: if is_reversed { 0.0 } else { 1.0 }, stencil: 0 };
        let sky = vk::ClearColorValue { float32: [0.35, 0.5, 0.75, 1.0] };
        let clear = [vk::ClearValue { color: sky }, vk::ClearValue { depth_stencil: far }];
        let extent = vk::Extent2D { width: self.size[0], height: self.size[1] };
        let area = vk::Rect2D { extent, ..Default::default() };
        // SAFETY: the attachments live until the frame has finished.
        unsafe {
            device.cmd_pipeline_barrier2(commands, &vk::DependencyInfo::default().image_memory_barriers(&barriers));
            match self.target.render_pass {
                Some((pass, _)) => {
                    let clear: Vec<_> =
                        self.images().map(|(_, layout)| clear[usize::from(layout == DEPTH_LAYOUT)]).collect();
                    let info = vk::RenderPassBeginInfo::default()
                        .render_pass(pass)
                        .framebuffer(self.framebuffer)
                        .render_area(area)
                        .clear_values(&clear);
                    device.cmd_begin_render_pass(commands, &info, vk::SubpassContents::INLINE);
                }
                None => self.begin_rendering(commands, area, clear),
            }
            let [width, height] = self.size.map(|side| side as f32);
            let down = vk::Viewport { x: 0.0, y: 0.0, width, height, min_depth: 0.0, max_depth: 1.0 };
            let up = vk::Viewport { y: height, height: -height, ..down };
            device.cmd_set_viewport(commands, 0, &[if self.target.is_y_up { up } else { down }]);
            device.cmd_set_scissor(commands, 0, &[area]);
        }
    }

    /// Records the start of dynamic rendering, with the clear values of colour and depth.
    fn begin_rendering(&self, commands: vk::CommandBuffer, area: vk::Rect2D, clear: [vk::ClearValue; 2]) {
        let attachment = |attachment: &Attachment, layout, clear| {
            vk::RenderingAttachmentInfo::default()
                .image_view(attachment.view)
                .image_layout(layout)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(vk::AttachmentStoreOp::STORE)
                .clear_value(clear)
        };
        let colour = match &self.multisampled {
            None => attachment(&self.colour, COLOUR_LAYOUT, clear[0]),
            Some(multisampled) => attachment(multisampled, COLOUR_LAYOUT, clear[0])
                .resolve_mode(vk::ResolveModeFlags::AVERAGE)
                .resolve_image_view(self.colour.view)
                .resolve_image_layout(COLOUR_LAYOUT),
        };
        let colours = [colour];
        let depth = self.depth.as_ref().map(|depth| attachment(depth, DEPTH_LAYOUT, clear[1]));
        let mut info = vk::RenderingInfo::default().render_area(area).layer_count(1).color_attachments(&colours);
        if let Some(depth) = &depth {
            info = info.depth_attachment(depth);
        }
        if let (Some(stencil), true) = (&depth, self.target.depth.is_some_and(|depth| depth.has_stencil)) {
            info = info.stencil_attachment(stencil);
        }
        // SAFETY: the command buffer is being recorded; the attachments live until the frame has finished.
        unsafe { self.host.device.cmd_begin_rendering(commands, &info) };
    }

    /// Records the end of the pass, and the copy of the colours to the host.
    ///
    /// # Safety
    /// [`Self::begin`] was recorded in the same command buffer.
    pub unsafe fn end(&self, commands: vk::CommandBuffer) {
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
        let device = &self.host.device;
        let drawn = [barrier(&self.colour)
            .src_stage_mask(Stage::COLOR_ATTACHMENT_OUTPUT)
            .src_access_mask(Access::COLOR_ATTACHMENT_WRITE)
            .old_layout(COLOUR_LAYOUT)
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
        let extent = vk::Extent3D { width: self.size[0], height: self.size[1], depth: 1 };
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
    pub fn picture(&self) -> image::RgbaImage {
        let [width, height] = self.size;
        let bytes = self.readback.bytes()[..4 * (width * height) as usize].to_vec();
        image::RgbaImage::from_raw(width, height, bytes).expect("four bytes a pixel")
    }

    /// Destroys the attachments; the device is idle.
    pub fn destroy(self) -> Result<()> {
        // SAFETY: the device is idle.
        unsafe {
            self.host.device.destroy_framebuffer(self.framebuffer, None);
            self.host.device.destroy_render_pass(self.target.render_pass.unwrap_or_default().0, None);
        }
        for attachment in [Some(self.colour), self.multisampled, self.depth].into_iter().flatten() {
            self.host.destroy_attachment(attachment)?;
        }
        self.host.destroy_readback(self.readback)
    }
}

/// The barrier before the pass, after the frame before drew to the attachment, and copied it. Its content is not kept.
fn begun(attachment: &Attachment, layout: vk::ImageLayout) -> vk::ImageMemoryBarrier2<'static> {
    use vk::{AccessFlags2 as Access, PipelineStageFlags2 as Stage};
    let (stages, read, write) = match layout {
        DEPTH_LAYOUT => (
            Stage::EARLY_FRAGMENT_TESTS | Stage::LATE_FRAGMENT_TESTS,
            Access::DEPTH_STENCIL_ATTACHMENT_READ,
            Access::DEPTH_STENCIL_ATTACHMENT_WRITE,
        ),
        _ => (Stage::COLOR_ATTACHMENT_OUTPUT, Access::COLOR_ATTACHMENT_READ, Access::COLOR_ATTACHMENT_WRITE),
    };
    barrier(attachment)
        .src_stage_mask(stages | Stage::COPY)
        .src_access_mask(write)
        .dst_stage_mask(stages)
        .dst_access_mask(read | write)
        .new_layout(layout)
}

/// A barrier for a whole attachment.
fn barrier(attachment: &Attachment) -> vk::ImageMemoryBarrier2<'static> {
    vk::ImageMemoryBarrier2::default()
        .image(attachment.image)
        .src_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .dst_queue_family_index(vk::QUEUE_FAMILY_IGNORED)
        .subresource_range(range(attachment.format))
}
