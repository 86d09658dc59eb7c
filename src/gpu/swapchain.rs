//! A window's surface and swapchain.
//!
//! Expected events, such as a window resized, hidden or moved to another monitor, are a status, not an error.

use std::ffi::CStr;
use std::sync::Arc;

use anyhow::{Context, Result, bail};
use ash::{khr, vk};
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};

use super::device::{Candidate, FRAMES_IN_FLIGHT, Gpu};
use super::formats::{DEPTH, Formats};
use super::frames::Recording;
use super::instance::Instance;
use super::memory::{Image, barriers, image_barrier};
use super::screenshot::Screenshot;
use super::target::{Attachment, Attachments, COLOUR_WRITTEN, Depth, depth_image};

/// A window of the system.
pub trait Window: HasWindowHandle + HasDisplayHandle {}

impl<T: HasWindowHandle + HasDisplayHandle> Window for T {}

/// Returns the instance extensions that windows of this display need.
///
/// # Errors
/// If Vulkan has no surfaces for this kind of display.
pub fn extensions(display: &dyn HasDisplayHandle) -> Result<Vec<&'static CStr>> {
    let names = ash_window::enumerate_required_extensions(display.display_handle()?.as_raw())
        .context("no Vulkan surfaces for this kind of display")?;
    // SAFETY: these are names of extensions, constants of `ash`.
    Ok(names.iter().map(|name| unsafe { CStr::from_ptr(*name) }).collect())
}

/// The Vulkan surface of a window, which it keeps alive.
pub struct Surface {
    loader: khr::surface::Instance,
    raw: vk::SurfaceKHR,
    instance: Arc<Instance>,
    window: Arc<dyn Window>,
}

impl Surface {
    /// Makes the surface of a window, on an instance with [`extensions`].
    ///
    /// # Errors
    /// If the system refuses the surface.
    pub fn new(instance: &Arc<Instance>, window: Arc<dyn Window>) -> Result<Self> {
        let (display, handle) = (window.display_handle()?.as_raw(), window.window_handle()?.as_raw());
        // SAFETY: the window outlives the surface, which holds it, and so does the instance.
        let raw = unsafe { ash_window::create_surface(&instance.entry, &instance.raw, display, handle, None) }
            .context("no Vulkan surface for the window")?;
        let loader = khr::surface::Instance::new(&instance.entry, &instance.raw);
        Ok(Self { loader, raw, instance: Arc::clone(instance), window })
    }

    /// Returns true if a device can present to this surface.
    pub fn is_shown_by(&self, candidate: &Candidate) -> bool {
        let instance = &self.instance.raw;
        // SAFETY: device and surface are of the same instance.
        unsafe {
            let extensions = instance.enumerate_device_extension_properties(candidate.raw).unwrap_or_default();
            let has_swapchains = extensions.iter().any(|e| e.extension_name_as_c_str() == Ok(khr::swapchain::NAME));
            let (device, family) = (candidate.raw, candidate.queue_family);
            has_swapchains && self.loader.get_physical_device_surface_support(device, family, self.raw).unwrap_or(false)
        }
    }

    fn formats(&self, device: vk::PhysicalDevice) -> Result<Vec<vk::SurfaceFormatKHR>> {
        // SAFETY: device and surface are of the same instance.
        unsafe { self.loader.get_physical_device_surface_formats(device, self.raw) }.context("formats of the window")
    }
}

impl Drop for Surface {
    fn drop(&mut self) {
        // SAFETY: the swapchain on it is gone: it owns this surface and goes first.
        unsafe { self.loader.destroy_surface(self.raw, None) };
    }
}

/// The images of a window.
pub struct Swapchain {
    gpu: Arc<Gpu>,
    loader: khr::swapchain::Device,
    raw: vk::SwapchainKHR,
    format: vk::SurfaceFormatKHR,
    vsync: bool,
    size: [u32; 2],
    images: Vec<Shown>,
    /// True if frames are drawn with depth.
    has_depth: bool,
    /// The depth image of all frames, made with the images.
    depth: Option<Image>,
    can_copy: bool,
    /// One semaphore per slot, signalled when the slot's image may be drawn to.
    acquired: Vec<vk::Semaphore>,
    state: State,
    surface: Surface,
}

/// One of the images.
struct Shown {
    image: vk::Image,
    view: vk::ImageView,
    /// Signalled when the image is drawn. One per image, not per slot: only the return of the image shows that the
    /// presentation engine has waited for the semaphore.
    drawn: vk::Semaphore,
}

/// Fit of the images to the surface.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum State {
    /// The images have the properties of the surface.
    Fit,
    /// The images can be shown, but others would fit better.
    Suboptimal,
    /// The images can no longer be shown.
    Stale,
    /// The surface is lost.
    Lost,
}

/// An image acquired for one frame.
#[derive(Clone, Copy)]
pub struct Acquired {
    /// The image and the depth that goes with it.
    pub attachments: Attachments,
    /// The frame waits for this before it draws.
    pub wait: vk::Semaphore,
    /// The frame signals this when it is drawn.
    pub signal: vk::Semaphore,
    index: u32,
}

impl Swapchain {
    /// Makes a swapchain for a surface; [`Swapchain::fit`] makes the images. With `vsync` frames wait for the display,
    /// else they are shown as fast as possible and may tear.
    ///
    /// # Errors
    /// If the surface has no format.
    pub fn new(gpu: &Arc<Gpu>, surface: Surface, vsync: bool) -> Result<Self> {
        let format = preferred(&surface.formats(gpu.candidate.raw)?)?;
        let info = vk::SemaphoreCreateInfo::default();
        // SAFETY: the device is alive; Drop destroys the semaphores.
        let acquired = (0..FRAMES_IN_FLIGHT).map(|_| unsafe { gpu.raw.create_semaphore(&info, None) });
        let acquired = acquired.collect::<Result<Vec<_>, _>>()?;
        acquired.iter().for_each(|semaphore| gpu.name(*semaphore, "image acquired"));
        Ok(Self {
            gpu: Arc::clone(gpu),
            loader: khr::swapchain::Device::new(&gpu.instance.raw, &gpu.raw),
            raw: vk::SwapchainKHR::null(),
            format,
            vsync,
            size: [0; 2],
            images: Vec::new(),
            has_depth: true,
            depth: None,
            can_copy: false,
            acquired,
            state: State::Stale,
            surface,
        })
    }

    /// Formats of the attachments.
    pub fn formats(&self) -> Formats {
        Formats::own(self.format.format, self.has_depth.then_some(DEPTH))
    }

    /// Adds or removes depth for later frames. Waits for the device.
    ///
    /// # Errors
    /// If the device is out of memory.
    pub fn set_depth(&mut self, has_depth: bool) -> Result<()> {
        if has_depth != self.has_depth {
            self.gpu.wait_idle()?;
            self.has_depth = has_depth;
            self.depth = if self.images.is_empty() { None } else { self.make_depth()? };
        }
        Ok(())
    }

    fn make_depth(&self) -> Result<Option<Image>> {
        self.has_depth.then(|| depth_image(&self.gpu, self.size, vk::ImageUsageFlags::empty())).transpose()
    }

    /// Makes the images fit the window. `window` is its size in pixels, used where the system leaves the size to the
    /// program. Returns the size of a frame, or `None` while the window is minimised.
    ///
    /// # Errors
    /// If the device fails or can no longer present to the window.
    pub fn fit(&mut self, window: [u32; 2]) -> Result<Option<[u32; 2]>> {
        if self.state == State::Fit && self.size == window {
            return Ok(Some(self.size));
        }
        if self.state == State::Lost {
            self.replace_surface()?;
        }
        let mut capabilities = self.capabilities();
        if capabilities.as_ref().is_err_and(|e| *e == vk::Result::ERROR_SURFACE_LOST_KHR) {
            self.replace_surface()?;
            capabilities = self.capabilities();
        }
        let capabilities = capabilities.context("the window's surface")?;
        let size = extent(&capabilities, window);
        if size.contains(&0) {
            return Ok(None);
        }
        if self.state == State::Stale || self.size != size {
            self.make(&capabilities, size)?;
        }
        self.state = State::Fit;
        Ok(Some(size))
    }

    fn capabilities(&self) -> Result<vk::SurfaceCapabilitiesKHR, vk::Result> {
        let device = self.gpu.candidate.raw;
        // SAFETY: device and surface are of the same instance.
        unsafe { self.surface.loader.get_physical_device_surface_capabilities(device, self.surface.raw) }
    }

    /// Replaces a lost surface by a new one of the same window, without images.
    fn replace_surface(&mut self) -> Result<()> {
        self.gpu.wait_idle()?;
        self.destroy_images();
        // SAFETY: the device is idle and the images' views are gone.
        unsafe { self.loader.destroy_swapchain(self.raw, None) };
        self.raw = vk::SwapchainKHR::null();
        let surface = Surface::new(&self.surface.instance, Arc::clone(&self.surface.window))?;
        if !surface.is_shown_by(&self.gpu.candidate) {
            bail!("{} can no longer show pictures on the window", self.gpu.candidate.name);
        }
        self.surface = surface;
        self.state = State::Stale;
        Ok(())
    }

    /// Makes new images and hands over the old ones.
    fn make(&mut self, capabilities: &vk::SurfaceCapabilitiesKHR, [width, height]: [u32; 2]) -> Result<()> {
        self.gpu.wait_idle()?;
        let max = if capabilities.max_image_count == 0 { u32::MAX } else { capabilities.max_image_count };
        let copy = vk::ImageUsageFlags::TRANSFER_SRC;
        let alpha = [vk::CompositeAlphaFlagsKHR::OPAQUE, vk::CompositeAlphaFlagsKHR::INHERIT];
        let alpha = alpha.into_iter().find(|a| capabilities.supported_composite_alpha.contains(*a));
        let old = self.raw;
        let info = vk::SwapchainCreateInfoKHR::default()
            .surface(self.surface.raw)
            .min_image_count((capabilities.min_image_count + 1).min(max))
            .image_format(self.format.format)
            .image_color_space(self.format.color_space)
            .image_extent(vk::Extent2D { width, height })
            .image_array_layers(1)
            .image_usage(vk::ImageUsageFlags::COLOR_ATTACHMENT | (capabilities.supported_usage_flags & copy))
            .pre_transform(capabilities.current_transform)
            .composite_alpha(alpha.unwrap_or(vk::CompositeAlphaFlagsKHR::POST_MULTIPLIED))
            .present_mode(self.mode()?)
            .clipped(true)
            .old_swapchain(old);
        self.destroy_images();
        // SAFETY: the device is idle, the old swapchain is retired by this call and then destroyed.
        unsafe {
            let made = self.loader.create_swapchain(&info, None);
            self.raw = *made.as_ref().unwrap_or(&vk::SwapchainKHR::null());
            self.loader.destroy_swapchain(old, None);
            made.context("images for the window")?;
        }
        self.gpu.name(self.raw, "window");
        self.can_copy = capabilities.supported_usage_flags.contains(copy);
        self.size = [width, height];
        // SAFETY: the swapchain was just made.
        for image in unsafe { self.loader.get_swapchain_images(self.raw) }? {
            self.images.push(Shown::new(&self.gpu, image, self.format.format)?);
        }
        self.depth = self.make_depth()?;
        Ok(())
    }

    /// Returns the present mode: FIFO, which every device has, unless a faster one is wanted and available.
    fn mode(&self) -> Result<vk::PresentModeKHR> {
        if self.vsync {
            return Ok(vk::PresentModeKHR::FIFO);
        }
        let device = self.gpu.candidate.raw;
        // SAFETY: device and surface are of the same instance.
        let modes = unsafe { self.surface.loader.get_physical_device_surface_present_modes(device, self.surface.raw) }?;
        let fast = [vk::PresentModeKHR::MAILBOX, vk::PresentModeKHR::IMMEDIATE];
        Ok(fast.into_iter().find(|mode| modes.contains(mode)).unwrap_or(vk::PresentModeKHR::FIFO))
    }

    /// Acquires an image for the frame in this slot, whose last frame has finished. Returns `None` if there is none now;
    /// the next [`Swapchain::fit`] repairs that.
    ///
    /// # Errors
    /// If the device fails.
    pub fn acquire(&mut self, slot: usize) -> Result<Option<Acquired>> {
        const PATIENCE_NS: u64 = 1_000_000_000;
        let wait = self.acquired[slot];
        // SAFETY: the slot's last frame has ended, so nothing waits for or signals the semaphore.
        let acquired = unsafe { self.loader.acquire_next_image(self.raw, PATIENCE_NS, wait, vk::Fence::null()) };
        let index = match acquired {
            Ok((index, suboptimal)) => {
                self.note(suboptimal);
                index
            }
            // A hidden window may not give its images back.
            Err(vk::Result::TIMEOUT | vk::Result::NOT_READY) => return Ok(None),
            Err(error) => return self.classify(error, "acquiring an image of the window").map(|()| None),
        };
        let Shown { image, view, drawn } = self.images[index as usize];
        let colour = Attachment { image, view, format: self.format.format, size: self.size };
        let store = vk::AttachmentStoreOp::DONT_CARE;
        let depth = self.depth.as_ref().map(|depth| Depth { image: depth.raw, view: depth.view, store });
        Ok(Some(Acquired { attachments: Attachments { colour, depth }, wait, signal: drawn, index }))
    }

    /// Makes the buffer for a copy of one frame, before the frame begins.
    ///
    /// # Errors
    /// If the window's images cannot be copied, or the device is out of memory.
    pub fn screenshot(&self) -> Result<Screenshot> {
        if !self.can_copy {
            bail!("this window's pictures cannot be copied");
        }
        Screenshot::new(&self.gpu, self.format.format, self.size)
    }

    /// Records the copy of an image, if wanted, and its transition to the layout of presentation.
    pub fn finish(&self, recording: &Recording, acquired: &Acquired, screenshot: Option<&Screenshot>) {
        use vk::{AccessFlags2 as Access, ImageLayout as Layout, PipelineStageFlags2 as Stage};
        let image = acquired.attachments.colour;
        let mut last = COLOUR_WRITTEN;
        if let Some(screenshot) = screenshot {
            last = screenshot.record(recording, image, last);
        }
        // The semaphore makes the writes visible to the presentation.
        let shown = (Stage::NONE, Access::NONE, Layout::PRESENT_SRC_KHR);
        barriers(&self.gpu, recording.commands, &[image_barrier(image.image, image.format, last, shown)]);
    }

    /// Presents an image whose frame was submitted.
    ///
    /// # Errors
    /// If the device fails.
    pub fn present(&mut self, acquired: &Acquired) -> Result<()> {
        let (waits, chains, indices) = ([acquired.signal], [self.raw], [acquired.index]);
        let info = vk::PresentInfoKHR::default().wait_semaphores(&waits).swapchains(&chains).image_indices(&indices);
        // SAFETY: the image was acquired, and a submitted frame signals the semaphore.
        match unsafe { self.loader.queue_present(self.gpu.queue, &info) } {
            Ok(suboptimal) => {
                self.note(suboptimal);
                Ok(())
            }
            Err(error) => self.classify(error, "showing a frame"),
        }
    }

    fn note(&mut self, suboptimal: bool) {
        if suboptimal && self.state == State::Fit {
            self.state = State::Suboptimal;
        }
    }

    /// Turns expected errors of a window into a status.
    fn classify(&mut self, error: vk::Result, doing: &'static str) -> Result<()> {
        match error {
            vk::Result::ERROR_OUT_OF_DATE_KHR => self.state = State::Stale,
            vk::Result::ERROR_SURFACE_LOST_KHR => self.state = State::Lost,
            other => return Err(self.gpu.failure(other)).context(doing),
        }
        Ok(())
    }

    fn destroy_images(&mut self) {
        for shown in self.images.drain(..) {
            // SAFETY: callers have waited for the device.
            unsafe {
                self.gpu.raw.destroy_image_view(shown.view, None);
                self.gpu.raw.destroy_semaphore(shown.drawn, None);
            }
        }
        self.depth = None;
    }
}

impl Shown {
    fn new(gpu: &Gpu, image: vk::Image, format: vk::Format) -> Result<Self> {
        let range =
            vk::ImageSubresourceRange::default().aspect_mask(vk::ImageAspectFlags::COLOR).level_count(1).layer_count(1);
        let info = vk::ImageViewCreateInfo::default()
            .image(image)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(format)
            .subresource_range(range);
        // SAFETY: the image is the swapchain's; its owner destroys view and semaphore first.
        unsafe {
            let view = gpu.raw.create_image_view(&info, None)?;
            let drawn = gpu.raw.create_semaphore(&vk::SemaphoreCreateInfo::default(), None)?;
            gpu.name(view, "window");
            gpu.name(drawn, "image drawn");
            Ok(Self { image, view, drawn })
        }
    }
}

impl Drop for Swapchain {
    fn drop(&mut self) {
        // SAFETY: nothing is in use once the device is idle; the surface goes after this.
        unsafe {
            let _ = self.gpu.raw.device_wait_idle();
            self.destroy_images();
            self.loader.destroy_swapchain(self.raw, None);
            self.acquired.iter().for_each(|semaphore| self.gpu.raw.destroy_semaphore(*semaphore, None));
        }
    }
}

/// Returns an 8-bit sRGB format, else the first one.
fn preferred(formats: &[vk::SurfaceFormatKHR]) -> Result<vk::SurfaceFormatKHR> {
    let wanted = [vk::Format::B8G8R8A8_SRGB, vk::Format::R8G8B8A8_SRGB, vk::Format::A8B8G8R8_SRGB_PACK32];
    let srgb = vk::ColorSpaceKHR::SRGB_NONLINEAR;
    let found = wanted.iter().find_map(|w| formats.iter().find(|f| f.format == *w && f.color_space == srgb));
    found.or(formats.first()).copied().context("the window has no format")
}

/// Returns the surface's own size or, where it has none, the window's within the limits.
fn extent(capabilities: &vk::SurfaceCapabilitiesKHR, window: [u32; 2]) -> [u32; 2] {
    let (own, low, high) = (capabilities.current_extent, capabilities.min_image_extent, capabilities.max_image_extent);
    if own.width != u32::MAX {
        return [own.width, own.height];
    }
    let within = |value: u32, low: u32, high: u32| if value == 0 { 0 } else { value.max(low).min(high) };
    [within(window[0], low.width, high.width), within(window[1], low.height, high.height)]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_is_the_surfaces_or_the_windows_within_limits_or_nothing() {
        let size = |width, height| vk::Extent2D { width, height };
        let left_to_us = vk::SurfaceCapabilitiesKHR {
            current_extent: size(u32::MAX, u32::MAX),
            min_image_extent: size(10, 10),
            max_image_extent: size(100, 100),
            ..Default::default()
        };
        assert_eq!(extent(&left_to_us, [50, 5000]), [50, 100]);
        assert_eq!(extent(&left_to_us, [1, 50]), [10, 50]);
        assert_eq!(extent(&left_to_us, [0, 50]), [0, 50], "minimised");
        let own = vk::SurfaceCapabilitiesKHR { current_extent: size(0, 0), ..left_to_us };
        assert_eq!(extent(&own, [50, 50]), [0, 0], "minimised");
    }

    #[test]
    fn srgb_is_preferred() {
        let format = |format| vk::SurfaceFormatKHR { format, color_space: vk::ColorSpaceKHR::SRGB_NONLINEAR };
        let [unorm, srgb] = [vk::Format::B8G8R8A8_UNORM, vk::Format::R8G8B8A8_SRGB].map(format);
        assert_eq!(preferred(&[unorm, srgb]).unwrap(), srgb);
        assert_eq!(preferred(&[unorm]).unwrap(), unorm);
        assert!(preferred(&[]).is_err());
    }
}
