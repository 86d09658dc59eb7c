//! A fixed number of textures of one size for the nodes of a working set: made on workers when they are first needed, and
//! until then the nearest coarser node that is there serves.
//!
//! After J. Blow, "Terrain Rendering at High Levels of Detail" (2000), §2.1 and §3.3: only nodes that are needed exist. The
//! paper generates them in the frame that needs them; here no frame waits. A frame is a call of [`TileCache::begin`], one of
//! [`TileCache::serve`] for each node needed, and one of [`TileCache::finish`]. A slot that served in the last frame is not
//! given to another node: what the device still reads is not overwritten.

use std::collections::{HashMap, HashSet};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

use super::working_set::Node;

/// Red, green, blue and nothing.
pub type Texel = [u8; 4];

/// Makes the texels of a node, row by row.
pub type Make = dyn Fn(Node) -> Vec<Texel> + Send + Sync;

/// The most nodes that workers are asked for at a time: a turn of the head makes others needed.
const MAX_COMING: usize = 256;

/// The root of the quadtree, which always has a slot.
const ROOT: Node = Node { level: 0, at: [0, 0] };

/// What a slot is to be filled with before it serves.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fill {
    /// Which slot.
    pub slot: u32,
    /// Its texels, row by row.
    pub texels: Vec<Texel>,
}

/// What serves a node: itself, or one around it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ResolvedTile {
    /// Whose texels they are.
    pub node: Node,
    /// Where they are.
    pub slot: u32,
}

struct CachedTile {
    slot: u32,
    /// The last frame in which it served.
    frame: u64,
}

/// The slots.
pub struct TileCache {
    held: HashMap<Node, CachedTile>,
    free: Vec<u32>,
    coming: HashSet<Node>,
    missing: HashSet<Node>,
    make: Arc<Make>,
    made: Receiver<(Node, Vec<Texel>)>,
    makes: Sender<(Node, Vec<Texel>)>,
    /// Taken from the workers, not in a slot yet.
    arrived: Vec<(Node, Vec<Texel>)>,
    frame: u64,
    fills: Vec<Fill>,
}

impl TileCache {
    /// So many slots, at least 1; the root's texels are made at once.
    pub fn new(count: u32, make: Arc<Make>) -> Self {
        let (makes, made) = channel();
        let fills = vec![Fill { slot: 0, texels: make(ROOT) }];
        let held = HashMap::from([(ROOT, CachedTile { slot: 0, frame: 0 })]);
        let free = (1..count.max(1)).rev().collect();
        Self {
            held,
            free,
            coming: HashSet::new(),
            missing: HashSet::new(),
            make,
            made,
            makes,
            arrived: Vec::new(),
            frame: 0,
            fills,
        }
    }

    /// Begins a frame: gives slots to what was made meanwhile, to `max` nodes at the most, large ones first. Nodes for which
    /// there is none are forgotten, and asked for again if they are still needed.
    pub fn begin(&mut self, max: usize) -> Vec<Fill> {
        let mut made = std::mem::take(&mut self.arrived);
        made.extend(self.made.try_iter());
        made.sort_unstable_by_key(|(node, _)| *node);
        self.arrived = made.split_off(max.min(made.len()));
        let mut oldest = self.unused(made.len());
        for (node, texels) in made {
            self.coming.remove(&node);
            let Some(slot) = self.free.pop().or_else(|| self.held.remove(&oldest.pop()?).map(|held| held.slot)) else {
                continue;
            };
            self.held.insert(node, CachedTile { slot, frame: self.frame });
            self.fills.push(Fill { slot, texels });
        }
        self.frame += 1;
        self.missing.clear();
        std::mem::take(&mut self.fills)
    }

    /// Up to so many nodes that did not serve in the last frame, the longest unused last.
    fn unused(&self, count: usize) -> Vec<Node> {
        let unused = self.held.iter().filter(|(node, held)| **node != ROOT && held.frame < self.frame);
        let mut nodes: Vec<_> = unused.map(|(node, held)| (held.frame, *node)).collect();
        nodes.sort_unstable();
        nodes.into_iter().take(count).rev().map(|(_, node)| node).collect()
    }

    /// What serves a node in this frame: the finest that is there.
    pub fn resolve(&mut self, node: Node) -> ResolvedTile {
        let around = (0..=node.level).map(|up| node.above(up));
        let found = around.into_iter().find(|node| self.held.contains_key(node)).unwrap_or(ROOT);
        if found != node {
            self.missing.insert(node);
        }
        let held = self.held.get_mut(&found).expect("the root is always there");
        held.frame = self.frame;
        ResolvedTile { node: found, slot: held.slot }
    }

    /// Ends a frame: asks workers for what was missing, large nodes first.
    pub fn finish(&mut self) {
        let mut missing: Vec<_> = self.missing.iter().filter(|node| !self.coming.contains(node)).copied().collect();
        missing.sort_unstable();
        for node in missing.into_iter().take(MAX_COMING.saturating_sub(self.coming.len())) {
            self.coming.insert(node);
            let (make, makes) = (Arc::clone(&self.make), self.makes.clone());
            // Who no longer listens has gone.
            rayon::spawn(move || drop(makes.send((node, make(node)))));
        }
    }

    /// Waits until all that was asked for is made.
    pub fn wait(&mut self) {
        while self.arrived.len() < self.coming.len() {
            self.arrived.extend(self.made.recv());
        }
    }

    /// Nodes of this frame that a coarser one served.
    pub fn pending(&self) -> usize {
        self.missing.len()
    }

    /// Nodes that have a slot.
    pub fn held(&self) -> usize {
        self.held.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Texels that tell whose they are.
    fn label(node: Node) -> Vec<Texel> {
        vec![[node.level as u8, node.at[0] as u8, node.at[1] as u8, 7]]
    }

    /// Frames of nodes about a place that wanders: what a device would find in each slot is what is said to be there.
    fn wander(count: u32, frames: usize) -> (usize, usize) {
        let mut dice = fastrand::Rng::with_seed(2);
        let mut slots = TileCache::new(count, Arc::new(label));
        let mut device = vec![Vec::new(); count as usize];
        let (mut place, mut exact, mut coarse) = ([128i32, 128], 0, 0);
        let mut last: HashSet<u32> = HashSet::new();
        for _ in 0..frames {
            place = place.map(|n| (n + dice.i32(-1..=1)).clamp(0, 240));
            for Fill { slot, texels } in slots.begin(usize::MAX) {
                assert!(!last.contains(&slot), "slot {slot} served in the last frame");
                device[slot as usize] = texels;
            }
            last.clear();
            for k in 0..40 {
                let at = [place[0] + k % 8, place[1] + k / 8].map(|n| n as u32);
                let needed = Node { level: 8, at };
                let ResolvedTile { node, slot } = slots.resolve(needed);
                assert_eq!(node, needed.above(8 - node.level), "not around it");
                assert_eq!(device[slot as usize], label(node));
                last.insert(slot);
                *(if node == needed { &mut exact } else { &mut coarse }) += 1;
            }
            slots.finish();
            assert!(slots.held() <= count as usize && slots.pending() <= 40);
            slots.wait();
        }
        (exact, coarse)
    }

    #[test]
    fn nodes_are_served_by_themselves_or_by_one_around_them() {
        let (exact, coarse) = wander(128, 300);
        assert!(exact > 3 * coarse && coarse > 40, "{exact} served, {coarse} by coarser ones");
    }

    /// What was made is filled in over several frames, the large nodes first, and nothing is lost.
    #[test]
    fn so_many_are_filled_in_a_frame() {
        let mut slots = TileCache::new(64, Arc::new(label));
        let nodes: Vec<_> = (1..4).flat_map(|level| (0..5).map(move |x| Node { level, at: [x, 0] })).collect();
        let frame = |slots: &mut TileCache, max| {
            let fills = slots.begin(max);
            for node in &nodes {
                slots.resolve(*node);
            }
            slots.finish();
            slots.wait();
            fills
        };
        assert_eq!(frame(&mut slots, 4).len(), 1, "the root");
        let levels: Vec<u8> = (0..4).flat_map(|_| frame(&mut slots, 4)).map(|fill| fill.texels[0][0]).collect();
        assert_eq!(levels, [1, 1, 1, 1, 1, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3]);
        assert_eq!(slots.pending(), 0);
        assert!(frame(&mut slots, 4).is_empty());
    }

    #[test]
    fn with_too_few_slots_coarser_ones_go_on_serving() {
        let (exact, coarse) = wander(20, 100);
        assert!(exact > 0 && coarse > exact / 4, "{exact} served, {coarse} by coarser ones");
    }
}
