//! Bounds that hold for a whole level of a field, for techniques whose shapes are not squares of the quadtree.

use rayon::prelude::*;

use super::bounds::Bounds;
use super::field::Field;
use super::levels;

/// Returns the largest error, metres, of any square of each level, cut ones at the end of a tiled field included.
pub fn largest_errors(bounds: &Bounds) -> Vec<f32> {
    let [low, high] = bounds.square(bounds.levels() - 1, [0, 0]).range;
    let of_level = |level: u32| {
        let (_, squares) = bounds.held(level);
        squares.iter().map(|square| square.error).fold(bounds.cut(level).min(high - low), f32::max)
    };
    (0..bounds.levels()).map(of_level).collect()
}

/// Returns the largest distance, metres, by which a vertex moves when the level below morphs into each level.
///
/// A vertex moves from its sample to the middle of the coarser edge on which it lies. Vertices whose edge ends beyond
/// the field stay. The distance is 0 for level 0.
pub fn largest_displacements(field: &Field, bounds: &Bounds) -> Vec<f32> {
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

/// Returns the distance, metres, of a vertex of the level with a vertex on every `half`-th sample from the edge of the
/// next level; `None` if that level has the vertex, or not the whole edge.
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

    /// Returns the same terrain with every sample of every tile in memory.
    fn held(field: &Field) -> Field {
        let [w, h] = field.size();
        let heights = (0..w * h).map(|k| field.height(k % w, k / w)).collect();
        Field::new(Samples::F32(heights), [w, h], field.spacing, Holes::none(0))
    }

    #[test]
    fn of_a_tiled_field_they_hold_for_the_same_terrain_without_tiles() {
        for (size, tiles) in [([64, 32], [3, 5]), ([41, 64], [3, 2]), ([128, 128], [2, 2]), ([30, 43], [3, 3])] {
            let tiled = synth::synth(synth::Kind::Fractal, size, 3).tiled(tiles);
            let of = |field: &Field| (largest_errors(&bounds(field)), largest_displacements(field, &bounds(field)));
            let ((errors, displacements), (exact_errors, exact_displacements)) = (of(&tiled), of(&held(&tiled)));
            for level in 1..errors.len() {
                let what = format!("{size:?} {tiles:?} level {level}");
                assert!(errors[level] >= exact_errors[level] * (1.0 - 1e-6), "{what}: {errors:?} {exact_errors:?}");
                assert!(
                    displacements[level] >= exact_displacements[level] * (1.0 - 1e-6),
                    "{what}: {displacements:?} {exact_displacements:?}"
                );
            }
        }
    }

    #[test]
    fn no_vertex_goes_further_than_its_levels_error_where_there_are_no_holes() {
        let field = synth::synth(synth::Kind::Eroded, [129, 97], 5);
        let bounds = bounds(&field);
        let (errors, displacements) = (largest_errors(&bounds), largest_displacements(&field, &bounds));
        for level in 1..errors.len() {
            assert!(
                displacements[level] > 0.0 && displacements[level] <= errors[level] * (1.0 + 1e-5),
                "{level}: {displacements:?} {errors:?}"
            );
        }
    }
}
