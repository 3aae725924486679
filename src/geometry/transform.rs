//! Affine transforms of shapes.

use glam::{Affine3A, Mat3, Vec3};

/// Whether a transform loses a dimension, or is not made of finite numbers.
pub fn is_singular(transform: &Affine3A) -> bool {
    let m = transform.matrix3;
    let volume = m.x_axis.length() * m.y_axis.length() * m.z_axis.length();
    // A sheared box of that volume is flat to the precision of f32. The negation also catches NaN.
    !(transform.is_finite() && volume > 0.0 && m.determinant().abs() > 1e-6 * volume)
}

/// The scale of a similarity (rotation, reflection, translation and one scale in all directions); `None` where the
/// transform is none, as far as 1e-4 of the scale.
pub fn similarity_scale(transform: &Affine3A) -> Option<f32> {
    let m = transform.matrix3;
    let scale = m.x_axis.length();
    let tolerance = 1e-4 * scale;
    let same = |l: f32| (l - scale).abs() <= tolerance;
    let right = |a: f32| a.abs() <= tolerance * scale;
    (scale > 0.0
        && scale.is_finite()
        && same(m.y_axis.length())
        && same(m.z_axis.length())
        && right(m.x_axis.dot(m.y_axis))
        && right(m.y_axis.dot(m.z_axis))
        && right(m.z_axis.dot(m.x_axis)))
    .then_some(scale)
}

/// The matrix that takes normals along, up to a positive factor: an outside stays an outside, also under a reflection.
pub fn normal_matrix(transform: &Affine3A) -> Mat3 {
    let m = Mat3::from(transform.matrix3);
    let cofactors =
        Mat3::from_cols(m.y_axis.cross(m.z_axis), m.z_axis.cross(m.x_axis), m.x_axis.cross(m.y_axis));
    let scale = cofactors.x_axis.length().max(cofactors.y_axis.length()).max(cofactors.z_axis.length());
    // Scaled to about one, so that tiny scenes do not underflow.
    cofactors * (m.determinant().signum() / scale.max(f32::MIN_POSITIVE))
}

/// A rotation, scale and translation of a unit vector's plane kept a circle: scale of the circle about `normal`.
pub(super) fn circle_scale(transform: &Affine3A, normal: Vec3) -> Option<f32> {
    let (s, t) = normal.any_orthonormal_pair();
    let (s, t) = (transform.transform_vector3(s), transform.transform_vector3(t));
    let scale = s.length();
    let round = (t.length() - scale).abs() <= 1e-4 * scale && s.dot(t).abs() <= 1e-4 * scale * scale;
    (scale > 0.0 && scale.is_finite() && round).then_some(scale)
}
