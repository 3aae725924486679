//! Logarithmic axes: their range, where a value lies, and their ticks.

use super::numbers::{significant, superscript};

/// A logarithmic axis between two positions on the figure.
#[derive(Clone, Copy, Debug)]
pub(super) struct LogAxis {
    /// Decimal logarithms of the ends: values may lie further apart than a number can say.
    low: f64,
    high: f64,
    from: f64,
    to: f64,
}

/// A mark on an axis.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Tick {
    /// Where: the decimal logarithm.
    pub exponent: f64,
    /// What is written there; nothing at minor ticks.
    pub label: Option<String>,
}

impl LogAxis {
    /// An axis over the positive finite ones of the values, with some air at both ends; `None` if there are none.
    pub fn covering(values: impl IntoIterator<Item = f64>, from: f64, to: f64) -> Option<Self> {
        let (mut low, mut high) = (f64::INFINITY, f64::NEG_INFINITY);
        for v in values.into_iter().filter(|v| v.is_finite() && *v > 0.0) {
            low = low.min(v.log10());
            high = high.max(v.log10());
        }
        if high < low {
            return None;
        }
        let decades = high - low;
        // At least most of a decade in all: a single point still gets a tick on either side.
        let air = (0.05 * decades).max(0.5 * (0.9 - decades)).max(0.06);
        Some(Self { low: low - air, high: high + air, from, to })
    }

    /// Position of a positive value.
    pub fn at(&self, value: f64) -> f64 {
        self.at_log10(value.log10())
    }

    /// Position of a value by its decimal logarithm.
    pub fn at_log10(&self, exponent: f64) -> f64 {
        self.from + (exponent - self.low) / self.decades() * (self.to - self.from)
    }

    /// Decimal logarithm of the least value on the axis.
    pub fn low(&self) -> f64 {
        self.low
    }

    /// Decimal logarithm of the greatest value on the axis.
    pub fn high(&self) -> f64 {
        self.high
    }

    fn decades(&self) -> f64 {
        self.high - self.low
    }

    /// Ticks: labelled at decades, every second, third … where they would crowd (`room` is the least distance of two
    /// labels), at 2 and 5 too where decades alone are too few.
    pub fn ticks(&self, room: f64) -> Vec<Tick> {
        let per_decade = (self.to - self.from).abs() / self.decades();
        let every = (room / per_decade).ceil().max(1.0) as i32;
        let first = self.low.floor() as i32;
        let last = self.high.ceil() as i32;
        let within = |exponent: f64| exponent >= self.low - 1e-9 && exponent <= self.high + 1e-9;
        let decades_inside = (first..=last).filter(|e| within(f64::from(*e))).count();
        // The gap between 5 and 10 is the narrowest of 1, 2, 5: log10(2).
        let between = decades_inside <= 2 && per_decade * 2f64.log10() >= room;
        let mut ticks = Vec::new();
        for e in first..=last {
            for digit in 1..10 {
                let exponent = f64::from(digit).log10() + f64::from(e);
                if !within(exponent) {
                    continue;
                }
                let labelled = match digit {
                    1 => e.rem_euclid(every) == 0,
                    2 | 5 => between,
                    _ => false,
                };
                if labelled || every == 1 {
                    ticks.push(Tick { exponent, label: labelled.then(|| tick_label(digit, e)) });
                }
            }
        }
        ticks
    }
}

fn tick_label(digit: i32, e: i32) -> String {
    if (-2..4).contains(&e) {
        significant(f64::from(digit) * 10f64.powi(e), 1)
    } else if digit == 1 {
        format!("10{}", superscript(e))
    } else {
        format!("{digit}×10{}", superscript(e))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(axis: &LogAxis, room: f64) -> Vec<String> {
        axis.ticks(room).into_iter().filter_map(|t| t.label).collect()
    }

    #[test]
    fn positions_are_logarithmic() {
        let axis = LogAxis::covering([1.0, 100.0], 0.0, 220.0).unwrap();
        assert!((axis.at(10.0) - 110.0).abs() < 1e-9);
        assert!(axis.at(1.0) > 0.0 && axis.at(100.0) < 220.0);
    }

    #[test]
    fn zeros_and_nan_make_no_axis() {
        assert!(LogAxis::covering([0.0, f64::NAN, -1.0, f64::INFINITY], 0.0, 1.0).is_none());
        assert!(LogAxis::covering([], 0.0, 1.0).is_none());
    }

    #[test]
    fn labels_never_crowd_and_are_never_missing() {
        for (low, high) in
            [(3.0, 3.0), (1.0, 8.0), (0.02, 7.0), (1e-12, 1e9), (1e-3, 1.1e-3), (4e-300, 4e300)]
        {
            for length in [200.0, 400.0] {
                let axis = LogAxis::covering([low, high], 0.0, length).unwrap();
                let ticks: Vec<f64> = axis
                    .ticks(30.0)
                    .iter()
                    .filter(|t| t.label.is_some())
                    .map(|t| axis.at_log10(t.exponent))
                    .collect();
                assert!(!ticks.is_empty(), "no label from {low} to {high}");
                for pair in ticks.windows(2) {
                    assert!(pair[1] - pair[0] > 29.9, "labels crowd from {low} to {high}: {ticks:?}");
                }
            }
        }
        let axis = LogAxis::covering([1.0, 1e6], 0.0, 400.0).unwrap();
        assert_eq!(labels(&axis, 30.0), ["1", "10", "100", "1000", "10⁴", "10⁵", "10⁶"]);
        let axis = LogAxis::covering([2e-3, 8e-3], 0.0, 400.0).unwrap();
        assert_eq!(labels(&axis, 30.0), ["2×10⁻³", "5×10⁻³", "0.01"]);
    }
}
