//! Assumptions about pictures that state neither the spacing of their samples nor the scale of their heights.

/// The highest value that may be metres: no place on Earth is higher.
const HIGHEST_METRES: f32 = 9000.0;
/// The relief of a picture of unknown scale, as a part of its longer side.
const RELIEF: f64 = 0.2;

/// An assumption, and the warning that states it.
#[derive(Debug, PartialEq)]
pub(super) struct Assumed {
    /// Metres per unit of a value.
    pub scale: f64,
    /// States what was assumed, and the flags that replace it.
    pub warning: String,
}

/// Assumes samples 1 m apart, and metres where the values may be metres.
///
/// Unsigned 16-bit values above [`HIGHEST_METRES`] are codes: they get a scale that makes the relief a fifth of the
/// longer side. `has_scale` is true if the scale is stated. Other sample types are measurements, and stay silent
/// unless they come as a picture.
pub(super) fn assume(
    format: &str,
    sample_type: &str,
    size: [u32; 2],
    [min, max]: [f32; 2],
    has_scale: bool,
) -> Option<Assumed> {
    let is_grey = matches!(sample_type, "u8" | "u16");
    if !is_grey || sample_type != "u16" && format != "PNG" {
        return None;
    }
    if has_scale {
        let warning = "nothing states the spacing of samples: taken as 1 m (--spacing M)".to_owned();
        return Some(Assumed { scale: 1.0, warning });
    }
    let unstated = "nothing states the spacing of samples or the scale of heights";
    if sample_type == "u8" || max <= HIGHEST_METRES || max <= min {
        let warning = format!("{unstated}: taken as 1 m and as metres (--spacing M, --height-scale S)");
        return Some(Assumed { scale: 1.0, warning });
    }
    let longer = f64::from(size[0].max(size[1]) - 1);
    let scale = three_digits(RELIEF * longer / (f64::from(max) - f64::from(min)));
    let warning = format!(
        "{unstated}: taken as 1 m and {scale} m a value, which makes the relief a fifth of the side (--spacing M takes \
         values as metres, --height-scale S scales them)"
    );
    Some(Assumed { scale, warning })
}

/// Rounds a number to three digits, so that its text is exact.
fn three_digits(number: f64) -> f64 {
    format!("{number:.2e}").parse().unwrap_or(number)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn codes_get_a_fifth_of_the_side_and_metres_stay() {
        let codes = assume("PNG", "u16", [769, 1025], [0.0, 63682.0], false).unwrap();
        assert_eq!(codes.scale, 0.00322);
        assert!(codes.warning.contains("0.00322 m a value") && codes.warning.contains("--height-scale"));
        for (range, has_scale) in [([330.0, 3698.0], false), ([0.0, 63682.0], true), ([65535.0, 65535.0], false)] {
            assert_eq!(assume("PNG", "u16", [9, 9], range, has_scale).unwrap().scale, 1.0);
        }
        assert_eq!(assume("TIFF", "i16", [9, 9], [0.0, 30000.0], false), None);
    }
}
