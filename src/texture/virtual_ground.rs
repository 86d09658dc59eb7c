//! The working set of a ground's texels on the device: which nodes of its map a frame's wedges need, which of them are there,
//! and the table in which a fragment finds its own.
//!
//! After J. Blow, "Terrain Rendering at High Levels of Detail" (2000), part I. The wedges of the list say what is needed
//! ([`wedges`]), each node's texture has the same size and lies in a slot, and texels are made on workers
//! while the nearest coarser node that is there serves ([`TileCache`]). The paper tells each triangle its texture; here a
//! fragment goes down a table of the nodes that serve ([`PageTable`]), so that any technique's triangles will do, and a
//! fragment may find a finer node than its wedge asked for.

use std::sync::Arc;

use super::ground::Ground;
use super::page_table::PageTable;
use super::pieces::Cutter;
use super::tile_cache::{Fill, TileCache};
use super::virtual_overlay::VirtualTextureStats;
use super::wedges::{self, Wedge, root_side};
use super::working_set::{Node, Stop, WorkingSet};
use crate::draw::{DrawList, Geometry};
use crate::height::Field;
use crate::view::View;

/// Level of a node's texture, and cells along its side.
pub const SLOT_LEVEL: i32 = 6;
const CELLS: u32 = 1 << SLOT_LEVEL;
/// Level of the whole map: 2^36 texels.
const MAP_LEVEL: i32 = 18;
/// The least slots kept.
const MIN_SLOTS: u64 = 64;
/// The most: no screen needs more.
pub const MAX_SLOTS: u64 = 4096;
/// Slots that serve for nodes that are to come: the root, and some coarser ones.
const SPARE: u32 = 16;

/// How a ground's map is kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct VirtualGroundLayout {
    /// Samples along a side of the root square, as a power of two, 1 to 31.
    pub root_shift: u32,
    /// Nodes kept.
    pub slots: u32,
}

impl VirtualGroundLayout {
    /// For a field, a number of bytes, and at most `max_slots` nodes.
    ///
    /// # Errors
    /// If the bytes do not hold the few nodes that there must be.
    pub fn new(field: &Field, budget_bytes: u64, max_slots: u32) -> Result<Self, String> {
        let tile = Self::tile_bytes();
        let slots = (budget_bytes / tile).min(u64::from(max_slots)).min(MAX_SLOTS);
        if slots < MIN_SLOTS {
            let needed = (MIN_SLOTS * tile).div_ceil(1_000_000);
            return Err(format!("texture memory of {} MB: expected at least {needed} MB", budget_bytes / 1_000_000));
        }
        Ok(Self { root_shift: root_side(field).ilog2(), slots: slots as u32 })
    }

    /// Texels along a side of a node's texture.
    pub fn tile_side() -> u32 {
        CELLS + 1
    }

    /// Bytes of a node's texture.
    pub fn tile_bytes() -> u64 {
        4 * u64::from(CELLS + 1).pow(2)
    }

    /// Bytes of all slots.
    pub fn bytes(&self) -> u64 {
        u64::from(self.slots) * Self::tile_bytes()
    }

    /// Level of the whole map: 18, or more where samples are closer than its texels.
    pub fn map_level(&self) -> i32 {
        MAP_LEVEL.max(self.root_shift as i32)
    }

    /// The most words of a frame's table.
    pub fn table_words(&self) -> usize {
        PageTable::max_words(self.slots as usize, (self.map_level() - SLOT_LEVEL) as u32)
    }
}

/// The nodes that a frame's wedges need, as many as there are slots for.
pub struct GroundSet {
    layout: VirtualGroundLayout,
    set: WorkingSet,
    /// Texels a pixel along an axis.
    quality: f64,
}

impl GroundSet {
    /// An empty set.
    pub fn new(layout: VirtualGroundLayout) -> Self {
        Self { layout, set: WorkingSet::new(layout.map_level(), Stop::Largest(SLOT_LEVEL)), quality: 1.0 }
    }

    /// Finds the nodes that wedges need: a texel a pixel, or fewer until they fit the slots. It ends: what covers less than
    /// 2^-126 texels needs none.
    pub fn show(&mut self, view: &View, wedges: &[Wedge]) {
        self.quality = 1.0;
        loop {
            let cutter = Cutter::new(view, self.quality, self.layout.map_level(), SLOT_LEVEL);
            wedges::show(&mut self.set, view, cutter, wedges);
            if self.set.nodes().count() <= (self.layout.slots - SPARE) as usize {
                return;
            }
            self.quality *= std::f64::consts::FRAC_1_SQRT_2;
        }
    }

    /// The nodes with the levels of their textures.
    pub fn set(&self) -> &WorkingSet {
        &self.set
    }

    /// Length of a texel, pixels: 1, or longer where the slots do not hold that.
    pub fn texel_px(&self) -> f64 {
        1.0 / self.quality
    }
}

/// The working set on the device.
pub struct VirtualGround {
    field: Arc<Field>,
    needed: GroundSet,
    slots: TileCache,
    table: PageTable,
}

impl VirtualGround {
    /// For a field.
    pub fn new(field: &Arc<Field>, layout: VirtualGroundLayout) -> Self {
        let ground = Ground::new(field);
        let slots = TileCache::new(layout.slots, Arc::new(move |node: Node| ground.tile(node, CELLS)));
        Self { field: Arc::clone(field), needed: GroundSet::new(layout), slots, table: PageTable::new() }
    }

    /// How it is kept.
    pub fn layout(&self) -> &VirtualGroundLayout {
        &self.needed.layout
    }

    /// Finds the nodes that the wedges of a list need.
    pub fn see(&mut self, view: &View, resident: &Geometry, list: &DrawList) {
        self.needed.show(view, &wedges::of_list(&self.field, view, resident, list));
    }

    /// Chooses what they are drawn with; what is to be filled in before, at most so many nodes.
    pub fn look(&mut self, max_fills: usize) -> Vec<Fill> {
        let fills = self.slots.begin(max_fills);
        self.table.clear();
        for (node, _) in self.needed.set.nodes() {
            self.table.enter(&self.slots.resolve(node));
        }
        self.slots.finish();
        fills
    }

    /// The nodes that serve since the last look.
    pub fn table(&self) -> &PageTable {
        &self.table
    }

    /// Texels that the wedges seen last need.
    pub fn texels(&self) -> f64 {
        self.needed.set.texels()
    }

    /// Waits until all that was asked for is made.
    pub fn wait(&mut self) {
        self.slots.wait();
    }

    /// What it holds since the last look.
    pub fn stats(&self) -> VirtualTextureStats {
        let held = self.slots.held();
        let bytes = held as u64 * VirtualGroundLayout::tile_bytes();
        let (slots, pending) = (self.needed.layout.slots as usize, self.slots.pending());
        VirtualTextureStats { slots, held, bytes, pending, texel_px: self.needed.texel_px() }
    }
}
