//! Numbers as a reader wants them: as many digits as the interval bears, powers of ten, times and counts.

/// A space at which no line ends.
const NO_BREAK: char = '\u{a0}';

/// Digits as superscripts, for powers of ten.
pub(super) fn superscript(n: i32) -> String {
    n.to_string()
        .chars()
        .map(|c| match c {
            '-' => '⁻',
            '1' => '¹',
            '2' => '²',
            '3' => '³',
            c => char::from_u32('⁰' as u32 + c.to_digit(10).unwrap_or(0)).unwrap_or('⁰'),
        })
        .collect()
}

/// Decimal exponent: of 0.00123 it is −3.
fn exponent(x: f64) -> i32 {
    if x == 0.0 { 0 } else { x.abs().log10().floor() as i32 }
}

/// With a true minus sign.
fn minus(text: &str) -> String {
    text.replace('-', "−")
}

/// What stands for a number that is none.
fn not_finite(x: f64) -> &'static str {
    if x.is_nan() {
        "not a number"
    } else if x > 0.0 {
        "∞"
    } else {
        "−∞"
    }
}

/// A number with this many significant digits; beyond 10⁻³ and 10⁵ with a power of ten.
pub(super) fn significant(x: f64, digits: usize) -> String {
    if !x.is_finite() {
        return not_finite(x).into();
    }
    if x == 0.0 {
        return "0".into();
    }
    // Rounding first: 9.996 with three digits is 10.0.
    let rounded: f64 = format!("{x:.*e}", digits.saturating_sub(1)).parse().unwrap_or(x);
    let e = exponent(rounded);
    if (-3..5).contains(&e) {
        let decimals = (digits as i32 - 1 - e).max(0) as usize;
        minus(&format!("{rounded:.decimals$}"))
    } else {
        let mantissa = rounded / 10f64.powi(e);
        minus(&format!("{mantissa:.*}×10{}", digits.saturating_sub(1), superscript(e)))
    }
}

/// A value and the half width of its interval, both rounded where the interval has two digits: `(1.234 ± 0.056)×10⁻³`.
///
/// Without an interval (one run), or where it is not a number, the value alone with three digits.
pub(super) fn with_half_width(value: f64, half: Option<f64>) -> String {
    let Some(half) = half.filter(|h| h.is_finite() && *h > 0.0 && value.is_finite()) else {
        return significant(value, 3);
    };
    // The larger of both sets the power of ten that is taken out.
    let e = exponent(value.abs().max(half));
    let shared = if (-2..4).contains(&e) { 0 } else { e };
    let scale = 10f64.powi(shared);
    let (value, half) = (value / scale, half / scale);
    let decimals = (1 - exponent(half)).clamp(0, 8) as usize;
    if shared == 0 {
        minus(&format!("{value:.decimals$}{NO_BREAK}±{NO_BREAK}{half:.decimals$}"))
    } else {
        minus(&format!(
            "({value:.decimals$}{NO_BREAK}±{NO_BREAK}{half:.decimals$})×10{}",
            superscript(shared)
        ))
    }
}

/// A share as per cent: one decimal, and "< 0.1" where there is something but little.
pub(super) fn percent(share: f64) -> String {
    if !share.is_finite() {
        return "no share".into();
    }
    let p = 100.0 * share;
    if p != 0.0 && p.abs() < 0.05 {
        minus(if p > 0.0 { "< 0.1 %" } else { "> -0.1 %" })
    } else {
        minus(&format!("{p:.1} %"))
    }
}

/// Seconds, minutes and hours.
pub(super) fn duration(seconds: f64) -> String {
    if !seconds.is_finite() || seconds < 0.0 {
        return "unknown time".into();
    }
    if seconds < 120.0 {
        return format!("{} s", significant(seconds, 3));
    }
    let s = seconds.round() as u64;
    if s < 7200 {
        format!("{} min {:02} s", s / 60, s % 60)
    } else {
        format!("{} h {:02} min", s / 3600, s / 60 % 60)
    }
}

/// A count with narrow spaces between thousands.
pub(super) fn count(n: u64) -> String {
    let digits = n.to_string();
    let mut out = String::new();
    for (i, c) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) && digits.len() > 4 {
            out.push('\u{202f}');
        }
        out.push(c);
    }
    out
}

/// A noun with its number: "1 run", "4 runs".
pub(crate) fn plural(n: u64, noun: &str) -> String {
    if n == 1 { format!("{n} {noun}") } else { format!("{} {noun}s", count(n)) }
}

/// Bytes in units that people read.
pub(super) fn bytes(n: usize) -> String {
    match n {
        0..1_000 => format!("{n} B"),
        1_000..1_000_000 => format!("{:.0} kB", n as f64 / 1e3),
        _ => format!("{:.1} MB", n as f64 / 1e6),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn significant_digits_are_kept() {
        assert_eq!(significant(0.0123456, 3), "0.0123");
        assert_eq!(significant(9.996, 3), "10.0");
        assert_eq!(significant(1234.5, 3), "1230");
        assert_eq!(significant(1.234e-7, 3), "1.23×10⁻⁷");
        assert_eq!(significant(-2.5e12, 2), "−2.5×10¹²");
        assert_eq!(significant(0.0, 3), "0");
        assert_eq!(significant(f64::NAN, 3), "not a number");
        assert_eq!(significant(9.9996e4, 3), "1.00×10⁵");
    }

    #[test]
    fn values_are_rounded_where_their_interval_is() {
        assert_eq!(with_half_width(0.123456, Some(0.00321)), "0.1235\u{a0}±\u{a0}0.0032");
        assert_eq!(with_half_width(1.23456e-5, Some(5.6e-7)), "(1.235\u{a0}±\u{a0}0.056)×10⁻⁵");
        assert_eq!(with_half_width(-1.0213, Some(0.034)), "−1.021\u{a0}±\u{a0}0.034");
        assert_eq!(with_half_width(0.5, None), "0.500");
        assert_eq!(with_half_width(1e-9, Some(1e-5)), "(0.0\u{a0}±\u{a0}1.0)×10⁻⁵");
        assert_eq!(with_half_width(2.0, Some(0.0)), "2.00");
    }

    #[test]
    fn times_counts_and_shares() {
        assert_eq!(duration(0.0123), "0.0123 s");
        assert_eq!(duration(119.0), "119 s");
        assert_eq!(duration(125.4), "2 min 05 s");
        assert_eq!(duration(7260.0), "2 h 01 min");
        assert_eq!(count(1234), "1234");
        assert_eq!(count(1234567), "1\u{202f}234\u{202f}567");
        assert_eq!(percent(0.00001), "< 0.1 %");
        assert_eq!(percent(0.4567), "45.7 %");
        assert_eq!(plural(1, "run"), "1 run");
    }
}
