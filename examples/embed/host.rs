//! The host program's own Vulkan objects: instance, device, queue, allocator and attachments.

use std::ffi::{CStr, c_void};
use std::mem::ManuallyDrop;
use std::sync::{Arc, Mutex};

use anyhow::{Context, Result, anyhow, ensure};
use ash::{ext, vk};
use cuesta::embed::{DeviceHandles, Requirements};
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc};

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

/// Instance, device, queue and allocator.
pub struct Host {
    entry: ash::Entry,
    instance: ash::Instance,
    physical_device: vk::PhysicalDevice,
    pub device: ash::Device,
    pub queue: vk::Queue,
    pub queue_family: u32,
    allocator: ManuallyDrop<Arc<Mutex<Allocator>>>,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    /// Messages of the validation layers.
    messages: Box<Mutex<Vec<String>>>,
}

/// An attachment.
pub struct Attachment {
    pub image: vk::Image,
    pub view: vk::ImageView,
    pub format: vk::Format,
    pub samples: vk::SampleCountFlags,
    memory: Allocation,
}

/// A buffer that the host reads.
pub struct Readback {
    pub buffer: vk::Buffer,
    memory: Allocation,
}

impl Host {
    /// Creates a device with the features that the terrain needs and no others, under validation if it is installed.
    pub fn new(requirements: &Requirements) -> Result<Self> {
        // SAFETY: loading the system's Vulkan loader runs its initialisers.
        let entry = unsafe { ash::Entry::load() }.context("no Vulkan loader")?;
        let messages = Box::new(Mutex::new(Vec::new()));
        let (instance, messenger) = instance(&entry, &messages)?;
        let (physical_device, queue_family) = choose(&instance, requirements)?;
        let device = device(&instance, physical_device, queue_family, requirements)?;
        // SAFETY: the device was created with one queue of this family.
        let queue = unsafe { device.get_device_queue(queue_family, 0) };
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: device.clone(),
            physical_device,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        })?;
        let allocator = ManuallyDrop::new(Arc::new(Mutex::new(allocator)));
        Ok(Self { entry, instance, physical_device, device, queue, queue_family, allocator, messenger, messages })
    }

    /// Lends the handles to the terrain renderer, with the allocator or without.
    pub fn handles(&self, lends_allocator: bool) -> DeviceHandles {
        DeviceHandles {
            entry: self.entry.clone(),
            instance: self.instance.clone(),
            physical_device: self.physical_device,
            device: self.device.clone(),
            queue: self.queue,
            queue_family: self.queue_family,
            allocator: lends_allocator.then(|| Arc::clone(&self.allocator)),
            debug_utils: self.messenger.is_some(),
        }
    }

    /// Bytes of all live allocations of the allocator.
    pub fn allocated_bytes(&self) -> u64 {
        self.allocator.lock().expect("no thread panicked").generate_report().total_allocated_bytes
    }

    /// Creates an attachment.
    pub fn attachment(
        &self,
        size: [u32; 2],
        format: vk::Format,
        samples: vk::SampleCountFlags,
        usage: vk::ImageUsageFlags,
    ) -> Result<Attachment> {
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(format)
            .extent(vk::Extent3D { width: size[0], height: size[1], depth: 1 })
            .mip_levels(1)
            .array_layers(1)
            .samples(samples)
            .usage(usage);
        // SAFETY: the device is alive; memory is bound before the view is created.
        unsafe {
            let image = self.device.create_image(&info, None)?;
            let requirements = self.device.get_image_memory_requirements(image);
            let memory = self.allocate(requirements, MemoryLocation::GpuOnly, false)?;
            self.device.bind_image_memory(image, memory.memory(), memory.offset())?;
            let info = vk::ImageViewCreateInfo::default()
                .image(image)
                .view_type(vk::ImageViewType::TYPE_2D)
                .format(format)
                .subresource_range(range(format));
            let view = self.device.create_image_view(&info, None)?;
            Ok(Attachment { image, view, format, samples, memory })
        }
    }

    /// Creates a buffer that the device writes and the host reads.
    pub fn readback(&self, bytes: u64) -> Result<Readback> {
        let info = vk::BufferCreateInfo::default().size(bytes).usage(vk::BufferUsageFlags::TRANSFER_DST);
        // SAFETY: the device is alive.
        unsafe {
            let buffer = self.device.create_buffer(&info, None)?;
            let requirements = self.device.get_buffer_memory_requirements(buffer);
            let memory = self.allocate(requirements, MemoryLocation::GpuToCpu, true)?;
            self.device.bind_buffer_memory(buffer, memory.memory(), memory.offset())?;
            Ok(Readback { buffer, memory })
        }
    }

    fn allocate(
        &self,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
        linear: bool,
    ) -> Result<Allocation> {
        let allocation_scheme = AllocationScheme::GpuAllocatorManaged;
        let description = AllocationCreateDesc { name: "host", requirements, location, linear, allocation_scheme };
        let mut allocator = self.allocator.lock().expect("no thread panicked");
        Ok(allocator.allocate(&description)?)
    }

    /// Destroys an attachment that the device uses no more.
    pub fn destroy_attachment(&self, attachment: Attachment) -> Result<()> {
        // SAFETY: the caller waited for the device.
        unsafe {
            self.device.destroy_image_view(attachment.view, None);
            self.device.destroy_image(attachment.image, None);
        }
        Ok(self.allocator.lock().expect("no thread panicked").free(attachment.memory)?)
    }

    /// Destroys a buffer that the device uses no more.
    pub fn destroy_readback(&self, readback: Readback) -> Result<()> {
        // SAFETY: the caller waited for the device.
        unsafe { self.device.destroy_buffer(readback.buffer, None) };
        Ok(self.allocator.lock().expect("no thread panicked").free(readback.memory)?)
    }

    /// Destroys device and instance. Returns the messages of the validation layers, which also report leaked objects.
    pub fn close(mut self) -> Result<Vec<String>> {
        let leaks = self.allocator.lock().expect("no thread panicked").generate_report().allocations.len();
        let users = Arc::strong_count(&self.allocator);
        // SAFETY: all objects of the device are gone; its memory goes before it.
        unsafe {
            ManuallyDrop::drop(&mut self.allocator);
            self.device.destroy_device(None);
            if let Some((utils, messenger)) = self.messenger.take() {
                utils.destroy_debug_utils_messenger(messenger, None);
            }
            self.instance.destroy_instance(None);
        }
        ensure!(leaks == 0 && users == 1, "{leaks} allocations are left, {users} users of the allocator");
        Ok(self.messages.into_inner()?)
    }
}

impl Readback {
    /// The bytes that the device wrote.
    pub fn bytes(&self) -> &[u8] {
        self.memory.mapped_slice().expect("host-visible")
    }
}

/// The whole of an image.
pub fn range(format: vk::Format) -> vk::ImageSubresourceRange {
    use vk::ImageAspectFlags as Aspect;
    let aspect = match format {
        vk::Format::D16_UNORM | vk::Format::X8_D24_UNORM_PACK32 | vk::Format::D32_SFLOAT => Aspect::DEPTH,
        _ if has_stencil(format) => Aspect::DEPTH | Aspect::STENCIL,
        _ => Aspect::COLOR,
    };
    vk::ImageSubresourceRange::default().aspect_mask(aspect).level_count(1).layer_count(1)
}

/// Returns true if a depth format has stencil values, too.
pub fn has_stencil(format: vk::Format) -> bool {
    use vk::Format as F;
    [F::D16_UNORM_S8_UINT, F::D24_UNORM_S8_UINT, F::D32_SFLOAT_S8_UINT].contains(&format)
}

type Messenger = (ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT);

fn instance(entry: &ash::Entry, messages: &Mutex<Vec<String>>) -> Result<(ash::Instance, Option<Messenger>)> {
    use vk::DebugUtilsMessageSeverityFlagsEXT as Severity;
    use vk::DebugUtilsMessageTypeFlagsEXT as Type;
    // SAFETY: the loader is alive.
    let layers = unsafe { entry.enumerate_instance_layer_properties()? };
    let validates = layers.iter().any(|layer| layer.layer_name_as_c_str() == Ok(VALIDATION));
    let layers = [VALIDATION.as_ptr()];
    let extensions = [ext::debug_utils::NAME.as_ptr(), ext::validation_features::NAME.as_ptr()];
    let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    let app = vk::ApplicationInfo::default().application_name(c"host").api_version(Requirements::API_VERSION);
    let mut info = vk::InstanceCreateInfo::default().application_info(&app);
    if validates {
        info = info.enabled_layer_names(&layers).enabled_extension_names(&extensions).push_next(&mut features);
    }
    // SAFETY: all pointers live until the call returns.
    let instance = unsafe { entry.create_instance(&info, None) }.context("no Vulkan instance")?;
    if !validates {
        return Ok((instance, None));
    }
    let info = vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Type::GENERAL | Type::VALIDATION | Type::PERFORMANCE)
        .pfn_user_callback(Some(receive))
        .user_data(std::ptr::from_ref(messages).cast_mut().cast());
    let utils = ext::debug_utils::Instance::new(entry, &instance);
    // SAFETY: `messages` is boxed and outlives the messenger.
    let messenger = unsafe { utils.create_debug_utils_messenger(&info, None)? };
    Ok((instance, Some((utils, messenger))))
}

unsafe extern "system" fn receive(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    messages: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layers pass valid data, and the user data are the boxed messages.
    let (text, messages) = unsafe {
        let text = (*data).message_as_c_str().map(|text| text.to_string_lossy().into_owned());
        (text.unwrap_or_default(), &*messages.cast::<Mutex<Vec<String>>>())
    };
    messages.lock().expect("no thread panicked").push(text);
    vk::FALSE
}

/// Returns the first device that can draw the terrain, and the family of its queue.
fn choose(instance: &ash::Instance, requirements: &Requirements) -> Result<(vk::PhysicalDevice, u32)> {
    let mut error = anyhow!("no Vulkan device");
    // SAFETY: the instance is alive, and the devices are its own.
    unsafe {
        for device in instance.enumerate_physical_devices()? {
            let families = instance.get_physical_device_queue_family_properties(device);
            let has_graphics = |f: &vk::QueueFamilyProperties| f.queue_flags.contains(vk::QueueFlags::GRAPHICS);
            let family = families.iter().position(has_graphics).unwrap_or_default() as u32;
            match requirements.check(instance, device, family) {
                Ok(()) => return Ok((device, family)),
                Err(unsupported) => error = unsupported.into(),
            }
        }
    }
    Err(error)
}

fn device(
    instance: &ash::Instance,
    physical_device: vk::PhysicalDevice,
    queue_family: u32,
    requirements: &Requirements,
) -> Result<ash::Device> {
    let mut core = vk::PhysicalDeviceFeatures::default();
    let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
    requirements.enable(&mut core, &mut v12, &mut v13);
    // The host's own barriers.
    v13.synchronization2 = vk::TRUE;
    let queues = [vk::DeviceQueueCreateInfo::default().queue_family_index(queue_family).queue_priorities(&[1.0])];
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_features(&core)
        .push_next(&mut v12)
        .push_next(&mut v13);
    // SAFETY: all pointers live until the call returns.
    unsafe { instance.create_device(physical_device, &info, None) }.context("no logical device")
}
