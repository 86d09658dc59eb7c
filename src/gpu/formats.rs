//! Formats of attachments, and the conventions of the pass that has them.

use ash::vk;

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
