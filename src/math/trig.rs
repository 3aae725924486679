//! Sines and cosines of angles that are given as parts of a turn: what sampling asks for, without the library's
//! reduction of arguments and without a branch.

use super::choose;

/// Sine and cosine of a quarter turn times `x`, for −½ ≤ x ≤ ½; wrong by no more than 1e-7.
#[inline]
pub fn sin_cos_quarter(x: f32) -> (f32, f32) {
    // sin(πx/2)/x and (cos(πx/2) − 1)/x² as polynomials in x², interpolated at Chebyshev's nodes.
    let z = x * x;
    let s = z * 1.582_063e-4 - 4.681_266_4e-3;
    let s = s * z + 7.969_258e-2;
    let s = s * z - 0.645_964_1;
    let s = s * z + 1.570_796_4;
    let c = z * 9.067_399e-4 - 2.086_152_9e-2;
    let c = c * z + 0.253_669_4;
    let c = c * z - 1.233_700_5;
    (s * x, c * z + 1.0)
}

/// Sine and cosine of `turns` whole turns, for |turns| up to 1e5; the polynomials are wrong by no more than 1e-7.
#[inline]
pub fn sin_cos_turns(turns: f32) -> (f32, f32) {
    /// 1.5·2²³: added to a number it leaves the nearest whole one in the lowest bits of the sum.
    const ROUNDING: f32 = 12_582_912.0;
    let x = 4.0 * turns;
    let shifted = x + ROUNDING;
    let quarter = shifted.to_bits();
    let (s, c) = sin_cos_quarter(x - (shifted - ROUNDING));
    let even = quarter & 1 == 0;
    let (sin, cos) = (choose(even, s, c), choose(even, c, s));
    // Bit 1 of the quarter is the sine's sign, that of the next quarter the cosine's.
    let sign = |q: u32| (q & 2) << 30;
    (
        f32::from_bits(sin.to_bits() ^ sign(quarter)),
        f32::from_bits(cos.to_bits() ^ sign(quarter.wrapping_add(1))),
    )
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::{FRAC_PI_2, TAU};

    #[test]
    fn they_are_sines_and_cosines() {
        for i in -50_000..=50_000 {
            let x = i as f32 * 1e-5;
            let (s, c) = sin_cos_quarter(x);
            let (sin, cos) = (f64::from(x) * FRAC_PI_2).sin_cos();
            assert!((f64::from(s) - sin).abs() < 1.2e-7 && (f64::from(c) - cos).abs() < 1.2e-7, "{x}");
            let turns = 3.0 * x;
            let (s, c) = sin_cos_turns(turns);
            let (sin, cos) = (f64::from(turns) * TAU).sin_cos();
            assert!((f64::from(s) - sin).abs() < 1.2e-7 && (f64::from(c) - cos).abs() < 1.2e-7, "{turns}");
        }
    }

    #[test]
    fn quarters_are_where_they_belong() {
        assert_eq!([0.0, 1.0].map(sin_cos_turns), [(0.0, 1.0); 2]);
        for (turns, sin, cos) in [(0.25, 1.0, 0.0), (0.5, 0.0, -1.0), (0.75, -1.0, 0.0), (-0.25, -1.0, 0.0)] {
            let found = sin_cos_turns(turns);
            assert!(found.0 == sin && found.1 == cos, "{turns}: {found:?}");
        }
    }
}
