//! The textures that a frame needs of one map over a whole field: nodes of a quadtree, each at one resolution.
//!
//! After J. Blow, "Terrain Rendering at High Levels of Detail" (2000), part I. A wedge of a binary triangle tree needs
//! the map at a level α of the root square, from its area on the screen ([`resolution`](super::resolution)), and is
//! given the node of the quadtree in which it lies at which that is a texture of an acceptable size ([`Stop`]). What is
//! needed is remembered with the interval of areas for which it holds, and moves on by one level where the area leaves
//! it (§4.1, §4.2). Only nodes that a wedge of the last frame needs are in the set.
//!
//! **Errata**: the lower end of the interval is `Texture_Area(α − 1)` (§4.2 says its inverse); a level of the quadtree
//! is two of the binary tree, so that the descent ends at ⌊l/2⌋ and takes 1 from α at each step, which agrees with §4.2's
//! recurrence but not with the factor 2^(l−q+1) of §3.2.

use std::collections::HashMap;

use super::resolution::{level_by_exponent, texture_area};

/// A node of the quadtree: its level from the root, and its place among that level's.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Node {
    /// Level, 0 the root.
    pub level: u32,
    /// Place (x, z).
    pub at: [u32; 2],
}

/// Where a wedge lies in the map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wedge {
    /// Its level in the binary triangle tree, 0 for the two halves of the root square.
    pub level: u32,
    /// Its barycentre in the root square, 0 to 1.
    pub barycentre: [f64; 2],
}

/// Which node a wedge takes of those around it (§3.3).
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stop {
    /// The first whose texture is of this level or lower: as few textures as possible.
    Largest(i32),
    /// The same, but one already there at the resolution is taken before: fewer textures are made as the viewpoint
    /// moves.
    Generated(i32),
    /// The root's if its texture is of this level or lower, or else the smallest node around the wedge: the map's top
    /// and bottom are made before.
    Ends(i32),
}

/// What a wedge needs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Need {
    /// The level at which it needs the root square's texture.
    pub alpha: i32,
    /// Areas on the screen for which that holds, texels: above the first, up to the second.
    pub interval: [f64; 2],
    /// The node that it takes.
    pub node: Node,
    frame: u32,
}

/// What became of a wedge's need.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Change {
    /// It faces away: it needs nothing.
    Culled,
    /// It needs what it did.
    DeviceGeometry,
    /// It was not there, and its level was worked out.
    Begun,
    /// It went on to other levels, one after the other.
    Moved,
}

/// The needs of a frame's wedges, and the nodes that serve them.
#[derive(Debug)]
pub struct WorkingSet {
    stop: Stop,
    /// Level of the whole map: 18 has 2^36 texels.
    map_level: i32,
    needs: HashMap<u64, Need>,
    /// For each node, how many wedges need it at each level of its own texture.
    nodes: HashMap<Node, Vec<u32>>,
    texels: f64,
    frame: u32,
}

impl Node {
    /// The node so many levels up around it.
    ///
    /// # Panics
    /// If there are not so many.
    pub fn above(self, levels: u32) -> Self {
        Self { level: self.level - levels, at: self.at.map(|n| n >> levels) }
    }
}

impl Wedge {
    /// A number that no other wedge has, down to level 50.
    pub fn key(&self) -> u64 {
        // Barycentres of one level are a third of a half side apart or more.
        let [x, z] = self.barycentre.map(|part| (part * f64::from(1u32 << 29)) as u64);
        u64::from(self.level) << 58 | x << 29 | z
    }

    /// The node of a level around it.
    fn node(&self, level: u32) -> Node {
        let at = self.barycentre.map(|part| (part * f64::from(1u32 << level)) as u32);
        Node { level, at }
    }

    /// The level of the smallest node around it.
    fn deepest(&self) -> u32 {
        self.level / 2
    }
}

impl WorkingSet {
    /// An empty set for a map of 4^`map_level` texels.
    pub fn new(map_level: i32, stop: Stop) -> Self {
        Self { stop, map_level, needs: HashMap::new(), nodes: HashMap::new(), texels: 0.0, frame: 0 }
    }

    /// Begins a frame.
    pub fn begin(&mut self) {
        self.frame = self.frame.wrapping_add(1);
    }

    /// Says that a wedge of the frame, known by a key, has an area on the screen: quality² × pixels, not above 0 if it
    /// faces away. One that may be cut by the near plane needs the most there is, whatever its area (§5).
    pub fn show(&mut self, key: u64, wedge: &Wedge, texels: f32, is_near: bool) -> Change {
        if is_near {
            return self.step_to(key, wedge, self.map_level, [0.0, f64::INFINITY]);
        }
        let area = f64::from(texels);
        let Some(need) = self.needs.get_mut(&key) else {
            if area <= 0.0 {
                return Change::Culled;
            }
            let alpha = level_by_exponent(texels, wedge.level);
            self.enter(key, wedge, alpha, interval(alpha, wedge.level));
            return Change::Begun;
        };
        let [low, high] = need.interval;
        // Two comparisons, whether it is culled or not (§4.1).
        if area <= low {
            if area <= 0.0 {
                return Change::Culled;
            }
        } else if area <= high && high < f64::INFINITY {
            need.frame = self.frame;
            return Change::DeviceGeometry;
        }
        self.go_on(key, wedge, area)
    }

    /// Goes on level by level until the area is in the interval.
    fn go_on(&mut self, key: u64, wedge: &Wedge, area: f64) -> Change {
        let Need { mut alpha, interval: [mut low, mut high], .. } = self.needs[&key];
        if high == f64::INFINITY {
            // It is no longer near.
            alpha = self.map_level;
            [low, high] = interval(alpha, wedge.level);
        }
        while area <= low {
            (alpha, low, high) = (alpha - 1, low / 4.0, low);
        }
        while area > high {
            (alpha, low, high) = (alpha + 1, high, high * 4.0);
        }
        self.step_to(key, wedge, alpha, [low, high])
    }

    fn step_to(&mut self, key: u64, wedge: &Wedge, alpha: i32, interval: [f64; 2]) -> Change {
        if let Some(need) = self.needs.get_mut(&key).filter(|need| need.alpha == alpha && need.interval == interval) {
            need.frame = self.frame;
            return Change::DeviceGeometry;
        }
        let was_there = self.leave(key);
        self.enter(key, wedge, alpha, interval);
        if was_there { Change::Moved } else { Change::Begun }
    }

    fn enter(&mut self, key: u64, wedge: &Wedge, alpha: i32, interval: [f64; 2]) {
        let node = self.choose(wedge, alpha.clamp(0, self.map_level));
        self.count(node, self.own_level(node, alpha), 1);
        self.needs.insert(key, Need { alpha, interval, node, frame: self.frame });
    }

    fn leave(&mut self, key: u64) -> bool {
        let Some(need) = self.needs.remove(&key) else { return false };
        self.count(need.node, self.own_level(need.node, need.alpha), -1);
        true
    }

    /// The level of a node's own texture.
    fn own_level(&self, node: Node, alpha: i32) -> usize {
        (alpha.min(self.map_level) - node.level as i32).max(0) as usize
    }

    fn choose(&self, wedge: &Wedge, alpha: i32) -> Node {
        let first_up_to = |max: i32| wedge.node(((alpha - max).max(0) as u32).min(wedge.deepest()));
        match self.stop {
            Stop::Largest(max) => first_up_to(max),
            Stop::Ends(max) => wedge.node(if alpha <= max { 0 } else { wedge.deepest() }),
            Stop::Generated(max) => {
                let is_there = |node: &Node| self.resolution(*node) >= Some(self.own_level(*node, alpha) as u32);
                let around = (0..=wedge.deepest()).map(|level| wedge.node(level));
                around.into_iter().find(is_there).unwrap_or_else(|| first_up_to(max))
            }
        }
    }

    /// The level of a node's texture, if it is in the set.
    pub fn resolution(&self, node: Node) -> Option<u32> {
        self.nodes.get(&node).map(|counts| counts.len() as u32 - 1)
    }

    /// One wedge more or less that needs a node at a level. The last count is never 0.
    fn count(&mut self, node: Node, level: usize, change: i32) {
        let area = |counts: &Vec<u32>| if counts.is_empty() { 0.0 } else { texture_area(counts.len() as i32 - 1) };
        let counts = self.nodes.entry(node).or_default();
        let before = area(counts);
        counts.resize(counts.len().max(level + 1), 0);
        counts[level] = counts[level].checked_add_signed(change).expect("as many leave as entered");
        while counts.last() == Some(&0) {
            counts.pop();
        }
        self.texels += area(counts) - before;
        if counts.is_empty() {
            self.nodes.remove(&node);
        }
    }

    /// Ends a frame: what was not shown in it is needed no more.
    pub fn end(&mut self) {
        let unseen: Vec<u64> =
            self.needs.iter().filter(|(_, need)| need.frame != self.frame).map(|(&key, _)| key).collect();
        unseen.into_iter().for_each(|key| {
            self.leave(key);
        });
    }

    /// Texels of all nodes in the set.
    pub fn texels(&self) -> f64 {
        self.texels
    }

    /// Nodes in the set with the levels of their textures.
    pub fn nodes(&self) -> impl Iterator<Item = (Node, u32)> {
        self.nodes.iter().map(|(&node, counts)| (node, counts.len() as u32 - 1))
    }

    /// What the wedge of a key needs.
    pub fn need(&self, key: u64) -> Option<&Need> {
        self.needs.get(&key)
    }
}

/// Areas on the screen, texels, for which a wedge of a level needs the root square's texture at level α.
fn interval(alpha: i32, wedge_level: u32) -> [f64; 2] {
    let share = 2f64.powi(wedge_level as i32 + 1);
    [texture_area(alpha - 1) / share, texture_area(alpha) / share]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::texture::resolution::level_by_logarithm;

    /// Wedges whose areas wander: what is remembered is what would be worked out anew, and the set is what it needs.
    #[test]
    fn needs_and_texels_are_those_of_the_last_frame_alone() {
        let mut dice = fastrand::Rng::with_seed(5);
        for stop in [Stop::Largest(6), Stop::Ends(4), Stop::Generated(6)] {
            let mut set = WorkingSet::new(18, stop);
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
                    let change = set.show(key as u64, wedge, shown, is_near);
                    changes[change as usize] += 1;
                    if let Some(need) = set.need(key as u64).filter(|_| !is_hidden || is_near) {
                        let alpha = if is_near { 18 } else { level_by_logarithm(*area, wedge.level) };
                        assert_eq!(need.alpha, alpha, "{wedge:?} with {area}");
                        assert_eq!(need.node, wedge.node(need.node.level));
                        assert!(need.node.level <= wedge.deepest());
                        let own = need.alpha.min(18) - need.node.level as i32;
                        assert!(set.resolution(need.node).is_some_and(|level| level as i32 >= own));
                    }
                }
                set.end();
                let texels: f64 = set.nodes().map(|(_, level)| texture_area(level as i32)).sum();
                assert_eq!(set.texels(), texels);
                for (node, level) in set.nodes() {
                    let needs = set.needs.values().filter(|need| need.node == node);
                    assert_eq!(needs.map(|need| set.own_level(node, need.alpha)).max(), Some(level as usize));
                }
            }
            assert!(changes.iter().all(|&n| n > 50), "{changes:?}");
        }
    }
}
