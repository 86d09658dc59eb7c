//! The camera path `cave`: through a cave from end to end, along its widest passage. Over terrain without a ceiling it
//! runs at eye height.
//!
//! The floor is sampled on a grid. Two runs of Dijkstra's algorithm on this grid find two distant cells and the
//! cheapest way between them, where low passages cost more.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use glam::DVec3;

use super::ground::Ground;
use super::pose::{Opening, Pose};
use super::shapes::{along, angles};

/// Largest number of grid cells along a side.
const CELLS: u32 = 512;
/// Smallest height of a passable cell, as a share of the cave's greatest height.
const MIN_ROOM: f64 = 0.3;
/// Number of cells before and after a cell over which the way is averaged.
const SMOOTHED: usize = 6;
/// Distance from the eye to the point it looks at, as a share of the path.
const AHEAD: f64 = 0.02;
/// Height of the eye between floor (0) and ceiling (1).
const MIDDLE: f64 = 0.5;
/// Smallest distance of the eye from floor and ceiling, as a share of the height between them.
const NEAREST: f64 = 0.25;

/// Returns the poses of the path `cave`, see [`PATHS`](super::PATHS).
pub fn cave(ground: &Ground, frames: usize) -> Vec<Pose> {
    let way = Way::through(ground);
    let pose = |t: f64| {
        let eye = way.eye(ground, t);
        let from = t.min(1.0 - AHEAD);
        let (yaw, pitch) = angles(way.smooth(from + AHEAD) - way.smooth(from));
        Pose { eye, yaw, pitch: pitch.clamp(-30.0, 30.0), opening: Opening::Horizontal(75.0) }
    };
    along(frames).map(pose).collect()
}

/// The way through a cave: world positions half-way between floor and ceiling, averaged over neighbours.
struct Way {
    places: Vec<DVec3>,
}

impl Way {
    /// Finds the way between two distant cells.
    fn through(ground: &Ground) -> Self {
        let grid = Grid::of(ground);
        let widest = (0..grid.heights.len()).max_by(|&a, &b| grid.heights[a].total_cmp(&grid.heights[b]));
        let one_end = grid.furthest(widest.unwrap_or(0)).0;
        let (other_end, before) = grid.furthest(one_end);
        let mut cells = vec![other_end];
        while let Some(&next) = cells.last().filter(|&&cell| cell != one_end) {
            cells.push(before[next]);
        }
        let places: Vec<DVec3> = cells.iter().map(|&cell| grid.middle(ground, cell)).collect();
        let mean = |k: usize| {
            let around = &places[k.saturating_sub(SMOOTHED)..(k + SMOOTHED + 1).min(places.len())];
            around.iter().sum::<DVec3>() / around.len() as f64
        };
        Self { places: (0..places.len()).map(mean).collect() }
    }

    /// Returns the position at a part of the way: 0 at its start, 1 at its end.
    fn smooth(&self, t: f64) -> DVec3 {
        let at = t * (self.places.len() - 1) as f64;
        let next = (at as usize + 1).min(self.places.len() - 1);
        self.places[at as usize].lerp(self.places[next], at.fract())
    }

    /// Returns the position of the eye at a part of the way, clear of floor and ceiling.
    fn eye(&self, ground: &Ground, t: f64) -> DVec3 {
        let (low, high, mean) = (ground.place(0.0, 0.0), ground.place(1.0, 1.0), self.smooth(t));
        // Means of positions on the border may be rounded across it.
        let place = DVec3 { x: mean.x.clamp(low[0], high[0]), z: mean.z.clamp(low[1], high[1]), ..mean };
        let (floor, room) = (ground.height([place.x, place.z]), ground.room([place.x, place.z]));
        DVec3 { y: place.y.clamp(floor + NEAREST * room, floor + (1.0 - NEAREST) * room), ..place }
    }
}

/// Heights between floor and ceiling on a grid over the field.
struct Grid {
    /// Cells along (x, z).
    count: [usize; 2],
    /// Height at each cell, row by row, metres.
    heights: Vec<f64>,
    max: f64,
}

impl Grid {
    fn of(ground: &Ground) -> Self {
        let count = ground.field.size().map(|n| n.min(CELLS) as usize);
        let mut grid = Self { count, heights: Vec::new(), max: 0.0 };
        grid.heights = (0..count[0] * count[1]).map(|cell| ground.room(grid.place(ground, cell))).collect();
        grid.max = grid.heights.iter().copied().fold(0.0, f64::max);
        grid
    }

    /// Returns the world position (x, z) of a cell.
    fn place(&self, ground: &Ground, cell: usize) -> [f64; 2] {
        let part = |n: usize, count: usize| n as f64 / (count - 1) as f64;
        ground.place(part(cell % self.count[0], self.count[0]), part(cell / self.count[0], self.count[1]))
    }

    /// Returns the world position of a cell half-way between floor and ceiling.
    fn middle(&self, ground: &Ground, cell: usize) -> DVec3 {
        let [x, z] = self.place(ground, cell);
        DVec3::new(x, ground.height([x, z]) + MIDDLE * self.heights[cell], z)
    }

    /// Returns the cell with the most expensive cheapest way from `from`, and for each cell the one before it on that
    /// way (`usize::MAX` if it is unreachable). A step costs 100 divided by the squared relative height of its cell.
    fn furthest(&self, from: usize) -> (usize, Vec<usize>) {
        let mut before = vec![usize::MAX; self.heights.len()];
        let (mut reached, mut last) = (BinaryHeap::from([Reverse((0, from, from))]), from);
        while let Some(Reverse((length, cell, came_from))) = reached.pop() {
            if before[cell] != usize::MAX {
                continue;
            }
            (before[cell], last) = (came_from, cell);
            for next in self.beside(cell).filter(|&next| before[next] == usize::MAX) {
                let wide = self.heights[next] / self.max;
                if wide >= MIN_ROOM {
                    reached.push(Reverse((length + (100.0 / (wide * wide)) as u64, next, cell)));
                }
            }
        }
        (last, before)
    }

    /// Returns the cells to the west, east, north and south that exist.
    fn beside(&self, cell: usize) -> impl Iterator<Item = usize> {
        let ([w, h], [x, z]) = (self.count, [cell % self.count[0], cell / self.count[0]]);
        let west = (x > 0).then(|| cell - 1);
        let east = (x + 1 < w).then(|| cell + 1);
        let north = (z > 0).then(|| cell - w);
        let south = (z + 1 < h).then(|| cell + w);
        [west, east, north, south].into_iter().flatten()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::cave::Cave;
    use crate::height::synth::{Kind, synth};

    /// The path must stay clear of the rock in two synthetic caves, and be longer than 300 m.
    #[test]
    fn the_eye_is_between_floor_and_ceiling() {
        for seed in [1, 7] {
            let [floor, ceiling] = [Kind::CaveFloor, Kind::CaveCeiling].map(|kind| synth(kind, [257, 257], seed));
            let cave = Cave::new(&floor, &ceiling, "ceiling").expect("two fields of one size");
            let ground = Ground::of(cave.floor());
            let poses = super::cave(&ground, 200);
            for pose in &poses {
                let at = [pose.eye.x, pose.eye.z];
                let (low, room) = (ground.height(at), ground.room(at));
                assert!(room > 1.0 && pose.eye.y > low + 0.2 * room && pose.eye.y < low + 0.8 * room, "{pose:?}");
            }
            let length: f64 = poses.windows(2).map(|p| p[0].eye.distance(p[1].eye)).sum();
            assert!(length > 300.0, "seed {seed}: {length} m");
        }
    }
}
