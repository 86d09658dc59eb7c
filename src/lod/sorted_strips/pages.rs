//! Pages: squares of the lattice that are drawn as a whole or not at all, and the order in which they are walked.
//!
//! Rows of pages along the minor direction are walked outward from the eye's own row, and pages of a row outward from
//! the eye's own column. Every ray from the eye therefore meets pages in the order in which they are drawn, and every
//! page is walked away from the eye. The eye's own row and column have terrain on both sides of the eye; there the walk
//! follows the view's direction. For rays against it see [`depth_sorter`](super::depth_sorter).

use std::ops::Range;

use super::depth_sorter::Crossing;
use crate::height::Field;
use crate::view::{Lens, View};

/// Maximum number of pages. Above it, pages are made larger.
pub const MAX_PAGES: u64 = 1 << 16;

/// Grid of pages over a field.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Grid {
    /// Level of a quad that fills a page: a page has 2^level cells a side.
    pub level: u32,
    /// Number of pages along (x, z). The last ones may extend beyond the field.
    pub count: [u32; 2],
    /// Last sample of the field.
    pub last: [i32; 2],
}

impl Grid {
    /// Creates pages of at least 2^level cells a side; larger ones if there would be more than `max`.
    pub fn new(field: &Field, level: u32, max: u64) -> Self {
        let last = field.size().map(|n| n as i32 - 1);
        let count = |level: u32| last.map(|n| (n as u32).div_ceil(1 << level));
        let fits = |level: &u32| count(*level).iter().map(|&n| u64::from(n)).product::<u64>() <= max;
        let level = (level..31).find(fits).unwrap_or(30);
        Self { level, count: count(level), last }
    }

    /// Returns the cells along a side of a page.
    pub fn side(&self) -> i32 {
        1 << self.level
    }

    /// Returns the index of a page; `None` outside the grid.
    #[inline]
    pub fn index(&self, [x, z]: [i32; 2]) -> Option<usize> {
        let inside = x >= 0 && z >= 0 && (x as u32) < self.count[0] && (z as u32) < self.count[1];
        inside.then(|| z as usize * self.count[0] as usize + x as usize)
    }
}

/// The set of pages to draw.
#[derive(Clone, Debug)]
pub struct Pages {
    /// Grid of all pages.
    pub grid: Grid,
    drawn: Vec<bool>,
    list: Vec<[i32; 2]>,
}

impl Pages {
    /// Creates an empty set.
    pub fn none(grid: Grid) -> Self {
        Self { grid, drawn: vec![false; (grid.count[0] * grid.count[1]) as usize], list: Vec::new() }
    }

    /// Replaces the set by these pages.
    pub fn set(&mut self, pages: impl IntoIterator<Item = [i32; 2]>) {
        for at in self.list.drain(..) {
            self.grid.index(at).into_iter().for_each(|k| self.drawn[k] = false);
        }
        for at in pages {
            if let Some(k) = self.grid.index(at).filter(|&k| !self.drawn[k]) {
                self.drawn[k] = true;
                self.list.push(at);
            }
        }
    }

    /// Returns the pages to draw.
    pub fn list(&self) -> &[[i32; 2]] {
        &self.list
    }

    /// Returns true if a page is to be drawn.
    #[inline]
    pub fn is_drawn(&self, at: [i32; 2]) -> bool {
        self.grid.index(at).is_some_and(|k| self.drawn[k])
    }

    /// Returns the rows of pages to walk, nearest first.
    pub fn rows(&self, traversal: &TraversalDirection) -> Vec<Row> {
        let (major, side) = (traversal.major, f64::from(self.grid.side()));
        let drawn: Vec<bool> = (0..self.grid.count[major] as i32)
            .map(|row| (0..self.grid.count[1 - major] as i32).any(|n| self.is_drawn(placed(major, row, n))))
            .collect();
        let eye_row = (traversal.eye[major] / side).floor();
        let outward = outward(eye_row, traversal.ahead[major], drawn.len() as i32);
        let rows = outward.filter(|&(row, _)| drawn[row as usize]);
        rows.map(|(row, sign)| Row {
            row,
            sign,
            runs: self.runs(traversal, row),
            // The row behind the first one of each direction is drawn later, or is the first one.
            has_behind: f64::from(row) != eye_row.clamp(0.0, (drawn.len() - 1) as f64),
        })
        .collect()
    }

    fn runs(&self, traversal: &TraversalDirection, row: i32) -> Vec<Run> {
        let (major, minor) = (traversal.major, 1 - traversal.major);
        let count = self.grid.count[minor] as i32;
        let eye_column = (traversal.eye[minor] / f64::from(self.grid.side())).floor();
        let mut runs: Vec<Run> = Vec::new();
        for (column, sign) in outward(eye_column, traversal.ahead[minor], count) {
            if !self.is_drawn(placed(major, row, column)) {
                continue;
            }
            match runs.last_mut() {
                Some(run) if run.sign == sign && run.first + sign * run.pages == column => run.pages += 1,
                _ => runs.push(Run { first: column, pages: 1, sign }),
            }
        }
        runs
    }
}

/// Returns a place from its coordinates along the major and the minor direction.
#[inline]
pub fn placed(major: usize, along: i32, across: i32) -> [i32; 2] {
    if major == 0 { [along, across] } else { [across, along] }
}

/// Returns 0 to `count` outward from the eye's place or the nearest one: first in the direction of the view, then in
/// the other. Each comes with the direction away from the eye.
fn outward(eye: f64, ahead: i32, count: i32) -> impl Iterator<Item = (i32, i32)> {
    let own = eye.clamp(0.0, f64::from(count - 1)) as i32;
    // An eye outside the field has one direction only.
    let ahead = if eye < 0.0 {
        1
    } else if eye > f64::from(count - 1) {
        -1
    } else {
        ahead
    };
    let to = |first: i32, sign: i32| {
        let ends: Range<i32> = if sign > 0 { 0..count - first } else { 0..first + 1 };
        ends.map(move |n| (first + sign * n, sign))
    };
    to(own, ahead).chain(to(own - ahead, -ahead))
}

/// A row of pages, with the direction of its walk.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Index along the major direction.
    pub row: i32,
    /// Direction of the walk along the major axis: 1 towards greater positions, −1 towards smaller ones.
    pub sign: i32,
    /// Runs of adjacent pages, each from its first page on.
    pub runs: Vec<Run>,
    /// True if the row behind it is drawn before it.
    pub has_behind: bool,
}

/// A run of adjacent pages.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Run {
    /// Index of the first page along the minor direction.
    pub first: i32,
    /// Number of pages.
    pub pages: i32,
    /// Direction of the walk along the minor axis: 1 towards greater positions, −1 towards smaller ones.
    pub sign: i32,
}

/// Position of the eye over the lattice and direction of the view, which determine the order of the walk.
#[derive(Clone, Copy, Debug)]
pub struct TraversalDirection {
    /// Axis nearest the view's direction, along which strips follow each other: 0 for x, 1 for z.
    pub major: usize,
    /// Origin of rays, samples. Parallel rays have a very distant one.
    pub eye: [f64; 2],
    /// Signs of the view's direction, ±1.
    pub ahead: [i32; 2],
    /// True for each axis along which some ray runs against the view's direction.
    pub against: [bool; 2],
}

/// Distance of the origin of parallel rays, in the field's sizes.
const FAR: f64 = 1e9;

impl TraversalDirection {
    /// Computes the direction for a view of a field.
    pub fn new(field: &Field, view: &View) -> Self {
        let forward = [view.forward().x, view.forward().z];
        let extent_m = [0, 1].map(|k| field.spacing[k] * f64::from(field.size()[k])).into_iter().fold(0.0, f64::max);
        let far_m = match view.lens {
            Lens::Perspective { .. } => 0.0,
            Lens::Orthographic { .. } => FAR * extent_m,
        };
        let eye = [0, 1].map(|k| {
            let from = [view.eye.x, view.eye.z][k] - far_m * forward[k];
            (from - field.origin[k]) / field.spacing[k]
        });
        let ahead = forward.map(|f| if f < 0.0 { -1 } else { 1 });
        Self { major: usize::from(forward[0].abs() <= forward[1].abs()), eye, ahead, against: against(view, ahead) }
    }

    /// Returns the rays against the walk of a run, given its first corner and its directions along (minor, major).
    pub fn crossing(&self, origin: [i32; 2], signs: [i32; 2]) -> Crossing {
        let axes = [1 - self.major, self.major];
        let eye = [0, 1].map(|k| f64::from(signs[k]) * (self.eye[axes[k]] - f64::from(origin[k])));
        Crossing { eye, against: [0, 1].map(|k| eye[k] > 0.0 && self.against[axes[k]]) }
    }
}

/// Returns true for each axis along which some ray runs against `ahead`. Rays lie between those of the picture's
/// corners.
fn against(view: &View, ahead: [i32; 2]) -> [bool; 2] {
    let Lens::Perspective { .. } = view.lens else { return [false; 2] };
    let half = view.size.map(|n| 0.5 * f64::from(n) / view.focal_px());
    let corners = [(-1.0, -1.0), (1.0, -1.0), (-1.0, 1.0), (1.0, 1.0)]
        .map(|(x, y)| view.forward() + view.world_from_eye * glam::DVec3::new(x * half[0], y * half[1], 0.0));
    [0, 1].map(|k| corners.iter().any(|ray| [ray.x, ray.z][k] * f64::from(ahead[k]) < 0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn outward_visits_every_place_once() {
        for (eye, ahead, count) in [(3.0, 1, 8), (3.0, -1, 8), (-7.0, -1, 4), (99.0, 1, 5), (0.0, -1, 1)] {
            let places: Vec<_> = outward(eye, ahead, count).collect();
            let mut sorted: Vec<_> = places.iter().map(|p| p.0).collect();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..count).collect::<Vec<_>>());
            for sign in [-1, 1] {
                let own: Vec<_> = places.iter().filter(|p| p.1 == sign).map(|p| p.0 * sign).collect();
                assert!(own.is_sorted(), "{places:?}");
                assert!(own.iter().all(|n| f64::from(*n) >= f64::from(sign) * eye), "{places:?} away from {eye}");
            }
        }
    }

    #[test]
    fn runs_end_at_missing_pages() {
        let grid = Grid { level: 4, count: [9, 2], last: [140, 31] };
        let mut pages = Pages::none(grid);
        pages.set([0, 1, 3, 4, 5, 6, 8].map(|x| [x, 1]));
        let traversal = TraversalDirection { major: 1, eye: [70.0, -100.0], ahead: [1, 1], against: [false; 2] };
        let rows = pages.rows(&traversal);
        let run = |first, pages, sign| Run { first, pages, sign };
        assert_eq!(rows.len(), 1);
        assert_eq!((rows[0].row, rows[0].sign, rows[0].has_behind), (1, 1, true));
        assert_eq!(rows[0].runs, [run(4, 3, 1), run(8, 1, 1), run(3, 1, -1), run(1, 2, -1)]);
    }
}
