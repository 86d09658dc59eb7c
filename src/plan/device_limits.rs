//! The limits of a device on which plans depend.

/// The limits of a device on which plans depend.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeviceLimits {
    /// Maximum side of a 2D image, texels.
    pub image_side: u32,
    /// Maximum number of layers of an image.
    pub image_layers: u32,
    /// True if samplers can filter height textures linearly.
    pub filters_heights: bool,
}
