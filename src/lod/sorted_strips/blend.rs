//! Vertices, and how they go over into the next level: a vertex is in the middle of an edge of that level, and either rises
//! or falls to where that edge is drawn, or slides along it into one of its ends (Finch & Bishop, §4.9).
//!
//! What slides has places between samples. Its way has as many steps as a sample has parts, so that each of its places lies
//! on the lattice of these parts and on the edge, to the bit. An edge's ends stand while something slides between them: the
//! table's levels are far enough apart for it ([`Radial`](super::table::Radial)). So no triangle turns over: what slides
//! does so on a side of a triangle of the next level, and that triangle stands. The last of the steps is that in which it
//! goes: a vertex in the end of its edge would leave triangles without area beside others that have not arrived yet.
//!
//! Lines between quads go along with what slides on them, while the walk knows quads by where they stand: some rays meet
//! triangles out of order (9 of 50,656 in the room's tests, 3 pixels of a painter's would be wrong), so `order=painter` keeps
//! the depth buffer then.
//!
//! What it is worth: jumps from frame to frame on the path `fly` over the demo, 640 × 360 pixels, `edge=10`, 120 frames, and
//! the time of selection:
//!
//! | `blend` | 99th percentile | 99.9th | largest | selection |
//! |---|---|---|---|---|
//! | `off` | 0.98 px | 3.37 px | 9.5 px | 2.5 ms |
//! | `height` | 0.34 px | 0.68 px | 2.3 px | 3.9 ms |
//! | `end` | 0.41 px | 0.85 px | 3.5 px | 5.4 ms |

use super::pages::Grid;

/// Bits that the sides of a page and of a field may have in parts of samples: areas of triangles fit 32 bits, and positions
/// are proven ([`watertight`](crate::measure::watertight)).
const BITS: [u32; 2] = [14, 24];

/// How vertices go over into the next level.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Blend {
    /// They are there at once.
    #[default]
    Off,
    /// Their heights go to that of the edge of the next level on which they lie.
    Height,
    /// They go to an end of that edge, in all three dimensions, by so many bits of parts of a sample.
    End(u32),
}

impl Blend {
    /// What the setting may be.
    pub const WORDS: &[&str] = &["off", "height", "end"];

    /// What a word of the setting says over a field in pages: the smaller they are, the finer the parts.
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

    /// Bits of positions that are parts of a sample.
    pub fn fraction_bits(self) -> u32 {
        if let Blend::End(bits) = self { bits } else { 0 }
    }
}
