//! The published level function: a table indexed by the squared distance from the eye (Finch & Bishop, §4.5).
//!
//! LOD = LUT[distance² · scale]
//!
//! The distance combines the distance in plan from the eye to the nearest point of a square with the eye's height above
//! the terrain below it. Levels must rise with the distance, and none may begin within reach of squares that touch one
//! two levels finer (a Lipschitz condition). Levels that violate it are moved to greater distances. A table is stored
//! as the entry at which each level begins.

use super::blend::Blend;
use super::splits::Levels;
use crate::height::Field;
use crate::view::{Lens, View};

/// Number of entries of a table.
const ENTRIES: usize = 1 << 14;

/// A table, as the entry at which each level begins. The last entry holds for all greater distances.
#[derive(Clone, Debug, PartialEq)]
struct Steps {
    /// First entry of each level; the number of entries if it does not begin.
    begins: Vec<usize>,
    /// Entries per square metre.
    scale: f64,
    entries: usize,
}

impl Steps {
    /// Creates a table of one entry: the same level everywhere. The maximum is `max`.
    fn constant(level: u32, max: u32) -> Self {
        Self { begins: (0..=max).map(|l| usize::from(l > level)).collect(), scale: 0.0, entries: 1 }
    }

    /// Creates levels that rise by one with each doubling of the distance, for triangles of constant size on the
    /// screen. Level 1 begins at `unit_m` metres; the maximum is `max`. The table extends further by `more_m` metres,
    /// for repairs. Scales are powers of four, so a smaller unit never gives a finer level.
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

    /// Moves the beginnings of levels that violate the condition to greater distances.
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

    /// Returns the distance at which a level begins, metres; infinite if it does not.
    fn distance_m(&self, level: u32) -> f64 {
        match self.begins[level as usize] {
            0 => 0.0,
            entry if entry < self.entries => (entry as f64 / self.scale).sqrt(),
            _ => f64::INFINITY,
        }
    }

    /// Returns the minimum distance at which a level may begin, metres. It is one diagonal of a square of the level
    /// before beyond that level's beginning, which also splits squares that touch its last split ones.
    fn min_m(&self, level: u32, diagonal_m: f64) -> f64 {
        // No square is split if the level before holds everywhere.
        let is_needed = level > 1 && self.begins[level as usize - 1] > 0;
        if is_needed { self.distance_m(level - 1) + diagonal_m * f64::from(1u32 << (level - 1)) } else { 0.0 }
    }

    /// Returns true if a level begins at or beyond a distance, up to rounding.
    fn begins_at(&self, level: u32, min_m: f64) -> bool {
        self.distance_m(level) >= min_m * (1.0 - 1e-12)
    }
}

/// Returns the entries per square metre of a table that covers the required distance: a power of four.
fn doubling_scale(unit_m: f64, max: u32, more_m: f64) -> f64 {
    let reach_m = unit_m * f64::from(1u32 << max.saturating_sub(1)) + more_m;
    0.25f64.powf((reach_m / ((ENTRIES - 1) as f64).sqrt()).log2().ceil())
}

/// Returns the distance of an entry, in units.
fn doublings(entry: usize, scale: f64, unit_m: f64) -> f64 {
    (entry as f64 / scale).sqrt() / unit_m
}

/// A table applied to a field from one viewpoint. Squared distances are compared with the entries at which levels
/// begin, which is equivalent to a lookup and needs no table per frame.
#[derive(Clone, Debug)]
pub struct Radial {
    spacing: [f64; 2],
    /// Eye over the lattice, samples.
    eye: [f64; 2],
    /// Squared height of the eye above the terrain below it, metres².
    height_m2: f64,
    /// Entries per square metre.
    scale: f64,
    /// Entry at which each level begins.
    begins: Vec<f64>,
    /// Distance at which each level begins, metres; empty if vertices do not morph.
    begins_m: Vec<f64>,
}

impl Radial {
    /// Creates levels for triangles whose short sides are about `edge_px` pixels long on the screen, up to level `max`,
    /// repaired if necessary. Vertices of levels below `max` morph to the next level as `blend` says.
    pub fn uniform(field: &Field, view: &View, edge_px: f64, max: u32, blend: Blend) -> Self {
        let [dx, dz] = field.spacing;
        let sample_px = view.focal_px() * dx.max(dz);
        let steps = match view.lens {
            Lens::Perspective { .. } => {
                Steps::doubling(2.0 * sample_px / edge_px, max, dx.hypot(dz) * f64::from(2u32 << max))
            }
            // Parallel projection has the same level everywhere.
            Lens::Orthographic { .. } => {
                let level = (0..max).take_while(|&l| sample_px * f64::from(2u32 << l) <= edge_px).count() as u32;
                Steps::constant(level, max)
            }
        };
        // A sliding vertex and the ends of its edge lie in a square of the next level. That square begins before the
        // next level does, so the ends are at most its diagonal further away. The half of the next level in which they
        // are fixed is as deep.
        let diagonals = if matches!(blend, Blend::End(_)) { 2.0 } else { 1.0 };
        let radial = Self::of(field, view, &steps.repaired(diagonals * dx.hypot(dz)));
        if blend == Blend::Off { radial } else { radial.blending(max) }
    }

    fn of(field: &Field, view: &View, steps: &Steps) -> Self {
        let (eye, height_m) = (eye_over_lattice(field, view), eye_height_m(field, view));
        // The last entry holds for all greater distances, so a level that has not begun there never does.
        let begin = |&entry: &usize| if entry < steps.entries { entry as f64 } else { f64::INFINITY };
        Self {
            spacing: field.spacing,
            eye,
            height_m2: height_m * height_m,
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

/// Returns the eye over the lattice, samples.
fn eye_over_lattice(field: &Field, view: &View) -> [f64; 2] {
    [0, 1].map(|k| ([view.eye.x, view.eye.z][k] - field.origin[k]) / field.spacing[k])
}

/// Returns the height of the eye above the terrain below it, metres.
pub fn eye_height_m(field: &Field, view: &View) -> f64 {
    (view.eye.y - ground(field, eye_over_lattice(field, view))).max(0.0)
}

/// Returns the height of the terrain at a position, or at the nearest one of the field, metres. Continuous, so that
/// morphs are.
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
        (x * x + z * z + self.height_m2) * self.scale < self.begins[level as usize]
    }

    /// The morph begins half way between the beginnings of the level and of the next one, and ends at the latter.
    fn weight(&self, level: u32, at: [i32; 2]) -> f32 {
        let Some(&[begin, end]) = self.begins_m.get(level as usize..).and_then(|levels| levels.first_chunk()) else {
            return 0.0;
        };
        let [x, z] = [0, 1].map(|k| (f64::from(at[k]) - self.eye[k]) * self.spacing[k]);
        let distance = (x * x + z * z + self.height_m2).sqrt();
        let start = (begin + end) / 2.0;
        if end.is_finite() && end > start { ((distance - start) / (end - start)).clamp(0.0, 1.0) as f32 } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The published table: a level for each entry.
    #[derive(Clone, PartialEq)]
    struct Table {
        levels: Vec<u8>,
        /// Entries per square metre.
        scale: f64,
    }

    impl Table {
        /// The table of [`Steps::doubling`].
        fn doubling(unit_m: f64, max: u32, more_m: f64) -> Self {
            let scale = doubling_scale(unit_m, max, more_m);
            let level = |k: usize| {
                let distance = doublings(k, scale, unit_m);
                (0..max).take_while(|&l| distance >= f64::from(1u32 << l)).count() as u8
            };
            Self { levels: (0..ENTRIES).map(level).collect(), scale }
        }

        /// Returns the level at a squared distance, metres².
        fn level(&self, squared_m2: f64) -> u32 {
            u32::from(self.levels[((squared_m2 * self.scale) as usize).min(self.levels.len() - 1)])
        }

        /// Returns the entries from which on every level is at least this one, up to `max`.
        fn steps(&self, max: u32) -> Steps {
            let begin = |level: u32| self.levels.iter().rposition(|&l| u32::from(l) < level).map_or(0, |k| k + 1);
            Steps { begins: (0..=max).map(begin).collect(), scale: self.scale, entries: self.levels.len() }
        }

        /// Returns the first level, from 1 to `max`, that violates the Lipschitz condition for cells of this diagonal
        /// (metres); `None` if there is none.
        fn first_violation(&self, diagonal_m: f64, max: u32) -> Option<u32> {
            let falls = self.levels.windows(2).find(|pair| pair[1] < pair[0]).map(|pair| u32::from(pair[0]));
            let steps = self.steps(max);
            falls.or_else(|| (2..=max).find(|&level| !steps.begins_at(level, steps.min_m(level, diagonal_m))))
        }

        /// Lowers levels to those of the repaired steps.
        fn repair(&mut self, diagonal_m: f64, max: u32) {
            let begins = self.steps(max).repaired(diagonal_m).begins;
            for (k, level) in self.levels.iter_mut().enumerate() {
                *level = begins.iter().rposition(|&begin| begin <= k).unwrap_or(0) as u8;
            }
        }
    }

    #[test]
    fn invalid_tables_are_repaired_and_valid_ones_kept() {
        let mut seed = 3u32;
        let mut random = |n: u32| {
            seed = seed.wrapping_mul(1664525).wrapping_add(1013904223);
            (seed >> 8) % n
        };
        let (mut invalid, mut valid) = (0, 0);
        for round in 0..500 {
            let mut level = 0;
            let step = 1 + random(9000);
            let entry = |_| {
                level = (level + u8::from(random(step) == 0)).min(6);
                if round % 2 == 0 && random(5000) == 0 { random(7) as u8 } else { level }
            };
            let mut table = Table { levels: (0..20_000).map(entry).collect(), scale: 1.0 };
            let before = table.clone();
            match table.first_violation(0.05, 6) {
                Some(_) => invalid += 1,
                None => valid += 1,
            }
            let was_invalid = table.first_violation(0.05, 6).is_some();
            table.repair(0.05, 6);
            assert_eq!(table.first_violation(0.05, 6), None);
            assert!(was_invalid || table == before, "a valid table was changed");
            assert!(table.levels.iter().zip(&before.levels).all(|(new, old)| new <= old), "a level was raised");
        }
        assert!(invalid > 50 && valid > 50, "{invalid} invalid, {valid} valid");
    }

    #[test]
    fn a_constant_table_has_one_level() {
        for level in 0..=4 {
            let table = Table { levels: vec![level as u8], scale: 0.0 };
            assert_eq!(Steps::constant(level, 4), table.steps(4));
        }
    }

    /// Compares the steps with a table at every entry and between entries.
    #[test]
    fn steps_match_table_lookups() {
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
            assert_eq!(steps, table.steps(max), "unit {unit_m} m");
            table.repair(0.3 * unit_m, max);
            let repaired = steps.repaired(0.3 * unit_m);
            assert_eq!(repaired, table.steps(max), "unit {unit_m} m");
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
