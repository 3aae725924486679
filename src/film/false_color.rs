//! Numbers as colours: a sequential map for magnitudes and a diverging one for signed errors.

use super::image::ScalarImage;
use super::png::{DisplayImage, srgb_encode};

/// Control points of the sequential map in Oklab [Ottosson 2020] (L, a, b), evenly spaced: black over violet
/// and orange to a light yellow. Lightness rises from point to point by nearly the same step, so that equal
/// differences of value look equal, and a print in grey keeps the order.
const SEQUENTIAL: [[f32; 3]; 7] = [
    [0.14, 0.005, -0.030],
    [0.28, 0.060, -0.095],
    [0.42, 0.130, -0.085],
    [0.56, 0.165, 0.005],
    [0.70, 0.120, 0.085],
    [0.84, 0.035, 0.130],
    [0.98, -0.015, 0.070],
];

/// Control points of the diverging map in Oklab, evenly spaced from −1 to 1: light blue, blue, black, red,
/// light orange. Both arms have the same lightness at the same magnitude, and zero is black.
const DIVERGING: [[f32; 3]; 5] = [
    [0.88, -0.050, -0.060],
    [0.52, -0.025, -0.150],
    [0.08, 0.000, 0.000],
    [0.52, 0.165, 0.075],
    [0.88, 0.035, 0.100],
];

/// The colour of `t` in [0, 1] in the sequential map, sRGB in 8 bits; values outside are clamped, NaN is
/// [`NOT_FINITE`](super::png::NOT_FINITE).
pub fn sequential(t: f32) -> [u8; 3] {
    lookup(&SEQUENTIAL, t)
}

/// The colour of `t` in [−1, 1] in the diverging map, sRGB in 8 bits; values outside are clamped, NaN is
/// [`NOT_FINITE`](super::png::NOT_FINITE).
pub fn diverging(t: f32) -> [u8; 3] {
    lookup(&DIVERGING, 0.5 * (t + 1.0))
}

/// How a map's values become positions in a colour map.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Scale {
    /// 0 at the dark end, this value at the light end, linearly between. Not positive: every value is 0.
    Linear(f32),
    /// The first value at the dark end, the second at the light end, by logarithm between; both positive.
    Logarithmic(f32, f32),
    /// −value at one end, 0 in the middle, +value at the other end of the diverging map.
    Signed(f32),
}

impl Scale {
    /// The values at either end.
    pub fn ends(self) -> (f32, f32) {
        match self {
            Self::Linear(white) => (0.0, white),
            Self::Logarithmic(dark, light) => (dark, light),
            Self::Signed(end) => (-end, end),
        }
    }

    /// The colour of `value`.
    pub fn color(self, value: f32) -> [u8; 3] {
        let ratio = |v: f32, whole: f32| if whole > 0.0 || v.is_nan() { v / whole } else { 0.0 };
        match self {
            Self::Linear(white) => sequential(ratio(value, white)),
            Self::Logarithmic(black, white) => {
                // Zero and negative values lie at the dark end, though they have no logarithm.
                let v = if value.is_nan() { value } else { value.max(black) };
                sequential(ratio((v / black).ln(), (white / black).ln()))
            }
            Self::Signed(end) => diverging(ratio(value, end)),
        }
    }
}

/// The map in false colour.
pub fn paint(map: &ScalarImage, scale: Scale) -> DisplayImage {
    let pixels = map.values.iter().map(|v| scale.color(*v)).collect();
    DisplayImage { width: map.width, height: map.height, pixels }
}

fn lookup(points: &[[f32; 3]], t: f32) -> [u8; 3] {
    if t.is_nan() {
        return super::png::NOT_FINITE;
    }
    let position = t.clamp(0.0, 1.0) * (points.len() - 1) as f32;
    let index = (position as usize).min(points.len() - 2);
    let f = position - index as f32;
    let mix = |i: usize| points[index][i] * (1.0 - f) + points[index + 1][i] * f;
    oklab_to_rgb([mix(0), mix(1), mix(2)]).map(|v| (srgb_encode(v.clamp(0.0, 1.0)) * 255.0).round() as u8)
}

/// Oklab to linear Rec. 709 [Ottosson 2020].
fn oklab_to_rgb([l, a, b]: [f32; 3]) -> [f32; 3] {
    let cube = |x: f32| x * x * x;
    let long = cube(l + 0.396_337_78 * a + 0.215_803_76 * b);
    let medium = cube(l - 0.105_561_346 * a - 0.063_854_17 * b);
    let short = cube(l - 0.089_484_18 * a - 1.291_485_5 * b);
    [
        4.076_741_7 * long - 3.307_711_6 * medium + 0.230_969_94 * short,
        -1.268_438 * long + 2.609_757_4 * medium - 0.341_319_38 * short,
        -0.004_196_086_3 * long - 0.703_418_6 * medium + 1.707_614_7 * short,
    ]
}

#[cfg(test)]
mod tests {
    use super::super::png::{NOT_FINITE, srgb_decode};
    use super::*;

    fn lightness(color: [u8; 3]) -> f32 {
        let [r, g, b] = color.map(|v| srgb_decode(f32::from(v) / 255.0));
        let y = 0.2126 * r + 0.7152 * g + 0.0722 * b;
        if y > 0.008_856 { 116.0 * y.cbrt() - 16.0 } else { 903.3 * y }
    }

    #[test]
    fn lightness_rises_with_the_value() {
        for i in 0..100 {
            let (a, b) = (i as f32 / 100.0, (i + 1) as f32 / 100.0);
            assert!(lightness(sequential(b)) > lightness(sequential(a)), "at {a}");
            assert!(lightness(diverging(b)) > lightness(diverging(a)), "at {a}");
            assert!(lightness(diverging(-b)) > lightness(diverging(-a)), "at -{a}");
        }
        assert!(lightness(sequential(0.0)) < 3.0 && lightness(sequential(1.0)) > 90.0);
    }

    #[test]
    fn equal_steps_of_value_are_nearly_equal_steps_of_lightness() {
        let at = |i: u8| lightness(sequential(f32::from(i) / 16.0));
        let steps: Vec<f32> = (0..16).map(|i| at(i + 1) - at(i)).collect();
        let mean = steps.iter().sum::<f32>() / 16.0;
        assert!(steps.iter().all(|s| (s / mean - 1.0).abs() < 0.5), "{steps:?}");
    }

    #[test]
    fn both_signs_are_equally_light_and_of_different_hue() {
        for i in 1..=20 {
            let t = i as f32 / 20.0;
            let (plus, minus) = (diverging(t), diverging(-t));
            assert!((lightness(plus) - lightness(minus)).abs() < 6.0, "{t} {plus:?} {minus:?}");
            assert!(plus[0] > plus[2] && minus[2] > minus[0], "{t} {plus:?} {minus:?}");
        }
    }

    #[test]
    fn any_value_and_scale_has_a_colour() {
        let scales = [
            Scale::Linear(0.0),
            Scale::Linear(2.0),
            Scale::Logarithmic(1e-3, 1.0),
            Scale::Logarithmic(1.0, 1.0),
            Scale::Signed(0.5),
        ];
        for scale in scales {
            assert_eq!(scale.color(f32::NAN), NOT_FINITE);
            for v in [f32::NEG_INFINITY, -1.0, 0.0, 1e-30, 1.0, f32::INFINITY] {
                assert_ne!(scale.color(v), NOT_FINITE, "{scale:?} {v}");
            }
        }
        assert_eq!(Scale::Linear(2.0).color(2.0), sequential(1.0));
        assert_eq!(Scale::Logarithmic(1e-2, 1.0).color(0.1), sequential(0.5));
        assert_eq!(Scale::Signed(2.0).color(-1.0), diverging(-0.5));
        assert_eq!(Scale::Linear(0.0).color(1.0), sequential(0.0));
    }
}
