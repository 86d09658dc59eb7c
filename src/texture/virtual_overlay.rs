//! A virtual texture for an overlay image that is larger than its memory budget.
//!
//! After M. Finch and L. Bishop, "Sorted Height Field Rendering" (1998), §4.8: each page uses the coarsest mip level
//! whose texels are at most one pixel at the page's nearest point. Resident tiles are drawn at once; finer ones are
//! made on workers meanwhile ([`TileCache`]).
//!
//! Difference: the paper has textures of several sizes. Here a coarser mip level is a tile of the same size over
//! twice as many pages along each axis. The texels are equal, and any slot takes any tile. A page table entry holds
//! the slot and the length of its tile in pages.
//!
//! Pages are squares of image texels, independently of the image's placement over the field ([`Drape`]).

use std::fmt;
use std::sync::Arc;

use super::drape::Drape;
use super::overlay_pyramid::{OverlayPyramid, Picture, PyramidLayout};
use super::picture_bounds::PictureBounds;
use super::tile_cache::{TileCache, TileUpload};
use super::virtual_layout::{SPARE, VirtualTextureLayout};
use super::working_set::TileId;
use crate::height::Field;
use crate::view::{Frustum, View};

/// Statistics of a tile cache.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct VirtualTextureStats {
    /// Cache slots.
    pub slots: usize,
    /// Resident tiles.
    pub held: usize,
    /// Bytes of the resident tiles.
    pub bytes: u64,
    /// Tiles that this frame needs and that are not resident yet.
    pub pending: usize,
    /// Length that a texel may have, pixels: 1, or more if the budget is too small for that.
    pub texel_px: f64,
}

impl fmt::Display for VirtualTextureStats {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let Self { slots, held, bytes, pending, texel_px } = self;
        write!(f, "{held} of {slots}, {:.1} MB, {pending} pending, texels of {texel_px:.1} px", *bytes as f64 / 1e6)
    }
}

/// The tile cache and page table of an overlay image.
pub struct VirtualOverlay {
    layout: VirtualTextureLayout,
    cache: TileCache,
    bounds: PictureBounds,
    table: Vec<u32>,
    texel_px: f64,
}

impl VirtualOverlay {
    /// Filters an RGBA image placed over a field. The field must have samples.
    pub fn new(field: &Field, layout: VirtualTextureLayout, drape: Drape, picture: Picture) -> Self {
        let VirtualTextureLayout { pages, extent, depth, .. } = layout;
        let pyramid = OverlayPyramid::new(picture, PyramidLayout { pages, extent, repeats: drape.repeats() });
        debug_assert_eq!(pyramid.side(0), layout.cells + 1);
        let cache =
            TileCache::new(layout.slots, Arc::new(move |tile: TileId| pyramid.tile(depth - tile.level, tile.at)));
        let table = vec![entry(0, depth); pages[0] as usize * pages[1] as usize];
        Self { layout, cache, bounds: PictureBounds::new(field, &layout, drape), table, texel_px: 1.0 }
    }

    /// Returns the layout.
    pub fn layout(&self) -> &VirtualTextureLayout {
        &self.layout
    }

    /// Rebuilds the page table for a view with the tiles resident now and requests missing ones. Returns the texels
    /// to upload before drawing, at most `max_uploads` tiles.
    pub fn update(&mut self, view: &View, max_uploads: usize) -> Vec<TileUpload> {
        let uploads = self.cache.begin(max_uploads);
        let (needed, texel_px) = self.needed(view);
        self.texel_px = texel_px;
        // Pages outside the frustum get the root tile.
        self.table.fill(entry(0, self.layout.depth));
        for tile in needed {
            let resolved = self.cache.resolve(tile);
            self.fill_pages(tile, entry(resolved.slot, self.layout.depth - resolved.tile.level));
        }
        self.cache.finish();
        uploads
    }

    /// Returns the page table of the last [`update`](Self::update), row by row. An entry is slot · 16 + log2 of the
    /// length of its tile in pages.
    pub fn table(&self) -> &[u32] {
        &self.table
    }

    /// Blocks until all requested tiles are generated.
    pub fn wait(&mut self) {
        self.cache.wait();
    }

    /// Returns the cache statistics of the last [`update`](Self::update).
    pub fn stats(&self) -> VirtualTextureStats {
        let held = self.cache.resident();
        let bytes = held as u64 * self.layout.tile_bytes();
        VirtualTextureStats {
            slots: self.layout.slots as usize,
            held,
            bytes,
            pending: self.cache.pending(),
            texel_px: self.texel_px,
        }
    }

    /// Writes an entry to all pages that a tile covers.
    fn fill_pages(&mut self, tile: TileId, entry: u32) {
        let shift = self.layout.depth - tile.level;
        let along = |k: usize| (tile.at[k] << shift)..((tile.at[k] + 1) << shift).min(self.layout.pages[k]);
        for z in along(1) {
            let row = (z * self.layout.pages[0]) as usize;
            self.table[row + along(0).start as usize..row + along(0).end as usize].fill(entry);
        }
    }

    /// Returns the tiles in view whose texels are at most `texel_px` pixels long, and `texel_px`: 1, or the smallest
    /// multiple by √2 at which the tiles fit the cache.
    fn needed(&self, view: &View) -> (Vec<TileId>, f64) {
        let (max, frustum) = ((self.layout.slots - SPARE) as usize, view.frustum());
        let mut texel_px = 1.0;
        loop {
            let mut tiles = Vec::new();
            let root = TileId { level: 0, at: [0, 0] };
            if self.visit(root, view, &frustum, texel_px, &mut tiles, max).is_some() {
                return (tiles, texel_px);
            }
            texel_px *= std::f64::consts::SQRT_2;
        }
    }

    /// Appends the tiles needed below a tile; `None` if they exceed `max`.
    fn visit(
        &self,
        tile: TileId,
        view: &View,
        frustum: &Frustum,
        texel_px: f64,
        found: &mut Vec<TileId>,
        max: usize,
    ) -> Option<()> {
        let up = self.layout.depth - tile.level;
        let Some(pixel_m) = self.bounds.pixel_m(up, tile.at, view, frustum) else { return Some(()) };
        // At infinite `texel_px` any texel is short enough: a small cache may not hold the finest tiles around the eye.
        if up == 0 || texel_px == f64::INFINITY || self.bounds.texel_m(up) <= texel_px * pixel_m {
            found.push(tile);
            return (found.len() <= max).then_some(());
        }
        let [x, z] = tile.at.map(|n| 2 * n);
        let places = [[x, z], [x + 1, z], [x, z + 1], [x + 1, z + 1]];
        let is_there = |at: &[u32; 2]| (0..2).all(|k| at[k] << (up - 1) < self.layout.pages[k]);
        let mut children = places.into_iter().filter(is_there).map(|at| TileId { level: tile.level + 1, at });
        children.try_for_each(|child| self.visit(child, view, frustum, texel_px, found, max))
    }
}

/// Encodes a page table entry.
fn entry(slot: u32, up: u32) -> u32 {
    slot << 4 | up
}

#[cfg(test)]
mod tests {
    use glam::DVec3;

    use super::*;
    use crate::height::{Holes, Samples};
    use crate::view::{Lens, Metric, Tolerance};

    /// A plane of 257 × 200 samples, 1 m apart, whose west half is 40 m higher.
    fn field() -> Field {
        let heights = (0..257 * 200).map(|k| if k % 257 < 128 { 40.0 } else { 0.0 }).collect();
        Field::new(Samples::F32(heights), [257, 200], [1.0; 2], Holes::none(257 * 200))
    }

    fn overlay(budget_bytes: u64) -> VirtualOverlay {
        let size = [4096, 3184];
        let texels = (0..size[0] * size[1]).map(|k: u32| k.wrapping_mul(0x9e37_79b1).to_le_bytes()).collect::<Vec<_>>();
        let layout = VirtualTextureLayout::new(size, [false; 2], budget_bytes, 2048).unwrap();
        VirtualOverlay::new(&field(), layout, Drape::over(&field()), Picture { size, texels: &texels })
    }

    /// A view from `above_m` metres above the ground.
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

    fn settled(overlay: &mut VirtualOverlay, view: &View) -> VirtualTextureStats {
        for _ in 0..1000 {
            overlay.update(view, 4);
            overlay.wait();
            if overlay.stats().pending == 0 {
                return overlay.stats();
            }
        }
        panic!("tiles are still pending after 1000 frames");
    }

    #[test]
    fn pages_are_at_least_as_fine_as_the_image() {
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

    /// Each page in view has the coarsest mip level whose texels are at most a pixel at its nearest point.
    #[test]
    fn texels_in_view_are_at_most_a_pixel() {
        let mut overlay = overlay(1 << 28);
        for view in [view(200.0, 1.7, -5.0), view(60.0, 1.7, -5.0), view(128.0, 300.0, -89.0)] {
            settled(&mut overlay, &view);
            let layout = *overlay.layout();
            let (mut fine, mut coarse) = (0, 0);
            for (k, entry) in overlay.table().iter().enumerate() {
                let page = [k as u32 % layout.pages[0], k as u32 / layout.pages[0]];
                let (level, frustum) = (entry & 15, view.frustum());
                let Some(pixel_m) = overlay.bounds.pixel_m(0, page, &view, &frustum) else { continue };
                assert!(level == 0 || overlay.bounds.texel_m(level) <= pixel_m, "page {page:?}: {level}");
                *(if level == 0 { &mut fine } else { &mut coarse }) += 1;
                let around = overlay.bounds.pixel_m(level + 1, page.map(|n| n >> (level + 1)), &view, &frustum);
                let is_too_fine =
                    around.is_some_and(|px| level < layout.depth && overlay.bounds.texel_m(level + 1) <= px);
                assert!(!is_too_fine, "page {page:?}: {level}");
            }
            assert!(fine + coarse > 10, "{fine} pages at mip level 0, {coarse} at coarser levels");
        }
    }

    /// The root is drawn at once, finer tiles follow, and the final table depends on the view alone.
    #[test]
    fn the_root_is_drawn_at_once_and_finer_tiles_follow() {
        let (there, here) = (view(60.0, 1.7, -5.0), view(200.0, 1.7, -5.0));
        let mut overlay = overlay(1 << 28);
        let uploads = overlay.update(&here, 4);
        assert_eq!((uploads.len(), overlay.stats().held), (1, 1), "the root");
        assert!(overlay.table().iter().all(|&t| t == entry(0, overlay.layout.depth)) && overlay.stats().pending > 4);
        let levels = |overlay: &VirtualOverlay| overlay.table().iter().map(|entry| entry & 15).collect::<Vec<_>>();
        settled(&mut overlay, &here);
        let first = levels(&overlay);
        assert!(first.contains(&0), "{first:?}");
        settled(&mut overlay, &there);
        assert_ne!(levels(&overlay), first);
        settled(&mut overlay, &here);
        assert_eq!(levels(&overlay), first);
    }

    /// The cache never exceeds its slots, and every view settles.
    #[test]
    fn a_smaller_budget_gives_longer_texels() {
        let mut before = f64::INFINITY;
        for budget in [500_000, 2_000_000, 8_000_000, 1 << 28] {
            let mut overlay = overlay(budget);
            let mut worst: f64 = 0.0;
            for x in [10.0, 60.0, 120.0, 140.0, 200.0, 250.0] {
                let stats = settled(&mut overlay, &view(x, 1.7, -5.0));
                assert!(stats.bytes <= budget && stats.held <= stats.slots);
                worst = worst.max(stats.texel_px);
            }
            assert!(worst <= before, "{worst} px after {before} px");
            before = worst;
        }
        assert_eq!(before, 1.0);
    }

    /// The eye is inside the boxes of tiles of every level, which are more than the slots.
    #[test]
    fn few_slots_settle_with_the_eye_among_the_heights() {
        let mut overlay = overlay(500_000);
        let max = overlay.layout.slots - SPARE;
        assert!(3 * overlay.layout.depth + 1 > max, "{max} slots, {} levels", overlay.layout.depth);
        settled(&mut overlay, &view(128.0, 20.0, -5.0));
    }
}
