//! Scattering alike in all directions.

use crate::math::warp;
use glam::{Vec2, Vec3A};

/// 1/(4π).
pub const VALUE: f32 = warp::UNIFORM_SPHERE_PDF;

#[inline]
pub(super) fn sample(u: Vec2) -> (Vec3A, f32) {
    (warp::uniform_sphere(u), VALUE)
}
