//! A fixed-size cache of virtual-texture tiles. Missing tiles are generated on worker threads; until then the nearest
//! resident ancestor is drawn.
//!
//! After J. Blow, "Terrain Rendering at High Levels of Detail" (2000), §2.1 and §3.3: only tiles that are needed
//! exist. Difference: the paper generates tiles in the frame that needs them; here no frame waits. A frame calls
//! [`TileCache::begin`], then [`TileCache::resolve`] for each tile needed, then [`TileCache::finish`]. A slot used in
//! the previous frame is not reassigned, so that texels still being read by the GPU are not overwritten.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use super::working_set::TileId;

/// An RGBA texel; alpha is unused by ground tiles.
pub type Texel = [u8; 4];

/// Generates the texels of a tile, row by row. Called on worker threads.
pub type GenerateTile = dyn Fn(TileId) -> Vec<Texel> + Send + Sync;

/// Upper limit of tiles in generation at a time. Fast camera turns make requested tiles obsolete.
const MAX_REQUESTED: usize = 256;

/// The root tile, always resident.
const ROOT: TileId = TileId { level: 0, at: [0, 0] };

/// Texels to upload into a slot before the frame is drawn.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct TileUpload {
    /// Slot index.
    pub slot: u32,
    /// Texels, row by row.
    pub texels: Vec<Texel>,
}

/// The resident tile to draw for a requested one: itself or an ancestor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ResolvedTile {
    /// The resident tile.
    pub tile: TileId,
    /// Its slot index.
    pub slot: u32,
}

/// A tile in a slot.
struct CachedTile {
    slot: u32,
    /// Last frame in which the tile was drawn.
    frame: u64,
}

/// A cache of equally sized tiles with least-recently-used replacement.
pub struct TileCache {
    resident: HashMap<TileId, CachedTile>,
    free: Vec<u32>,
    requested: HashSet<TileId>,
    missing: HashSet<TileId>,
    generate: Arc<GenerateTile>,
    receiver: Receiver<(TileId, Vec<Texel>)>,
    sender: Sender<(TileId, Vec<Texel>)>,
    /// Generated tiles that have no slot yet.
    arrived: Vec<(TileId, Vec<Texel>)>,
    frame: u64,
    uploads: Vec<TileUpload>,
}

impl TileCache {
    /// Creates a cache of `count` slots, at least 1. The root tile is generated at once.
    pub fn new(count: u32, generate: Arc<GenerateTile>) -> Self {
        let (sender, receiver) = channel();
        let uploads = vec![TileUpload { slot: 0, texels: generate(ROOT) }];
        let resident = HashMap::from([(ROOT, CachedTile { slot: 0, frame: 0 })]);
        let free = (1..count.max(1)).rev().collect();
        Self {
            resident,
            free,
            requested: HashSet::new(),
            missing: HashSet::new(),
            generate,
            receiver,
            sender,
            arrived: Vec::new(),
            frame: 0,
            uploads,
        }
    }

    /// Begins a frame: assigns slots to at most `max` generated tiles, coarse ones first, and returns their uploads.
    /// Tiles that get no slot are dropped; they are requested again if still needed.
    pub fn begin(&mut self, max: usize) -> Vec<TileUpload> {
        let mut generated = std::mem::take(&mut self.arrived);
        generated.extend(self.receiver.try_iter());
        generated.sort_unstable_by_key(|(tile, _)| *tile);
        self.arrived = generated.split_off(max.min(generated.len()));
        let mut oldest = self.least_recent(generated.len());
        for (tile, texels) in generated {
            self.requested.remove(&tile);
            let Some(slot) =
                self.free.pop().or_else(|| self.resident.remove(&oldest.pop()?).map(|resident| resident.slot))
            else {
                continue;
            };
            self.resident.insert(tile, CachedTile { slot, frame: self.frame });
            self.uploads.push(TileUpload { slot, texels });
        }
        self.frame += 1;
        self.missing.clear();
        std::mem::take(&mut self.uploads)
    }

    /// Returns up to `count` tiles that were not drawn in the previous frame, the least recently used last.
    fn least_recent(&self, count: usize) -> Vec<TileId> {
        let least_recent =
            self.resident.iter().filter(|(tile, resident)| **tile != ROOT && resident.frame < self.frame);
        let mut tiles: Vec<_> = least_recent.map(|(tile, resident)| (resident.frame, *tile)).collect();
        tiles.sort_unstable();
        tiles.into_iter().take(count).rev().map(|(_, tile)| tile).collect()
    }

    /// Returns the finest resident tile around a tile, and marks it as used in this frame.
    pub fn resolve(&mut self, tile: TileId) -> ResolvedTile {
        let ancestors = (0..=tile.level).map(|up| tile.ancestor(up));
        let nearest = ancestors.into_iter().find(|tile| self.resident.contains_key(tile)).unwrap_or(ROOT);
        if nearest != tile {
            self.missing.insert(tile);
        }
        let resident = self.resident.get_mut(&nearest).expect("the root tile is always resident");
        resident.frame = self.frame;
        ResolvedTile { tile: nearest, slot: resident.slot }
    }

    /// Ends a frame: requests missing tiles from the workers, coarse ones first.
    pub fn finish(&mut self) {
        let mut missing: Vec<_> = self.missing.iter().filter(|tile| !self.requested.contains(tile)).copied().collect();
        missing.sort_unstable();
        for tile in missing.into_iter().take(MAX_REQUESTED.saturating_sub(self.requested.len())) {
            self.requested.insert(tile);
            let (generate, sender) = (Arc::clone(&self.generate), self.sender.clone());
            // Sending fails if the cache was dropped meanwhile.
            rayon::spawn(move || drop(sender.send((tile, generate(tile)))));
        }
    }

    /// Blocks until all requested tiles are generated.
    pub fn wait(&mut self) {
        while self.arrived.len() < self.requested.len() {
            self.arrived.extend(self.receiver.recv());
        }
    }

    /// Returns the number of tiles of this frame that an ancestor stands in for.
    pub fn pending(&self) -> usize {
        self.missing.len()
    }

    /// Returns the number of resident tiles.
    pub fn resident(&self) -> usize {
        self.resident.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texels that encode their tile.
    fn label(tile: TileId) -> Vec<Texel> {
        vec![[tile.level as u8, tile.at[0] as u8, tile.at[1] as u8, 7]]
    }

    /// Requests tiles around a moving point and checks the contents of every slot. Returns how many were exact and
    /// how many were ancestors.
    fn wander(count: u32, frames: usize) -> (usize, usize) {
        let mut dice = fastrand::Rng::with_seed(2);
        let mut cache = TileCache::new(count, Arc::new(label));
        let mut device = vec![Vec::new(); count as usize];
        let (mut place, mut exact, mut coarse) = ([128i32, 128], 0, 0);
        let mut last: HashSet<u32> = HashSet::new();
        for _ in 0..frames {
            place = place.map(|n| (n + dice.i32(-1..=1)).clamp(0, 240));
            for TileUpload { slot, texels } in cache.begin(usize::MAX) {
                assert!(!last.contains(&slot), "slot {slot} was used in the last frame");
                device[slot as usize] = texels;
            }
            last.clear();
            for k in 0..40 {
                let at = [place[0] + k % 8, place[1] + k / 8].map(|n| n as u32);
                let needed = TileId { level: 8, at };
                let ResolvedTile { tile, slot } = cache.resolve(needed);
                assert_eq!(tile, needed.ancestor(8 - tile.level), "not an ancestor");
                assert_eq!(device[slot as usize], label(tile));
                last.insert(slot);
                *(if tile == needed { &mut exact } else { &mut coarse }) += 1;
            }
            cache.finish();
            assert!(cache.resident() <= count as usize && cache.pending() <= 40);
            cache.wait();
        }
        (exact, coarse)
    }

    #[test]
    fn a_tile_resolves_to_itself_or_an_ancestor() {
        let (exact, coarse) = wander(128, 300);
        assert!(exact > 3 * coarse && coarse > 40, "{exact} exact, {coarse} ancestors");
    }

    /// Generated tiles are uploaded over several frames, coarse ones first, and none is lost.
    #[test]
    fn uploads_per_frame_are_limited() {
        let mut cache = TileCache::new(64, Arc::new(label));
        let tiles: Vec<_> = (1..4).flat_map(|level| (0..5).map(move |x| TileId { level, at: [x, 0] })).collect();
        let frame = |cache: &mut TileCache, max| {
            let uploads = cache.begin(max);
            for tile in &tiles {
                cache.resolve(*tile);
            }
            cache.finish();
            cache.wait();
            uploads
        };
        assert_eq!(frame(&mut cache, 4).len(), 1, "the root");
        let levels: Vec<u8> = (0..4).flat_map(|_| frame(&mut cache, 4)).map(|fill| fill.texels[0][0]).collect();
        assert_eq!(levels, [1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3]);
        assert_eq!(cache.pending(), 0);
        assert!(frame(&mut cache, 4).is_empty());
    }

    #[test]
    fn ancestors_stand_in_when_slots_are_few() {
        let (exact, coarse) = wander(20, 100);
        assert!(exact > 0 && coarse > exact / 4, "{exact} exact, {coarse} ancestors");
    }
}
