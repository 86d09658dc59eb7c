//! Which pages' maps are in memory: the coarsest of each page always, finer ones from a worker when they are asked for,
//! within a number of bytes.
//!
//! After M. Finch and L. Bishop, "Sorted Height Field Rendering" (1998), §4.8: a page that comes into view is drawn with
//! what is there, and what it should be drawn with is loaded meanwhile. A frame is a call of [`ResidentMaps::begin`], one of
//! [`ResidentMaps::choose`] for each page in sight, nearest first, and one of [`ResidentMaps::finish`].

use std::collections::{BTreeMap, BTreeSet};
use std::fmt;
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};
use std::thread::JoinHandle;

use super::page_maps::{Map, PageMaps, Texel};

/// The maps in memory.
pub struct ResidentMaps {
    maps: Arc<PageMaps>,
    budget_bytes: u64,
    /// Of all maps in memory, and of those that the worker makes.
    bytes: u64,
    resident: BTreeMap<Map, Resident>,
    loading: BTreeSet<Map>,
    /// What this frame's pages should be drawn with, nearest first.
    wanted: Vec<Map>,
    frame: u64,
    worker: Worker,
}

struct Resident {
    texels: Vec<Texel>,
    /// The last frame that was drawn with it.
    frame: u64,
}

/// What a working set holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Figures {
    /// Bytes of all maps in memory, and of those being loaded.
    pub bytes: u64,
    /// Maps in memory.
    pub resident: usize,
    /// Pages in sight that are drawn with a coarser map than they should be.
    pub waiting: usize,
}

/// A budget that does not hold the coarsest maps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TooSmall {
    /// The budget, bytes.
    pub budget: u64,
    /// What the coarsest maps take, bytes.
    pub needed: u64,
}

impl fmt::Display for TooSmall {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "expected at least {} bytes, which the coarsest maps take, found {}", self.needed, self.budget)
    }
}

impl std::error::Error for TooSmall {}

impl ResidentMaps {
    /// The coarsest map of each page, within `budget_bytes`.
    ///
    /// # Errors
    /// If these do not fit.
    pub fn new(maps: Arc<PageMaps>, budget_bytes: u64) -> Result<Self, TooSmall> {
        let (level, [columns, rows]) = (maps.levels() - 1, maps.layout().pages);
        let needed = u64::from(columns) * u64::from(rows) * maps.bytes(level);
        if needed > budget_bytes {
            return Err(TooSmall { budget: budget_bytes, needed });
        }
        let pages = (0..rows).flat_map(|z| (0..columns).map(move |x| Map { page: [x, z], level }));
        let resident = pages.map(|map| (map, Resident { texels: maps.cut(map), frame: 0 })).collect();
        let (loading, worker) = (BTreeSet::new(), Worker::new(Arc::clone(&maps)));
        Ok(Self { maps, budget_bytes, bytes: needed, resident, loading, wanted: Vec::new(), frame: 0, worker })
    }

    /// Begins a frame: takes what was loaded.
    pub fn begin(&mut self) {
        while let Ok((map, texels)) = self.worker.made.try_recv() {
            self.keep(map, texels);
        }
        self.frame += 1;
        self.wanted.clear();
    }

    /// A page in sight that should be drawn with a level: the finest one there that is no finer. It stays until the frame
    /// ends.
    pub fn choose(&mut self, wanted: Map) -> Map {
        self.wanted.push(wanted);
        let levels = wanted.level..self.maps.levels();
        let there = levels.map(|level| Map { level, ..wanted }).find(|map| self.resident.contains_key(map));
        let chosen = there.unwrap_or(Map { level: self.maps.levels() - 1, ..wanted });
        if let Some(map) = self.resident.get_mut(&chosen) {
            map.frame = self.frame;
        }
        chosen
    }

    /// Ends a frame: begins to load what was missing, as far as it fits. What no page in sight is drawn with gives way to
    /// it, the longest unseen first, and then what stands in for something finer. Where there is no room, a coarser map
    /// is loaded to stand in, for which nothing in sight gives way: so a still view comes to rest.
    pub fn finish(&mut self) {
        let wanted = std::mem::take(&mut self.wanted);
        let in_sight: BTreeSet<Map> = wanted.iter().copied().collect();
        for map in &wanted {
            let coarser = (map.level..self.maps.levels()).map(|level| Map { level, ..*map });
            for map in coarser {
                let is_coming = self.resident.contains_key(&map) || self.loading.contains(&map);
                if is_coming || self.load(map, &in_sight) {
                    break;
                }
            }
        }
        self.wanted = wanted;
    }

    /// Waits until all that is being loaded is there.
    pub fn wait(&mut self) {
        while !self.loading.is_empty() {
            let Ok((map, texels)) = self.worker.made.recv() else { return };
            self.keep(map, texels);
        }
    }

    /// The texels of a map in memory, row by row.
    pub fn texels(&self, map: Map) -> Option<&[Texel]> {
        self.resident.get(&map).map(|resident| resident.texels.as_slice())
    }

    /// What it holds now.
    pub fn figures(&self) -> Figures {
        let waiting = self.wanted.iter().filter(|map| !self.resident.contains_key(map)).count();
        Figures { bytes: self.bytes, resident: self.resident.len(), waiting }
    }

    fn keep(&mut self, map: Map, texels: Vec<Texel>) {
        self.loading.remove(&map);
        // As new as the frame that asked for it, or it would be the first to go.
        self.resident.insert(map, Resident { texels, frame: self.frame });
    }

    /// Hands a map to the worker; `false` if there is no room for it.
    fn load(&mut self, map: Map, in_sight: &BTreeSet<Map>) -> bool {
        let needed = self.maps.bytes(map.level);
        let over = (self.bytes + needed).saturating_sub(self.budget_bytes);
        let Some(dropped) = self.dropped(over, in_sight.contains(&map), in_sight) else { return false };
        for map in dropped {
            self.resident.remove(&map);
            self.bytes -= self.maps.bytes(map.level);
        }
        self.bytes += needed;
        self.loading.insert(map);
        self.worker.asked.as_ref().is_some_and(|asked| asked.send(map).is_ok())
    }

    /// The maps to drop for `over` bytes: unseen ones, and for something wanted those that stand in. `None` if all of
    /// them are not enough.
    fn dropped(&self, mut over: u64, is_wanted: bool, in_sight: &BTreeSet<Map>) -> Option<Vec<Map>> {
        if over == 0 {
            return Some(Vec::new());
        }
        let coarsest = self.maps.levels() - 1;
        let may_go = |map: &Map, held: &Resident| {
            map.level < coarsest && !in_sight.contains(map) && (is_wanted || held.frame < self.frame)
        };
        let maps = self.resident.iter().filter(|(map, held)| may_go(map, held));
        let mut oldest: Vec<_> = maps.map(|(map, held)| (held.frame, *map)).collect();
        oldest.sort_unstable();
        let mut dropped = Vec::new();
        for (_, map) in oldest {
            dropped.push(map);
            over = over.saturating_sub(self.maps.bytes(map.level));
            if over == 0 {
                return Some(dropped);
            }
        }
        None
    }
}

/// A thread that makes maps.
struct Worker {
    /// `None` once it is to end.
    asked: Option<Sender<Map>>,
    made: Receiver<(Map, Vec<Texel>)>,
    thread: Option<JoinHandle<()>>,
}

impl Worker {
    fn new(maps: Arc<PageMaps>) -> Self {
        let (asked, asks) = channel::<Map>();
        let (makes, made) = channel();
        let make = move || asks.iter().try_for_each(|map| makes.send((map, maps.cut(map))));
        let thread = std::thread::spawn(move || drop(make()));
        Self { asked: Some(asked), made, thread: Some(thread) }
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        self.asked = None;
        if let Some(thread) = self.thread.take() {
            // A thread that panicked has said so itself.
            drop(thread.join());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::page_maps::{Layout, Picture};
    use super::*;

    /// 8 × 8 pages of maps of 17, 9, 5, 3 and 2 texels a side.
    fn maps() -> Arc<PageMaps> {
        let texels: Vec<Texel> = (0..128 * 128u32).map(|k| k.wrapping_mul(0x9e37_79b1).to_le_bytes()).collect();
        let layout = Layout { pages: [8; 2], extent: [8.0; 2], repeats: [false; 2] };
        Arc::new(PageMaps::new(Picture { size: [128; 2], texels: &texels }, layout))
    }

    const COARSEST: u64 = 64 * 2 * 2 * 4;
    const FINEST: u64 = 17 * 17 * 4;

    /// The level that each page should have, seen from a place: finer where it is nearer.
    fn levels_around(at: [f64; 2]) -> Vec<Map> {
        let distance = |page: &[u32; 2]| (0..2).map(|k| (f64::from(page[k]) - at[k]).abs()).fold(0.0, f64::max);
        let mut pages: Vec<[u32; 2]> = (0..64).map(|k| [k % 8, k / 8]).filter(|page| distance(page) < 4.0).collect();
        pages.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        pages.into_iter().map(|page| Map { page, level: distance(&page) as u32 }).collect()
    }

    fn frame(set: &mut ResidentMaps, wanted: &[Map]) -> Vec<Map> {
        set.begin();
        let chosen: Vec<_> = wanted.iter().map(|map| set.choose(*map)).collect();
        assert!(chosen.iter().all(|map| set.texels(*map).is_some()), "maps to draw with that are not there");
        set.finish();
        chosen
    }

    #[test]
    fn a_page_is_coarse_until_its_finer_map_is_there() {
        let maps = maps();
        let mut set = ResidentMaps::new(Arc::clone(&maps), 1 << 20).unwrap();
        let wanted = Map { page: [3, 5], level: 1 };
        let coarsest = Map { level: 4, ..wanted };
        assert_eq!(frame(&mut set, &[wanted]), [coarsest]);
        assert_eq!(set.figures().waiting, 1);
        assert_eq!(set.texels(coarsest), Some(&*maps.cut(coarsest)));
        set.wait();
        assert_eq!(frame(&mut set, &[wanted]), [wanted]);
        assert_eq!(set.texels(wanted), Some(&*maps.cut(wanted)));
        assert_eq!(set.figures(), Figures { bytes: COARSEST + 9 * 9 * 4, resident: 65, waiting: 0 });
        // What is finer than asked for is not chosen.
        let coarser = Map { level: 2, ..wanted };
        assert_eq!(frame(&mut set, &[coarser]), [coarsest]);
    }

    /// Whatever is asked for, on a path across the pages and with jumps, at budgets down to the least.
    #[test]
    fn the_budget_is_never_exceeded() {
        for budget in [COARSEST, COARSEST + 400, COARSEST + 3 * FINEST, COARSEST + 10 * FINEST, 1 << 20] {
            let maps = maps();
            let mut set = ResidentMaps::new(Arc::clone(&maps), budget).unwrap();
            for step in 0..400u32 {
                let jump = if step % 50 == 49 { 4.0 } else { 0.0 };
                let at = [f64::from(step % 80) / 10.0, (f64::from(step) / 57.0 + jump) % 8.0];
                let wanted = levels_around(at);
                for (chosen, wanted) in frame(&mut set, &wanted).into_iter().zip(&wanted) {
                    assert!(chosen.page == wanted.page && chosen.level >= wanted.level);
                }
                let held: u64 = set.resident.keys().chain(&set.loading).map(|map| maps.bytes(map.level)).sum();
                assert_eq!(set.figures().bytes, held);
                assert!(held <= budget, "{held} bytes of {budget} in step {step}");
                if step % 3 == 0 {
                    set.wait();
                }
            }
        }
    }

    /// A still view gets what it asks for, in time, where that fits beside what the way there left; and the nearest
    /// pages get theirs first where it does not.
    #[test]
    fn a_still_view_gets_its_maps() {
        let maps = maps();
        let wanted = levels_around([4.0, 4.0]);
        let needed: u64 = wanted.iter().filter(|map| map.level < 4).map(|map| maps.bytes(map.level)).sum();
        for (budget, all) in [(COARSEST + needed, true), (COARSEST + needed / 2, false)] {
            let mut set = ResidentMaps::new(Arc::clone(&maps), budget).unwrap();
            for before in [[0.0, 0.0], [7.0, 1.0]] {
                frame(&mut set, &levels_around(before));
                set.wait();
            }
            for _ in 0..8 {
                frame(&mut set, &wanted);
                set.wait();
            }
            let chosen = frame(&mut set, &wanted);
            assert_eq!(chosen == wanted, all, "{budget} bytes");
            assert_eq!(chosen[0], wanted[0], "the nearest page");
            assert_eq!(set.figures().waiting, chosen.iter().zip(&wanted).filter(|(a, b)| a != b).count());
        }
    }

    /// Where there is no room for both, what stands in gives way.
    #[test]
    fn what_stands_in_does_not_stand_in_the_way() {
        let maps = maps();
        let mut set = ResidentMaps::new(Arc::clone(&maps), COARSEST + maps.bytes(1)).unwrap();
        let [coarser, finer] = [3, 1].map(|level| Map { page: [2, 2], level });
        for wanted in [coarser, finer] {
            frame(&mut set, &[wanted]);
            set.wait();
            assert_eq!(frame(&mut set, &[wanted]), [wanted]);
        }
    }

    #[test]
    fn a_budget_below_the_coarsest_maps_is_refused() {
        let refused = ResidentMaps::new(maps(), COARSEST - 1).err();
        assert_eq!(refused, Some(TooSmall { budget: COARSEST - 1, needed: COARSEST }));
    }
}
