//! A comparison of two benchmarks as text.

use std::fmt;

use crate::bench::compare::{Change, Comparison};

/// Shows a comparison: a line for each technique and case, then what differs.
pub struct Text<'a>(pub &'a Comparison);

impl fmt::Display for Text<'_> {
    fn fmt(&self, out: &mut fmt::Formatter) -> fmt::Result {
        let Comparison { matched, over_shading_only, shading_only, techniques, cases, .. } = self.0;
        let cost = if *over_shading_only { "frame time over shading-only time" } else { "frame time" };
        writeln!(out, "{matched} cases in both runs; {cost}, B / A:")?;
        let changes: Vec<_> = techniques.iter().chain(shading_only).chain(cases).collect();
        let width = changes.iter().map(|change| change.what.chars().count()).max().unwrap_or(0);
        for change in changes {
            writeln!(out, "  {:width$}  {}", change.what, ratio(change))?;
        }
        if !self.0.is_judged {
            writeln!(out, "times are not judged: a run has too few rounds")?;
        }
        for difference in &self.0.differences {
            let mark = if difference.is_regression { " (worse)" } else { "" };
            let (before, after) = (significant(difference.before), significant(difference.after));
            writeln!(out, "{}: {} {before} before, {after} after{mark}", difference.case, difference.value)?;
        }
        for case in &self.0.unmatched {
            writeln!(out, "in one run only: {case}")?;
        }
        match &self.0.regressions[..] {
            [] => write!(out, "no regressions"),
            found => write!(out, "{} regressions:\n  {}", found.len(), found.join("\n  ")),
        }
    }
}

fn ratio(change: &Change) -> String {
    let ratio = change.ratio;
    let mark = if change.is_regression { "  slower" } else { "" };
    format!("{:.3} ({:.3} to {:.3}){mark}", ratio.value, ratio.low, ratio.high)
}

/// Formats a value with four significant digits, without an exponent.
fn significant(value: f64) -> String {
    let digits = if value == 0.0 || !value.is_finite() { 0 } else { 3 - value.abs().log10().floor() as i32 };
    let text = format!("{value:.*}", digits.clamp(0, 12) as usize);
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_string() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bench::compare::Difference;
    use crate::bench::statistics::Estimate;

    #[test]
    fn changes_are_aligned_and_numbers_are_short() {
        let change = |what: &str, low: f64, is_regression: bool| Change {
            what: what.to_string(),
            ratio: Estimate { value: low + 0.1, low, high: low + 0.234_567 },
            is_regression,
        };
        let difference = Difference {
            case: "demo, spin".to_string(),
            value: "error_px.max",
            before: 0.123_456,
            after: 12_345.6,
            is_regression: true,
        };
        let comparison = Comparison {
            matched: 1,
            is_judged: false,
            over_shading_only: true,
            shading_only: None,
            techniques: vec![change("clusters, 1 cases", 1.5, true)],
            cases: vec![change("demo, spin", 0.9, false)],
            differences: vec![difference],
            unmatched: vec!["demo, fly".to_string()],
            regressions: vec!["clusters is slower".to_string()],
        };
        let expected = "1 cases in both runs; frame time over shading-only time, B / A:
  clusters, 1 cases  1.600 (1.500 to 1.735)  slower
  demo, spin         1.000 (0.900 to 1.135)
times are not judged: a run has too few rounds
demo, spin: error_px.max 0.1235 before, 12346 after (worse)
in one run only: demo, fly
1 regressions:
  clusters is slower";
        assert_eq!(Text(&comparison).to_string(), expected);
    }
}
