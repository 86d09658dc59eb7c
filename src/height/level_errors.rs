//! What holds for a whole level of a field, wherever a square of it lies: bounds for shapes that know of no square.

use rayon::prelude::*;

use super::Field;
use super::bounds::{Bounds, is_aligned};
use super::levels::{self, Patch};

/// The largest error, metres, of any square of each level ([`Bounds`]), those that the end of a tiled field cuts
/// included.
pub fn largest_errors(field: &Field, bounds: &Bounds) -> Vec<f32> {
    let of_level = |level: u32| {
        let (_, squares) = bounds.held(level);
        let whole = squares.iter().map(|square| square.error).fold(0.0, f32::max);
        if level == 0 { whole } else { whole.max(cut_error(field, bounds, level)) }
    };
    (0..bounds.levels()).map(of_level).collect()
}

/// The largest way, metres, that a vertex goes from the level below into each level: from its sample to the middle of
/// the edge of the level on which it lies. Vertices whose edge ends beyond the field do not go. 0 of level 0.
pub fn largest_ways(field: &Field, bounds: &Bounds) -> Vec<f32> {
    let of_level = |level: u32| if level == 0 { 0.0 } else { largest_way(field, bounds, level) };
    (0..bounds.levels()).map(of_level).collect()
}

fn largest_way(field: &Field, bounds: &Bounds, level: u32) -> f32 {
    let (period, last, half) = (bounds.period(), field.size().map(|n| n - 1), 1u32 << (level - 1));
    if !(0..2).all(|k| period[k].is_none_or(|n| n.is_multiple_of(4 * half))) {
        return levels::detail(field, [0, 0], field.stored().map(|n| n - 1), level);
    }
    let count = [0, 1].map(|k| last[k].min(period[k].unwrap_or(u32::MAX)) / half + 1);
    let row = |j: u32| (0..count[0]).filter_map(|i| bend(field, [i, j], half, last)).fold(0.0, f32::max);
    (0..count[1]).into_par_iter().map(row).reduce(|| 0.0, f32::max).next_up()
}

/// How far a vertex of the level with a vertex on every `half`-th sample is from the edge of the next level; `None` if
/// that level has it, or not the whole edge.
fn bend(field: &Field, vertex: [u32; 2], half: u32, last: [u32; 2]) -> Option<f32> {
    let [odd_x, odd_z] = vertex.map(|n| n & 1);
    let (dx, mut dz) = (odd_x as i32, odd_z as i32);
    if dx & dz == 1 && (vertex[0] / 2 + vertex[1] / 2) & 1 == 1 {
        dz = -dz;
    }
    let height = |sign: i32| {
        let at = [vertex[0] as i32 + sign * dx, vertex[1] as i32 + sign * dz].map(|n| n as u32 * half);
        (at[0] <= last[0] && at[1] <= last[1]).then(|| field.height(at[0], at[1]))
    };
    if (dx, dz) == (0, 0) {
        return None;
    }
    let (ends, middle) = (height(-1)? / 2.0 + height(1)? / 2.0, height(0)?);
    Some((middle - ends).abs())
}

/// The largest error of the cells of a level that the end of a tiled axis cuts, their sides on or off the next level.
fn cut_error(field: &Field, bounds: &Bounds, level: u32) -> f32 {
    let (period, last, pair) = (bounds.period(), field.size().map(|n| n - 1), 2u32 << level);
    let of_axis = |axis: usize| {
        if period[axis].is_none() || last[axis].is_multiple_of(pair) {
            return 0.0;
        }
        let (across, side) = (1 - axis, bounds.side(level));
        if let Some(length) = period[across]
            && !is_aligned(length, level, side)
        {
            // They lie anywhere: no more than all samples are apart.
            let [low, high] = bounds.square(bounds.levels() - 1, [0, 0]).range;
            return high - low;
        }
        let once = period[across].unwrap_or(u32::MAX);
        let starts = (0..last[across].min(once)).step_by(side as usize).chain([last[across] / pair * pair]);
        let patch = |start: u32| {
            let (mut first, mut cells) = ([last[axis] / pair * pair; 2], [2; 2]);
            (first[across], cells[across]) = (start, side.min(once) >> level);
            let patch = Patch { field, first, cells, level, last };
            patch.deviation().max(patch.stitched_deviation(1))
        };
        starts.map(patch).fold(0.0, f32::max)
    };
    of_axis(0).max(of_axis(1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::height::bounds::Measure;
    use crate::height::progress::Progress;
    use crate::height::{Holes, Samples, synth};

    const MEASURE: Measure = Measure { cells: 8, growth: 1.0, errors: true, morph: false };

    fn bounds(field: &Field) -> Bounds {
        Bounds::new(field, MEASURE, &Progress::default())
    }

    /// The same land with every sample of every tile held.
    fn held(field: &Field) -> Field {
        let [w, h] = field.size();
        let heights = (0..w * h).map(|k| field.height(k % w, k / w)).collect();
        Field::new(Samples::F32(heights), [w, h], field.spacing, Holes::none(0))
    }

    #[test]
    fn of_a_tiled_field_they_hold_for_the_same_land_without_tiles() {
        for (size, tiles) in [([64, 32], [3, 5]), ([41, 64], [3, 2]), ([128, 128], [2, 2]), ([30, 43], [3, 3])] {
            let tiled = synth::synth(synth::Kind::Fractal, size, 3).tiled(tiles);
            let of = |field: &Field| (largest_errors(field, &bounds(field)), largest_ways(field, &bounds(field)));
            let ((errors, ways), (exact_errors, exact_ways)) = (of(&tiled), of(&held(&tiled)));
            for level in 1..errors.len() {
                let what = format!("{size:?} {tiles:?} level {level}");
                assert!(errors[level] >= exact_errors[level] * (1.0 - 1e-6), "{what}: {errors:?} {exact_errors:?}");
                assert!(ways[level] >= exact_ways[level] * (1.0 - 1e-6), "{what}: {ways:?} {exact_ways:?}");
            }
        }
    }

    #[test]
    fn no_vertex_goes_further_than_its_levels_error_where_there_are_no_holes() {
        let field = synth::synth(synth::Kind::Eroded, [129, 97], 5);
        let bounds = bounds(&field);
        let (errors, ways) = (largest_errors(&field, &bounds), largest_ways(&field, &bounds));
        for level in 1..errors.len() {
            assert!(ways[level] > 0.0 && ways[level] <= errors[level] * (1.0 + 1e-5), "{level}: {ways:?} {errors:?}");
        }
    }
}
