//! A device lent by a caller: wrapped, used, and left for the caller to destroy.

use std::sync::{Arc, Mutex};

use anyhow::{Result, ensure};
use ash::vk;
use gpu_allocator::vulkan::Allocator;

use super::device::{self, Candidate, Gpu, Handles, Optional};
use super::instance::Instance;
use super::requirements::Requirements;

/// Vulkan handles that a caller lends. They stay the caller's: nothing here is ever destroyed, and nothing is global.
#[derive(Clone)]
pub struct DeviceHandles {
    /// The loader.
    pub entry: ash::Entry,
    /// An instance for Vulkan 1.3 or later.
    pub instance: ash::Instance,
    /// The physical device of `device`.
    pub physical_device: vk::PhysicalDevice,
    /// A device with the features of [`Requirements`].
    pub device: ash::Device,
    /// A queue with graphics. It is used only during construction, to upload heights and textures.
    pub queue: vk::Queue,
    /// The family of `queue`. Command buffers that draw terrain are of the same family.
    pub queue_family: u32,
    /// The caller's allocator; `None`: the renderer allocates device memory by itself. It is locked while the renderer is made
    /// and dropped: the caller does not hold the lock then.
    pub allocator: Option<Arc<Mutex<Allocator>>>,
    /// True if the instance has `VK_EXT_debug_utils`: then every object and pass is named.
    pub debug_utils: bool,
}

/// Most frames of a caller that may be under way at once. Each has buffers of its own.
const MAX_FRAMES_IN_FLIGHT: usize = 16;

impl Gpu {
    /// Wraps a caller's device, for at most `frames_in_flight` frames under way at once.
    ///
    /// # Errors
    /// Names what the physical device lacks.
    ///
    /// # Safety
    /// The handles are valid, belong together and outlive the result. The device has the required features enabled.
    pub(super) unsafe fn lent(
        handles: DeviceHandles,
        requirements: &Requirements,
        frames_in_flight: usize,
    ) -> Result<Arc<Self>> {
        let is_allowed = (1..=MAX_FRAMES_IN_FLIGHT).contains(&frames_in_flight);
        ensure!(is_allowed, "frames in flight: expected 1 to {MAX_FRAMES_IN_FLIGHT}, found {frames_in_flight}");
        let DeviceHandles { entry, instance, physical_device, device: raw, queue, queue_family, .. } = handles;
        // SAFETY: the caller vouches for the handles.
        unsafe { requirements.check(&instance, physical_device, queue_family)? };
        let allocator = match handles.allocator {
            Some(allocator) => allocator,
            None => device::allocator(&instance, &raw, physical_device)?,
        };
        let instance = Instance::lent(entry, instance, handles.debug_utils);
        let candidate = Candidate { queue_family, ..device::candidate(&instance, physical_device) };
        let handles = Handles { raw, queue, allocator, is_lent: true };
        // Of a caller's device only the required features are known to be enabled.
        Ok(Self::assemble(instance, candidate, handles, Optional::default(), frames_in_flight))
    }
}
