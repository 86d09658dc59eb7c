//! A picture laid over a field that is larger than the memory for it: which of its maps a view needs, which of them are
//! there, and which one each page is drawn with.
//!
//! After M. Finch and L. Bishop, "Sorted Height Field Rendering" (1998), §4.8: each page takes the coarsest map whose
//! texels are at most a pixel where the page is nearest; what is there is drawn at once, and finer maps are made on workers
//! meanwhile ([`TileCache`]). Where the paper has maps of many sizes, a coarser map here is a tile of the same size over twice
//! as many pages along each axis: the same texels, and any slot takes any tile. A page's table entry says which slot, and
//! how many pages the tile in it is long.
//!
//! Pages are squares of the picture's texels, wherever the picture lies over the field ([`Drape`]).

use std::fmt;
use std::sync::Arc;

use super::drape::Drape;
use super::overlay_pyramid::{Layout, OverlayPyramid, Picture};
use super::picture_bounds::PictureBounds;
use super::tile_cache::{Fill, TileCache};
use super::virtual_layout::SPARE;
pub use super::virtual_layout::VirtualTextureLayout;
use super::working_set::Node;
use crate::height::Field;
use crate::view::{Frustum, View};

/// What a working set holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct VirtualTextureStats {
    /// Tiles there are slots for.
    pub slots: usize,
    /// Tiles that are there.
    pub held: usize,
    /// Bytes of these.
    pub bytes: u64,
    /// Tiles of this frame that are not there yet.
    pub pending: usize,
    /// Pixels that a texel may be long, along an axis: 1, or more where the memory does not hold a finer picture.
    pub texel_px: f64,
}

impl fmt::Display for VirtualTextureStats {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { slots, held, bytes, pending, texel_px } = self;
        write!(f, "{held} of {slots}, {:.1} MB, {pending} to come, {texel_px:.1} px", *bytes as f64 / 1e6)
    }
}

/// The maps of a picture.
pub struct VirtualOverlay {
    layout: VirtualTextureLayout,
    slots: TileCache,
    bounds: PictureBounds,
    table: Vec<u32>,
    texel_px: f64,
}

impl VirtualOverlay {
    /// Filters a picture of RGBA texels, row by row, that lies over a field with samples.
    pub fn new(field: &Field, layout: VirtualTextureLayout, drape: Drape, picture: Picture) -> Self {
        let VirtualTextureLayout { pages, extent, depth, .. } = layout;
        let maps = OverlayPyramid::new(picture, Layout { pages, extent, repeats: drape.repeats() });
        debug_assert_eq!(maps.side(0), layout.cells + 1);
        let slots = TileCache::new(layout.slots, Arc::new(move |node: Node| maps.tile(depth - node.level, node.at)));
        let table = vec![entry(0, depth); pages[0] as usize * pages[1] as usize];
        Self { layout, slots, bounds: PictureBounds::new(field, &layout, drape), table, texel_px: 1.0 }
    }

    /// How it is cut.
    pub fn layout(&self) -> &VirtualTextureLayout {
        &self.layout
    }

    /// Chooses what the pages in sight are drawn with; what is to be filled in before, at most so many tiles.
    pub fn look(&mut self, view: &View, max_fills: usize) -> Vec<Fill> {
        let fills = self.slots.begin(max_fills);
        let (needed, texel_px) = self.needed(view);
        self.texel_px = texel_px;
        // What is not in sight is never seen, but always there.
        self.table.fill(entry(0, self.layout.depth));
        for node in needed {
            let resolved = self.slots.resolve(node);
            self.enter(node, entry(resolved.slot, self.layout.depth - resolved.node.level));
        }
        self.slots.finish();
        fills
    }

    /// What each page is drawn with since the last look, row by row: the slot times 16, and the number of times that the tile
    /// in it is twice as long as a page.
    pub fn table(&self) -> &[u32] {
        &self.table
    }

    /// Waits until all that was asked for is made.
    pub fn wait(&mut self) {
        self.slots.wait();
    }

    /// What it holds since the last look.
    pub fn stats(&self) -> VirtualTextureStats {
        let held = self.slots.held();
        let bytes = held as u64 * self.layout.tile_bytes();
        VirtualTextureStats {
            slots: self.layout.slots as usize,
            held,
            bytes,
            pending: self.slots.pending(),
            texel_px: self.texel_px,
        }
    }

    fn enter(&mut self, node: Node, entry: u32) {
        let shift = self.layout.depth - node.level;
        let along = |k: usize| (node.at[k] << shift)..((node.at[k] + 1) << shift).min(self.layout.pages[k]);
        for z in along(1) {
            let row = (z * self.layout.pages[0]) as usize;
            self.table[row + along(0).start as usize..row + along(0).end as usize].fill(entry);
        }
    }

    /// The tiles in sight whose texels are at most a pixel, or as few pixels as there is room for; and how many.
    fn needed(&self, view: &View) -> (Vec<Node>, f64) {
        let (max, frustum) = ((self.layout.slots - SPARE) as usize, view.frustum());
        let mut texel_px = 1.0;
        loop {
            let mut nodes = Vec::new();
            let root = Node { level: 0, at: [0, 0] };
            if self.visit(root, view, &frustum, texel_px, &mut nodes, max).is_some() {
                return (nodes, texel_px);
            }
            texel_px *= std::f64::consts::SQRT_2;
        }
    }

    /// Appends what is needed below a node; `None` if it were more than `max`.
    fn visit(
        &self,
        node: Node,
        view: &View,
        frustum: &Frustum,
        texel_px: f64,
        found: &mut Vec<Node>,
        max: usize,
    ) -> Option<()> {
        let up = self.layout.depth - node.level;
        let Some(pixel_m) = self.bounds.pixel_m(up, node.at, view, frustum) else { return Some(()) };
        // Any texel is short enough at last: few slots may not hold the finest tiles around the eye.
        if up == 0 || texel_px == f64::INFINITY || self.bounds.texel_m(up) <= texel_px * pixel_m {
            found.push(node);
            return (found.len() <= max).then_some(());
        }
        let [x, z] = node.at.map(|n| 2 * n);
        let places = [[x, z], [x + 1, z], [x, z + 1], [x + 1, z + 1]];
        let is_there = |at: &[u32; 2]| (0..2).all(|k| at[k] << (up - 1) < self.layout.pages[k]);
        let mut children = places.into_iter().filter(is_there).map(|at| Node { level: node.level + 1, at });
        children.try_for_each(|child| self.visit(child, view, frustum, texel_px, found, max))
    }
}

fn entry(slot: u32, up: u32) -> u32 {
    slot << 4 | up
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::height::{Holes, Samples};
    use crate::view::{Lens, Metric, Tolerance};

    /// Flat land of 257 × 200 samples a metre apart, its west half higher.
    fn field() -> Field {
        let heights = (0..257 * 200).map(|k| if k % 257 < 128 { 40.0 } else { 0.0 }).collect();
        Field::new(Samples::F32(heights), [257, 200], [1.0; 2], Holes::none(257 * 200))
    }

    fn maps(budget_bytes: u64) -> VirtualOverlay {
        let size = [4096, 3184];
        let texels = (0..size[0] * size[1]).map(|k: u32| k.wrapping_mul(0x9e37_79b1).to_le_bytes()).collect::<Vec<_>>();
        let layout = VirtualTextureLayout::new(size, [false; 2], budget_bytes, 2048).unwrap();
        VirtualOverlay::new(&field(), layout, Drape::over(&field()), Picture { size, texels: &texels })
    }

    /// From a place 1.7 m above the ground, or from above.
    fn view(x: f64, above_m: f64, pitch: f64) -> View {
        View {
            eye: DVec3::new(x, if x < 128.0 { 40.0 } else { 0.0 } + above_m, 60.0),
            world_from_eye: View::turned(20.0, pitch, 0.0),
            lens: Lens::Perspective { fov_x: 1.0 },
            size: [640, 360],
            near: 0.1,
            tolerance: Tolerance { px: 1.0, metric: Metric::Certified },
            time_s: 0.0,
        }
    }

    fn settled(maps: &mut VirtualOverlay, view: &View) -> VirtualTextureStats {
        for _ in 0..1000 {
            maps.look(view, 4);
            maps.wait();
            if maps.stats().pending == 0 {
                return maps.stats();
            }
        }
        panic!("it does not come to rest");
    }

    #[test]
    fn a_cut_is_as_fine_as_its_picture() {
        for (picture, repeats) in
            [([2048, 2048], true), ([16_384, 1000], false), ([20_000, 9], true), ([14_000, 14_000], false)]
        {
            let layout = VirtualTextureLayout::new(picture, [repeats; 2], 1 << 40, 2048).unwrap();
            for ((texels, extent), pages) in picture.into_iter().zip(layout.extent).zip(layout.pages) {
                let texels_a_page = f64::from(texels) / extent;
                assert!(f64::from(layout.cells) >= texels_a_page, "{texels_a_page} texels a page, {layout:?}");
                assert!(f64::from(pages) >= extent && pages <= 1 << layout.depth);
                assert!(!repeats || f64::from(pages) == extent);
            }
            assert!(layout.depth <= layout.cells.ilog2() && layout.bytes() == 2048 * layout.tile_bytes());
        }
        let refused = VirtualTextureLayout::new([2048, 2048], [false; 2], 100_000, 2048).unwrap_err();
        assert!(refused.contains("expected at least 1 MB"), "{refused}");
    }

    /// Every page in sight has texels of at most a pixel where it is nearest, and none finer than it need be.
    #[test]
    fn texels_are_at_most_a_pixel() {
        let mut maps = maps(1 << 28);
        for view in [view(200.0, 1.7, -5.0), view(60.0, 1.7, -5.0), view(128.0, 300.0, -89.0)] {
            settled(&mut maps, &view);
            let layout = *maps.layout();
            let (mut fine, mut coarse) = (0, 0);
            for (k, entry) in maps.table().iter().enumerate() {
                let page = [k as u32 % layout.pages[0], k as u32 / layout.pages[0]];
                let (level, frustum) = (entry & 15, view.frustum());
                let Some(pixel_m) = maps.bounds.pixel_m(0, page, &view, &frustum) else { continue };
                assert!(level == 0 || maps.bounds.texel_m(level) <= pixel_m, "page {page:?}: {level}");
                *(if level == 0 { &mut fine } else { &mut coarse }) += 1;
                let around = maps.bounds.pixel_m(level + 1, page.map(|n| n >> (level + 1)), &view, &frustum);
                let is_too_fine = around.is_some_and(|px| level < layout.depth && maps.bounds.texel_m(level + 1) <= px);
                assert!(!is_too_fine, "page {page:?}: {level}");
            }
            assert!(fine + coarse > 10, "{fine} pages with their own maps, {coarse} with coarser ones");
        }
    }

    /// The root serves at once, finer ones follow, and the end depends on the view alone.
    #[test]
    fn coarse_at_once_and_finer_ones_follow() {
        let (there, here) = (view(60.0, 1.7, -5.0), view(200.0, 1.7, -5.0));
        let mut maps = maps(1 << 28);
        let fills = maps.look(&here, 4);
        assert_eq!((fills.len(), maps.stats().held), (1, 1), "the root");
        assert!(maps.table().iter().all(|&t| t == entry(0, maps.layout.depth)) && maps.stats().pending > 4);
        let levels = |maps: &VirtualOverlay| maps.table().iter().map(|entry| entry & 15).collect::<Vec<_>>();
        settled(&mut maps, &here);
        let first = levels(&maps);
        assert!(first.contains(&0), "{first:?}");
        settled(&mut maps, &there);
        assert_ne!(levels(&maps), first);
        settled(&mut maps, &here);
        assert_eq!(levels(&maps), first);
    }

    /// With less memory texels are longer, no more tiles are held than there are slots, and every view comes to rest.
    #[test]
    fn memory_is_by_choice() {
        let mut before = f64::INFINITY;
        for budget in [500_000, 2_000_000, 8_000_000, 1 << 28] {
            let mut maps = maps(budget);
            let mut worst: f64 = 0.0;
            for x in [10.0, 60.0, 120.0, 140.0, 200.0, 250.0] {
                let stats = settled(&mut maps, &view(x, 1.7, -5.0));
                assert!(stats.bytes <= budget && stats.held <= stats.slots);
                worst = worst.max(stats.texel_px);
            }
            assert!(worst <= before, "{worst} px after {before} px");
            before = worst;
        }
        assert_eq!(before, 1.0);
    }

    /// The eye is in the boxes of a tile of every level, more than there are slots for.
    #[test]
    fn few_slots_come_to_rest_within_the_range_of_heights() {
        let mut maps = maps(500_000);
        let max = maps.layout.slots - SPARE;
        assert!(3 * maps.layout.depth + 1 > max, "{max} slots, {} levels", maps.layout.depth);
        settled(&mut maps, &view(128.0, 20.0, -5.0));
    }
}
