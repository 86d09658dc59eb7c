//! Axes of charts: the range of values that an axis covers, the position of a value on it, and its ticks.

/// Placement of values on an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Linear, starting at 0.
    Linear,
    /// Logarithmic, for positive values.
    Logarithmic,
}

/// Largest number of decades on a logarithmic axis. Smaller values are drawn at its lower end.
const DECADES: f64 = 4.0;

/// Label and scale of an axis.
#[derive(Clone, Debug)]
pub struct Axis {
    /// Quantity and unit.
    pub label: String,
    /// Scale that the chart has by default.
    pub scale: Scale,
}

/// The values that an axis covers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    scale: Scale,
    low: f64,
    high: f64,
}

impl Range {
    /// Returns a range with round ends that contains all finite values, up to [`DECADES`] below the largest.
    pub fn around(scale: Scale, values: impl Iterator<Item = f64>) -> Self {
        let finite: Vec<f64> = values.filter(|v| v.is_finite()).collect();
        let high = finite.iter().copied().fold(0.0, f64::max);
        let shown = |v: &f64| *v > high / 10f64.powf(DECADES);
        let smallest = finite.iter().copied().filter(shown).fold(f64::INFINITY, f64::min);
        match scale {
            Scale::Linear => {
                let top = if high > 0.0 { high } else { 1.0 };
                let step = step(top);
                Self { scale, low: 0.0, high: (top * 1.02 / step).ceil() * step }
            }
            Scale::Logarithmic if smallest.is_finite() => {
                Self { scale, low: round_down(smallest / 1.05), high: round_up(high * 1.05) }
            }
            Scale::Logarithmic => Self { scale, low: 0.1, high: 1.0 },
        }
    }

    /// Returns the position of a value: 0 at the lower end, 1 at the upper end. Values outside are clamped.
    pub fn place(&self, value: f64) -> f64 {
        let part = match self.scale {
            Scale::Linear => (value - self.low) / (self.high - self.low),
            Scale::Logarithmic => (value.max(self.low) / self.low).ln() / (self.high / self.low).ln(),
        };
        if part.is_nan() { 1.0 } else { part.clamp(0.0, 1.0) }
    }

    /// Returns the round values that get a grid line, in ascending order.
    pub fn ticks(&self) -> Vec<f64> {
        match self.scale {
            Scale::Linear => {
                let step = step(self.high);
                (0..).map(|k| f64::from(k) * step).take_while(|v| *v <= self.high * 1.0001).collect()
            }
            Scale::Logarithmic => {
                let marks: &[f64] = match (self.high / self.low).log10() {
                    decades if decades > 2.2 => &[1.0],
                    decades if decades > 0.9 => &[1.0, 2.0, 5.0],
                    _ => &MARKS[..MARKS.len() - 1],
                };
                let decades = self.low.log10().floor() as i32..=self.high.log10().ceil() as i32;
                let all = decades.flat_map(|d| marks.iter().map(move |m| m * 10f64.powi(d)));
                all.filter(|v| (self.low * 0.999..=self.high * 1.001).contains(v)).collect()
            }
        }
    }
}

/// Returns the distance of ticks on a linear axis: 1, 2 or 5 times a power of ten, so that it has four to ten steps.
fn step(high: f64) -> f64 {
    let rough = high / 4.0;
    let decade = 10f64.powf(rough.log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|m| m * decade).find(|s| *s <= rough).unwrap_or(decade)
}

/// Factors on a power of ten at which a logarithmic axis may end.
const MARKS: [f64; 8] = [1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 7.0, 10.0];

/// Returns the largest possible end that is not above a value.
fn round_down(value: f64) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    MARKS.iter().rev().map(|m| m * decade).find(|v| *v <= value * 1.0001).unwrap_or(decade)
}

/// Returns the smallest possible end that is not below a value.
fn round_up(value: f64) -> f64 {
    let decade = 10f64.powf(value.log10().floor());
    MARKS.iter().map(|m| m * decade).find(|v| *v >= value * 0.9999).unwrap_or(10.0 * decade)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ends_are_round_and_hold_all_values() {
        let range = Range::around(Scale::Logarithmic, [0.3, 7.0, 42.0].into_iter());
        assert_eq!((range.low, range.high), (0.2, 50.0));
        let range = Range::around(Scale::Linear, [3.0, 7.3].into_iter());
        assert_eq!((range.low, range.high), (0.0, 8.0));
        assert_eq!(range.ticks(), [0.0, 2.0, 4.0, 6.0, 8.0]);
        assert_eq!(Range::around(Scale::Logarithmic, [1.0, 1000.0].into_iter()).ticks(), [1.0, 10.0, 100.0, 1000.0]);
    }

    #[test]
    fn zero_and_infinity_lie_on_the_ends_and_do_not_stretch_the_axis() {
        for scale in [Scale::Linear, Scale::Logarithmic] {
            let range = Range::around(scale, [0.0, 1e-9, 4.0, f64::INFINITY].into_iter());
            assert_eq!((range.place(0.0), range.place(f64::INFINITY)), (0.0, 1.0));
            assert!(range.place(4.0) > 0.5 && range.low >= 0.0 && (scale == Scale::Linear || range.low > 1e-5));
        }
        for empty in [Scale::Linear, Scale::Logarithmic] {
            assert!(Range::around(empty, std::iter::empty()).ticks().len() > 1);
        }
    }

    #[test]
    fn a_logarithmic_axis_gives_equal_factors_equal_room() {
        let range = Range::around(Scale::Logarithmic, [1.0, 100.0].into_iter());
        let gap = |a, b| range.place(b) - range.place(a);
        assert!((gap(2.0, 4.0) - gap(20.0, 40.0)).abs() < 1e-12 && gap(2.0, 4.0) > 0.0);
    }
}
