//! Rayleigh's phase function, of particles much smaller than the wavelength: 3/(16π) (1 + cos² θ).

use super::about;
use glam::{Vec2, Vec3A};
use std::f32::consts::FRAC_1_PI;

const SCALE: f32 = 3.0 / 16.0 * FRAC_1_PI;

#[inline]
pub(super) fn evaluate(wl: Vec3A, wc: Vec3A) -> f32 {
    let cos = wl.dot(wc);
    SCALE * (1.0 + cos * cos)
}

/// The distribution function of the cosine is a cubic, 4ξ − 2 = (cos³ + 3 cos)/2, which Cardano's formula inverts.
#[inline]
pub(super) fn sample(from: Vec3A, u: Vec2) -> (Vec3A, f32) {
    let b = 4.0 * u.x - 2.0;
    let root = (b.abs() + (b * b + 1.0).sqrt()).cbrt();
    let cos = (root - root.recip()).min(1.0).copysign(b);
    // Either end of the axis is as good: forward and backward are alike.
    (about(from, 1.0 - cos, u.y), SCALE * (1.0 + cos * cos))
}
