//! A frame's triangles as a list of threes, or as strips that end where the next triangle in the order of sight does not
//! share the right side.

use rayon::prelude::*;

use crate::draw::{Draw, DrawList, RESTART, Topology};

/// The words of the setting.
pub const WORDS: &[&str] = &["list", "strip"];

/// What a word of the setting says.
pub fn of(word: &str) -> Topology {
    if word == "strip" { Topology::Strip } else { Topology::Triangles }
}

/// Indices that so many indices of a list become at most: three a triangle, and two ends.
pub fn max_indices(topology: Topology, list: usize) -> usize {
    if topology == Topology::Strip { list / 3 * 5 } else { list }
}

/// Makes strips of a list's streamed triangles, the same ones in the same order, if that is the topology.
pub fn arrange(topology: Topology, list: &mut DrawList) {
    if topology != Topology::Strip {
        return;
    }
    let indices = &list.streamed.indices;
    let strips_of = |draw: &Draw| strips(indices[draw.indices.start as usize..draw.indices.end as usize].as_chunks().0);
    let strips: Vec<Vec<u32>> = list.draws.par_iter().map(strips_of).collect();
    let mut first = 0;
    for (draw, strips) in list.draws.iter_mut().zip(&strips) {
        draw.indices = first..first + strips.len() as u32;
        draw.topology = Topology::Strip;
        first = draw.indices.end;
    }
    list.streamed.indices.clear();
    strips.iter().for_each(|strips| list.streamed.indices.extend_from_slice(strips));
}

fn strips(triangles: &[[u32; 3]]) -> Vec<u32> {
    let mut strips: Vec<u32> = Vec::with_capacity(3 * triangles.len());
    for (k, triangle) in triangles.iter().enumerate() {
        if let Some(corner) = next_corner(&strips, triangle) {
            strips.push(corner);
            continue;
        }
        if !strips.is_empty() {
            strips.extend_from_slice(&[RESTART, RESTART][strips.len() % 2..]);
        }
        strips.extend(begun(triangle, triangles.get(k + 1)));
    }
    strips
}

/// The third corner of a triangle that goes on with the last strip.
fn next_corner(strips: &[u32], triangle: &[u32; 3]) -> Option<u32> {
    let &[.., first, second] = strips else { return None };
    // Strips begin at even places, and every other triangle has its first two corners the other way round.
    let side = if strips.len().is_multiple_of(2) { [first, second] } else { [second, first] };
    opposite(triangle, side)
}

/// The corner of a triangle that is not on a directed side of it.
fn opposite(triangle: &[u32; 3], side: [u32; 2]) -> Option<u32> {
    (0..3).find(|&k| [triangle[k], triangle[(k + 1) % 3]] == side).map(|k| triangle[(k + 2) % 3])
}

/// A triangle turned so that the next one can follow in a strip, if that is possible.
fn begun(triangle: &[u32; 3], next: Option<&[u32; 3]>) -> [u32; 3] {
    let turned = |by: usize| [0, 1, 2].map(|k| triangle[(k + by) % 3]);
    let goes_on = |&by: &usize| next.is_some_and(|next| opposite(next, [turned(by)[2], turned(by)[1]]).is_some());
    turned((0..3).find(goes_on).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Triangles of strips as the device makes them: counted from the beginning of each strip.
    fn triangles(strips: &[u32]) -> Vec<[u32; 3]> {
        let of_strip = |strip: &[u32]| -> Vec<[u32; 3]> {
            let ordered = |(k, t): (usize, &[u32])| if k % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] };
            strip.windows(3).enumerate().map(ordered).collect()
        };
        strips.split(|&k| k == RESTART).flat_map(of_strip).collect()
    }

    fn from_lowest(t: [u32; 3]) -> [u32; 3] {
        let by = (0..3).min_by_key(|&k| t[k]).unwrap_or(0);
        [0, 1, 2].map(|k| t[(k + by) % 3])
    }

    fn same(list: &[[u32; 3]]) -> Vec<u32> {
        let strips = strips(list);
        let made: Vec<_> = triangles(&strips).into_iter().map(from_lowest).collect();
        assert_eq!(made, list.iter().copied().map(from_lowest).collect::<Vec<_>>());
        assert!(strips.len() <= max_indices(Topology::Strip, 3 * list.len()));
        for (k, _) in strips.windows(2).enumerate().filter(|(_, pair)| pair[0] == RESTART && pair[1] != RESTART) {
            assert_eq!(k % 2, 1, "a strip begins at an even place");
        }
        strips
    }

    #[test]
    fn a_row_of_quads_is_one_strip() {
        let quad = |k: u32| [[2 * k, 2 * k + 1, 2 * k + 2], [2 * k + 1, 2 * k + 3, 2 * k + 2]];
        let list: Vec<_> = (0..20).flat_map(quad).collect();
        assert_eq!(same(&list), (0..42).collect::<Vec<_>>());
    }

    #[test]
    fn any_triangles_stay_what_they_are_and_where() {
        let mut dice = fastrand::Rng::with_seed(3);
        for round in 0..2000 {
            let corners = 4 + round % 9;
            let triangle = |dice: &mut fastrand::Rng| {
                let mut all: Vec<u32> = (0..corners).collect();
                dice.shuffle(&mut all);
                [all[0], all[1], all[2]]
            };
            let list: Vec<_> = (0..dice.usize(0..30)).map(|_| triangle(&mut dice)).collect();
            same(&list);
        }
    }
}
