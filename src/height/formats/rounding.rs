//! The loss of heights that are rounded to single precision.

/// Steps of a relief below which a warning is given.
const STEPS: f64 = 1000.0;

/// Returns a warning about heights of a wider type whose relief has few steps left in single precision. `range` is that
/// of the values, in units of `metres`.
pub(super) fn warning(sample_type: &str, range: [f32; 2], metres: f64) -> Option<String> {
    let is_wider = !["u8", "i8", "u16", "i16", "f16", "f32"].contains(&sample_type);
    let [low, high] = range.map(f64::from);
    let largest = range[0].abs().max(range[1].abs());
    let mut step = f64::from(largest.next_up() - largest);
    // Whole numbers are exact as long as a step is at most one.
    if ["u32", "i32", "u64", "i64"].contains(&sample_type) && step <= 1.0 {
        step = 0.0;
    }
    let relief = high - low;
    if !is_wider || relief <= 0.0 || step * STEPS <= relief {
        return None;
    }
    let middle = -((low + high) / 2.0 * metres).round();
    Some(format!(
        "heights around {:.0} m are rounded to steps of {} m, their relief is {} m: add {middle} to them in the file",
        -middle,
        short(step * metres),
        short(relief * metres),
    ))
}

/// Formats a length with three digits.
fn short(metres: f64) -> f64 {
    let unit = 10f64.powf(metres.abs().log10().floor() - 2.0);
    (metres / unit).round() * unit
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_small_relief_far_up_is_worth_a_warning() {
        let text = warning("f64", [1e6, 1e6 + 2.0], 1.0).unwrap();
        assert!(text.contains("1000001 m") && text.contains("0.0625 m") && text.contains("2 m"), "{text}");
        assert!(text.contains("add -1000001 to them"), "{text}");
        let feet = warning("f64", [3e6, 3e6 + 8.0], 0.3048).unwrap();
        assert!(feet.contains("add -914401 to them") && feet.contains("0.0762 m"), "{feet}");
        assert!(warning("i32", [3e9, 3e9 + 4096.0], 0.001).is_some());
    }

    #[test]
    fn what_loses_nothing_or_little_is_none() {
        assert_eq!(warning("f64", [0.0, 8848.0], 1.0), None);
        assert_eq!(warning("f64", [1e6, 1e6], 1.0), None, "flat");
        assert_eq!(warning("f32", [1e6, 1e6 + 2.0], 1.0), None, "the file has no finer steps");
        assert_eq!(warning("i32", [1e6, 1e6 + 2.0], 1.0), None, "whole metres are exact");
    }
}
