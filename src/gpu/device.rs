//! The choice of a device, and the logical device made on it.

use std::ffi::{CStr, CString};
use std::mem::ManuallyDrop;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex};

use anyhow::{Context, Result, bail};
use ash::{ext, khr, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};

use super::clock;
use super::instance::{Instance, version_text};
use super::loss::Presence;
use crate::plan::DeviceLimits;

/// Which device to take.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub enum Choice {
    /// Discrete before integrated before virtual before software.
    #[default]
    Best,
    /// A software device.
    Cpu,
    /// The first whose name contains this, whatever the case.
    Named(String),
}

/// A physical device as the program sees it.
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
    /// What it lacks; empty if it can be used.
    pub missing: Vec<String>,
    pub(super) queue_family: u32,
}

/// A logical device with one queue and an allocator. Objects made on it hold an `Arc` of it.
pub struct Gpu {
    /// The instance it was made from.
    pub instance: Arc<Instance>,
    /// The device it was made on.
    pub candidate: Candidate,
    /// The device.
    pub raw: ash::Device,
    /// The one queue: graphics, compute and transfer.
    pub queue: vk::Queue,
    /// The queue's family.
    pub queue_family: u32,
    /// Device limits.
    pub limits: vk::PhysicalDeviceLimits,
    /// Nanoseconds per tick of a timestamp; 0 if there are none.
    pub timestamp_ns: f64,
    /// Whether pipeline statistics can be queried.
    pub has_statistics: bool,
    /// Whether fragments that pass the depth test can be counted.
    pub counts_passed: bool,
    /// Whether vertex programs may write to buffers: what capturing the as-drawn mesh needs.
    pub captures: bool,
    /// Whether the number of draws may come from a buffer (`drawIndirectCount`): what selection on the device needs.
    pub counts_draws: bool,
    /// Allocator of all memory.
    pub allocator: ManuallyDrop<Arc<Mutex<Allocator>>>,
    utils: Option<ext::debug_utils::Device>,
    /// Reads the clock of timestamps, where the driver can.
    pub(super) clock: Option<ext::calibrated_timestamps::Device>,
    /// Valid bits of a timestamp.
    pub(super) timestamp_bits: u32,
    /// Device bytes in use by purpose.
    pub(super) bytes: Mutex<std::collections::BTreeMap<&'static str, u64>>,
    /// Allocations that are still to succeed.
    allocations_left: AtomicU64,
    pub(super) presence: Presence,
}

/// All devices of an instance, the usable ones first, the best first among them.
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

fn candidate(instance: &Instance, raw: vk::PhysicalDevice) -> Candidate {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
    // SAFETY: `raw` comes from this instance.
    unsafe { instance.raw.get_physical_device_properties2(raw, &mut properties) };
    let properties = properties.properties;
    // SAFETY: the handles come from this instance and device, and what is pointed to lives until the call returns.
    let families = unsafe { instance.raw.get_physical_device_queue_family_properties(raw) };
    let wanted = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    let queue_family = families.iter().position(|f| f.queue_flags.contains(wanted));
    let mut missing = Vec::new();
    if properties.api_version < vk::API_VERSION_1_3 {
        missing.push(format!("Vulkan 1.3 (it has {})", version_text(properties.api_version)));
    } else {
        missing.extend(missing_features(instance, raw));
    }
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

fn missing_features(instance: &Instance, raw: vk::PhysicalDevice) -> Vec<String> {
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut v12).push_next(&mut v13);
    // SAFETY: the chain holds structs that a 1.3 device knows.
    unsafe { instance.raw.get_physical_device_features2(raw, &mut features) };
    let core = features.features;
    [
        (core.multi_draw_indirect, "multiDrawIndirect"),
        (core.draw_indirect_first_instance, "drawIndirectFirstInstance"),
        (core.fill_mode_non_solid, "fillModeNonSolid"),
        (v12.scalar_block_layout, "scalarBlockLayout"),
        (v12.host_query_reset, "hostQueryReset"),
        (v13.dynamic_rendering, "dynamicRendering"),
        (v13.maintenance4, "maintenance4"),
        (v13.synchronization2, "synchronization2"),
        (v13.shader_demote_to_helper_invocation, "shaderDemoteToHelperInvocation"),
    ]
    .into_iter()
    .filter(|(has, _)| *has == vk::FALSE)
    .map(|(_, name)| name.to_string())
    .collect()
}

fn counts_draws(instance: &Instance, raw: vk::PhysicalDevice) -> bool {
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut v12);
    // SAFETY: the chain holds structs that a 1.3 device knows.
    unsafe { instance.raw.get_physical_device_features2(raw, &mut features) };
    v12.draw_indirect_count == vk::TRUE
}

impl Candidate {
    /// Whether it computes on the CPU.
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
    /// Makes a device; `window` adds the swapchain extension.
    pub fn new(instance: &Arc<Instance>, choice: &Choice, window: bool) -> Result<Arc<Self>> {
        Self::on(instance, choose(instance, choice, |_| true)?, window)
    }

    /// Makes a device that can show pictures on a window, as `is_shown_by` says.
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
        let core = vk::PhysicalDeviceFeatures::default()
            .multi_draw_indirect(true)
            .draw_indirect_first_instance(true)
            .fill_mode_non_solid(true)
            .occlusion_query_precise(available.occlusion_query_precise == vk::TRUE)
            .pipeline_statistics_query(available.pipeline_statistics_query == vk::TRUE)
            .vertex_pipeline_stores_and_atomics(available.vertex_pipeline_stores_and_atomics == vk::TRUE);
        let counts_draws = counts_draws(instance, candidate.raw);
        let mut v12 = vk::PhysicalDeviceVulkan12Features::default()
            .scalar_block_layout(true)
            .host_query_reset(true)
            .draw_indirect_count(counts_draws);
        let mut v13 = vk::PhysicalDeviceVulkan13Features::default()
            .dynamic_rendering(true)
            // Compilers state the size of workgroups by LocalSizeId, which needs it.
            .maintenance4(true)
            .synchronization2(true)
            .shader_demote_to_helper_invocation(true);
        let has_clock = clock::is_readable(instance, candidate.raw);
        let wanted = [(window, khr::swapchain::NAME), (has_clock, ext::calibrated_timestamps::NAME)];
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
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.raw.clone(),
            device: raw.clone(),
            physical_device: candidate.raw,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        })
        .context("no allocator")?;
        // SAFETY: the handles come from this instance and device, and what is pointed to lives until the call returns.
        let limits = unsafe { instance.raw.get_physical_device_properties(candidate.raw) }.limits;
        // SAFETY: the handles come from this instance and device, and what is pointed to lives until the call returns.
        let families = unsafe { instance.raw.get_physical_device_queue_family_properties(candidate.raw) };
        let timestamp_bits = families[candidate.queue_family as usize].timestamp_valid_bits;
        let clock = has_clock.then(|| ext::calibrated_timestamps::Device::new(&instance.raw, &raw));
        let utils = instance.has_debug_utils.then(|| ext::debug_utils::Device::new(&instance.raw, &raw));
        let gpu = Arc::new(Self {
            instance: Arc::clone(instance),
            queue_family: candidate.queue_family,
            candidate,
            raw,
            queue,
            limits,
            timestamp_ns: if timestamp_bits > 0 { f64::from(limits.timestamp_period) } else { 0.0 },
            has_statistics: available.pipeline_statistics_query == vk::TRUE,
            counts_passed: available.occlusion_query_precise == vk::TRUE,
            counts_draws,
            captures: available.vertex_pipeline_stores_and_atomics == vk::TRUE,
            allocator: ManuallyDrop::new(Arc::new(Mutex::new(allocator))),
            utils,
            clock,
            timestamp_bits,
            bytes: Mutex::default(),
            allocations_left: AtomicU64::new(u64::MAX),
            presence: Presence::default(),
        });
        gpu.name(queue, "queue");
        Ok(gpu)
    }

    /// Gives a Vulkan object a name that tools show.
    pub fn name(&self, handle: impl vk::Handle, name: &str) {
        let Some(utils) = &self.utils else { return };
        let text = CString::new(name).unwrap_or_default();
        let info = vk::DebugUtilsObjectNameInfoEXT::default().object_handle(handle).object_name(&text);
        // SAFETY: the handle is alive and of this device. A name that is not taken is no loss.
        let _ = unsafe { utils.set_debug_utils_object_name(&info) };
    }

    /// Opens a label in a command buffer.
    pub fn begin_label(&self, commands: vk::CommandBuffer, name: &str) {
        let Some(utils) = &self.utils else { return };
        let text = CString::new(name).unwrap_or_default();
        // SAFETY: the command buffer is being recorded.
        unsafe { utils.cmd_begin_debug_utils_label(commands, &vk::DebugUtilsLabelEXT::default().label_name(&text)) };
    }

    /// Closes the label opened last.
    pub fn end_label(&self, commands: vk::CommandBuffer) {
        if let Some(utils) = &self.utils {
            // SAFETY: the command buffer is being recorded and a label is open.
            unsafe { utils.cmd_end_debug_utils_label(commands) };
        }
    }

    /// What the device allows, as far as plans depend on it.
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

    /// From now on so many allocations of device memory succeed, and those after them fail: to try what happens then.
    pub fn limit_allocations(&self, count: u64) {
        self.allocations_left.store(count, Relaxed);
    }

    /// Counts an allocation: whether it may succeed.
    pub(super) fn may_allocate(&self) -> bool {
        self.allocations_left.fetch_update(Relaxed, Relaxed, |left| left.checked_sub(1)).is_ok()
    }

    /// Device bytes in use, by purpose.
    pub fn device_bytes(&self) -> std::collections::BTreeMap<&'static str, u64> {
        self.bytes.lock().unwrap_or_else(|e| e.into_inner()).clone()
    }

    /// Gives the device up, of which nothing is in use any more: what the validation layers have said, the device's
    /// end included.
    pub fn close(gpu: Arc<Self>) -> Vec<String> {
        let instance = Arc::clone(&gpu.instance);
        drop(gpu);
        let messages = instance.messages.lock().unwrap_or_else(|e| e.into_inner());
        messages.clone()
    }

    /// Waits until the device has nothing to do.
    pub fn wait_idle(&self) -> Result<()> {
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
            let _ = self.raw.device_wait_idle();
            ManuallyDrop::drop(&mut self.allocator);
            self.raw.destroy_device(None);
        }
    }
}
