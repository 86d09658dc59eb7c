//! The value that means "no data", as programs write it.

use super::decoded::Decoded;
use super::options::Options;
use crate::height::samples::Samples;

/// Largest absolute value of a height, metres: programs fill samples without data with larger ones.
pub(super) const BEYOND: f64 = 1e30;

/// Reads a number in the spelling of gdalinfo, of Rust, or of the C library of Windows (`1.#QNAN`, `-1.#IND`, `1.#INF`).
pub fn number(text: &str) -> Option<f64> {
    let text = text.trim_matches(|c: char| c.is_whitespace() || c == '\0');
    if let Ok(number) = text.parse() {
        return Some(number);
    }
    let (is_negative, magnitude) = match text.strip_prefix('-') {
        Some(rest) => (true, rest),
        None => (false, text.strip_prefix('+').unwrap_or(text)),
    };
    let magnitude = magnitude.to_ascii_lowercase();
    match magnitude.strip_prefix("1.#") {
        Some(name) if name.starts_with("inf") => Some(if is_negative { f64::NEG_INFINITY } else { f64::INFINITY }),
        Some(name) if ["qnan", "snan", "ind", "nan"].iter().any(|kind| name.starts_with(kind)) => Some(f64::NAN),
        // As in nan(0x8000000000000).
        None if magnitude.starts_with("nan(") && magnitude.ends_with(')') => Some(f64::NAN),
        _ => None,
    }
}

impl Decoded {
    /// Sets the nodata value from a file's text. A text that is no number is ignored with a warning.
    pub(super) fn declare_nodata(&mut self, place: &str, text: &str, options: &Options) {
        self.nodata = number(text);
        if self.nodata.is_none() && options.nodata.is_none() {
            let text = text.trim_end_matches('\0');
            self.warnings.push(format!("{place} is {text:?}, which is no number and is ignored (--nodata sets one)"));
        }
    }

    /// Makes holes of the nodata value, NaN, infinities and values beyond [`BEYOND`].
    pub(super) fn make_holes(&mut self, options: &Options) {
        let nodata = options.nodata.or(self.nodata).map(|value| value / self.step);
        if nodata.is_none() && matches!(self.samples, Samples::Coded { .. }) {
            return;
        }
        // The nodata value is often rounded on its way through text: two units in the last place of an f32.
        let slack = nodata.filter(|value| value.is_finite()).map(|value| 2.0 * f64::from(f32::EPSILON) * value.abs());
        let is_nodata = |value: f32| {
            let is_near = |none: f64| slack.is_some_and(|slack| (f64::from(value) - none).abs() <= slack);
            nodata.is_some_and(|none| value == none as f32 || is_near(none))
        };
        let (mut bad, mut beyond, mut first) = (0u64, 0u64, 0.0);
        for k in 0..self.samples.len() {
            let value = self.samples.height(k);
            let is_beyond = value.is_finite() && (f64::from(value) * self.step).abs() > BEYOND;
            let is_known = self.holes.contains(k) || is_nodata(value);
            if is_known || is_beyond || !value.is_finite() {
                self.holes.insert(k);
            }
            if !is_known && is_beyond {
                first = if beyond == 0 { f64::from(value) * self.step } else { first };
                beyond += 1;
            } else if !is_known && !value.is_finite() {
                bad += 1;
            }
        }
        if bad > 0 && nodata.is_none_or(f64::is_finite) {
            self.warnings.push(format!("{bad} samples are NaN or infinite and become holes"));
        }
        if beyond > 0 {
            let samples = if beyond == 1 { "1 sample is" } else { &format!("{beyond} samples are") };
            self.warnings.push(format!(
                "{samples} beyond ±1e30 (the first is {first:e}): undeclared nodata, taken as holes; --nodata {first:e} says so"
            ));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn every_spelling_of_a_number() {
        for (text, expected) in [
            ("-9999", -9999.0),
            (" -3.4028234663852886e+38 \0", -3.4028234663852886e38),
            ("-3.4028234663852886E+038", -3.4028234663852886e38),
            ("inf", f64::INFINITY),
            ("-inf", f64::NEG_INFINITY),
            ("Infinity", f64::INFINITY),
            ("1.#INF", f64::INFINITY),
            ("-1.#INF00", f64::NEG_INFINITY),
        ] {
            assert_eq!(number(text), Some(expected), "{text}");
        }
        for text in ["nan", "-nan", "NaN", "1.#QNAN", "-1.#IND", "1.#SNAN", "nan(0x8000000000000)"] {
            assert!(number(text).is_some_and(f64::is_nan), "{text}");
        }
        for text in ["none", "", "\0", "null", "1.#", "1,5", "--5", "n/a"] {
            assert_eq!(number(text), None, "{text}");
        }
    }
}
