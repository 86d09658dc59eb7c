//! The grid of pages over an image, and the size of its tile cache.

/// The grid of pages over an image, and the size of the tile cache.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VirtualTextureLayout {
    /// Pages along (x, z).
    pub pages: [u32; 2],
    /// Length of the image's sides in pages. Less than `pages` where the last page extends beyond the image.
    pub extent: [f64; 2],
    /// Texels along a side of a tile, less one: a power of two.
    pub cells: u32,
    /// Level of single pages in the tile quadtree: the root tile is 2^depth pages long.
    pub depth: u32,
    /// Tiles in the cache.
    pub slots: u32,
}

/// Minimum cells along a side of a tile.
const MIN_CELLS: u32 = 128;
/// Maximum cells along a side of a tile, as in [`OverlayPyramid`](super::overlay_pyramid::OverlayPyramid).
const MAX_CELLS: u32 = 4096;
/// Slots reserved for stand-ins: the root, and a tile that is replaced by the one it stands in for.
pub(super) const SPARE: u32 = 2;
/// Minimum number of cache slots: the root, its four children and the reserve.
const MIN_SLOTS: u64 = 5 + SPARE as u64;

impl VirtualTextureLayout {
    /// Returns the layout for an image of `picture` texels along (x, z), a memory budget in bytes and at most
    /// `max_slots` tiles (an image's layer limit). `repeats`: true, per axis, if the image wraps around; it then has
    /// a whole number of pages.
    ///
    /// # Errors
    /// If the image is too large for tiles of 4096 cells, or if the budget holds fewer than 7 tiles.
    pub fn new(picture: [u32; 2], repeats: [bool; 2], budget_bytes: u64, max_slots: u32) -> Result<Self, String> {
        let layout = |cells: u32| {
            let pages = picture.map(|n| n.div_ceil(cells));
            let extent = [0, 1].map(|k| match repeats[k] {
                true => f64::from(pages[k]),
                false => f64::from(picture[k]) / f64::from(cells),
            });
            let depth = pages[0].max(pages[1]).next_power_of_two().ilog2();
            Self { pages, extent, cells, depth, slots: 0 }
        };
        let sizes = (MIN_CELLS.ilog2()..=MAX_CELLS.ilog2()).map(|shift| layout(1 << shift));
        let whole = sizes.into_iter().find(|layout| layout.depth <= layout.cells.ilog2());
        let whole = whole.ok_or_else(|| format!("a picture of {} x {} texels is too large", picture[0], picture[1]))?;
        let slots = (budget_bytes / whole.tile_bytes()).min(u64::from(max_slots));
        if slots < MIN_SLOTS {
            let needed = (MIN_SLOTS * whole.tile_bytes()).div_ceil(1_000_000);
            return Err(format!("texture memory of {} MB: expected at least {needed} MB", budget_bytes / 1_000_000));
        }
        Ok(Self { slots: slots as u32, ..whole })
    }

    /// Returns the bytes of a tile.
    pub fn tile_bytes(&self) -> u64 {
        4 * u64::from(self.cells + 1).pow(2)
    }

    /// Returns the bytes of all cache slots.
    pub fn bytes(&self) -> u64 {
        u64::from(self.slots) * self.tile_bytes()
    }
}
