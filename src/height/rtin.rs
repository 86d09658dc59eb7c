//! The right-triangle pattern of every surface over the lattice. Cell diagonals alternate with the parity of i + j. Every
//! odd vertex of a level thus lies on an edge of the next coarser level, and a quarter turn maps the pattern onto itself.

/// Returns the two triangles of cell `(i, j)`, counter-clockwise from above, as vertex positions.
pub fn cell(i: i32, j: i32) -> [[[i32; 2]; 3]; 2] {
    let [a, b, c, d] = [[i, j], [i + 1, j], [i, j + 1], [i + 1, j + 1]];
    if (i + j) & 1 == 0 { [[a, c, d], [a, d, b]] } else { [[a, c, b], [b, c, d]] }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn set(triangles: impl Iterator<Item = [[i32; 2]; 3]>) -> BTreeSet<Vec<[i32; 2]>> {
        triangles
            .map(|mut t| {
                t.sort();
                t.to_vec()
            })
            .collect()
    }

    #[test]
    fn a_quarter_turn_maps_the_pattern_onto_itself() {
        let all = || (0..6).flat_map(|j| (0..6).flat_map(move |i| cell(i, j)));
        let turned = all().map(|t| t.map(|[x, z]| [6 - z, x]));
        assert_eq!(set(all()), set(turned));
    }

    #[test]
    fn odd_vertices_lie_on_edges_of_the_coarser_level() {
        let coarse: Vec<_> = (0..4).flat_map(|j| (0..4).flat_map(move |i| cell(i, j))).collect();
        for z in 0..=8 {
            for x in (0..=8).filter(|x| x % 2 == 1 || z % 2 == 1) {
                let on_edge = coarse.iter().any(|t| {
                    (0..3).any(|k| {
                        let (p, q) = (t[k], t[(k + 1) % 3]);
                        (p[0] + q[0], p[1] + q[1]) == (x, z)
                    })
                });
                assert!(on_edge, "({x}, {z}) is no midpoint of an edge");
            }
        }
    }
}
