//! Chooses the level of each block in a view, and brings neighbours within one level of each other.

use super::blocks::Blocks;
use crate::view::View;

/// End of the morph band: a block starts to morph where the allowed error reaches that of the morph to the next level,
/// and has morphed at this multiple of it. A wider band draws finer levels for longer, a narrower one is noticeable.
const MORPH_RATIO: f64 = 1.3;

/// Rule for the level of a block.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distance {
    /// The coarsest level whose ε the view's tolerance and metric allow. With the paper's metric this is de Boer 2000,
    /// eq. 4: D = δ·v_res / (2·τ·tan(fov/2)).
    Error,
    /// One level coarser per this distance from the block's centre, metres.
    Linear(f64),
    /// One level coarser for each doubling of the distance, starting at this distance, metres.
    Exponential(f64),
}

/// One level as a fixed-point number; the fraction is the morph weight to the next level. Integers make sums exact;
/// with 16 bits, weights are exact in f32 and their steps are invisible.
pub const ONE: u32 = 1 << 16;

impl Distance {
    /// Returns the quantity that must reach 1 before a block uses `level` instead of `level − 1`. It falls with the
    /// level.
    fn ratio(self, blocks: &Blocks, view: &View, block: usize) -> impl Fn(u32) -> f64 {
        let bounds = blocks.bounds(block);
        let distance = view.eye.distance((bounds.min + bounds.max) / 2.0);
        let allowed = view.allowed_error(&bounds);
        move |level| match self {
            // Avoids 0 / 0.
            Distance::Error => allowed / f64::from(blocks.errors(block)[level as usize].max(f32::MIN_POSITIVE)),
            Distance::Linear(base) => distance / base - f64::from(level - 1),
            Distance::Exponential(base) => distance / base / f64::from(1u32 << (level - 1)),
        }
    }

    /// Returns the ratios between which a block morphs.
    fn band(self) -> [f64; 2] {
        match self {
            Distance::Error => [1.0, MORPH_RATIO],
            // The last 30 % of the distance between two levels; exponential levels begin at half the ratio.
            Distance::Linear(_) => [0.7, 1.0],
            Distance::Exponential(_) => [0.85, 1.0],
        }
    }

    /// Returns the coarsest whole level whose ratio reaches 1.
    fn level(self, blocks: &Blocks, view: &View, block: usize) -> u32 {
        let ratio = self.ratio(blocks, view, block);
        ONE * (1..blocks.levels).take_while(|&level| ratio(level) >= 1.0).count() as u32
    }

    /// Returns the continuous level: the sum over levels of the part of each band that is passed. It is continuous even
    /// if bands overlap. As the ratio falls with the level, the sum exceeds a level only if the next one's band has
    /// begun, where the error bound holds.
    fn morphing_level(self, blocks: &Blocks, view: &View, block: usize) -> u32 {
        let ratio = self.ratio(blocks, view, block);
        let [begin, end] = self.band();
        let part = |level| ((ratio(level) - begin) / (end - begin)).clamp(0.0, 1.0);
        let sum: f64 = (1..blocks.levels).map(part).take_while(|part| *part > 0.0).sum();
        (sum * f64::from(ONE)) as u32
    }

    /// Computes the fixed-point level of every block, with neighbours within one level of each other.
    pub fn levels(self, blocks: &Blocks, view: &View, morph: bool, levels: &mut Vec<u32>) {
        let [w, h] = blocks.count.map(|n| n as usize);
        let level = if morph { Self::morphing_level } else { Self::level };
        levels.clear();
        levels.extend((0..w * h).map(|block| level(self, blocks, view, block)));
        restrict(levels, w, h);
    }
}

/// Refines levels until neighbours differ by at most one. Two sweeps give each block the minimum of (level + distance
/// in blocks) over all blocks. This is continuous in all of them, and so are morph weights.
pub fn restrict(levels: &mut [u32], w: usize, h: usize) {
    for k in 0..w * h {
        let (i, j) = (k % w, k / w);
        let west = if i > 0 { levels[k - 1] + ONE } else { u32::MAX };
        let north = if j > 0 { levels[k - w] + ONE } else { u32::MAX };
        levels[k] = levels[k].min(west).min(north);
    }
    for k in (0..w * h).rev() {
        let (i, j) = (k % w, k / w);
        let east = if i + 1 < w { levels[k + 1] + ONE } else { u32::MAX };
        let south = if j + 1 < h { levels[k + w] + ONE } else { u32::MAX };
        levels[k] = levels[k].min(east).min(south);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn restriction_is_the_smallest_level_plus_distance() {
        let (w, h) = (13usize, 9usize);
        let mut seed = 7u32;
        let mut random = || {
            seed = seed.wrapping_mul(1664525).wrapping_add(1013904223);
            seed >> 24
        };
        for _ in 0..50 {
            let wanted: Vec<u32> = (0..w * h).map(|_| if random() < 20 { random() * 99 } else { 7 * ONE }).collect();
            let mut levels = wanted.clone();
            restrict(&mut levels, w, h);
            for (k, &level) in levels.iter().enumerate() {
                let expected = (0..w * h)
                    .map(|o| wanted[o] + ONE * ((k % w).abs_diff(o % w) + (k / w).abs_diff(o / w)) as u32)
                    .min();
                assert_eq!(level, expected.unwrap());
            }
        }
    }
}
