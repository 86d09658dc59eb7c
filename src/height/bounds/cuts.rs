//! Errors of the cells that the end of a tiled field cuts. Such cells equal none of the repeating ones.

use super::measure::{Measure, ROUNDING, is_aligned};
use crate::height::field::Field;
use crate::height::levels::Patch;

/// Returns the largest error, metres, of the cut cells of each level, from level 0 on.
///
/// Errors are those of [`Bounds`](super::Bounds). They are infinite where cells may lie anywhere in the period,
/// or are as long as it; their height range then bounds the error. `highest` is the largest absolute height, metres.
pub fn errors(field: &Field, measure: Measure, levels: u32, highest: f32) -> Vec<f32> {
    let mut errors: Vec<f32> = vec![0.0];
    for level in 1..levels {
        let own =
            [0, 1].map(|axis| Cut { field, measure, highest, level, axis }.error()).into_iter().fold(0.0, f32::max);
        errors.push(own.max(errors[level as usize - 1] * measure.growth));
    }
    errors
}

/// The cells of a level that the last sample along an axis cuts.
struct Cut<'a> {
    field: &'a Field,
    measure: Measure,
    highest: f32,
    level: u32,
    axis: usize,
}

impl Cut<'_> {
    fn error(&self) -> f32 {
        let (size, stored, pair) = (self.field.size(), self.field.stored(), 2u32 << self.level);
        let period = [0, 1].map(|k| (size[k] > stored[k]).then_some(stored[k]));
        let (last, side, across) = (size.map(|n| n - 1), self.measure.cells << self.level, 1 - self.axis);
        let Some(length) = period[self.axis] else { return 0.0 };
        if last[self.axis].is_multiple_of(pair) {
            return 0.0;
        }
        if pair > length || period[across].is_some_and(|n| !is_aligned(n, self.level, side)) {
            return f32::INFINITY;
        }
        let once = period[across].unwrap_or(u32::MAX);
        // Square by square along the end, and where both axes end.
        let starts = (0..last[across].min(once)).step_by(side as usize).chain([last[across] / pair * pair]);
        starts.map(|start| self.error_at(start, side.min(once), last)).fold(0.0, f32::max)
    }

    /// The error of the cells beside a square from `start` on.
    fn error_at(&self, start: u32, length: u32, last: [u32; 2]) -> f32 {
        let (pair, across) = (2u32 << self.level, 1 - self.axis);
        let mut first = [last[self.axis] / pair * pair; 2];
        first[across] = start;
        let patch = |level: u32| {
            let mut cells = [pair >> level; 2];
            cells[across] = length >> level;
            Patch { field: self.field, first, cells, level, last }
        };
        let own = patch(self.level).deviation().max(patch(self.level).stitched_deviation(1));
        if !self.measure.morph {
            return own;
        }
        own.max(patch(self.level - 1).stitched_deviation(2)) + self.highest * ROUNDING
    }
}
