//! The working set of a virtual texture: the quadtree tiles that a frame needs, each at one resolution.
//!
//! After J. Blow, "Terrain Rendering at High Levels of Detail" (2000), part I. A wedge of a binary triangle tree
//! needs the virtual texture at a level α of the root square, from its screen area
//! ([`resolution`](super::resolution)). It is assigned the coarsest quadtree tile around it whose texture is of at most
//! a given level (§3.3). Each need is stored with the interval of areas for which it holds, and moves by one level when
//! the area leaves the interval (§4.1, §4.2). The set contains only tiles that a wedge of the last frame needs.
//!
//! **Errata**: the lower end of the interval is `Texture_Area(α − 1)` (§4.2 prints its inverse). A quadtree level is
//! two levels of the binary tree. The descent therefore ends at ⌊l/2⌋ and lowers α by 1 at each step; this agrees
//! with §4.2's recurrence but not with the factor 2^(l−q+1) of §3.2.

use std::collections::HashMap;

use super::resolution::{level_by_exponent, texture_area};

/// A tile of the virtual texture's quadtree.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TileId {
    /// Level, 0 the root.
    pub level: u32,
    /// Index (x, z) within the level.
    pub at: [u32; 2],
}

/// Position of a wedge in the virtual texture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wedge {
    /// Level in the binary triangle tree, 0 for the two halves of the root square.
    pub level: u32,
    /// Barycentre in the root square, 0 to 1.
    pub barycentre: [f64; 2],
}

/// The texture that a wedge needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Need {
    /// Level α of the root square's texture.
    pub alpha: i32,
    /// Screen areas for which α holds, texels: above the first, up to the second.
    pub interval: [f64; 2],
    /// The tile assigned to the wedge.
    pub tile: TileId,
    frame: u32,
}

/// Effect of an update on a wedge's need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// The wedge faces away and needs nothing.
    Culled,
    /// The need is unchanged.
    Unchanged,
    /// The need is new; its level was computed.
    Added,
    /// The need moved to another level, step by step.
    Moved,
}

/// The needs of a frame's wedges and the tiles that satisfy them.
#[derive(Debug)]
pub struct WorkingSet {
    /// Largest level of a tile's texture.
    max: i32,
    /// Level of the whole virtual texture; 18 is 2^36 texels.
    texture_level: i32,
    needs: HashMap<u64, Need>,
    /// For each tile, the number of wedges that need it at each level of the tile's own texture.
    tiles: HashMap<TileId, Vec<u32>>,
    texels: f64,
    frame: u32,
}

impl TileId {
    /// Returns the ancestor `levels` levels up.
    ///
    /// # Panics
    /// If `levels` exceeds the tile's level.
    pub fn ancestor(self, levels: u32) -> Self {
        Self { level: self.level - levels, at: self.at.map(|n| n >> levels) }
    }
}

impl Wedge {
    /// Returns a key that is unique among wedges down to level 50.
    pub fn key(&self) -> u64 {
        // Barycentres of one level are a third of a half side apart or more.
        let [x, z] = self.barycentre.map(|part| (part * f64::from(1u32 << 29)) as u64);
        u64::from(self.level) << 58 | x << 29 | z
    }

    /// Returns the tile of a level around the wedge.
    fn tile(&self, level: u32) -> TileId {
        let at = self.barycentre.map(|part| (part * f64::from(1u32 << level)) as u32);
        TileId { level, at }
    }

    /// Returns the level of the smallest tile around the wedge.
    fn deepest_level(&self) -> u32 {
        self.level / 2
    }
}

impl WorkingSet {
    /// Creates an empty set for a virtual texture of 4^`texture_level` texels. Tiles have textures of at most 4^`max`
    /// texels, unless the smallest tile around a wedge needs more.
    pub fn new(texture_level: i32, max: i32) -> Self {
        Self { max, texture_level, needs: HashMap::new(), tiles: HashMap::new(), texels: 0.0, frame: 0 }
    }

    /// Begins a frame.
    pub fn begin(&mut self) {
        self.frame = self.frame.wrapping_add(1);
    }

    /// Updates the need of a wedge of this frame. `texels` is its screen area, quality² × pixels; at most 0 if it
    /// faces away. If `is_near`, the near plane may clip the wedge: it needs the finest level whatever its area (§5).
    pub fn require(&mut self, key: u64, wedge: &Wedge, texels: f32, is_near: bool) -> Change {
        if is_near {
            return self.replace(key, wedge, self.texture_level, [0.0, f64::INFINITY]);
        }
        let area = f64::from(texels);
        let Some(need) = self.needs.get_mut(&key) else {
            if area <= 0.0 {
                return Change::Culled;
            }
            let alpha = level_by_exponent(texels, wedge.level);
            self.insert(key, wedge, alpha, interval(alpha, wedge.level));
            return Change::Added;
        };
        let [low, high] = need.interval;
        // Two comparisons, for culled wedges too (§4.1).
        if area <= low {
            if area <= 0.0 {
                return Change::Culled;
            }
        } else if area <= high && high < f64::INFINITY {
            need.frame = self.frame;
            return Change::Unchanged;
        }
        self.step_levels(key, wedge, area)
    }

    /// Steps level by level until the area is in the interval.
    fn step_levels(&mut self, key: u64, wedge: &Wedge, area: f64) -> Change {
        let Need { mut alpha, interval: [mut low, mut high], .. } = self.needs[&key];
        if high == f64::INFINITY {
            // The wedge was near in the last frame and no longer is.
            alpha = self.texture_level;
            [low, high] = interval(alpha, wedge.level);
        }
        while area <= low {
            (alpha, low, high) = (alpha - 1, low / 4.0, low);
        }
        while area > high {
            (alpha, low, high) = (alpha + 1, high, high * 4.0);
        }
        self.replace(key, wedge, alpha, [low, high])
    }

    fn replace(&mut self, key: u64, wedge: &Wedge, alpha: i32, interval: [f64; 2]) -> Change {
        if let Some(need) = self.needs.get_mut(&key).filter(|need| need.alpha == alpha && need.interval == interval) {
            need.frame = self.frame;
            return Change::Unchanged;
        }
        let existed = self.remove(key);
        self.insert(key, wedge, alpha, interval);
        if existed { Change::Moved } else { Change::Added }
    }

    fn insert(&mut self, key: u64, wedge: &Wedge, alpha: i32, interval: [f64; 2]) {
        let tile = self.choose(wedge, alpha.clamp(0, self.texture_level));
        self.add_to_count(tile, self.own_level(tile, alpha), 1);
        self.needs.insert(key, Need { alpha, interval, tile, frame: self.frame });
    }

    fn remove(&mut self, key: u64) -> bool {
        let Some(need) = self.needs.remove(&key) else { return false };
        self.add_to_count(need.tile, self.own_level(need.tile, need.alpha), -1);
        true
    }

    /// Returns the level of a tile's own texture when the root square's is α.
    fn own_level(&self, tile: TileId, alpha: i32) -> usize {
        (alpha.min(self.texture_level) - tile.level as i32).max(0) as usize
    }

    /// Returns the coarsest tile around a wedge whose texture is of at most the largest level.
    fn choose(&self, wedge: &Wedge, alpha: i32) -> TileId {
        wedge.tile(((alpha - self.max).max(0) as u32).min(wedge.deepest_level()))
    }

    /// Returns the level of a tile's texture; `None` if the tile is not in the set.
    pub fn resolution(&self, tile: TileId) -> Option<u32> {
        self.tiles.get(&tile).map(|counts| counts.len() as u32 - 1)
    }

    /// Adds or removes a wedge that needs a tile at a level. The last count of a tile is never 0.
    fn add_to_count(&mut self, tile: TileId, level: usize, change: i32) {
        let area = |counts: &Vec<u32>| if counts.is_empty() { 0.0 } else { texture_area(counts.len() as i32 - 1) };
        let counts = self.tiles.entry(tile).or_default();
        let before = area(counts);
        counts.resize(counts.len().max(level + 1), 0);
        counts[level] = counts[level].checked_add_signed(change).expect("each need is removed once");
        while counts.last() == Some(&0) {
            counts.pop();
        }
        self.texels += area(counts) - before;
        if counts.is_empty() {
            self.tiles.remove(&tile);
        }
    }

    /// Ends a frame: removes the needs of wedges that were not required in it.
    pub fn end(&mut self) {
        let unseen: Vec<u64> =
            self.needs.iter().filter(|(_, need)| need.frame != self.frame).map(|(&key, _)| key).collect();
        unseen.into_iter().for_each(|key| {
            self.remove(key);
        });
    }

    /// Returns the texels of all tiles in the set.
    pub fn texels(&self) -> f64 {
        self.texels
    }

    /// Returns the tiles in the set with the levels of their textures.
    pub fn tiles(&self) -> impl Iterator<Item = (TileId, u32)> {
        self.tiles.iter().map(|(&tile, counts)| (tile, counts.len() as u32 - 1))
    }
}

/// Returns the screen areas, texels, for which a wedge of a level needs level α of the root square's texture.
fn interval(alpha: i32, wedge_level: u32) -> [f64; 2] {
    let share = 2f64.powi(wedge_level as i32 + 1);
    [texture_area(alpha - 1) / share, texture_area(alpha) / share]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::resolution::tests::level_by_logarithm;

    /// Wedges with random areas: stored needs equal those computed anew, and tiles and texels match the needs.
    #[test]
    fn incremental_needs_equal_needs_computed_anew() {
        let mut dice = fastrand::Rng::with_seed(5);
        let mut set = WorkingSet::new(18, 6);
        let wedges: Vec<_> =
            (0..300).map(|_| Wedge { level: dice.u32(0..24), barycentre: [dice.f64(), dice.f64()] }).collect();
        let mut areas: Vec<f32> = wedges.iter().map(|_| 10f32.powf(4.0 * dice.f32() - 1.0)).collect();
        let mut changes = [0; 4];
        for _ in 0..200 {
            set.begin();
            for (key, (wedge, area)) in wedges.iter().zip(&mut areas).enumerate().filter(|(key, _)| key % 7 != 3) {
                *area *= 1.3f32.powf(2.0 * dice.f32() - 1.0);
                let (is_hidden, is_near) = (dice.f32() < 0.05, dice.f32() < 0.02);
                let shown = if is_hidden { -*area } else { *area };
                let change = set.require(key as u64, wedge, shown, is_near);
                changes[change as usize] += 1;
                if let Some(need) = set.needs.get(&(key as u64)).filter(|_| !is_hidden || is_near) {
                    let alpha = if is_near { 18 } else { level_by_logarithm(*area, wedge.level) };
                    assert_eq!(need.alpha, alpha, "{wedge:?} with {area}");
                    assert_eq!(need.tile, wedge.tile(need.tile.level));
                    assert!(need.tile.level <= wedge.deepest_level());
                    let own = need.alpha.min(18) - need.tile.level as i32;
                    assert!(set.resolution(need.tile).is_some_and(|level| level as i32 >= own));
                }
            }
            set.end();
            let texels: f64 = set.tiles().map(|(_, level)| texture_area(level as i32)).sum();
            assert_eq!(set.texels(), texels);
            for (tile, level) in set.tiles() {
                let needs = set.needs.values().filter(|need| need.tile == tile);
                assert_eq!(needs.map(|need| set.own_level(tile, need.alpha)).max(), Some(level as usize));
            }
        }
        assert!(changes.iter().all(|&n| n > 50), "{changes:?}");
    }
}
