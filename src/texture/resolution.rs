//! Computes the texture level a triangle needs, from the exponent of the float that holds its screen area.
//!
//! After J. Blow, "Terrain Rendering at High Levels of Detail" (2000), §3 and §4. A square texture of level n has 4^n
//! texels. A triangle of level l of a binary triangle tree covers 2^−(l+1) of its root square. If its screen area is
//! a texels (quality² × pixels), a texture of the root square needs a·2^(l+1) texels: level α = ⌈½ log2(a·2^(l+1))⌉.
//! A tile q levels down the quadtree needs level α − q.

/// Returns the texels of a square texture of a level: 4^level.
pub fn texture_area(level: i32) -> f64 {
    2f64.powi(2 * level)
}

/// Returns the level α of the root square's texture for a triangle of level `triangle_level` with a screen area of
/// `texels`, without a logarithm: (l + x + 3) >> 1 with texels = m·2^x, 1 ≤ m < 2 (§4.3). For m = 1 and even l + x + 1
/// the result is one level finer.
///
/// `texels` must be positive and finite; subnormal values are allowed.
#[inline]
pub fn level_by_exponent(texels: f32, triangle_level: u32) -> i32 {
    (triangle_level as i32 + exponent(texels) + 3) >> 1
}

/// Returns ⌊log2⌋ of a positive finite float.
#[inline]
pub fn exponent(value: f32) -> i32 {
    let bits = value.to_bits();
    if bits < 1 << 23 { -118 - bits.leading_zeros() as i32 } else { (bits >> 23) as i32 - 127 }
}

#[cfg(test)]
pub(super) mod tests {
    use rayon::prelude::*;

    use super::*;

    /// Returns the level α of a triangle from its definition: ⌈½ log2(texels·2^(l+1))⌉ (§4.3, before its last step).
    pub fn level_by_logarithm(texels: f32, triangle_level: u32) -> i32 {
        (0.5 * (f64::from(texels).log2() + f64::from(triangle_level + 1))).ceil() as i32
    }

    /// Bit patterns of all positive finite floats.
    const PATTERNS: std::ops::Range<u32> = 1..0x7f80_0000;

    /// Returns 2^n, exactly.
    fn power_of_two(n: i32) -> f64 {
        f64::from_bits(((1023 + n) as u64) << 52)
    }

    /// Counts the bit patterns of a range whose level violates the definition 4^(α−1) < a·2^(l+1) ≤ 4^α, and those
    /// that are the documented exception (m = 1). All arithmetic is exact in f64.
    fn wrong(patterns: std::ops::Range<u32>, level: u32) -> [u64; 2] {
        let mut count = [0; 2];
        for bits in patterns {
            let texels = f32::from_bits(bits);
            let (a, l) = (f64::from(texels), level as i32);
            let is_exception = bits & 0x007f_ffff == 0 && (l + (bits >> 23) as i32 - 127 + 1) % 2 == 0
                || bits < 1 << 23 && bits.is_power_of_two() && (l + bits.trailing_zeros() as i32 - 149 + 1) % 2 == 0;
            let alpha = level_by_exponent(texels, level) - i32::from(is_exception);
            let is_right = power_of_two(2 * alpha - 2 - l - 1) < a && a <= power_of_two(2 * alpha - l - 1);
            count[0] += u64::from(!is_right);
            count[1] += u64::from(is_exception);
        }
        count
    }

    fn check(level: u32) {
        const PART: u32 = 1 << 20;
        let parts = (0..PATTERNS.end / PART).into_par_iter();
        let of_part = |part: u32| wrong((part * PART).max(1)..(part + 1) * PART, level);
        let [wrong, exceptions] = parts.map(of_part).reduce(|| [0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
        assert_eq!(wrong, 0, "level {level}");
        // Every second power of two from 2^-149 to 2^127.
        assert_eq!(exceptions, if level.is_multiple_of(2) { 139 } else { 138 }, "level {level}");
    }

    #[test]
    fn all_floats_match_the_definition_at_one_even_and_one_odd_level() {
        check(0);
        check(1);
    }

    #[test]
    #[ignore = "minutes: all 41 levels of 2^31 floats each"]
    fn all_floats_match_the_definition_at_every_level() {
        (0..=40).for_each(check);
    }

    #[test]
    fn exponent_and_logarithm_agree_away_from_integers() {
        for level in 0..=40 {
            for bits in PATTERNS.step_by(99_991) {
                let texels = f32::from_bits(bits);
                let half = 0.5 * (f64::from(texels).log2() + f64::from(level + 1));
                if (half - half.round()).abs() > 1e-12 {
                    assert_eq!(level_by_exponent(texels, level), level_by_logarithm(texels, level), "{texels:e}");
                }
            }
        }
    }

    /// A triangle of 515.42 texels that covers half of its texture needs 1030.84: level 5 is too small, level 6 (64 ×
    /// 64) suffices.
    #[test]
    fn worked_example() {
        assert_eq!(level_by_logarithm(515.42, 0), 6);
        assert_eq!(level_by_exponent(515.42, 0), 6);
        assert!(texture_area(5) < 2.0 * 515.42 && 2.0 * 515.42 <= texture_area(6));
    }
}
