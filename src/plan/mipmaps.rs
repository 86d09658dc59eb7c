//! Mipmap levels of images, and their bytes.

/// Bytes of a picture of this size (texels) with its mipmap levels.
pub(super) fn overlay_bytes(size: [u32; 2]) -> u64 {
    (0..mip_levels(size)).map(|level| size.map(|n| u64::from((n >> level).max(1)))).map(|[w, h]| 4 * w * h).sum()
}

/// Mipmap levels of an image, down to one texel.
pub fn mip_levels(size: [u32; 2]) -> u32 {
    size[0].max(size[1]).ilog2() + 1
}
