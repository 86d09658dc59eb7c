//! Texts and numbers in the spellings of many programs.

/// Returns a text without its UTF-8 byte order mark.
pub(super) fn without_mark(text: &[u8]) -> &[u8] {
    text.strip_prefix(b"\xef\xbb\xbf").unwrap_or(text)
}

/// Parses a number; words for "no data" become NaN. A comma may stand for the decimal point, and C runtimes write
/// `1.#QNAN`, `-1.#IND` and `-nan(ind)`.
pub(super) fn number(word: &str) -> Option<f64> {
    if let Ok(number) = word.parse() {
        return Some(number);
    }
    let lower = word.to_ascii_lowercase();
    let unsigned = lower.trim_start_matches(['-', '+']);
    if NONE.contains(&unsigned) || unsigned.starts_with("nan(") || unsigned.starts_with("1.#") {
        return Some(f64::NAN);
    }
    let is_decimal = lower.matches(',').count() == 1 && !lower.contains('.');
    is_decimal.then(|| lower.replace(',', ".").parse().ok())?
}

/// Words that mean "no data", lower case.
const NONE: [&str; 5] = ["null", "none", "na", "n/a", "nodata"];
