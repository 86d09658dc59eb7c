//! Sorts quads in the eye's own row and column of pages, where the walk does not lead away from the eye.
//!
//! Everywhere else rays run in the direction of the walk. Rays against it start in the eye's own column or row of
//! pages, and meet the quads there in reverse order of generation. The quads of a run are therefore sorted afterwards.
//! Each is a square of a quadtree, or a pair of squares separated from their siblings by one line. Of the two halves
//! beside such a line, the eye's half comes first for every ray. The sort key of a quad is its page, followed by its
//! sides of the two middle lines at each level: 0 on the eye's side.

/// Position of the eye in a run, and the directions in which rays run against the walk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Crossing {
    /// Origin of rays relative to the run's first corner along (u, v), samples.
    pub eye: [f64; 2],
    /// True if any ray over the run runs against the walk along (u, v).
    pub against: [bool; 2],
}

impl Crossing {
    /// Returns true if the walk's order is wrong for some ray.
    pub fn is_any(&self) -> bool {
        self.against != [false; 2]
    }

    /// Returns the sort key of a square, or of a pair that begins with it. `at` is its place in squares of `level` from
    /// the run's first corner; `page` is the level of pages. Quads already in order share one key.
    #[inline]
    fn key(&self, page: u32, level: u32, at: [i32; 2], is_pair: bool) -> u64 {
        let in_run = at[0] >> (page - level);
        // Rays along all strips run against the walk in the first page only.
        if !self.against[1] && in_run > 0 {
            return u64::MAX;
        }
        let step = |key: u64, finer: u32| {
            let far = |k: usize| {
                let half = at[k] >> (finer - level);
                let line = f64::from((half | 1) << finer);
                u64::from((half & 1 == 0) == (self.eye[k] >= line))
            };
            let across = if is_pair && finer == level { 0 } else { far(0) };
            key << 2 | far(1) << 1 | across
        };
        (level..page).rev().fold(in_run as u64, step) << (2 * level)
    }
}

/// Quads of a run in order of generation, each with its first index and its sort key.
#[derive(Default)]
pub struct DepthSorter {
    quads: Vec<Quad>,
    indices: Vec<u32>,
}

#[derive(Clone, Copy)]
struct Quad {
    key: u64,
    first: u32,
    end: u32,
}

impl DepthSorter {
    /// Begins a quad at index `first`: a square of a level at a place, counted from the run's first corner, or a pair
    /// of squares that begins with it. `page` is the level of pages.
    #[inline]
    pub fn begin(&mut self, crossing: &Crossing, page: u32, (level, at): (u32, [i32; 2]), is_pair: bool, first: usize) {
        let (key, first) = (crossing.key(page, level, at, is_pair), first as u32);
        match self.quads.last_mut() {
            Some(quad) if quad.key == key => return,
            Some(quad) => quad.end = first,
            None => {}
        }
        self.quads.push(Quad { key, first, end: first });
    }

    /// Sorts the quads' indices and clears the sorter. The last quad ends at the end of `indices`.
    pub fn finish(&mut self, indices: &mut [u32]) {
        let Some(&Quad { first, .. }) = self.quads.first() else { return };
        self.quads.last_mut().into_iter().for_each(|quad| quad.end = indices.len() as u32);
        self.quads.sort_by_key(|quad| quad.key);
        self.indices.clear();
        for quad in self.quads.drain(..) {
            self.indices.extend_from_slice(&indices[quad.first as usize..quad.end as usize]);
        }
        indices[first as usize..].copy_from_slice(&self.indices);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eye_half_comes_first() {
        let crossing = |eye| Crossing { eye, against: [true; 2] };
        let order = |eye: [f64; 2]| {
            let mut quads = [[0, 0], [1, 0], [0, 1], [1, 1]];
            quads.sort_by_key(|&at| crossing(eye).key(1, 0, at, false));
            quads
        };
        assert_eq!(order([1.5, 0.5]), [[1, 0], [0, 0], [1, 1], [0, 1]]);
        assert_eq!(order([0.5, 7.5]), [[0, 1], [1, 1], [0, 0], [1, 0]]);
        // A pair lies on both sides of the line across, and before the half in front.
        let keys =
            [([0, 0], true), ([0, 1], false), ([1, 1], false)].map(|(at, p)| crossing([1.5, 0.5]).key(1, 0, at, p));
        assert!(keys[0] < keys[2] && keys[2] < keys[1], "{keys:?}");
    }

    #[test]
    fn walk_order_is_kept_without_rays_against_it() {
        let crossing = Crossing { eye: [3.5, -9.0], against: [true, false] };
        let mut order = DepthSorter::default();
        let mut indices = Vec::new();
        // Squares of a page's first row, twice, and one of the next page between them.
        for (n, at) in [[0, 0], [4, 0], [3, 0], [5, 0], [2, 1]].into_iter().enumerate() {
            order.begin(&crossing, 2, (0, at), false, indices.len());
            indices.extend([n as u32; 3]);
        }
        order.finish(&mut indices);
        assert_eq!(indices.chunks(3).map(|t| t[0]).collect::<Vec<_>>(), [2, 4, 0, 1, 3]);
    }
}
