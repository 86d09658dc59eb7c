//! Arranges a frame's triangles as a list, or as strips that end where the next triangle in drawing order does not
//! share the required side.

use rayon::prelude::*;

use crate::draw::{Draw, DrawList, RESTART, Topology};

/// Words of the setting `topology`.
pub const WORDS: &[&str] = &["list", "strip"];

/// Returns the topology for a word of the setting.
pub fn of(word: &str) -> Topology {
    if word == "strip" { Topology::Strip } else { Topology::Triangles }
}

/// Returns the maximum number of indices that `list` indices of a triangle list become: per triangle, three and two
/// restarts.
pub fn max_indices(topology: Topology, list: usize) -> usize {
    if topology == Topology::Strip { list / 3 * 5 } else { list }
}

/// Converts a list's streamed triangles to strips with the same triangles in the same order, if that is the topology.
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
        strips.extend(first_triangle(triangle, triangles.get(k + 1)));
    }
    strips
}

/// Returns the third corner of a triangle that continues the last strip.
fn next_corner(strips: &[u32], triangle: &[u32; 3]) -> Option<u32> {
    let &[.., first, second] = strips else { return None };
    // Strips begin at even positions, and every other triangle has its first two corners exchanged.
    let side = if strips.len().is_multiple_of(2) { [first, second] } else { [second, first] };
    opposite(triangle, side)
}

/// Returns the corner of a triangle opposite to a directed side.
fn opposite(triangle: &[u32; 3], side: [u32; 2]) -> Option<u32> {
    (0..3).find(|&k| [triangle[k], triangle[(k + 1) % 3]] == side).map(|k| triangle[(k + 2) % 3])
}

/// Rotates a triangle so that the next one can continue the strip, if possible.
fn first_triangle(triangle: &[u32; 3], next: Option<&[u32; 3]>) -> [u32; 3] {
    let turned = |by: usize| [0, 1, 2].map(|k| triangle[(k + by) % 3]);
    let continues = |&by: &usize| next.is_some_and(|next| opposite(next, [turned(by)[2], turned(by)[1]]).is_some());
    turned((0..3).find(continues).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the triangles of strips as the device assembles them, counted from the beginning of each strip.
    fn triangles(strips: &[u32]) -> Vec<[u32; 3]> {
        let of_strip = |strip: &[u32]| -> Vec<[u32; 3]> {
            let ordered = |(k, t): (usize, &[u32])| if k % 2 == 0 { [t[0], t[1], t[2]] } else { [t[1], t[0], t[2]] };
            strip.windows(3).enumerate().map(ordered).collect()
        };
        strips.split(|&k| k == RESTART).flat_map(of_strip).collect()
    }

    fn rotated(t: [u32; 3]) -> [u32; 3] {
        let by = (0..3).min_by_key(|&k| t[k]).unwrap_or(0);
        [0, 1, 2].map(|k| t[(k + by) % 3])
    }

    fn check(list: &[[u32; 3]]) -> Vec<u32> {
        let strips = strips(list);
        let made: Vec<_> = triangles(&strips).into_iter().map(rotated).collect();
        assert_eq!(made, list.iter().copied().map(rotated).collect::<Vec<_>>());
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
        assert_eq!(check(&list), (0..42).collect::<Vec<_>>());
    }

    #[test]
    fn strips_keep_triangles_and_their_order() {
        let mut dice = fastrand::Rng::with_seed(3);
        for round in 0..2000 {
            let corners = 4 + round % 9;
            let triangle = |dice: &mut fastrand::Rng| {
                let mut all: Vec<u32> = (0..corners).collect();
                dice.shuffle(&mut all);
                [all[0], all[1], all[2]]
            };
            let list: Vec<_> = (0..dice.usize(0..30)).map(|_| triangle(&mut dice)).collect();
            check(&list);
        }
    }
}
