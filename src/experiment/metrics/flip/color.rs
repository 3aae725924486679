//! The colour spaces of FLIP: linear Rec. 709, XYZ relative to white, YCxCz and Lab.

use std::sync::LazyLock;

/// A 3×3 matrix by rows.
type Matrix = [[f32; 3]; 3];

/// Linear Rec. 709 to XYZ, each row divided by its sum: white is (1, 1, 1).
static TO_RELATIVE_XYZ: LazyLock<Matrix> = LazyLock::new(|| {
    // IEC 61966-2-1's primaries and white point.
    const TO_XYZ: Matrix = [
        [0.412_390_8, 0.357_584_33, 0.180_480_8],
        [0.212_639, 0.715_168_7, 0.072_192_32],
        [0.019_330_818, 0.119_194_78, 0.950_532_14],
    ];
    TO_XYZ.map(|row| row.map(|v| v / (row[0] + row[1] + row[2])))
});

static FROM_RELATIVE_XYZ: LazyLock<Matrix> = LazyLock::new(|| {
    let [r, g, b] = TO_RELATIVE_XYZ.map(glam::Vec3::from_array);
    glam::Mat3::from_cols(r, g, b).transpose().inverse().transpose().to_cols_array_2d()
});

fn multiply(m: &Matrix, v: [f32; 3]) -> [f32; 3] {
    m.map(|row| row[0] * v[0] + row[1] * v[1] + row[2] * v[2])
}

/// Linear RGB to YCxCz, the opponent space in which contrast sensitivity is applied.
pub fn to_ycxcz(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = multiply(&TO_RELATIVE_XYZ, rgb);
    [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
}

/// The inverse of [`to_ycxcz`].
pub fn from_ycxcz([lightness, cx, cz]: [f32; 3]) -> [f32; 3] {
    let y = (lightness + 16.0) / 116.0;
    multiply(&FROM_RELATIVE_XYZ, [y + cx / 500.0, y, y - cz / 200.0])
}

/// Linear RGB to Lab, with a and b scaled by lightness, since differences of hue show less in the dark
/// (the Hunt effect).
pub fn to_hunt_lab(rgb: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = multiply(&TO_RELATIVE_XYZ, rgb).map(lab_curve);
    let lightness = 116.0 * y - 16.0;
    let hunt = 0.01 * lightness;
    [lightness, hunt * 500.0 * (x - y), hunt * 200.0 * (y - z)]
}

/// The cube root of CIE Lab with its linear toe.
fn lab_curve(t: f32) -> f32 {
    const DELTA: f32 = 6.0 / 29.0;
    if t > DELTA * DELTA * DELTA { t.cbrt() } else { t / (3.0 * DELTA * DELTA) + 4.0 / 29.0 }
}

/// The HyAB distance [Abasi et al. 2020]: city block in lightness, Euclidean in chroma.
pub fn hyab(p: [f32; 3], q: [f32; 3]) -> f32 {
    (p[0] - q[0]).abs() + ((p[1] - q[1]).powi(2) + (p[2] - q[2]).powi(2)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ycxcz_has_its_inverse_and_white_is_neutral() {
        for rgb in [[0.1, 0.7, 0.3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]] {
            let back = from_ycxcz(to_ycxcz(rgb));
            assert!((0..3).all(|c| (back[c] - rgb[c]).abs() < 1e-5), "{rgb:?} {back:?}");
        }
        let white = to_ycxcz([1.0; 3]);
        assert!((white[0] - 100.0).abs() < 1e-4 && white[1].abs() < 1e-4 && white[2].abs() < 1e-4);
    }

    #[test]
    fn lab_of_known_colours() {
        // CIE Lab of sRGB green is (87.735, −86.183, 83.179); a and b here times 0.87735.
        let green = to_hunt_lab([0.0, 1.0, 0.0]);
        let expected = [87.735, -86.183 * 0.87735, 83.179 * 0.87735];
        assert!((0..3).all(|c| (green[c] - expected[c]).abs() < 0.02), "{green:?}");
        assert_eq!(to_hunt_lab([0.0; 3])[1..], [0.0, 0.0]);
    }
}
