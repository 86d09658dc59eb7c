//! Text for HTML and SVG: escaping, file names, and numbers.

/// Escapes the special characters of HTML.
pub fn escape(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

/// Converts a name to lower-case letters, digits and hyphens, for file names and anchors.
pub fn slug(text: &str) -> String {
    let plain: String = text.to_lowercase().chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '-' }).collect();
    plain.split('-').filter(|part| !part.is_empty()).collect::<Vec<_>>().join("-")
}

/// Formats a number with three significant digits: 0.0123, 4.56, 78.9. Whole numbers up to 9999 keep all digits, larger
/// ones get a unit, as in 12.3 k. Infinite numbers and NaN become ∞.
pub fn number(value: f64) -> String {
    if !value.is_finite() {
        return "∞".to_string();
    }
    let size = value.abs();
    if size >= 1e4 {
        let (factor, unit) =
            [(1e9, "G"), (1e6, "M"), (1e3, "k")].into_iter().find(|(f, _)| size >= *f).unwrap_or((1.0, ""));
        return format!("{} {unit}", number(value / factor));
    }
    if size > 0.0 && size < 1e-4 {
        return format!("{value:.1e}");
    }
    let digits = if size == 0.0 { 0 } else { (2 - size.log10().floor() as i32).clamp(0, 6) as usize };
    let text = format!("{value:.digits$}");
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_three_digits() {
        let cases = [
            (0.0, "0"),
            (0.012345, "0.0123"),
            (0.5, "0.5"),
            (4.5678, "4.57"),
            (78.94, "78.9"),
            (1234.6, "1235"),
            (20_000.0, "20 k"),
            (123456.0, "123 k"),
            (2_340_000.0, "2.34 M"),
            (-0.25, "-0.25"),
            (3e-7, "3.0e-7"),
            (f64::INFINITY, "∞"),
        ];
        for (value, text) in cases {
            assert_eq!(number(value), text);
        }
    }

    #[test]
    fn names_are_made_safe() {
        assert_eq!(escape("a<b & \"c\""), "a&lt;b &amp; &quot;c&quot;");
        assert_eq!(slug("Demo 1025x1025, circle: 0.5 px"), "demo-1025x1025-circle-0-5-px");
    }
}
