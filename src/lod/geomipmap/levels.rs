//! Which level a block takes in a view, and how neighbours are brought within one level of each other.

use super::blocks::Blocks;
use crate::view::View;

/// How the level of a block is chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Distance {
    /// The coarsest level whose ε the view's tolerance and metric allow. With the paper metric this is
    /// de Boer 2000, eq. 4: D = δ·v_res / (2·τ·tan(fov/2)).
    Error,
    /// One level coarser every so many metres from the block's centre.
    Linear(f64),
    /// One level coarser each time the distance doubles, from so many metres on.
    Exponential(f64),
}

impl Distance {
    fn level(self, blocks: &Blocks, view: &View, block: usize) -> u8 {
        let bounds = blocks.bounds(block);
        let coarsest = blocks.levels - 1;
        let level = match self {
            Distance::Error => {
                let allowed = view.allowed_error(&bounds);
                let fits = |&&error: &&f32| f64::from(error) <= allowed;
                blocks.errors(block).iter().take_while(fits).count().max(1) as u32 - 1
            }
            Distance::Linear(base) => (view.eye.distance((bounds.min + bounds.max) / 2.0) / base) as u32,
            Distance::Exponential(base) => {
                let ratio = view.eye.distance((bounds.min + bounds.max) / 2.0) / base;
                (0..coarsest).take_while(|&level| ratio >= f64::from(1u32 << level)).count() as u32
            }
        };
        level.min(coarsest) as u8
    }

    /// The level of every block, neighbours within one level of each other.
    pub fn levels(self, blocks: &Blocks, view: &View, levels: &mut Vec<u8>) {
        let [w, h] = blocks.count.map(|n| n as usize);
        levels.clear();
        levels.extend((0..w * h).map(|block| self.level(blocks, view, block)));
        restrict(levels, w, h);
    }
}

/// Refines levels until neighbours differ by at most one: two sweeps give each block the smallest of
/// (level + distance in blocks) over all others.
pub fn restrict(levels: &mut [u8], w: usize, h: usize) {
    for k in 0..w * h {
        let (i, j) = (k % w, k / w);
        let west = if i > 0 { levels[k - 1] + 1 } else { u8::MAX };
        let north = if j > 0 { levels[k - w] + 1 } else { u8::MAX };
        levels[k] = levels[k].min(west).min(north);
    }
    for k in (0..w * h).rev() {
        let (i, j) = (k % w, k / w);
        let east = if i + 1 < w { levels[k + 1] + 1 } else { u8::MAX };
        let south = if j + 1 < h { levels[k + w] + 1 } else { u8::MAX };
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
            let wanted: Vec<u8> = (0..w * h).map(|_| if random() < 20 { 0 } else { 7 }).collect();
            let mut levels = wanted.clone();
            restrict(&mut levels, w, h);
            for (k, &level) in levels.iter().enumerate() {
                let expected = (0..w * h)
                    .map(|o| usize::from(wanted[o]) + (k % w).abs_diff(o % w) + (k / w).abs_diff(o / w))
                    .min();
                assert_eq!(usize::from(level), expected.unwrap());
            }
        }
    }
}
