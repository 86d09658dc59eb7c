//! The Vulkan instance, its validation layers, and the messages they send.

use std::ffi::{CStr, c_void};
use std::sync::{Arc, Mutex};

use anyhow::{Context, Result, bail};
use ash::{ext, vk};

/// Messages of the validation layers, in order.
pub type Messages = Arc<Mutex<Vec<String>>>;

/// A Vulkan 1.3 instance.
pub struct Instance {
    /// The loader.
    pub entry: ash::Entry,
    /// The instance.
    pub raw: ash::Instance,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    /// True if objects can be named and labelled.
    pub has_debug_utils: bool,
    /// Messages of the validation layers.
    pub messages: Messages,
    /// True if the instance belongs to a caller, who destroys it.
    is_lent: bool,
    // The messenger's user data points here.
    _sink: Box<Messages>,
}

/// Parts of the text of expected messages, each with the reason. None at present.
const EXPECTED: &[&str] = &[];

const VALIDATION: &CStr = c"VK_LAYER_KHRONOS_validation";

impl Instance {
    /// Creates an instance with the given extensions in addition to those of the renderer. `validate` turns on core and
    /// synchronization validation.
    pub fn new(extensions: &[&CStr], validate: bool) -> Result<Arc<Self>> {
        // SAFETY: loading the system's Vulkan loader runs its initialisers, which is what it is for.
        let entry = unsafe { ash::Entry::load() }.context("no Vulkan loader (libvulkan.so.1) on this system")?;
        // SAFETY: what is pointed to lives until the call returns.
        let version = unsafe { entry.try_enumerate_instance_version() }?.unwrap_or(vk::API_VERSION_1_0);
        if version < vk::API_VERSION_1_3 {
            bail!("the Vulkan loader knows version {}, 1.3 is needed", version_text(version));
        }
        // SAFETY: what is pointed to lives until the call returns.
        let available = unsafe { entry.enumerate_instance_extension_properties(None) }?;
        let has = |name: &CStr| available.iter().any(|e| e.extension_name_as_c_str() == Ok(name));
        let mut names: Vec<_> = extensions.iter().map(|e| e.as_ptr()).collect();
        if let Some(missing) = extensions.iter().find(|e| !has(e)) {
            bail!("the Vulkan loader lacks the instance extension {missing:?}");
        }
        let has_debug_utils = has(ext::debug_utils::NAME);
        if has_debug_utils {
            names.push(ext::debug_utils::NAME.as_ptr());
        }
        let mut layers = Vec::new();
        if validate {
            // SAFETY: what is pointed to lives until the call returns.
            let known = unsafe { entry.enumerate_instance_layer_properties() }?;
            if !known.iter().any(|l| l.layer_name_as_c_str() == Ok(VALIDATION)) {
                bail!("the validation layer {VALIDATION:?} is not installed");
            }
            layers.push(VALIDATION.as_ptr());
            names.push(ext::validation_features::NAME.as_ptr());
        }
        let sink: Box<Messages> = Box::default();
        let messages = Arc::clone(&sink);
        let app = vk::ApplicationInfo::default().application_name(c"cuesta").api_version(vk::API_VERSION_1_3);
        let enabled = [vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION];
        let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
        let mut watch = messenger_info(&sink);
        let mut info = vk::InstanceCreateInfo::default()
            .application_info(&app)
            .enabled_layer_names(&layers)
            .enabled_extension_names(&names);
        if validate {
            // Messages about the creation of the instance itself.
            info = info.push_next(&mut features).push_next(&mut watch);
        }
        // SAFETY: all pointers live until the call returns; `sink` lives as long as the instance.
        let raw = unsafe { entry.create_instance(&info, None) }.context("no Vulkan instance")?;
        let messenger = if validate {
            let utils = ext::debug_utils::Instance::new(&entry, &raw);
            // SAFETY: what is pointed to lives until the call returns.
            let messenger = unsafe { utils.create_debug_utils_messenger(&messenger_info(&sink), None) }?;
            Some((utils, messenger))
        } else {
            None
        };
        Ok(Arc::new(Self { entry, raw, messenger, has_debug_utils, messages, is_lent: false, _sink: sink }))
    }

    /// Wraps an instance of a caller. `has_debug_utils`: it was created with `VK_EXT_debug_utils`.
    pub(super) fn lent(entry: ash::Entry, raw: ash::Instance, has_debug_utils: bool) -> Arc<Self> {
        let sink: Box<Messages> = Box::default();
        let messages = Arc::clone(&sink);
        Arc::new(Self { entry, raw, messenger: None, has_debug_utils, messages, is_lent: true, _sink: sink })
    }
}

impl Drop for Instance {
    fn drop(&mut self) {
        // SAFETY: every device holds an Arc of this instance, so none is left.
        unsafe {
            if let Some((utils, messenger)) = self.messenger.take() {
                utils.destroy_debug_utils_messenger(messenger, None);
            }
            if !self.is_lent {
                self.raw.destroy_instance(None);
            }
        }
    }
}

fn messenger_info(sink: &Messages) -> vk::DebugUtilsMessengerCreateInfoEXT<'static> {
    use vk::DebugUtilsMessageSeverityFlagsEXT as Severity;
    use vk::DebugUtilsMessageTypeFlagsEXT as Type;
    vk::DebugUtilsMessengerCreateInfoEXT::default()
        .message_severity(Severity::WARNING | Severity::ERROR)
        .message_type(Type::GENERAL | Type::VALIDATION | Type::PERFORMANCE)
        .pfn_user_callback(Some(receive))
        .user_data(std::ptr::from_ref(sink).cast_mut().cast())
}

unsafe extern "system" fn receive(
    _: vk::DebugUtilsMessageSeverityFlagsEXT,
    _: vk::DebugUtilsMessageTypeFlagsEXT,
    data: *const vk::DebugUtilsMessengerCallbackDataEXT<'_>,
    sink: *mut c_void,
) -> vk::Bool32 {
    // SAFETY: the layers pass valid data, and `sink` is the instance's boxed `Messages`.
    let (text, messages) = unsafe {
        let text = (*data).message_as_c_str().map(|t| t.to_string_lossy().into_owned()).unwrap_or_default();
        (text, &*sink.cast::<Messages>())
    };
    if !EXPECTED.iter().any(|part| text.contains(part)) {
        messages.lock().unwrap_or_else(|e| e.into_inner()).push(text);
    }
    vk::FALSE
}

/// Returns a version as major.minor.patch.
pub fn version_text(version: u32) -> String {
    format!("{}.{}.{}", vk::api_version_major(version), vk::api_version_minor(version), vk::api_version_patch(version))
}
