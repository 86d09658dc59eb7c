//! The quantities that bounds are measured for.

/// Largest rounding error of a morphed height, relative to the largest height around it.
///
/// It is at most 12 half-ulps: six for each of the two steps of `draw::place::lattice_height`.
pub const ROUNDING: f32 = 8.0 * f32::EPSILON;

/// Choice of squares and of the quantities measured.
#[derive(Clone, Copy, Debug)]
pub struct Measure {
    /// Cells along a side of a square at every level: a power of two, at least 8.
    pub cells: u32,
    /// Smallest ratio of a square's error to those of the squares in it (1: saturated).
    pub growth: f32,
    /// True if errors are measured; otherwise they are 0.
    pub errors: bool,
    /// True if children morph into their parent: the parent's error then bounds all stages of the morph.
    pub morph: bool,
}

impl Measure {
    /// Returns a name for the choice, for file names.
    pub(super) fn name(&self) -> String {
        let Self { cells, growth, errors, morph } = self;
        let what = if *errors { "errors" } else { "ranges" };
        format!("{what}-{cells}x{growth}{}", if *morph { "-morph" } else { "" })
    }
}

/// Returns true if each square of a level equals one in the first period along a tiled axis.
pub fn is_aligned(period: u32, level: u32, side: u32) -> bool {
    period.is_multiple_of(side) || side.is_multiple_of(period) && period.is_multiple_of(4 << level)
}
