//! The pages of a height texture that exceeds one image.

use super::device_limits::DeviceLimits;

/// Smallest side of a page as a power of two: smaller pages cost more in lookups than they save.
const MIN_PAGE_SHIFT: u32 = 4;

/// The side of a page of the height texture as a power of two; 0: one image holds all samples. The largest side whose
/// pages hold at most an eighth more texels than samples, or else the side with the fewest texels.
pub(super) fn page_shift(stored: [u32; 2], device: &DeviceLimits) -> u32 {
    if stored.iter().all(|&n| n <= device.image_side) {
        return 0;
    }
    let largest = device.image_side.ilog2();
    let pages = |shift: u32| stored.iter().map(|n| u64::from(n.div_ceil(1 << shift))).product::<u64>();
    let texels = |shift: u32| pages(shift) << (2 * shift);
    let samples: u64 = stored.iter().map(|&n| u64::from(n)).product();
    let shifts = || (MIN_PAGE_SHIFT..=largest).rev().filter(|&shift| pages(shift) <= u64::from(device.image_layers));
    let tight = shifts().find(|&shift| texels(shift) <= samples + samples / 8);
    tight.or_else(|| shifts().min_by_key(|&shift| texels(shift))).unwrap_or(largest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pages_hold_few_texels_more_than_samples() {
        let device = DeviceLimits { image_side: 16_384, image_layers: 2048, filters_heights: true };
        for (stored, shift) in [
            ([16_384, 16_384], 0),
            ([16_385, 16_385], 9),
            ([16_385, 2], 4),
            ([32_768, 32_768], 14),
            ([40_000, 40_000], 13),
            ([131_072, 131_072], 14),
        ] {
            let found = page_shift(stored, &device);
            assert_eq!(found, shift, "{stored:?}");
            let pages = stored.iter().map(|n| u64::from(n.div_ceil(1 << found))).product::<u64>();
            assert!(found == 0 || pages <= 2048, "{stored:?}: {pages} pages");
        }
        // A field that no layers hold gets the largest pages; the check of layers rejects it.
        assert_eq!(page_shift([1 << 30, 1 << 30], &device), 14);
    }
}
