//! Geometry of a binary triangle tree over a field, organised by diamonds.
//!
//! A *wedge* is a right isosceles triangle of the tree. Two wedges that share a hypotenuse split together, so that the
//! mesh is conforming. They form a *diamond*, identified by the middle of that hypotenuse, a vertex of the lattice.
//! Each vertex except the root square's corners is the middle of one diamond. If the lowest set bits of both
//! coordinates are equal, it is the middle of a cell; the diagonal alternates with the cell's parity, as everywhere in
//! this crate. Otherwise it is the middle of a cell's side. A diamond can split once its *parents* have: the diamonds
//! whose middles are its wedges' apexes. Its *children* are in the middles of its four sides.
//!
//! The root square is at least as large as the field's longer side. Vertices beyond the field collapse onto its edge.
//! Hypotenuses are axis-parallel or diagonal, so no triangle flips by that. A diagonal that crosses the edge bends, so
//! a collapsed wedge covers another area than its two halves. Coarse diamonds that extend beyond the field therefore
//! always split ([`Lattice::always_splits`]). Diamonds entirely outside the field are omitted.

/// A vertex of the lattice, (x, z) in samples from the field's first one. It lies in the root square and may lie beyond
/// the field.
pub type Place = [i32; 2];

/// Two wedges that share a hypotenuse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Diamond {
    /// Ends of the hypotenuse.
    pub ends: [Place; 2],
    /// Apexes of the wedges, at their right angles. One may lie outside the root square.
    pub apexes: [Place; 2],
}

impl Diamond {
    /// Returns the diamond with this middle, which must not be the origin.
    pub fn around([x, z]: Place) -> Self {
        let half = half_length([x, z]);
        let to = |dx: i32, dz: i32| [x + dx * half, z + dz * half];
        let (rising, falling) = ([to(-1, -1), to(1, 1)], [to(1, -1), to(-1, 1)]);
        let (along_x, along_z) = ([to(-1, 0), to(1, 0)], [to(0, -1), to(0, 1)]);
        let [ends, apexes] = match (x & half != 0, z & half != 0) {
            (true, true) if ((x ^ z) & (half << 1)) == 0 => [rising, falling],
            (true, true) => [falling, rising],
            (true, false) => [along_x, along_z],
            _ => [along_z, along_x],
        };
        Self { ends, apexes }
    }
}

/// Returns half the extent of a diamond along the axes, samples: the lowest set bit of its middle's coordinates.
pub fn half_length([x, z]: Place) -> i32 {
    let both = x | z;
    both & both.wrapping_neg()
}

/// Maximum number of blocks along the root square's side.
const MAX_BLOCKS_ALONG: i32 = 32;
/// Minimum side of a block, cells.
const MIN_BLOCK_SIDE: i32 = 32;
/// Blocks along the side of a square that is culled as one at the field's edge: a power of two. Larger squares draw
/// fewer triangles at great tolerances and cull less at small ones. Triangles over 921 × 859 samples of mountains, sum
/// of eleven views:
///
/// | tolerance | 1 block | 2 | 4 | 8 |
/// |---|---|---|---|---|
/// | 1 px | 411 905 | 412 212 | 415 521 | 425 636 |
/// | 16 px | 11 741 | 10 928 | 10 677 | 10 656 |
/// | 64 px | 3812 | 2767 | 2316 | 2161 |
/// | flat terrain, one view | 314 | 139 | 60 | 24 |
const EDGE_BLOCKS: i32 = 2;

/// Diamonds over a field.
#[derive(Clone, Debug)]
pub struct Lattice {
    last: Place,
    /// Base-2 logarithm of the root square's side.
    depth: u32,
    /// Number of places along (x, z) and first index of each level. The level is the exponent of the half length.
    levels: Vec<([i32; 2], usize)>,
    len: usize,
}

impl Lattice {
    /// Creates the lattice of a field with this last sample.
    pub fn new(last: Place) -> Self {
        let depth = (last[0].max(last[1]) as u32).next_power_of_two().ilog2();
        let (mut levels, mut len) = (Vec::new(), 0);
        for level in 0..depth {
            // Diamonds that begin beyond the field do not overlap it.
            let count = last.map(|n| ((n - 1) >> level) + 2);
            levels.push((count, len));
            len += count[0] as usize * count[1] as usize;
        }
        Self { last, depth, levels, len }
    }

    /// Returns the side of the root square, samples.
    pub fn side(&self) -> i32 {
        1 << self.depth
    }

    /// Returns the side of the aligned squares by which triangles are culled, cells: a power of two, at most the root
    /// square's.
    pub fn block_side(&self) -> i32 {
        (self.side() / MAX_BLOCKS_ALONG).max(MIN_BLOCK_SIDE).min(self.side())
    }

    /// Returns the side of the aligned squares whose blocks are culled together at the field's edge, cells.
    pub fn edge_side(&self) -> i32 {
        (EDGE_BLOCKS * self.block_side()).min(self.side())
    }

    /// Returns the number of levels of cells' middles.
    pub fn levels(&self) -> u32 {
        self.depth
    }

    /// Returns the number of indices; all are below it.
    pub fn size(&self) -> usize {
        self.len
    }

    /// Returns the middle of the root square; `None` if its side is one cell.
    pub fn root(&self) -> Option<Place> {
        (self.depth > 0).then(|| [self.side() / 2; 2])
    }

    /// Returns the number of places along (x, z) of a level, the exponent of a diamond's half length.
    pub fn count(&self, level: u32) -> [i32; 2] {
        self.levels[level as usize].0
    }

    /// Returns the index of the diamond with this middle; `None` if none exists.
    #[inline]
    pub fn index(&self, [x, z]: Place) -> Option<usize> {
        let level = (x | z).trailing_zeros();
        let &([x_count, z_count], first) = self.levels.get(level as usize)?;
        let [i, j] = [x >> level, z >> level];
        ((0..x_count).contains(&i) && (0..z_count).contains(&j))
            .then(|| first + j as usize * x_count as usize + i as usize)
    }

    /// Returns the diamonds that must have split before this one can.
    #[inline]
    pub fn parents(&self, middle: Place) -> impl Iterator<Item = (Place, usize)> {
        Diamond::around(middle).apexes.into_iter().filter_map(|at| Some((at, self.index(at)?)))
    }

    /// Returns the diamonds that can only split after this one.
    #[inline]
    pub fn children(&self, middle: Place) -> impl Iterator<Item = (Place, usize)> {
        let [x, z] = middle;
        let half = half_length(middle);
        let is_cell = x & half != 0 && z & half != 0;
        let quarter = half >> 1;
        // Children of a cell's diamond are in the middles of its sides; of a side's, in the middles of the cells around
        // its ends.
        let at = if is_cell {
            [[x - half, z], [x + half, z], [x, z - half], [x, z + half]]
        } else {
            [[-1, -1], [1, -1], [-1, 1], [1, 1]].map(|[dx, dz]| [x + dx * quarter, z + dz * quarter])
        };
        let has_children = is_cell || quarter > 0;
        at.into_iter().filter(move |_| has_children).filter_map(|at| Some((at, self.index(at)?)))
    }

    /// Returns a vertex clamped to the field, where it is drawn.
    #[inline]
    pub fn on_field(&self, [x, z]: Place) -> Place {
        [x.min(self.last[0]), z.min(self.last[1])]
    }

    /// Returns true if a vertex lies in the root square.
    pub fn contains(&self, [x, z]: Place) -> bool {
        (0..=self.side()).contains(&x) && (0..=self.side()).contains(&z)
    }

    /// Returns true if a wedge collapses onto the field's edge.
    #[inline]
    pub fn collapses(&self, wedge: [Place; 3]) -> bool {
        let [[ax, az], [bx, bz], [cx, cz]] = wedge.map(|at| self.on_field(at));
        i64::from(bz - az) * i64::from(cx - ax) == i64::from(bx - ax) * i64::from(cz - az)
    }

    /// Returns true if a diamond splits in every view. It does if it extends beyond the field and is larger than a
    /// square of blocks that are culled together. No drawn wedge therefore extends beyond the square that it is culled
    /// with.
    pub fn always_splits(&self, middle: Place) -> bool {
        let Diamond { ends, apexes } = Diamond::around(middle);
        let has_area = |&apex: &Place| self.contains(apex) && !self.collapses([apex, ends[0], ends[1]]);
        2 * half_length(middle) > self.edge_side() && self.sticks_out(middle) && apexes.iter().any(has_area)
    }

    /// Returns true if a diamond has a corner beyond the field.
    pub fn sticks_out(&self, middle: Place) -> bool {
        let Diamond { ends, apexes } = Diamond::around(middle);
        let mut corners = ends.into_iter().chain(apexes).filter(|&at| self.contains(at));
        corners.any(|at| self.on_field(at) != at)
    }
}
