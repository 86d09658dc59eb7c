//! How fine a texture a triangle needs: by the logarithm of its area on the screen, or by the exponent of the float
//! that holds it.
//!
//! After J. Blow, "Terrain Rendering at High Levels of Detail" (2000), §3 and §4. A square texture of level n has 4^n
//! texels. A triangle of level l of a binary triangle tree covers 2^−(l+1) of its root square, so that with an area of
//! a texels on the screen (quality² × pixels) a texture of the whole square needs a·2^(l+1) of them: level
//! α = ⌈½ log2(a·2^(l+1))⌉. A texture q levels down its quadtree needs α − q.

/// Texels of a square texture of a level: 4^level.
pub fn texture_area(level: i32) -> f64 {
    2f64.powi(2 * level)
}

/// The level that a texture of the root square needs for a triangle of level `triangle_level` with an area of `texels`
/// on the screen: ⌈½ log2(texels·2^(l+1))⌉ (§4.3, before its last step).
pub fn level_by_logarithm(texels: f32, triangle_level: u32) -> i32 {
    (0.5 * (f64::from(texels).log2() + f64::from(triangle_level + 1))).ceil() as i32
}

/// The same without a logarithm: (l + x + 3) >> 1 with texels = m·2^x, 1 ≤ m < 2 (§4.3). Where m = 1 and l + x + 1 is
/// even it says one more: the area counts as a little larger than it is.
///
/// `texels` must be positive and finite; subnormal ones have an exponent too.
#[inline]
pub fn level_by_exponent(texels: f32, triangle_level: u32) -> i32 {
    (triangle_level as i32 + exponent(texels) + 3) >> 1
}

/// ⌊log2⌋ of a positive finite float.
#[inline]
pub fn exponent(value: f32) -> i32 {
    let bits = value.to_bits();
    if bits < 1 << 23 { -118 - bits.leading_zeros() as i32 } else { (bits >> 23) as i32 - 127 }
}

#[cfg(test)]
mod tests {
    use rayon::prelude::*;

    use super::*;

    /// The positive finite floats' bit patterns.
    const PATTERNS: std::ops::Range<u32> = 1..0x7f80_0000;

    /// 2^n, exactly.
    fn power_of_two(n: i32) -> f64 {
        f64::from_bits(((1023 + n) as u64) << 52)
    }

    /// How many of a range of patterns at a level are not what ⌈½ log2⌉ is by its definition,
    /// 4^(α−1) < a·2^(l+1) ≤ 4^α, and how many are the exception. All of it is exact in f64.
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
    fn every_float_has_the_level_of_its_logarithm_at_an_even_and_an_odd_level() {
        check(0);
        check(1);
    }

    #[test]
    #[ignore = "minutes: all 41 levels of 2^31 floats each"]
    fn every_float_has_the_level_of_its_logarithm_at_every_level() {
        (0..=40).for_each(check);
    }

    #[test]
    fn the_logarithm_agrees_where_it_is_not_within_its_rounding_of_an_integer() {
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

    /// A triangle of 515.42 texels that covers half of its texture needs 1030.84: level 6, 64 × 64.
    #[test]
    fn the_worked_example() {
        assert_eq!(level_by_logarithm(515.42, 0), 6);
        assert_eq!(level_by_exponent(515.42, 0), 6);
        assert!(texture_area(5) < 2.0 * 515.42 && 2.0 * 515.42 <= texture_area(6));
    }
}
