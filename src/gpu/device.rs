//! The choice of a device, and the logical device made on it.

use std::ffi::{CStr, CString};
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex};

use anyhow::{Context, Result, bail};
use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};

use super::instance::{Instance, version_text};
use super::requirements::Requirements;
use crate::plan::DeviceLimits;

/// Frames in flight on a device of this crate: the host records one while the device draws the other.
pub const FRAMES_IN_FLIGHT: usize = 2;

/// Choice of a device.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Choice {
    /// Discrete before integrated before virtual before software.
    #[default]
    Best,
    /// A software device.
    Cpu,
    /// The first device whose name contains this, in any case.
    Named(String),
}

/// A physical device.
#[derive(Clone, Debug)]
pub struct Candidate {
    /// The device.
    pub raw: vk::PhysicalDevice,
    /// Its name.
    pub name: String,
    /// Its kind.
    pub kind: vk::PhysicalDeviceType,
    /// Its Vulkan version.
    pub version: String,
    /// Its driver's name and version.
    pub driver: String,
    /// Missing features; empty if the device can be used.
    pub missing: Vec<String>,
    pub(super) queue_family: u32,
}

/// A logical device with one queue and an allocator: its own, or lent by a caller. Its objects hold an `Arc` of it.
pub struct Gpu {
    /// The instance of the device.
    pub instance: Arc<Instance>,
    /// The physical device.
    pub candidate: Candidate,
    /// The device.
    pub raw: ash::Device,
    /// The only queue: graphics, compute and transfer. A caller's queue is used only while resources are created.
    pub queue: vk::Queue,
    /// The queue's family.
    pub queue_family: u32,
    /// Device limits.
    pub limits: vk::PhysicalDeviceLimits,
    /// Nanoseconds per tick of a timestamp; 0 if there are none.
    pub timestamp_ns: f64,
    /// True if pipeline statistics can be queried.
    pub has_statistics: bool,
    /// True if fragments that pass the depth test can be counted.
    pub counts_passed: bool,
    /// True if vertex shaders may write to buffers, which capturing the drawn mesh needs.
    pub captures: bool,
    /// True if the number of draws may come from a buffer (`drawIndirectCount`), which GPU selection needs.
    pub counts_draws: bool,
    /// Frames whose commands may be under way at once.
    pub frames_in_flight: usize,
    /// Allocator of all memory.
    pub allocator: ManuallyDrop<Arc<Mutex<Allocator>>>,
    /// True if instance, device and queue belong to a caller.
    is_lent: bool,
    utils: Option<ext::debug_utils::Device>,
    /// Reads the clock of timestamps, where the driver supports it.
    pub(super) clock: Option<ext::calibrated_timestamps::Device>,
    /// Valid bits of a timestamp.
    pub(super) timestamp_bits: u32,
    /// Device bytes in use by purpose.
    pub(super) bytes: Mutex<std::collections::BTreeMap<&'static str, u64>>,
    /// Number of allocations that succeed before one fails.
    allocations_left: AtomicU64,
    pub(super) presence: Presence,
}

/// State of a device that may be lost.
pub(super) struct Presence {
    /// Number of calls that succeed before a simulated loss.
    pub calls_left: AtomicU64,
    pub is_lost: AtomicBool,
}

impl Default for Presence {
    fn default() -> Self {
        Self { calls_left: AtomicU64::new(u64::MAX), is_lost: AtomicBool::new(false) }
    }
}

/// Device and queue, with the allocator of the device's memory.
pub(super) struct Handles {
    pub raw: ash::Device,
    pub queue: vk::Queue,
    pub allocator: Arc<Mutex<Allocator>>,
    /// True if the handles belong to a caller, who destroys them.
    pub is_lent: bool,
}

/// Device features that are used where they are enabled.
#[derive(Clone, Copy, Default)]
pub(super) struct Optional {
    pub statistics: bool,
    pub counts_passed: bool,
    pub captures: bool,
    pub counts_draws: bool,
    pub clock: bool,
    pub timestamps: bool,
}

/// Creates an allocator of device memory.
pub(super) fn allocator(
    instance: &ash::Instance,
    device: &ash::Device,
    physical_device: vk::PhysicalDevice,
) -> Result<Arc<Mutex<Allocator>>> {
    let allocator = Allocator::new(&AllocatorCreateDesc {
        instance: instance.clone(),
        device: device.clone(),
        physical_device,
        debug_settings: Default::default(),
        buffer_device_address: false,
        allocation_sizes: Default::default(),
    });
    Ok(Arc::new(Mutex::new(allocator.context("no allocator")?)))
}

/// Returns all devices of an instance, the usable ones first, the best first among them.
pub fn candidates(instance: &Instance) -> Result<Vec<Candidate>> {
    // SAFETY: the instance is alive.
    let devices = unsafe { instance.raw.enumerate_physical_devices() }.context("no list of Vulkan devices")?;
    let mut candidates: Vec<_> = devices.into_iter().map(|raw| candidate(instance, raw)).collect();
    let rank = |kind: vk::PhysicalDeviceType| match kind {
        vk::PhysicalDeviceType::DISCRETE_GPU => 0,
        vk::PhysicalDeviceType::INTEGRATED_GPU => 1,
        vk::PhysicalDeviceType::VIRTUAL_GPU => 2,
        _ => 3,
    };
    candidates.sort_by_key(|c| (!c.missing.is_empty(), rank(c.kind)));
    Ok(candidates)
}

pub(super) fn candidate(instance: &Instance, raw: vk::PhysicalDevice) -> Candidate {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
    // SAFETY: `raw` comes from this instance.
    unsafe { instance.raw.get_physical_device_properties2(raw, &mut properties) };
    let properties = properties.properties;
    // SAFETY: the handles come from this instance and device, and what is pointed to lives until the call returns.
    let families = unsafe { instance.raw.get_physical_device_queue_family_properties(raw) };
    let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    let queue_family = families.iter().position(|f| f.queue_flags.contains(wanted));
    let mut missing = Requirements::OWN.missing(&instance.raw, raw, properties.api_version);
    if queue_family.is_none() {
        missing.push("a queue for graphics and compute".to_string());
    }
    let text = |bytes: &CStr| bytes.to_string_lossy().into_owned();
    let field = |value: Result<&CStr, _>| value.map(text).unwrap_or_default();
    Candidate {
        raw,
        name: field(properties.device_name_as_c_str()),
        kind: properties.device_type,
        version: version_text(properties.api_version),
        driver: format!("{} {}", field(driver.driver_name_as_c_str()), field(driver.driver_info_as_c_str())),
        missing,
        queue_family: queue_family.unwrap_or_default() as u32,
    }
}

fn counts_draws(instance: &Instance, raw: vk::PhysicalDevice) -> bool {
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut v12);
    // SAFETY: the chain holds structs that a 1.3 device knows.
    unsafe { instance.raw.get_physical_device_features2(raw, &mut features) };
    v12.draw_indirect_count == vk::TRUE
}

/// Returns true if the driver has `VK_EXT_calibrated_timestamps` and supports the device time domain with it.
fn reads_clock(instance: &Instance, raw: vk::PhysicalDevice) -> bool {
    // SAFETY: the device is of this instance.
    let extensions = unsafe { instance.raw.enumerate_device_extension_properties(raw) }.unwrap_or_default();
    let name = Ok(ext::calibrated_timestamps::NAME);
    if !extensions.iter().any(|extension| extension.extension_name_as_c_str() == name) {
        return false;
    }
    let calibrated = ext::calibrated_timestamps::Instance::new(&instance.entry, &instance.raw);
    // SAFETY: the device is of this instance and has the extension.
    let domains = unsafe { calibrated.get_physical_device_calibrateable_time_domains(raw) }.unwrap_or_default();
    domains.contains(&vk::TimeDomainEXT::DEVICE)
}

impl Candidate {
    /// Returns true if the device computes on the CPU.
    pub fn is_software(&self) -> bool {
        self.kind == vk::PhysicalDeviceType::CPU
    }

    fn is_chosen(&self, choice: &Choice) -> bool {
        match choice {
            Choice::Best => true,
            Choice::Cpu => self.is_software(),
            Choice::Named(part) => self.name.to_lowercase().contains(&part.to_lowercase()),
        }
    }
}

impl Gpu {
    /// Creates a device; `window` adds the swapchain extension.
    pub fn new(instance: &Arc<Instance>, choice: &Choice, window: bool) -> Result<Arc<Self>> {
        Self::on(instance, choose(instance, choice, |_| true)?, window)
    }

    /// Creates a device that can present to a window, as `is_shown_by` tells.
    pub fn for_window(
        instance: &Arc<Instance>,
        choice: &Choice,
        is_shown_by: impl Fn(&Candidate) -> bool,
    ) -> Result<Arc<Self>> {
        Self::on(instance, choose(instance, choice, is_shown_by)?, true)
    }

    fn on(instance: &Arc<Instance>, candidate: Candidate, window: bool) -> Result<Arc<Self>> {
        let priorities = [1.0];
        let queues = [vk::DeviceQueueCreateInfo::default()
            .queue_family_index(candidate.queue_family)
            .queue_priorities(&priorities)];
        // SAFETY: `raw` comes from this instance.
        let available = unsafe { instance.raw.get_physical_device_features(candidate.raw) };
        let optional = Optional {
            statistics: available.pipeline_statistics_query == vk::TRUE,
            counts_passed: available.occlusion_query_precise == vk::TRUE,
            captures: available.vertex_pipeline_stores_and_atomics == vk::TRUE,
            counts_draws: counts_draws(instance, candidate.raw),
            clock: reads_clock(instance, candidate.raw),
            timestamps: true,
        };
        let mut core = vk::PhysicalDeviceFeatures::default()
            .occlusion_query_precise(optional.counts_passed)
            .pipeline_statistics_query(optional.statistics)
            .vertex_pipeline_stores_and_atomics(optional.captures);
        let mut v12 = vk::PhysicalDeviceVulkan12Features::default().draw_indirect_count(optional.counts_draws);
        let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
        Requirements::OWN.enable(&mut core, &mut v12, &mut v13);
        let wanted = [(window, khr::swapchain::NAME), (optional.clock, ext::calibrated_timestamps::NAME)];
        let extensions: Vec<_> = wanted.into_iter().filter(|(is, _)| *is).map(|(_, name)| name.as_ptr()).collect();
        let info = vk::DeviceCreateInfo::default()
            .queue_create_infos(&queues)
            .enabled_features(&core)
            .enabled_extension_names(&extensions)
            .push_next(&mut v12)
            .push_next(&mut v13);
        // SAFETY: the handles come from this instance and device, and what is pointed to lives until the call returns.
        let raw = unsafe { instance.raw.create_device(candidate.raw, &info, None) }
            .with_context(|| format!("no logical device on {}", candidate.name))?;
        // SAFETY: the handles come from this instance and device, and what is pointed to lives until the call returns.
        let queue = unsafe { raw.get_device_queue(candidate.queue_family, 0) };
        let allocator = allocator(&instance.raw, &raw, candidate.raw)?;
        let handles = Handles { raw, queue, allocator, is_lent: false };
        let gpu = Self::assemble(Arc::clone(instance), candidate, handles, optional, FRAMES_IN_FLIGHT);
        gpu.name(queue, "queue");
        Ok(gpu)
    }

    /// Puts a device together from its handles. `candidate` holds the family of the queue.
    pub(super) fn assemble(
        instance: Arc<Instance>,
        candidate: Candidate,
        handles: Handles,
        optional: Optional,
        frames_in_flight: usize,
    ) -> Arc<Self> {
        let Handles { raw, queue, allocator, is_lent } = handles;
        // SAFETY: the handles come from this instance and device, and what is pointed to lives until the call returns.
        let limits = unsafe { instance.raw.get_physical_device_properties(candidate.raw) }.limits;
        // SAFETY: the handles come from this instance and device, and what is pointed to lives until the call returns.
        let families = unsafe { instance.raw.get_physical_device_queue_family_properties(candidate.raw) };
        let timestamp_bits = match optional.timestamps {
            true => families[candidate.queue_family as usize].timestamp_valid_bits,
            false => 0,
        };
        let clock = optional.clock.then(|| ext::calibrated_timestamps::Device::new(&instance.raw, &raw));
        let utils = instance.has_debug_utils.then(|| ext::debug_utils::Device::new(&instance.raw, &raw));
        Arc::new(Self {
            instance,
            queue_family: candidate.queue_family,
            candidate,
            raw,
            queue,
            limits,
            timestamp_ns: if timestamp_bits > 0 { f64::from(limits.timestamp_period) } else { 0.0 },
            has_statistics: optional.statistics,
            counts_passed: optional.counts_passed,
            counts_draws: optional.counts_draws,
            captures: optional.captures,
            frames_in_flight,
            allocator: ManuallyDrop::new(allocator),
            is_lent,
            utils,
            clock,
            timestamp_bits,
            bytes: Mutex::default(),
            allocations_left: AtomicU64::new(u64::MAX),
            presence: Presence::default(),
        })
    }

    /// Gives a Vulkan object a name that tools show.
    pub fn name(&self, handle: impl vk::Handle, name: &str) {
        let Some(utils) = &self.utils else { return };
        let text = CString::new(name).unwrap_or_default();
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&text);
        // SAFETY: the handle is alive and of this device. A name that is not taken is no loss.
        let _ = unsafe { utils.set_debug_utils_object_name(&info) };
    }

    /// Begins a debug label in a command buffer.
    pub fn begin_label(&self, commands: vk::CommandBuffer, name: &str) {
        let Some(utils) = &self.utils else { return };
        let text = CString::new(name).unwrap_or_default();
        // SAFETY: the command buffer is being recorded.
        unsafe { utils.cmd_begin_debug_utils_label(commands, &vk::DebugUtilsLabelEXT::default().label_name(&text)) };
    }

    /// Ends the label that was begun last.
    pub fn end_label(&self, commands: vk::CommandBuffer) {
        if let Some(utils) = &self.utils {
            // SAFETY: the command buffer is being recorded and a label is open.
            unsafe { utils.cmd_end_debug_utils_label(commands) };
        }
    }

    /// Returns the device limits that scene plans depend on.
    pub fn device_limits(&self) -> DeviceLimits {
        let filters = |format| {
            // SAFETY: the physical device is of this instance.
            let properties =
                unsafe { self.instance.raw.get_physical_device_format_properties(self.candidate.raw, format) };
            properties.optimal_tiling_features.contains(vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR)
        };
        DeviceLimits {
            image_side: self.limits.max_image_dimension2_d,
            image_layers: self.limits.max_image_array_layers,
            filters_heights: filters(vk::Format::R16_UNORM) && filters(vk::Format::R32_SFLOAT),
        }
    }

    /// Makes all allocations of device memory after the next `count` fail, for tests.
    pub fn limit_allocations(&self, count: u64) {
        self.allocations_left.store(count, Relaxed);
    }

    /// Counts an allocation. Returns true if it may succeed.
    pub(super) fn may_allocate(&self) -> bool {
        self.allocations_left.fetch_update(Relaxed, Relaxed, |left| left.checked_sub(1)).is_ok()
    }

    /// Returns the device bytes in use, by purpose.
    pub fn device_bytes(&self) -> std::collections::BTreeMap<&'static str, u64> {
        self.bytes.lock().unwrap_or_else(|e| e.into_inner()).clone()
    }

    /// Destroys the device, whose objects must all be gone. Returns the messages of the validation layers, those about the
    /// destruction included.
    pub fn close(gpu: Arc<Self>) -> Vec<String> {
        let instance = Arc::clone(&gpu.instance);
        drop(gpu);
        let messages = instance.messages.lock().unwrap_or_else(|e| e.into_inner());
        messages.clone()
    }

    /// Waits until the device is idle. A lent device is its owner's to wait for: then this returns at once.
    pub fn wait_idle(&self) -> Result<()> {
        if self.is_lent {
            return Ok(());
        }
        // SAFETY: one thread uses the queue.
        unsafe { self.raw.device_wait_idle() }.context("waiting for the device")
    }
}

fn choose(instance: &Instance, choice: &Choice, is_shown_by: impl Fn(&Candidate) -> bool) -> Result<Candidate> {
    let mut all = candidates(instance)?;
    for candidate in all.iter_mut().filter(|c| !is_shown_by(c)) {
        candidate.missing.push("a way to show pictures on this window".to_string());
    }
    let describe = |c: &Candidate| match c.missing.as_slice() {
        [] => c.name.clone(),
        missing => format!("{} (lacks {})", c.name, missing.join(", ")),
    };
    match all.iter().find(|c| c.missing.is_empty() && c.is_chosen(choice)) {
        Some(candidate) => Ok(candidate.clone()),
        None if all.is_empty() => bail!("no Vulkan device on this system"),
        None => bail!(
            "no usable Vulkan device{}; there are: {}",
            match choice {
                Choice::Best => String::new(),
                Choice::Cpu => " that computes on the CPU".to_string(),
                Choice::Named(part) => format!(" named {part}"),
            },
            all.iter().map(describe).collect::<Vec<_>>().join("; ")
        ),
    }
}

impl Drop for Gpu {
    fn drop(&mut self) {
        // SAFETY: every object holds an Arc of this device, so none is left; the allocator goes before it.
        unsafe {
            let _ = self.wait_idle();
            ManuallyDrop::drop(&mut self.allocator);
            if !self.is_lent {
                self.raw.destroy_device(None);
            }
        }
    }
}
