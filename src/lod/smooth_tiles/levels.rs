//! Limits and moves the levels of tiles: continuous numbers whose fraction is the morph weight towards the next level.
//! Neighbours always stay within one level of each other.

/// One level as a fixed-point number. Integers make both sides of an edge exactly equal.
pub const ONE: u32 = 1 << 16;

/// Converts a number of levels to units of [`ONE`], rounded down; NaN becomes 0.
pub fn fixed(levels: f64) -> u32 {
    (levels * f64::from(ONE)) as u32
}

/// Tiles begin to leave a level where the tolerance allows less than this multiple of its error. They start before the
/// bound forces them, so that no frame moves them far.
const BAND: f64 = 1.15;

/// Levels by which they have left it at the end of that band. Beyond it, only the error bound moves them.
const EARLY: f64 = 0.3;

/// Returns the coarsest whole level of a tile whose error is at most `allowed` metres, in units of [`ONE`]. `errors` by
/// level, metres, rise from 0 at level 0.
pub fn whole_ceiling(errors: &[f32], allowed: f64) -> u32 {
    ONE * errors.iter().skip(1).take_while(|&&error| f64::from(error) <= allowed).count() as u32
}

/// Returns the coarsest continuous level of a tile whose error is at most `allowed` metres, also while it morphs, in
/// units of [`ONE`]. `errors` by level, metres, rise from 0 at level 0. The result is a sum over levels of the part of
/// each that is allowed, so it is continuous in `allowed` for any errors.
///
/// The bound of a morph from a level of error a to the next, of error b, at weight f: a side has the coarser level of
/// its two tiles, so it may be at weight f beyond the next level already. Heights are affine in each of the two
/// weights; all four extremes are within b, and the first within a. The error is therefore at most (1 − f)² a + (1 − (1
/// − f)²) b. This solves it for f.
pub fn ceiling(errors: &[f32], allowed: f64) -> u32 {
    let part = |pair: &[f32]| {
        let [own, next] = [0, 1].map(|k| f64::from(pair[k]));
        if next <= 0.0 {
            return 1.0;
        }
        let early = EARLY * ((BAND - allowed / next) / (BAND - 1.0)).clamp(0.0, 1.0);
        let must = if allowed < next { ((next - allowed) / (next - own)).sqrt() } else { 0.0 };
        1.0 - early.max(must).min(1.0)
    };
    fixed(errors.windows(2).map(part).take_while(|part| *part > 0.0).sum())
}

/// Lowers levels until neighbours are within one of each other. Each becomes the minimum over all tiles of their level
/// plus the number of tiles to them.
pub fn restrict(levels: &mut [u32], [w, h]: [usize; 2]) {
    let mut lower = |k: usize, by: usize| levels[k] = levels[k].min(levels[by] + ONE);
    for k in 0..w * h {
        (k % w > 0).then(|| lower(k, k - 1));
        (k >= w).then(|| lower(k, k - w));
    }
    for k in (0..w * h).rev() {
        (k % w + 1 < w).then(|| lower(k, k + 1));
        (k + w < w * h).then(|| lower(k, k + w));
    }
}

/// Moves a level in one frame: by at most `step` towards the whole level below its ceiling, and never above the
/// ceiling. Neighbours that were within one level of each other stay so.
pub fn moved(level: u32, ceiling: u32, step: u32) -> u32 {
    let aim = ceiling / ONE * ONE;
    aim.clamp(level.saturating_sub(step), level.saturating_add(step)).min(ceiling)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn random(seed: &mut u32) -> u32 {
        *seed = seed.wrapping_mul(1664525).wrapping_add(1013904223);
        *seed >> 8
    }

    #[test]
    fn ceiling_keeps_the_bound_and_is_continuous() {
        let errors = [0.0f32, 0.5, 0.51, 2.0, 7.0];
        assert_eq!([0.0, 0.5, 0.51, 6.9, 7.0].map(|allowed| whole_ceiling(&errors, allowed) / ONE), [0, 1, 2, 3, 4]);
        assert_eq!(
            [0.0, 0.51 * BAND, 2.0 * BAND, 1e9].map(|allowed| ceiling(&errors, allowed + 1e-6) / ONE),
            [0, 2, 3, 4]
        );
        assert_eq!(ceiling(&[0.0; 4], 0.0), 3 * ONE, "nothing is off");
        let mut tight = 0;
        for k in 0..9000 {
            let allowed = f64::from(k) / 1000.0;
            let level = ceiling(&errors, allowed);
            let next_level = ceiling(&errors, allowed + 0.001);
            assert!(level <= next_level && next_level - level < ONE / 5, "at {allowed} m: {level}, then {next_level}");
            let (whole, f) = ((level / ONE) as usize, f64::from(level % ONE) / f64::from(ONE));
            let [own, next] = [0, 1].map(|n| f64::from(errors[(whole + n).min(4)]));
            // The sides at the same weight beyond the next level.
            let worst = (1.0 - f) * (1.0 - f) * own + (1.0 - (1.0 - f) * (1.0 - f)) * next;
            assert!(worst <= allowed + 1e-12, "{worst} m of {allowed} m");
            tight += u32::from(allowed - worst < 1e-3);
        }
        assert!(tight > 2000, "{tight}");
    }

    #[test]
    fn neighbours_stay_within_one_level() {
        let (size, mut seed) = ([7, 5], 9);
        let apart = |levels: &[u32]| {
            let pairs = (0..35).flat_map(|k| [(k % 7 < 6).then_some((k, k + 1)), (k < 28).then_some((k, k + 7))]);
            pairs.flatten().map(|(a, b)| levels[a].abs_diff(levels[b])).max().unwrap()
        };
        let mut levels = vec![0; 35];
        for _ in 0..2000 {
            let mut ceilings: Vec<u32> = (0..35).map(|_| random(&mut seed) % (6 * ONE)).collect();
            let free = ceilings.clone();
            restrict(&mut ceilings, size);
            assert!(apart(&ceilings) <= ONE);
            let nearest = |k: usize| {
                let distance = |o: usize| (k % 7).abs_diff(o % 7) + (k / 7).abs_diff(o / 7);
                (0..35).map(|o| free[o] + ONE * distance(o) as u32).min()
            };
            assert!((0..35).all(|k| Some(ceilings[k]) == nearest(k)), "no lower than it must be");
            let step = [0, 700, ONE / 3, 2 * ONE, u32::MAX][random(&mut seed) as usize % 5];
            levels.iter_mut().zip(&ceilings).for_each(|(level, &ceiling)| *level = moved(*level, ceiling, step));
            assert!(apart(&levels) <= ONE, "by steps of {step}");
            assert!(levels.iter().zip(&ceilings).all(|(level, ceiling)| level <= ceiling));
        }
    }
}
