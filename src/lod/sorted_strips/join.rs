//! Streams of rows put together, one after the other, on all cores: copied once, into memory that nobody wrote before.

use rayon::prelude::*;

/// The fewest items for which another core is asked.
const LEAST: usize = 1 << 13;

/// Where parts of these lengths begin when they follow each other; and last, where all of them end.
pub fn starts(lengths: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut end = 0;
    let ends = lengths.map(|length| {
        end += length;
        end
    });
    std::iter::once(0).chain(ends).collect()
}

/// All items of `parts` in order; `place` is told which part an item is of.
pub fn join<T: Copy + Send + Sync>(parts: &[&[T]], into: &mut Vec<T>, place: impl Fn(usize, T) -> T + Sync) {
    let starts = starts(parts.iter().map(|part| part.len()));
    let item = |at: &mut usize, k: usize| {
        if !(starts[*at]..starts[*at + 1]).contains(&k) {
            *at = starts.partition_point(|&start| start <= k) - 1;
        }
        place(*at, parts[*at][k - starts[*at]])
    };
    (0..starts[parts.len()]).into_par_iter().with_min_len(LEAST).map_init(|| 0, item).collect_into_vec(into);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_follow_each_other_and_are_told_which_they_are() {
        for lengths in [&[][..], &[0], &[3, 0, 2], &[0, 0, 40_000, 1, 30_000, 0]] {
            let parts: Vec<Vec<usize>> = lengths.iter().map(|&n| (0..n).collect()).collect();
            let slices: Vec<&[usize]> = parts.iter().map(Vec::as_slice).collect();
            let expected: Vec<usize> =
                parts.iter().enumerate().flat_map(|(at, part)| part.iter().map(move |k| k + 7 * at)).collect();
            let mut joined = vec![1; 5];
            join(&slices, &mut joined, |at, k| k + 7 * at);
            assert_eq!(joined, expected);
        }
    }
}
