//! The published level function: a table indexed by the squared distance from the eye (Finch & Bishop, §4.5),
//!
//! LOD = LUT[distance² · scale]
//!
//! with distance in plan from the eye to the nearest point of a square, and the eye's height above the land under it as
//! the third side. Any table may be given. Whether it keeps the Lipschitz condition is checked, never assumed.

use super::blend::Blend;
use super::splits::Levels;
use crate::height::Field;
use crate::view::{Lens, View};

/// Entries of a table.
const ENTRIES: usize = 1 << 14;

/// Levels by squared distance.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    levels: Vec<u8>,
    /// Entries per square metre.
    scale: f64,
}

impl Table {
    /// Any levels; the last one holds for all greater distances. `scale`: entries per square metre.
    ///
    /// # Panics
    /// If there is no level.
    pub fn new(levels: Vec<u8>, scale: f64) -> Self {
        assert!(!levels.is_empty());
        Self { levels, scale }
    }

    /// Levels that double with the distance, so that triangles are as large on the screen: `unit_m` metres away is
    /// level 1, up to `max`. The table reaches further by `more_m`, for repairs. Its entries are those of any larger
    /// unit or divide them, so that a smaller unit never gives a finer level.
    pub fn doubling(unit_m: f64, max: u32, more_m: f64) -> Self {
        let scale = doubling_scale(unit_m, max, more_m);
        let level = |k: usize| {
            let distance = doublings(k, scale, unit_m);
            (0..max).take_while(|&l| distance >= f64::from(1u32 << l)).count() as u8
        };
        Self { levels: (0..ENTRIES).map(level).collect(), scale }
    }

    /// The level at a squared distance, metres².
    #[inline]
    pub fn level(&self, squared_m2: f64) -> u32 {
        u32::from(self.levels[((squared_m2 * self.scale) as usize).min(self.levels.len() - 1)])
    }

    /// The first level, from 1 to `max`, at which the table breaks its condition for cells of this diagonal
    /// (metres); `None` if it keeps it. Levels must rise with the distance, and none may begin before squares that
    /// touch those with the level before the last one have ended.
    pub fn broken_at(&self, diagonal_m: f64, max: u32) -> Option<u32> {
        let falls = self.levels.windows(2).find(|pair| pair[1] < pair[0]).map(|pair| u32::from(pair[0]));
        let steps = Steps::of(self, max);
        falls.or_else(|| (2..=max).find(|&level| !steps.begins_at(level, steps.min_m(level, diagonal_m))))
    }

    /// Lowers levels where they break the condition, and nowhere else.
    pub fn repair(&mut self, diagonal_m: f64, max: u32) {
        let begins = Steps::of(self, max).repaired(diagonal_m).begins;
        for (k, level) in self.levels.iter_mut().enumerate() {
            *level = begins.iter().rposition(|&begin| begin <= k).unwrap_or(0) as u8;
        }
    }
}

/// A table without its repetitions: levels that never fall, each by the entry at which it begins.
#[derive(Clone, Debug, PartialEq)]
struct Steps {
    /// By level; the number of entries if it does not begin.
    begins: Vec<usize>,
    scale: f64,
    entries: usize,
}

impl Steps {
    /// From where on every level of a table is at least this one, up to `max`.
    fn of(table: &Table, max: u32) -> Self {
        let begin = |level: u32| table.levels.iter().rposition(|&l| u32::from(l) < level).map_or(0, |k| k + 1);
        Self { begins: (0..=max).map(begin).collect(), scale: table.scale, entries: table.levels.len() }
    }

    /// Those of [`Table::doubling`], without making it.
    fn doubling(unit_m: f64, max: u32, more_m: f64) -> Self {
        let scale = doubling_scale(unit_m, max, more_m);
        let begin = |level: u32| {
            let min = f64::from((1u32 << level) >> 1);
            // Rounding may be off by one on either side.
            let about = ((unit_m * min).powi(2) * scale) as usize;
            let begins = |k: &usize| level == 0 || doublings(*k, scale, unit_m) >= min;
            (about.saturating_sub(1)..ENTRIES).find(begins).unwrap_or(ENTRIES)
        };
        Self { begins: (0..=max).map(begin).collect(), scale, entries: ENTRIES }
    }

    /// Levels begin later where they break the condition.
    fn repaired(mut self, diagonal_m: f64) -> Self {
        for level in 1..self.begins.len() {
            let min_m = self.min_m(level as u32, diagonal_m);
            if !self.begins_at(level as u32, min_m) {
                let min = (min_m * min_m * self.scale).ceil().min(self.entries as f64) as usize;
                self.begins[level] = self.begins[level].max(min);
            }
        }
        self
    }

    /// Distance at which a level begins, metres; infinite if it does not.
    fn distance_m(&self, level: u32) -> f64 {
        match self.begins[level as usize] {
            0 => 0.0,
            entry if entry < self.entries => (entry as f64 / self.scale).sqrt(),
            _ => f64::INFINITY,
        }
    }

    /// Where a level must not begin before, metres: one diagonal of a square of the one before it further than that
    /// begins, so that squares touching the last ones split at it are split too.
    fn min_m(&self, level: u32, diagonal_m: f64) -> f64 {
        // Nothing is split where the level before holds everywhere.
        let is_needed = level > 1 && self.begins[level as usize - 1] > 0;
        if is_needed { self.distance_m(level - 1) + diagonal_m * f64::from(1u32 << (level - 1)) } else { 0.0 }
    }

    /// Whether a level begins at a distance or beyond it, but for rounding.
    fn begins_at(&self, level: u32, min_m: f64) -> bool {
        self.distance_m(level) >= min_m * (1.0 - 1e-12)
    }
}

/// Entries per square metre of a table that reaches as far as it must: a power of four.
fn doubling_scale(unit_m: f64, max: u32, more_m: f64) -> f64 {
    let reach_m = unit_m * f64::from(1u32 << max.saturating_sub(1)) + more_m;
    0.25f64.powf((reach_m / ((ENTRIES - 1) as f64).sqrt()).log2().ceil())
}

/// Distance of an entry in units.
fn doublings(entry: usize, scale: f64, unit_m: f64) -> f64 {
    (entry as f64 / scale).sqrt() / unit_m
}

/// A table over a field, seen from somewhere: entries are compared with those at which levels begin, which is the
/// same as looking them up, and no table is needed in a frame.
#[derive(Clone, Debug)]
pub struct Radial {
    spacing: [f64; 2],
    /// The eye over the lattice, samples.
    eye: [f64; 2],
    /// Squared height of the eye above the land under it, metres².
    above_m2: f64,
    /// Entries per square metre.
    scale: f64,
    /// By level: the entry at which it begins.
    begins: Vec<f64>,
    /// By level: the distance from which on it is allowed, metres; empty if vertices do not blend.
    begins_m: Vec<f64>,
}

impl Radial {
    /// Triangles whose short sides are about `edge_px` pixels long on the screen, up to level `max`; the table is
    /// repaired if it must be. Vertices of levels below `max` go over into the next level as `blend` says.
    pub fn uniform(field: &Field, view: &View, edge_px: f64, max: u32, blend: Blend) -> Self {
        let [dx, dz] = field.spacing;
        let sample_px = view.focal_px() * dx.max(dz);
        let steps = match view.lens {
            Lens::Perspective { .. } => {
                Steps::doubling(2.0 * sample_px / edge_px, max, dx.hypot(dz) * f64::from(2u32 << max))
            }
            // The same level everywhere.
            Lens::Orthographic { .. } => {
                let level = (0..max).take_while(|&l| sample_px * f64::from(2u32 << l) <= edge_px).count() as u8;
                Steps::of(&Table::new(vec![level], 0.0), max)
            }
        };
        // A vertex that slides is in a square of the next level, as are the ends between which it does. That square begins
        // before the next level does, so the ends are at most its diagonal further away, and the half of the next level in
        // which they stand is as deep.
        let diagonals = if matches!(blend, Blend::End(_)) { 2.0 } else { 1.0 };
        let radial = Self::of(field, view, &steps.repaired(diagonals * dx.hypot(dz)));
        if blend == Blend::Off { radial } else { radial.blending(max) }
    }

    /// A table up to level `max` that keeps its condition, seen from the view's eye.
    pub fn new(field: &Field, view: &View, table: &Table, max: u32) -> Self {
        Self::of(field, view, &Steps::of(table, max))
    }

    fn of(field: &Field, view: &View, steps: &Steps) -> Self {
        let (eye, above_m) = (over(field, view), above_m(field, view));
        // The last entry holds for all greater distances: what does not begin up to there never does.
        let begin = |&entry: &usize| if entry < steps.entries { entry as f64 } else { f64::INFINITY };
        Self {
            spacing: field.spacing,
            eye,
            above_m2: above_m * above_m,
            scale: steps.scale,
            begins: steps.begins.iter().map(begin).collect(),
            begins_m: Vec::new(),
        }
    }

    fn blending(mut self, max: u32) -> Self {
        let distance_m = |begin: &f64| if *begin > 0.0 { (begin / self.scale).sqrt() } else { 0.0 };
        self.begins_m = self.begins[..=max as usize].iter().map(distance_m).collect();
        self
    }
}

/// The eye over the lattice, samples.
fn over(field: &Field, view: &View) -> [f64; 2] {
    [0, 1].map(|k| ([view.eye.x, view.eye.z][k] - field.origin[k]) / field.spacing[k])
}

/// How high the eye is above the land under it, metres.
pub fn above_m(field: &Field, view: &View) -> f64 {
    (view.eye.y - ground(field, over(field, view))).max(0.0)
}

/// Height of the land at a position, or at the nearest one of the field, metres: continuous, so that blending is.
fn ground(field: &Field, at: [f64; 2]) -> f64 {
    let size = field.size();
    let cell = [0, 1].map(|k| at[k].clamp(0.0, f64::from(size[k] - 2)) as u32);
    let [u, v] = [0, 1].map(|k| (at[k] - f64::from(cell[k])).clamp(0.0, 1.0));
    let height = |i: u32, j: u32| f64::from(field.height(cell[0] + i, cell[1] + j));
    let row = |j: u32| height(0, j) * (1.0 - u) + height(1, j) * u;
    row(0) * (1.0 - v) + row(1) * v
}

impl Levels for Radial {
    #[inline]
    fn is_split(&self, level: u32, at: [i32; 2]) -> bool {
        let away_m = |k: usize| {
            let (first, last) = (f64::from(at[k] << level), f64::from((at[k] + 1) << level));
            (first - self.eye[k]).max(self.eye[k] - last).max(0.0) * self.spacing[k]
        };
        let (x, z) = (away_m(0), away_m(1));
        (x * x + z * z + self.above_m2) * self.scale < self.begins[level as usize]
    }

    /// It begins half way from where the level begins to where the next one does, and ends there.
    fn weight(&self, level: u32, at: [i32; 2]) -> f32 {
        let Some(&[begin, end]) = self.begins_m.get(level as usize..).and_then(|levels| levels.first_chunk()) else {
            return 0.0;
        };
        let [x, z] = [0, 1].map(|k| (f64::from(at[k]) - self.eye[k]) * self.spacing[k]);
        let distance = (x * x + z * z + self.above_m2).sqrt();
        let start = (begin + end) / 2.0;
        if end.is_finite() && end > start { ((distance - start) / (end - start)).clamp(0.0, 1.0) as f32 } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn broken_tables_are_found_and_repaired_and_good_ones_stay() {
        let mut seed = 3u32;
        let mut random = |n: u32| {
            seed = seed.wrapping_mul(1664525).wrapping_add(1013904223);
            (seed >> 8) % n
        };
        let (mut broken, mut kept) = (0, 0);
        for round in 0..500 {
            let mut level = 0;
            let step = 1 + random(9000);
            let entry = |_| {
                level = (level + u8::from(random(step) == 0)).min(6);
                if round % 2 == 0 && random(5000) == 0 { random(7) as u8 } else { level }
            };
            let mut table = Table::new((0..20_000).map(entry).collect(), 1.0);
            let before = table.clone();
            match table.broken_at(0.05, 6) {
                Some(_) => broken += 1,
                None => kept += 1,
            }
            let was_broken = table.broken_at(0.05, 6).is_some();
            table.repair(0.05, 6);
            assert_eq!(table.broken_at(0.05, 6), None);
            assert!(was_broken || table == before, "a good table was changed");
            assert!(table.levels.iter().zip(&before.levels).all(|(new, old)| new <= old), "a level was raised");
        }
        assert!(broken > 50 && kept > 50, "{broken} broken, {kept} kept");
    }

    /// What is compared is what a table would say, at every entry and between them.
    #[test]
    fn comparing_is_looking_up() {
        let field = crate::height::synth::synth(crate::height::synth::Kind::Flat, [9, 9], 1);
        let view = View {
            eye: glam::DVec3::ZERO,
            world_from_eye: View::turned(0.0, 0.0, 0.0),
            lens: Lens::Perspective { fov_x: 1.0 },
            size: [100, 100],
            near: 1.0,
            tolerance: crate::view::Tolerance { px: 1.0, metric: crate::view::Metric::Certified },
            time_s: 0.0,
        };
        for (unit_m, max, more_m) in [(10.0, 5, 1.0), (3.7, 6, 40.0), (0.01, 4, 9.0), (1e5, 8, 700.0), (1.0, 1, 0.5)] {
            let mut table = Table::doubling(unit_m, max, more_m);
            let steps = Steps::doubling(unit_m, max, more_m);
            assert_eq!(steps, Steps::of(&table, max), "unit {unit_m} m");
            table.repair(0.3 * unit_m, max);
            let repaired = steps.repaired(0.3 * unit_m);
            assert_eq!(repaired, Steps::of(&table, max), "unit {unit_m} m");
            let radial = Radial::of(&field, &view, &repaired);
            for entry in 0..ENTRIES + 100 {
                let squared_m2 = (entry as f64 + 0.5) / table.scale;
                let is_split = |level: usize| squared_m2 * radial.scale < radial.begins[level];
                for level in 1..=max {
                    assert_eq!(is_split(level as usize), table.level(squared_m2) < level, "entry {entry}, {level}");
                }
            }
        }
    }

    #[test]
    fn doubling_levels_begin_at_doubled_distances() {
        let table = Table::doubling(10.0, 5, 1.0);
        for (distance, level) in [(0.0, 0), (9.0, 0), (11.5, 1), (22.0, 2), (79.0, 3), (81.0, 4), (161.0, 5), (1e9, 5)]
        {
            assert_eq!(table.level(distance * distance), level, "{distance} m");
        }
    }
}
