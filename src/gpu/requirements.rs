//! The Vulkan version, device features and formats that the renderer needs: one table for devices of its own and of callers.

use std::fmt;

use ash::vk;

use super::formats::Formats;
use super::instance::version_text;

/// Vulkan version, device features and formats that drawing terrain needs.
///
/// A caller enables the features when it creates its device, and checks a physical device before that.
#[derive(Clone, Copy, Debug)]
pub struct Requirements {
    uses: Uses,
    formats: Option<Formats>,
}

/// Optional parts of the renderer that need features of their own.
#[derive(Clone, Copy, Debug)]
struct Uses {
    wireframe: bool,
    dynamic_rendering: bool,
    timing: bool,
}

/// The reasons why a physical device cannot draw terrain.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Unsupported {
    /// Name of the device.
    pub device: String,
    /// One line for each missing feature, format or queue capability.
    pub missing: Vec<String>,
}

impl fmt::Display for Unsupported {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{} cannot draw the terrain. It lacks {}", self.device, self.missing.join("; "))
    }
}

impl std::error::Error for Unsupported {}

/// The structs in which Vulkan reports and enables features.
struct Structs<'a, 'p> {
    core: &'a mut vk::PhysicalDeviceFeatures,
    v12: &'a mut vk::PhysicalDeviceVulkan12Features<'p>,
    v13: &'a mut vk::PhysicalDeviceVulkan13Features<'p>,
}

/// One device feature.
struct Feature {
    /// Name in the Vulkan specification.
    name: &'static str,
    /// Use that the renderer makes of it.
    purpose: &'static str,
    is_needed: fn(&Uses) -> bool,
    field: for<'s> fn(&'s mut Structs<'_, '_>) -> &'s mut vk::Bool32,
}

const FEATURES: &[Feature] = &[
    Feature {
        name: "multiDrawIndirect",
        purpose: "one command for all draws of a pipeline",
        is_needed: |_| true,
        field: |s| &mut s.core.multi_draw_indirect,
    },
    Feature {
        name: "drawIndirectFirstInstance",
        purpose: "indirect draws of any instances",
        is_needed: |_| true,
        field: |s| &mut s.core.draw_indirect_first_instance,
    },
    Feature {
        name: "fillModeNonSolid",
        purpose: "wireframe",
        is_needed: |uses| uses.wireframe,
        field: |s| &mut s.core.fill_mode_non_solid,
    },
    Feature {
        name: "scalarBlockLayout",
        purpose: "structs without padding",
        is_needed: |_| true,
        field: |s| &mut s.v12.scalar_block_layout,
    },
    Feature {
        name: "hostQueryReset",
        purpose: "timestamps",
        is_needed: |uses| uses.timing,
        field: |s| &mut s.v12.host_query_reset,
    },
    Feature {
        name: "dynamicRendering",
        purpose: "rendering without render passes",
        is_needed: |uses| uses.dynamic_rendering,
        field: |s| &mut s.v13.dynamic_rendering,
    },
    Feature {
        name: "maintenance4",
        purpose: "sizes of workgroups that compilers state by LocalSizeId",
        is_needed: |_| true,
        field: |s| &mut s.v13.maintenance4,
    },
    Feature {
        name: "synchronization2",
        purpose: "barriers",
        is_needed: |_| true,
        field: |s| &mut s.v13.synchronization2,
    },
    Feature {
        name: "shaderDemoteToHelperInvocation",
        purpose: "holes in the terrain",
        is_needed: |_| true,
        field: |s| &mut s.v13.shader_demote_to_helper_invocation,
    },
];

impl Requirements {
    /// The least Vulkan version of the loader, the instance and the device.
    pub const API_VERSION: u32 = vk::API_VERSION_1_3;

    /// The requirements of devices that this crate creates: pictures of any kind, with timings.
    pub(super) const OWN: Self =
        Self { uses: Uses { wireframe: true, dynamic_rendering: true, timing: true }, formats: None };

    /// The requirements for drawing to these formats on a device of a caller.
    pub(super) fn for_formats(formats: Formats, wireframe: bool) -> Self {
        let dynamic_rendering = formats.render_pass.is_none();
        Self { uses: Uses { wireframe, dynamic_rendering, timing: false }, formats: Some(formats) }
    }

    fn needed(&self) -> impl Iterator<Item = &'static Feature> {
        let uses = self.uses;
        FEATURES.iter().filter(move |feature| (feature.is_needed)(&uses))
    }

    /// Returns the names of the needed device features, as in the Vulkan specification.
    pub fn features(&self) -> Vec<&'static str> {
        self.needed().map(|feature| feature.name).collect()
    }

    /// Sets the needed features in the structs of a `vk::DeviceCreateInfo`, and leaves all others as they are.
    ///
    /// No device extension is needed.
    pub fn enable<'p>(
        &self,
        core: &mut vk::PhysicalDeviceFeatures,
        v12: &mut vk::PhysicalDeviceVulkan12Features<'p>,
        v13: &mut vk::PhysicalDeviceVulkan13Features<'p>,
    ) {
        let mut structs = Structs { core, v12, v13 };
        for feature in self.needed() {
            *(feature.field)(&mut structs) = vk::TRUE;
        }
    }

    /// Checks a physical device and one of its queue families.
    ///
    /// # Errors
    /// Names the Vulkan version, features, formats and queue capabilities that are missing.
    ///
    /// # Safety
    /// `device` is a physical device of `instance`, which was created for Vulkan 1.3.
    pub unsafe fn check(
        &self,
        instance: &ash::Instance,
        device: vk::PhysicalDevice,
        queue_family: u32,
    ) -> Result<(), Unsupported> {
        // SAFETY: the caller vouches for the handles.
        let (properties, families) = unsafe {
            (
                instance.get_physical_device_properties(device),
                instance.get_physical_device_queue_family_properties(device),
            )
        };
        let mut missing = self.missing(instance, device, properties.api_version);
        let family = families.get(queue_family as usize);
        if family.is_none_or(|family| !family.queue_flags.contains(vk::QueueFlags::GRAPHICS)) {
            missing.push(format!("graphics in queue family {queue_family}"));
        }
        let name = properties.device_name_as_c_str().unwrap_or_default().to_string_lossy().into_owned();
        if missing.is_empty() { Ok(()) } else { Err(Unsupported { device: name, missing }) }
    }

    /// Returns the missing version, features and formats of a physical device of this instance.
    pub(super) fn missing(&self, instance: &ash::Instance, raw: vk::PhysicalDevice, version: u32) -> Vec<String> {
        if version < Self::API_VERSION {
            return vec![format!("Vulkan 1.3 (it has {})", version_text(version))];
        }
        let mut v12 = vk::PhysicalDeviceVulkan12Features::default();
        let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
        let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut v12).push_next(&mut v13);
        // SAFETY: the chain holds structs that a 1.3 device knows.
        unsafe { instance.get_physical_device_features2(raw, &mut features) };
        let mut core = features.features;
        let mut structs = Structs { core: &mut core, v12: &mut v12, v13: &mut v13 };
        let lacks = |feature: &&Feature| *(feature.field)(&mut structs) == vk::FALSE;
        let missing = self.needed().filter(lacks).map(|f| format!("the feature {} ({})", f.name, f.purpose));
        missing.collect::<Vec<_>>().into_iter().chain(self.missing_formats(instance, raw)).collect()
    }

    fn missing_formats(&self, instance: &ash::Instance, raw: vk::PhysicalDevice) -> Vec<String> {
        use vk::FormatFeatureFlags as Flags;
        let Some(formats) = self.formats else { return Vec::new() };
        let depth = formats.depth.map(|depth| (depth, Flags::DEPTH_STENCIL_ATTACHMENT, "a depth attachment"));
        let uses = [
            (formats.colour, Flags::COLOR_ATTACHMENT, "a colour attachment"),
            (vk::Format::R16_UNORM, Flags::SAMPLED_IMAGE, "a texture of heights"),
            (vk::Format::R32_SFLOAT, Flags::SAMPLED_IMAGE, "a texture of heights"),
        ];
        let is_missing = |&(format, flags, _): &(vk::Format, Flags, &str)| {
            // SAFETY: the physical device is of this instance.
            let properties = unsafe { instance.get_physical_device_format_properties(raw, format) };
            !properties.optimal_tiling_features.contains(flags)
        };
        let missing = uses.into_iter().chain(depth).filter(is_missing);
        let missing = missing.map(|(format, _, purpose)| format!("{format:?} as {purpose}"));
        missing.chain(missing_conventions(&formats)).chain(missing_samples(&formats, instance, raw)).collect()
    }
}

/// Returns what no device offers: a stencil attachment without stencil, and colours that are not fractions.
fn missing_conventions(formats: &Formats) -> impl Iterator<Item = String> + use<> {
    use vk::Format as F;
    let stencil = [F::UNDEFINED, F::D16_UNORM_S8_UINT, F::D24_UNORM_S8_UINT, F::D32_SFLOAT_S8_UINT];
    let stencil =
        (!stencil.contains(&formats.stencil)).then(|| format!("{:?} as a stencil attachment", formats.stencil));
    let is_depth = formats.depth.is_none_or(|depth| depth != F::S8_UINT);
    let depth = (!is_depth).then(|| "S8_UINT as a depth attachment".to_string());
    let name = format!("{:?}", formats.colour);
    let is_integer = name.ends_with("INT") || name.ends_with("SCALED");
    let colour = is_integer.then(|| format!("{name} as an attachment of linear colours"));
    stencil.into_iter().chain(depth).chain(colour)
}

/// Returns the attachments that the device does not offer with this number of samples.
fn missing_samples(formats: &Formats, instance: &ash::Instance, raw: vk::PhysicalDevice) -> Vec<String> {
    use vk::ImageUsageFlags as Usage;
    let samples = formats.samples;
    if samples.as_raw().count_ones() != 1 {
        return vec![format!("{samples:?} as one number of samples")];
    }
    let depth = formats.depth.map(|depth| (depth, Usage::DEPTH_STENCIL_ATTACHMENT));
    let is_missing = |&(format, usage): &(vk::Format, Usage)| {
        let (kind, tiling, flags) = (vk::ImageType::TYPE_2D, vk::ImageTiling::OPTIMAL, vk::ImageCreateFlags::empty());
        // SAFETY: the physical device is of this instance.
        let limits =
            unsafe { instance.get_physical_device_image_format_properties(raw, format, kind, tiling, usage, flags) };
        // A format that is no attachment at all is reported by itself.
        limits.is_ok_and(|limits| !limits.sample_counts.contains(samples))
    };
    let attachments = [(formats.colour, Usage::COLOR_ATTACHMENT)].into_iter().chain(depth);
    attachments.filter(is_missing).map(|(format, _)| format!("{format:?} with {samples:?} samples")).collect()
}
