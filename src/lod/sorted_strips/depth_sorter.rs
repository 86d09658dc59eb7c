//! The order of quads in the eye's own pages, where one direction of the walk is not away from the eye for all of them.
//!
//! Everywhere else rays go the way that strips are walked. Rays that go against it begin in the eye's own column of pages,
//! or in its own row, and the walk makes what they meet furthest first. There the quads of a run are put in order
//! after they are made. They are squares of a quadtree, or two of its squares that one line parts from the rest of theirs:
//! of the two halves on both sides of a line the eye's own comes first, whatever ray is followed. So a quad has a key,
//! page first, then at each level on which side of the two lines in the middle it is, 0 where the eye is too.

/// Where the eye is in a run, and which rays of the view go against the walk.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Crossing {
    /// Where rays come from, counted from the run's first corner along (u, v).
    pub eye: [f64; 2],
    /// Whether any of them goes against the walk while it is over the run, along (u, v).
    pub against: [bool; 2],
}

impl Crossing {
    /// Whether the walk's own order is not that of every ray.
    pub fn is_any(&self) -> bool {
        self.against != [false; 2]
    }

    /// The key of the square of a level at a place, both counted from the run's first corner, or of a pair that begins
    /// with it; `page` is the level of pages. Quads that are ordered already have one key.
    #[inline]
    fn key(&self, page: u32, level: u32, at: [i32; 2], is_pair: bool) -> u64 {
        let in_run = at[0] >> (page - level);
        // Rays that go along with all strips are against the walk in the first page only.
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

/// The quads of a run as they are made: where the indices of each begin, and its place in the order.
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
    /// A quad begins with the index `first`: the square of a level at a place, counted from the run's first corner, or a
    /// pair of squares that begins with it. `page` is the level of pages.
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

    /// Puts the quads in order, the last of which ends where `indices` end, and forgets them.
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
    fn the_half_with_the_eye_comes_first() {
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
    fn the_walks_own_order_stays_where_no_ray_goes_against_it() {
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
