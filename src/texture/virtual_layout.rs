//! Layout of a virtual texture: its pages and tiles, and the number of tiles in memory.

/// Pages and tiles of a picture, and the number of tiles in memory.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct VirtualTextureLayout {
    /// Pages along (x, z).
    pub pages: [u32; 2],
    /// Length of the picture's sides in pages: less than `pages` where the last ones stick out.
    pub extent: [f64; 2],
    /// Cells between the texels along a side of a tile: a power of two.
    pub cells: u32,
    /// A tile of the root is 2^depth pages long.
    pub depth: u32,
    /// Tiles kept.
    pub slots: u32,
}

/// The least cells along a side of a tile.
const MIN_CELLS: u32 = 128;
/// The most: those of [`OverlayPyramid`].
const MAX_CELLS: u32 = 4096;
/// Tiles that serve for others of a frame: the root, and one that gives way to what it stands in for.
pub(super) const SPARE: u32 = 2;
/// The least tiles kept: a root with all four in it.
const MIN_SLOTS: u64 = 5 + SPARE as u64;

impl VirtualTextureLayout {
    /// Cuts a picture of `picture` texels for a number of bytes and at most `max_slots` tiles. `repeats`: along this axis
    /// it goes on from its start where it ends, and so has whole pages.
    ///
    /// # Errors
    /// If the bytes do not hold the smallest number of tiles.
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

    /// Bytes of a tile.
    pub fn tile_bytes(&self) -> u64 {
        4 * u64::from(self.cells + 1).pow(2)
    }

    /// Bytes of all tiles kept.
    pub fn bytes(&self) -> u64 {
        u64::from(self.slots) * self.tile_bytes()
    }
}
