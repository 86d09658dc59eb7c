//! Parts of a frame put together, one after the other, on all cores: copied once, into memory that nobody wrote before.

use rayon::prelude::*;

/// The fewest items for which another core is asked.
const LEAST: usize = 1 << 13;

/// Where parts of these lengths begin when they follow each other; and last, where all of them end.
fn starts(lengths: impl Iterator<Item = usize>) -> Vec<usize> {
    let mut end = 0;
    let ends = lengths.map(|length| {
        end += length;
        end
    });
    std::iter::once(0).chain(ends).collect()
}

/// All items of `parts` in order.
pub fn join<T: Copy + Send + Sync>(parts: &[&[T]], into: &mut Vec<T>) {
    let starts = starts(parts.iter().map(|part| part.len()));
    let item = |at: &mut usize, k: usize| {
        if !(starts[*at]..starts[*at + 1]).contains(&k) {
            *at = starts.partition_point(|&start| start <= k) - 1;
        }
        parts[*at][k - starts[*at]]
    };
    (0..starts[parts.len()]).into_par_iter().with_min_len(LEAST).map_init(|| 0, item).collect_into_vec(into);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_follow_each_other() {
        for lengths in [&[][..], &[0], &[3, 0, 2], &[0, 0, 40_000, 1, 30_000, 0]] {
            let parts: Vec<Vec<usize>> = lengths.iter().map(|&n| (n..2 * n).collect()).collect();
            let slices: Vec<&[usize]> = parts.iter().map(Vec::as_slice).collect();
            let mut joined = vec![1; 5];
            join(&slices, &mut joined);
            assert_eq!(joined, parts.concat());
        }
    }
}
