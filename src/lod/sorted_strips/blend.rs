//! Morphs vertices to the next level: vertically to the edge of that level, or along the edge into one of its ends
//! (Finch & Bishop, §4.9).
//!
//! A vertex that slides has positions between samples. Its path has as many steps as a sample has fractional parts.
//! Each position lies exactly on the lattice of these parts and on the edge. The ends of the edge do not move while a
//! vertex slides between them, because the table's levels begin far enough apart ([`Radial`](super::table::Radial)). No
//! triangle therefore flips: the vertex slides on a side of a triangle of the next level, and that triangle does not
//! move. The vertex disappears in the last step. Reaching the end before that would leave triangles without area beside
//! others that still morph.
//!
//! Lines between quads move with the vertices on them, but the walk orders quads by their unmorphed positions. Some
//! rays therefore meet triangles out of order: 9 of 50,656 in the tests, which would be 3 wrong pixels without a depth
//! buffer. `order=painter` therefore uses the depth buffer with `blend=end`.
//!
//! Measured jumps from frame to frame on the path `fly` over the demo, 640 × 360 pixels, `edge=10`, 120 frames, and
//! time of selection:
//!
//! | `blend` | 99th percentile | 99.9th | largest | selection |
//! |---|---|---|---|---|
//! | `off` | 0.98 px | 3.37 px | 9.5 px | 2.5 ms |
//! | `height` | 0.34 px | 0.68 px | 2.3 px | 3.9 ms |
//! | `end` | 0.41 px | 0.85 px | 3.5 px | 5.4 ms |

use super::pages::Grid;

/// Maximum bits of a page's and of a field's side in fractional parts of samples. Areas of triangles then fit 32 bits,
/// and positions fit the exact arithmetic of [`watertight`](crate::measure::watertight).
const BITS: [u32; 2] = [14, 24];

/// Morph of vertices to the next level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Blend {
    /// None: vertices appear at once.
    #[default]
    Off,
    /// Heights morph to the edge of the next level on which they lie.
    Height,
    /// Vertices slide to an end of that edge in three dimensions. Stores the number of fractional bits of positions.
    End(u32),
}

impl Blend {
    /// Words of the setting `blend`.
    pub const WORDS: &[&str] = &["off", "height", "end"];

    /// Returns the morph for a word of the setting. The smaller pages and field are, the more fractional bits it has.
    pub fn of(word: &str, grid: &Grid) -> Self {
        match word {
            "height" => Blend::Height,
            "end" => {
                let field = 32 - grid.last[0].max(grid.last[1]).leading_zeros();
                Blend::End(BITS[0].saturating_sub(grid.level).min(BITS[1].saturating_sub(field)))
            }
            _ => Blend::Off,
        }
    }

    /// Returns the number of fractional bits of positions.
    pub fn fraction_bits(self) -> u32 {
        if let Blend::End(bits) = self { bits } else { 0 }
    }
}
