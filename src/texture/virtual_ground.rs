//! A virtual texture of generated ground texels: finds the tiles a frame needs, keeps them in a cache and builds the
//! page table.
//!
//! After J. Blow, "Terrain Rendering at High Levels of Detail" (2000), part I. The wedges of a draw list determine
//! the tiles needed ([`wedges`]). All tiles have the same size; they are generated on workers while the nearest
//! resident ancestor stands in ([`TileCache`]).
//!
//! Difference: the paper assigns each triangle its texture. Here a fragment looks its tile up in a page table
//! ([`PageTable`]), so that triangles of any technique work. A fragment may find a finer tile than its wedge
//! requested.

use std::sync::Arc;

use super::ground::Ground;
use super::page_table::PageTable;
use super::pieces::Clipper;
use super::tile_cache::{TileCache, TileUpload};
use super::virtual_overlay::VirtualTextureStats;
use super::wedges::{self, WedgeTriangle, root_side};
use super::working_set::{TileId, WorkingSet};
use crate::draw::{DrawList, Geometry};
use crate::height::Field;
use crate::view::View;

/// Texture level of a tile, and cells along its side: 64 × 64 cells.
pub const TILE_LEVEL: i32 = 6;
const CELLS: u32 = 1 << TILE_LEVEL;
/// Level of the whole virtual texture: 2^36 texels.
const TEXTURE_LEVEL: i32 = 18;
/// Minimum number of cache slots.
const MIN_SLOTS: u64 = 64;
/// Maximum number of cache slots; no screen needs more.
pub const MAX_SLOTS: u64 = 4096;
/// Slots reserved for stand-ins of pending tiles: the root and other coarse tiles.
const SPARE: u32 = 16;

/// Size of the virtual ground texture and of its tile cache.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VirtualGroundLayout {
    /// log2 of the root square's side in samples, 1 to 31.
    pub root_shift: u32,
    /// Tiles in the cache.
    pub slots: u32,
}

impl VirtualGroundLayout {
    /// Returns the layout for a field, a memory budget in bytes and at most `max_slots` tiles (an image's layer
    /// limit).
    ///
    /// # Errors
    /// If the budget holds fewer than 64 tiles.
    pub fn new(field: &Field, budget_bytes: u64, max_slots: u32) -> Result<Self, String> {
        let tile = Self::tile_bytes();
        let slots = (budget_bytes / tile).min(u64::from(max_slots)).min(MAX_SLOTS);
        if slots < MIN_SLOTS {
            let needed = (MIN_SLOTS * tile).div_ceil(1_000_000);
            return Err(format!("texture memory of {} MB: expected at least {needed} MB", budget_bytes / 1_000_000));
        }
        Ok(Self { root_shift: root_side(field).ilog2(), slots: slots as u32 })
    }

    /// Returns the texels along a side of a tile.
    pub fn tile_side() -> u32 {
        CELLS + 1
    }

    /// Returns the bytes of a tile.
    pub fn tile_bytes() -> u64 {
        4 * u64::from(CELLS + 1).pow(2)
    }

    /// Returns the bytes of all cache slots.
    pub fn bytes(&self) -> u64 {
        u64::from(self.slots) * Self::tile_bytes()
    }

    /// Returns the level of the whole virtual texture: 18, or more if samples are closer than its texels.
    pub fn texture_level(&self) -> i32 {
        TEXTURE_LEVEL.max(self.root_shift as i32)
    }

    /// Returns the maximum length of a page table, in words.
    pub fn table_words(&self) -> usize {
        PageTable::max_words(self.slots as usize, (self.texture_level() - TILE_LEVEL) as u32)
    }
}

/// The tiles that the wedges of a frame need, limited to the cache size.
pub struct GroundSet {
    layout: VirtualGroundLayout,
    set: WorkingSet,
    /// Texels per pixel along an axis.
    quality: f64,
}

impl GroundSet {
    /// Creates an empty set.
    pub fn new(layout: VirtualGroundLayout) -> Self {
        Self { layout, set: WorkingSet::new(layout.texture_level(), TILE_LEVEL), quality: 1.0 }
    }

    /// Finds the tiles that wedges need at one texel per pixel, or at a lower density at which they fit the cache.
    /// Terminates because areas below 2^-126 texels need no tile.
    pub fn update(&mut self, view: &View, wedges: &[WedgeTriangle]) {
        self.quality = 1.0;
        loop {
            let clipper = Clipper::new(view, self.quality, self.layout.texture_level(), TILE_LEVEL);
            wedges::update(&mut self.set, view, clipper, wedges);
            if self.set.tiles().count() <= (self.layout.slots - SPARE) as usize {
                return;
            }
            self.quality *= std::f64::consts::FRAC_1_SQRT_2;
        }
    }

    /// Returns the tiles with the levels of their textures.
    pub fn set(&self) -> &WorkingSet {
        &self.set
    }

    /// Returns the length of a texel, pixels: 1, or more if the cache is too small for that.
    pub fn texel_px(&self) -> f64 {
        1.0 / self.quality
    }
}

/// The tile cache and page table of the ground of one field.
pub struct VirtualGround {
    field: Arc<Field>,
    needed: GroundSet,
    cache: TileCache,
    table: PageTable,
}

impl VirtualGround {
    /// Creates the cache of a field's ground.
    pub fn new(field: &Arc<Field>, layout: VirtualGroundLayout) -> Self {
        let ground = Ground::new(field);
        let cache = TileCache::new(layout.slots, Arc::new(move |tile: TileId| ground.tile(tile, CELLS)));
        Self { field: Arc::clone(field), needed: GroundSet::new(layout), cache, table: PageTable::new() }
    }

    /// Returns the layout.
    pub fn layout(&self) -> &VirtualGroundLayout {
        &self.needed.layout
    }

    /// Determines the tiles that the wedges of a draw list need.
    pub fn require(&mut self, view: &View, resident: &Geometry, list: &DrawList) {
        self.needed.update(view, &wedges::from_draw_list(&self.field, view, resident, list));
    }

    /// Rebuilds the page table with the tiles resident now and requests missing ones. Returns the texels to upload
    /// before drawing, at most `max_uploads` tiles.
    pub fn update(&mut self, max_uploads: usize) -> Vec<TileUpload> {
        let uploads = self.cache.begin(max_uploads);
        self.table.clear();
        for (tile, _) in self.needed.set.tiles() {
            self.table.insert(&self.cache.resolve(tile));
        }
        self.cache.finish();
        uploads
    }

    /// Returns the page table of the last [`update`](Self::update).
    pub fn table(&self) -> &PageTable {
        &self.table
    }

    /// Returns the texels that the wedges of the last [`require`](Self::require) need.
    pub fn texels(&self) -> f64 {
        self.needed.set.texels()
    }

    /// Blocks until all requested tiles are generated.
    pub fn wait(&mut self) {
        self.cache.wait();
    }

    /// Returns the cache statistics of the last [`update`](Self::update).
    pub fn stats(&self) -> VirtualTextureStats {
        let held = self.cache.resident();
        let bytes = held as u64 * VirtualGroundLayout::tile_bytes();
        let (slots, pending) = (self.needed.layout.slots as usize, self.cache.pending());
        VirtualTextureStats { slots, held, bytes, pending, texel_px: self.needed.texel_px() }
    }
}
